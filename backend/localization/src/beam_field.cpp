// SPDX-License-Identifier: Apache-2.0
#include "beam_field.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hybrid_slam {
namespace {

constexpr double kSigma = 0.1;         // metres
constexpr double kUnknown = 0.3;       // likelihood of what ends there
constexpr double kHalfSpacing = 0.05;  // metres along a wall between points of the map
constexpr double kMostSquared = 2.0 * ReferenceMap::kNear * ReferenceMap::kNear;
// Factors, each above 1e-4, whose product does not underflow: one logarithm for so many beams.
constexpr std::size_t kTogether = 64;

}  // namespace

std::vector<Beam> beams_of(const Sweep& sweep, const ParticleFilterConfig& config) {
    const Points& points = sweep.surface.points;
    const std::size_t count = std::min(points.size(), static_cast<std::size_t>(config.beams));
    std::vector<Beam> beams;
    beams.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Point2& point = points[(2 * i + 1) * points.size() / (2 * count)];
        const double range = (point - sweep.origin).norm();
        beams.push_back(
            {point, config.random_hit + config.short_hit * std::exp(-range / config.short_range)});
    }
    return beams;
}

BeamField::BeamField(const ReferenceMap& map, double hit) : map_(map), hit_(hit) {
    for (std::size_t i = 0; i < bell_.size(); ++i) {
        const double squared = (static_cast<double>(i) + 0.5) * kMostSquared / kSteps;
        bell_[i] = std::exp(-0.5 * squared / (kSigma * kSigma));
    }
}

double BeamField::likelihood(const Point2& point) const {
    const std::uint32_t index = map_.nearest(point);
    if (index == ReferenceMap::kNothing) {
        // Where the map knows nothing, there may be a wall as well.
        const StateGrid& grid = map_.grid();
        return grid.at(grid.geometry.cell_of(point)) == CellState::kUnknown ? kUnknown : 0.0;
    }
    const Point2 off = point - map_.surface().points[index];
    const double across = off.dot(map_.surface().normals[index]);
    const double along2 = off.squaredNorm() - across * across;
    const double squared = across * across + std::max(0.0, along2 - kHalfSpacing * kHalfSpacing);
    const auto step = static_cast<std::size_t>(squared * (kSteps / kMostSquared));
    return step < bell_.size() ? bell_[step] : 0.0;
}

BeamsFit BeamField::fit_of(const std::vector<Beam>& beams, const Pose2d& map_from_robot) const {
    const Eigen::Matrix2d rotation = map_from_robot.rotation();
    BeamsFit fit;
    for (std::size_t first = 0; first < beams.size(); first += kTogether) {
        const std::size_t last = std::min(first + kTogether, beams.size());
        double product = 1.0;
        for (std::size_t i = first; i < last; ++i) {
            const double wall = likelihood(rotation * beams[i].end + map_from_robot.translation);
            product *= hit_ * wall + beams[i].otherwise;
            fit.mean += wall;
        }
        fit.log_likelihood += std::log(product);
    }
    fit.mean /= static_cast<double>(beams.size());
    return fit;
}

}  // namespace hybrid_slam
