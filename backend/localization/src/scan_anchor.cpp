// SPDX-License-Identifier: Apache-2.0
#include "scan_anchor.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/uncertainty.hpp"
#include "scan_certainty.hpp"

namespace hybrid_slam {
namespace {

constexpr double kSigmas = 3.0;             ///< of the pose's doubt that widen the gate
constexpr double kAlong = 0.15;             ///< metres along a wall between points of the map
constexpr double kSameDirection = 0.7;      ///< cosine between the normals of scan and map
constexpr double kLooseTranslation = 0.01;  ///< metres, added to the guess's sigma, so that the
constexpr double kLooseRotation = radians(0.3);  ///< scan moves freely where it knows the way
constexpr double kLooseFactor = 4.0;             ///< of the guess's covariance, likewise

Eigen::Matrix3d diagonal(double translation, double rotation) {
    return Eigen::Vector3d(translation * translation, translation * translation,
                           rotation * rotation)
        .asDiagonal();
}

/// Walls of the map near which a scan's points may lie, seen from a pose with its doubt.
class WallGate {
  public:
    WallGate(const ReferenceMap& map, const PoseBelief& belief, double gate)
        : map_(map), belief_(belief), rotation_(belief.map_from_robot.rotation()), gate_(gate) {}

    /// The points that pass, in the frame of the robot. Those in such doubt that the map's table
    /// does not reach so far pass untried.
    Surface near_walls(const Surface& scan) {
        Surface passed;
        for (std::size_t i = 0; i < scan.size(); ++i) {
            if (passes(scan.points[i], scan.normals[i])) {
                passed.points.push_back(scan.points[i]);
                passed.normals.push_back(scan.normals[i]);
                note(scan.points[i], scan.normals[i]);
            }
        }
        return passed;
    }

    /// The widest gate that was used, in metres.
    double widest() const { return widest_; }

    /// Of the points that passed.
    const std::vector<WallSighting>& sightings() const { return sightings_; }

  private:
    void note(const Point2& point, const Point2& normal) {
        const Point2 arm = rotation_ * point;
        const Point2 out = wall_normal(map_.nearest(arm + belief_.map_from_robot.translation));
        sightings_.push_back({arm, out.isZero(0.0) ? Point2(rotation_ * normal) : out});
    }

    Point2 wall_normal(std::uint32_t index) const {
        return index == ReferenceMap::kNothing ? Point2(Point2::Zero())
                                               : map_.surface().normals[index];
    }

    bool passes(const Point2& point, const Point2& normal) {
        const Point2 arm = rotation_ * point;
        const Point2 place = arm + belief_.map_from_robot.translation;
        const std::uint32_t index = map_.nearest(place);
        const Point2 out = wall_normal(index);
        // Lone points of a far wall would hold the pose along it, where they were seen by chance.
        if (index != ReferenceMap::kNothing && out.isZero(0.0)) {
            return false;
        }
        const double gate = gate_ + kSigmas * doubt(arm, out);
        if (gate < ReferenceMap::kNear &&
            (index == ReferenceMap::kNothing ||
             !lies_near(place - map_.surface().points[index], out, rotation_ * normal, gate))) {
            return false;
        }
        widest_ = std::max(widest_, gate);
        return true;
    }

    bool lies_near(const Point2& off, const Point2& out, const Point2& normal, double gate) const {
        const double across = std::abs(out.dot(off));
        const double along2 = off.squaredNorm() - across * across;
        const double along = kAlong + gate - gate_;
        return across <= gate && along2 <= along * along &&
               (normal.isZero(0.0) || out.dot(normal) > kSameDirection);
    }

    /// Sigma across the wall (or in any direction where that is not known) of a point seen along
    /// `arm`.
    double doubt(const Point2& arm, const Point2& out) const {
        const Eigen::Matrix3d& covariance = belief_.covariance;
        const Point2 swing(-arm.y(), arm.x());
        if (out.isZero(0.0)) {
            return std::sqrt(covariance(0, 0) + covariance(1, 1) +
                             arm.squaredNorm() * covariance(2, 2));
        }
        const Eigen::Vector3d across(out.x(), out.y(), out.dot(swing));
        return std::sqrt(std::max(0.0, across.dot(covariance * across)));
    }

    const ReferenceMap& map_;
    const PoseBelief& belief_;
    Eigen::Matrix2d rotation_;
    double gate_;
    double widest_ = 0.0;
    std::vector<WallSighting> sightings_;
};

/// ICP of the points near walls from `expected`. The guess counts as less sure than it is, so that
/// it only leads where the scan knows no way.
IcpResult align_near(const ReferenceMap& map, const Surface& points, const IcpGuess& guess,
                     double gate, IcpConfig config) {
    constexpr int kIterations = 10;  // along a corridor it would wander on without any gain
    config.metric = IcpMetric::kPointToLine;
    config.max_iterations = std::min(config.max_iterations, kIterations);
    config.max_distance = std::min(config.max_distance, gate);
    config.min_distance = std::min(config.min_distance, config.max_distance);
    return align(points, map.reference(), guess, config);
}

IcpGuess loose(const PoseBelief& belief) {
    const Eigen::Matrix3d covariance =
        kLooseFactor * belief.covariance + diagonal(kLooseTranslation, kLooseRotation);
    return {belief.map_from_robot, covariance.inverse()};
}

/// Where the scan alone would be: ICP's result r minimises both (x - s)^T H (x - s) and the guess's
/// (x - g)^T P (x - g), hence s = r + H^-1 P (r - g), taken in the directions that H determines.
Pose2d without_guess(const IcpResult& icp, const IcpGuess& guess, const ScanCertainty& certainty) {
    const Pose2d& pose = icp.reference_from_points;
    const Eigen::Vector3d step =
        certainty.solve(guess.information * difference(pose, guess.reference_from_points));
    return {pose.x() + step.x(), pose.y() + step.y(), normalize_angle(pose.heading + step.z())};
}

/// (information^-1 + floor)^-1 for an information that may be singular.
Eigen::Matrix3d blurred(const Eigen::Matrix3d& information, const Eigen::Matrix3d& floor) {
    const Eigen::Matrix3d mixed = Eigen::Matrix3d::Identity() + information * floor;
    const Eigen::Matrix3d result = mixed.partialPivLu().solve(information);
    return 0.5 * (result + result.transpose());
}

}  // namespace

ScanAnchor anchor_of(const ReferenceMap& map, const Surface& scan, const PoseBelief& expected,
                     const ScanAnchorConfig& config, IcpConfig icp) {
    // A guess in doubt passes much; what is found with it shows better what belongs to the map.
    constexpr double kWide = 0.05;
    constexpr std::size_t kFewest = 10;
    ScanAnchor result;
    PoseBelief belief = expected;
    IcpGuess guess = loose(expected);
    for (int pass = 0; pass < 2; ++pass) {
        WallGate walls(map, belief, config.gate);
        const Surface points = walls.near_walls(scan);
        result.found = points.size() >= kFewest;
        if (!result.found) {
            break;
        }
        result.near = static_cast<double>(points.size()) / static_cast<double>(scan.size());
        const IcpResult found = align_near(map, points, guess, walls.widest(), icp);
        result.found = found.usable();
        if (!result.found) {
            break;
        }
        const ScanCertainty certainty(found.information, walls.sightings());
        result.anchor.map_from_robot = without_guess(found, guess, certainty);
        // Where much is new, some of it stands so near to a wall that it pulls.
        const double doubt = 1.0 / (result.near * result.near);
        result.anchor.information =
            blurred(certainty.information(),
                    diagonal(doubt * config.translation_floor, doubt * config.rotation_floor));
        if (walls.widest() < config.gate + kWide) {
            break;
        }
        belief.map_from_robot = found.reference_from_points;
        belief.covariance = (found.information + guess.information).inverse();
        guess.reference_from_points = belief.map_from_robot;  // it is taken off again all the same
    }
    return result;
}

}  // namespace hybrid_slam
