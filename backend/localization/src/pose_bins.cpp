// SPDX-License-Identifier: Apache-2.0
#include "pose_bins.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hybrid_slam {
namespace {

// A key is x, y and heading side by side; the offset keeps x and y above zero.
constexpr int kBitsOfHeading = 16;
constexpr int kBitsOfCell = 24;
constexpr std::int64_t kOffset = std::int64_t{1} << (kBitsOfCell - 1);
constexpr std::int64_t kLastCell = 2 * kOffset - 1;

std::int64_t cell_of(double coordinate, double size) {
    const double cell = std::floor(coordinate / size) + static_cast<double>(kOffset);
    return static_cast<std::int64_t>(std::clamp(cell, 0.0, static_cast<double>(kLastCell)));
}

PoseBins::Key packed(std::int64_t x, std::int64_t y, std::int64_t heading) {
    const std::int64_t key =
        (((x & kLastCell) << kBitsOfCell | (y & kLastCell)) << kBitsOfHeading) | heading;
    return static_cast<PoseBins::Key>(key);
}

class UnionFind {
  public:
    std::uint32_t add() {
        parents_.push_back(static_cast<std::uint32_t>(parents_.size()));
        return parents_.back();
    }
    std::uint32_t root(std::uint32_t i) {
        while (parents_[i] != i) {
            parents_[i] = parents_[parents_[i]];
            i = parents_[i];
        }
        return i;
    }
    void unite(std::uint32_t a, std::uint32_t b) {
        const std::uint32_t roots[] = {root(a), root(b)};
        parents_[std::max(roots[0], roots[1])] = std::min(roots[0], roots[1]);
    }
    std::size_t size() const { return parents_.size(); }

  private:
    std::vector<std::uint32_t> parents_;
};

}  // namespace

PoseBins::PoseBins(double size, double angle)
    : size_(size),
      headings_(std::max<std::int64_t>(1, static_cast<std::int64_t>(2.0 * kPi / angle + 0.5))) {}

PoseBins::Key PoseBins::key_of(const Pose2d& pose) const {
    const double turn = (normalize_angle(pose.heading) + kPi) / (2.0 * kPi);
    const auto heading = static_cast<std::int64_t>(turn * static_cast<double>(headings_));
    return packed(cell_of(pose.x(), size_), cell_of(pose.y(), size_),
                  std::clamp<std::int64_t>(heading, 0, headings_ - 1));
}

void PoseBins::earlier_neighbors(Key key, std::vector<Key>& neighbors) const {
    const auto number = static_cast<std::int64_t>(key);
    const std::int64_t heading = number & ((std::int64_t{1} << kBitsOfHeading) - 1);
    const std::int64_t y = (number >> kBitsOfHeading) & kLastCell;
    const std::int64_t x = number >> (kBitsOfHeading + kBitsOfCell);
    neighbors.clear();
    for (std::int64_t turn = -1; turn <= 1; ++turn) {
        const std::int64_t towards = (heading + turn + headings_) % headings_;
        for (std::int64_t along = -1; along <= 1; ++along) {
            neighbors.push_back(packed(x - 1, y + along, towards));
        }
        neighbors.push_back(packed(x, y - 1, towards));
    }
    neighbors.push_back(packed(x, y, (heading + headings_ - 1) % headings_));
}

Clusters clusters_of(const std::vector<Pose2d>& poses, const PoseBins& bins) {
    std::unordered_map<PoseBins::Key, std::uint32_t> numbers;
    UnionFind sets;
    std::vector<PoseBins::Key> keys;  // of the bins, in the order of their first poses
    Clusters clusters;
    clusters.of_pose.reserve(poses.size());
    for (const Pose2d& pose : poses) {
        const PoseBins::Key key = bins.key_of(pose);
        const auto found = numbers.find(key);
        if (found != numbers.end()) {
            clusters.of_pose.push_back(found->second);
            continue;
        }
        clusters.of_pose.push_back(sets.add());
        numbers.emplace(key, clusters.of_pose.back());
        keys.push_back(key);
    }
    std::vector<PoseBins::Key> neighbors;
    for (std::uint32_t bin = 0; bin < keys.size(); ++bin) {
        bins.earlier_neighbors(keys[bin], neighbors);
        for (const PoseBins::Key neighbor : neighbors) {
            if (const auto found = numbers.find(neighbor); found != numbers.end()) {
                sets.unite(bin, found->second);
            }
        }
    }
    // A root is the first bin of its set, so that numbers are given in the order of the poses.
    std::vector<std::uint32_t> cluster_of_bin(keys.size(), 0);
    for (std::uint32_t bin = 0; bin < keys.size(); ++bin) {
        const std::uint32_t root = sets.root(bin);
        cluster_of_bin[bin] =
            root == bin ? static_cast<std::uint32_t>(clusters.count++) : cluster_of_bin[root];
    }
    for (std::uint32_t& pose : clusters.of_pose) {
        pose = cluster_of_bin[pose];
    }
    return clusters;
}

}  // namespace hybrid_slam
