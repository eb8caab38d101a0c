// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/scan_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kSpacing = 0.1;        ///< metres along a wall between points of the map, at most
constexpr double kSameFace = 0.3;       ///< cosine between the normals of one side of a wall
constexpr double kFacing = 0.2;         ///< cosine; flatter beams tell nothing of passing through
constexpr double kBefore = 0.25;        ///< metres before its end that a beam has passed a wall
constexpr double kHalfWall = 0.12;      ///< metres to both sides that a wall must go on
constexpr double kShortStep = 0.04;     ///< metres
constexpr std::size_t kMostRays = 400;  ///< walked in one query; more tell no more

enum class End { kExplained, kViolated, kUnmapped, kUnknown };

class Judge {
  public:
    Judge(const ReferenceMap& map, double gate) : map_(map), gate_(gate) {}

    /// Squared distance across the wall in `across2` when explained.
    End end_of(const Point2& point, const Point2& normal, double& across2) const {
        const std::uint32_t index = map_.nearest(point);
        if (index == ReferenceMap::kNothing) {
            return open_or_unknown(point);
        }
        const Point2& wall = map_.surface().points[index];
        const Point2& out = map_.surface().normals[index];
        const Point2 off = point - wall;
        const double across = out.isZero(0.0) ? off.norm() : out.dot(off);
        const double along2 = std::max(0.0, off.squaredNorm() - across * across);
        const bool same_side = out.isZero(0.0) || normal.isZero(0.0) || out.dot(normal) > kSameFace;
        if (std::abs(across) <= gate_ && along2 <= kSpacing * kSpacing && same_side) {
            across2 = across * across;
            return End::kExplained;
        }
        const bool behind = !out.isZero(0.0) && across < -gate_ && along2 <= kSpacing * kSpacing;
        return behind ? End::kViolated : open_or_unknown(point);
    }

    /// Whether a wall stands between `origin` and `point`: the beam would have ended there.
    bool passes_wall(const Point2& origin, const Point2& point) const {
        const double range = (point - origin).norm();
        const Point2 direction = (point - origin) / range;
        for (double way = kBefore; way < range - kBefore;) {
            const Point2 here = origin + way * direction;
            const std::uint32_t index = map_.nearest(here);
            if (index == ReferenceMap::kNothing) {
                way += ReferenceMap::kNear - kShortStep;
                continue;
            }
            const Point2& wall = map_.surface().points[index];
            const Point2& out = map_.surface().normals[index];
            const double facing = -out.dot(direction);
            const double left = out.dot(here - wall) / facing;  // to where the wall's line is met
            if (facing > kFacing && std::abs(left) < 2.0 * kShortStep &&
                way + left < range - kBefore && is_wall(here + left * direction, out)) {
                return true;
            }
            way += std::max(kShortStep, (here - wall).norm() - kSpacing);
        }
        return false;
    }

  private:
    End open_or_unknown(const Point2& point) const {
        const GridGeometry& geometry = map_.grid().geometry;
        return map_.grid().at(geometry.cell_of(point)) == CellState::kUnknown ? End::kUnknown
                                                                              : End::kUnmapped;
    }

    /// A wall that goes on to both sides, so that a pose that is off by some centimetres does not
    /// make a beam past a door frame one through it.
    bool is_wall(const Point2& place, const Point2& normal) const {
        const Point2 along(-normal.y(), normal.x());
        for (const double side : {-kHalfWall, 0.0, kHalfWall}) {
            const Point2 there = place + side * along;
            const std::uint32_t index = map_.nearest(there);
            if (index == ReferenceMap::kNothing ||
                (map_.surface().points[index] - there).squaredNorm() > 0.25 * kSpacing * kSpacing ||
                map_.surface().normals[index].dot(normal) < kSameFace || !is_occupied(there)) {
                return false;
            }
        }
        return true;
    }

    /// Those who walked by have left points, but no occupied cells.
    bool is_occupied(const Point2& place) const {
        const Cell middle = map_.grid().geometry.cell_of(place);
        for (int y = -1; y <= 1; ++y) {
            for (int x = -1; x <= 1; ++x) {
                if (map_.grid().at({middle.x + x, middle.y + y}) == CellState::kOccupied) {
                    return true;
                }
            }
        }
        return false;
    }

    const ReferenceMap& map_;
    double gate_;
};

std::size_t points_of(const Query& query) {
    std::size_t points = 0;
    for (const Sweep& sweep : query) {
        points += sweep.surface.size();
    }
    return points;
}

}  // namespace

Sweep transform(const Pose2d& a_from_b, const Sweep& sweep_in_b) {
    return {a_from_b * sweep_in_b.origin, transform(a_from_b, sweep_in_b.surface)};
}

ScanFit fit_of(const ReferenceMap& map, const Query& query, const Pose2d& map_from_query,
               double gate) {
    ScanFit fit;
    fit.points = points_of(query);
    if (fit.points == 0) {
        return fit;
    }
    const Judge judge(map, gate);
    const std::size_t stride = (fit.points + kMostRays - 1) / kMostRays;
    std::array<double, 4> counts{};
    double judged = 0.0;
    double beyond = 0.0;
    double across2 = 0.0;
    std::size_t next = 0;
    for (const Sweep& sweep : query) {
        const Point2 origin = map_from_query * sweep.origin;
        const Eigen::Matrix2d rotation = map_from_query.rotation();
        for (; next < sweep.surface.size(); next += stride) {
            const Point2 point = map_from_query * sweep.surface.points[next];
            double squared = 0.0;
            End end = judge.end_of(point, rotation * sweep.surface.normals[next], squared);
            if (end != End::kViolated && judge.passes_wall(origin, point)) {
                beyond += end == End::kExplained ? 1.0 : 0.0;
                end = End::kViolated;
            }
            across2 += end == End::kExplained ? squared : 0.0;
            counts[static_cast<std::size_t>(end)] += 1.0;
            judged += 1.0;
        }
        next -= sweep.surface.size();
    }
    const auto share = [&](End end) { return counts[static_cast<std::size_t>(end)] / judged; };
    fit.explained = share(End::kExplained);
    fit.violated = share(End::kViolated);
    fit.beyond = beyond / judged;
    fit.unmapped = share(End::kUnmapped);
    fit.unknown = share(End::kUnknown);
    fit.rms = fit.explained > 0.0 ? std::sqrt(across2 / (fit.explained * judged)) : 0.0;
    // What ends where the map knows nothing is half a reason to doubt.
    fit.score = std::clamp((fit.explained - fit.against()) / (1.0 - 0.5 * fit.unknown), 0.0, 1.0);
    return fit;
}

}  // namespace hybrid_slam
