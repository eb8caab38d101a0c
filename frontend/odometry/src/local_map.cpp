// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/local_map.hpp"

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace hybrid_slam {

namespace {

// Cell and side: the two faces of a thin wall may share a cell, but must not be averaged. The side
// is the quadrant of the normal, turned by 45 degrees so that walls along the axes do not flicker
// between two.
std::uint64_t key_of(const Point2& point, const Point2& normal, double resolution) {
    const auto x = static_cast<std::int64_t>(std::floor(point.x() / resolution));
    const auto y = static_cast<std::int64_t>(std::floor(point.y() / resolution));
    std::uint64_t side = 4;
    if (!normal.isZero(0.0)) {
        const bool up = normal.y() + normal.x() >= 0.0;
        const bool left = normal.y() - normal.x() >= 0.0;
        side = (up ? 1U : 0U) + (left ? 2U : 0U);
    }
    return (static_cast<std::uint64_t>(x & 0x3fffffff) << 33U) |
           (static_cast<std::uint64_t>(y & 0x3fffffff) << 3U) | side;
}

}  // namespace

Surface merge(const std::deque<Surface>& surfaces, double resolution) {
    std::size_t total = 0;
    for (const Surface& surface : surfaces) {
        total += surface.size();
    }
    std::unordered_map<std::uint64_t, std::size_t> slots;
    slots.reserve(total);
    Surface merged;
    std::vector<double> counts;
    for (const Surface& surface : surfaces) {
        for (std::size_t i = 0; i < surface.size(); ++i) {
            const auto [slot, is_new] = slots.emplace(
                key_of(surface.points[i], surface.normals[i], resolution), merged.size());
            if (is_new) {
                merged.points.push_back(surface.points[i]);
                merged.normals.push_back(surface.normals[i]);
                counts.push_back(1.0);
            } else {
                merged.points[slot->second] += surface.points[i];
                merged.normals[slot->second] += surface.normals[i];
                counts[slot->second] += 1.0;
            }
        }
    }
    for (std::size_t i = 0; i < merged.size(); ++i) {
        merged.points[i] /= counts[i];
        if (!merged.normals[i].isZero(0.0)) {
            merged.normals[i].normalize();
        }
    }
    return merged;
}

void LocalMap::insert(Surface surface_in_map) {
    surfaces_.push_back(std::move(surface_in_map));
    while (surfaces_.size() > static_cast<std::size_t>(config_.scans)) {
        surfaces_.pop_front();
    }
    Surface merged =
        surfaces_.size() == 1 ? surfaces_.front() : merge(surfaces_, config_.resolution);
    if (merged.size() > 0) {
        reference_.emplace(std::move(merged));
    }
}

void describe(ConfigSchema& schema, LocalMapConfig& config) {
    schema.add("scans", config.scans, 1, 1000, "the newest so many keyframes are the local map");
    schema.add("resolution", config.resolution, 0.001, 1.0, "m, points in one cell are averaged");
}

}  // namespace hybrid_slam
