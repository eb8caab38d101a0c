// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/correlative_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

namespace {

constexpr double kFull = 255.0;

// Stamps the blur around one point, keeping the larger value where stamps overlap.
class BlurStamp {
  public:
    BlurStamp(double resolution, double sigma)
        : radius_(static_cast<int>(std::ceil(2.5 * sigma / resolution))) {
        for (int y = -radius_; y <= radius_; ++y) {
            for (int x = -radius_; x <= radius_; ++x) {
                const double squared = resolution * resolution * (x * x + y * y);
                values_.push_back(static_cast<std::uint8_t>(
                    std::lround(kFull * std::exp(-0.5 * squared / (sigma * sigma)))));
            }
        }
    }

    int radius() const { return radius_; }

    void apply(std::vector<std::uint8_t>& grid, const GridGeometry& geometry, Cell cell) const {
        const auto side = 2 * static_cast<std::size_t>(radius_) + 1;
        for (std::size_t row = 0; row < side; ++row) {
            std::uint8_t* out = grid.data() +
                                geometry.index_of({cell.x - radius_, cell.y - radius_}) +
                                row * static_cast<std::size_t>(geometry.width);
            const std::uint8_t* in = values_.data() + row * side;
            for (std::size_t i = 0; i < side; ++i) {
                out[i] = std::max(out[i], in[i]);
            }
        }
    }

  private:
    int radius_;
    std::vector<std::uint8_t> values_;
};

// Maximum over blocks twice as large, from the maximum over the smaller ones.
std::vector<std::uint8_t> doubled(const std::vector<std::uint8_t>& grid,
                                  const GridGeometry& geometry, int step) {
    std::vector<std::uint8_t> result(grid);
    const auto width = static_cast<std::size_t>(geometry.width);
    const auto shift = static_cast<std::size_t>(step);
    for (std::size_t y = 0; y < static_cast<std::size_t>(geometry.height); ++y) {
        std::uint8_t* out = result.data() + y * width;
        const std::uint8_t* in = grid.data() + y * width;
        for (std::size_t x = 0; x + shift < width; ++x) {
            out[x] = std::max(in[x], in[x + shift]);
        }
    }
    for (std::size_t y = 0; y + shift < static_cast<std::size_t>(geometry.height); ++y) {
        std::uint8_t* out = result.data() + y * width;
        const std::uint8_t* above = result.data() + (y + shift) * width;
        for (std::size_t x = 0; x < width; ++x) {
            out[x] = std::max(out[x], above[x]);
        }
    }
    return result;
}

// The query at one heading, as cells of the grid at the window's centre.
struct RotatedQuery {
    double heading = 0.0;
    std::vector<Cell> cells;
};

// A block of translations: offsets x .. x + 2^level - 1, and likewise y, in cells from the centre.
struct Node {
    int sum = 0;
    int level = 0;
    int rotation = 0;
    int x = 0;
    int y = 0;
};

// Best bound first; every tie is broken, so that results do not depend on the queue's inner order.
struct Worse {
    bool operator()(const Node& a, const Node& b) const {
        if (a.sum != b.sum) {
            return a.sum < b.sum;
        }
        if (a.level != b.level) {
            return a.level > b.level;
        }
        return std::tie(a.rotation, a.x, a.y) > std::tie(b.rotation, b.x, b.y);
    }
};

class Search {
  public:
    Search(const LikelihoodPyramid& pyramid, const Points& query, const SearchWindow& window,
           const SearchLimits& limits)
        : pyramid_(pyramid),
          limits_(limits),
          center_(window.center),
          full_sum_(kFull * static_cast<double>(query.size())),
          reach_(static_cast<int>(std::ceil(window.half_width / pyramid.geometry().resolution))) {
        const int steps = static_cast<int>(std::ceil(window.half_angle / window.angle_step));
        for (int k = -steps; k <= steps; ++k) {
            rotations_.push_back(rotate(query, center_.heading + k * window.angle_step));
        }
    }

    SearchResult run() {
        start();
        while (!open_.empty() && !result_.exhausted) {
            const Node node = open_.top();
            if (static_cast<double>(node.sum) < wanted_now()) {
                break;
            }
            open_.pop();
            if (result_.found && is_near_best(node)) {
                continue;
            }
            if (node.level == 0) {
                if (accept(node)) {
                    break;
                }
                continue;
            }
            branch(node);
            if (gave_up()) {
                break;
            }
        }
        result_.found = result_.found && !result_.exhausted;
        return result_;
    }

  private:
    RotatedQuery rotate(const Points& query, double heading) const {
        RotatedQuery rotated;
        rotated.heading = normalize_angle(heading);
        rotated.cells.reserve(query.size());
        const Pose2d pose(center_.translation, heading);
        const Eigen::Matrix2d rotation = pose.rotation();
        for (const Point2& point : query) {
            rotated.cells.push_back(
                pyramid_.geometry().cell_of(rotation * point + pose.translation));
        }
        return rotated;
    }

    bool gave_up() {
        result_.exhausted = result_.nodes > limits_.max_nodes;
        return result_.exhausted;
    }

    void start() {
        const int level = pyramid_.levels() - 1;
        const int stride = 1 << level;
        for (int rotation = 0; rotation < static_cast<int>(rotations_.size()); ++rotation) {
            for (int y = -reach_; y <= reach_; y += stride) {
                for (int x = -reach_; x <= reach_; x += stride) {
                    push(level, rotation, x, y);
                }
                if (gave_up()) {
                    return;
                }
            }
        }
    }

    void branch(const Node& node) {
        const int half = 1 << (node.level - 1);
        for (const int y : {node.y, node.y + half}) {
            for (const int x : {node.x, node.x + half}) {
                if (x <= reach_ && y <= reach_) {
                    push(node.level - 1, node.rotation, x, y);
                }
            }
        }
    }

    void push(int level, int rotation, int x, int y) {
        ++result_.nodes;
        Node node{0, level, rotation, x, y};
        for (const Cell& cell : rotations_[static_cast<std::size_t>(rotation)].cells) {
            node.sum += pyramid_.at(level, cell.x + x, cell.y + y);
        }
        if (static_cast<double>(node.sum) >= wanted_later()) {
            open_.push(node);
        }
    }

    // What the next pose must reach to be of interest: the best, and then its runner-up.
    double wanted_now() const {
        return full_sum_ *
               (result_.found ? limits_.runner_up_ratio * result_.score : limits_.min_score);
    }

    // What is kept in the queue: a runner-up may score less than the least that the best must.
    double wanted_later() const {
        return full_sum_ * limits_.runner_up_ratio *
               (result_.found ? result_.score : std::min(limits_.min_score, 1.0));
    }

    Pose2d pose_of(const Node& node) const {
        const double resolution = pyramid_.geometry().resolution;
        return {center_.x() + node.x * resolution, center_.y() + node.y * resolution,
                rotations_[static_cast<std::size_t>(node.rotation)].heading};
    }

    // The whole block lies within the neighbourhood of the best: nothing in it is another place.
    bool is_near_best(const Node& node) const {
        const int last = (1 << node.level) - 1;
        for (const int y : {node.y, node.y + last}) {
            for (const int x : {node.x, node.x + last}) {
                const Pose2d apart =
                    between(result_.reference_from_query, pose_of({0, 0, node.rotation, x, y}));
                if (apart.translation.norm() > limits_.runner_up_distance ||
                    std::abs(apart.heading) > limits_.runner_up_angle) {
                    return false;
                }
            }
        }
        return true;
    }

    // The first single pose to arrive is the best, the second (elsewhere) the runner-up; true when
    // done.
    bool accept(const Node& node) {
        const double score = node.sum / full_sum_;
        if (!result_.found) {
            result_.found = true;
            result_.score = score;
            result_.reference_from_query = pose_of(node);
            return false;
        }
        result_.runner_up_score = score;
        result_.runner_up = pose_of(node);
        return true;
    }

    const LikelihoodPyramid& pyramid_;
    const SearchLimits& limits_;
    Pose2d center_;
    double full_sum_;
    int reach_;
    std::vector<RotatedQuery> rotations_;
    std::priority_queue<Node, std::vector<Node>, Worse> open_;
    SearchResult result_;
};

}  // namespace

LikelihoodPyramid::LikelihoodPyramid(const Points& reference, double resolution, double sigma,
                                     int levels) {
    if (reference.empty() || levels < 1 || levels > 12) {
        throw Error("likelihood pyramid: needs points and 1 to 12 levels");
    }
    Point2 lower = reference.front();
    Point2 upper = lower;
    for (const Point2& point : reference) {
        lower = lower.cwiseMin(point);
        upper = upper.cwiseMax(point);
    }
    const BlurStamp stamp(resolution, sigma);
    // The empty rim below and left is as wide as the largest block, so that a block that starts
    // outside of the grid holds nothing but rim.
    const double margin = resolution * (stamp.radius() + (1 << (levels - 1)) + 1);
    geometry_ = GridGeometry::around(lower, upper, resolution, margin);
    const auto cells =
        static_cast<std::size_t>(geometry_.width) * static_cast<std::size_t>(geometry_.height);
    grids_.emplace_back(cells, std::uint8_t{0});
    for (const Point2& point : reference) {
        stamp.apply(grids_.front(), geometry_, geometry_.cell_of(point));
    }
    for (int level = 1; level < levels; ++level) {
        grids_.push_back(doubled(grids_.back(), geometry_, 1 << (level - 1)));
    }
}

SearchResult branch_and_bound(const LikelihoodPyramid& pyramid, const Points& query,
                              const SearchWindow& window, const SearchLimits& limits) {
    if (query.empty()) {
        return {};
    }
    return Search(pyramid, query, window, limits).run();
}

double match_score(const LikelihoodPyramid& pyramid, const Points& query,
                   const Pose2d& reference_from_query) {
    if (query.empty()) {
        return 0.0;
    }
    const Eigen::Matrix2d rotation = reference_from_query.rotation();
    int sum = 0;
    for (const Point2& point : query) {
        const Cell cell =
            pyramid.geometry().cell_of(rotation * point + reference_from_query.translation);
        sum += pyramid.at(0, cell.x, cell.y);
    }
    return sum / (kFull * static_cast<double>(query.size()));
}

}  // namespace hybrid_slam
