// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/registration/surface.hpp"

namespace hybrid_slam {

enum class IcpMetric {
    kPointToPoint,  ///< closed form by SVD (thesis equations 3.7 to 3.10)
    kPointToLine    ///< Gauss-Newton on distances to the tangent (Chen and Medioni 1991)
};
enum class IcpKernel { kNone, kHuber, kCauchy };

struct IcpConfig {
    IcpMetric metric = IcpMetric::kPointToLine;
    int max_iterations = 30;
    double max_distance =
        2.5;  ///< metres; pairs farther apart are no pairs, at the first iteration
    double min_distance = 0.15;  ///< metres; to where that gate narrows as the fit improves
    double gate_factor = 10.0;   ///< the gate is this many times the median distance of the pairs
    double max_normal_angle = radians(50.0);  ///< between the normals of a pair
    double trim = 1.0;                        ///< share of the pairs kept, the closest first
    IcpKernel kernel = IcpKernel::kCauchy;
    double kernel_scale = 0.05;           ///< metres
    double kernel_gate_ratio = 0.25;      ///< the kernel is at least this share of the gate wide
    double translation_tolerance = 5e-4;  ///< metres; converged when a step is smaller than both
    double rotation_tolerance = 2e-4;     ///< radians
    double min_overlap = 0.3;             ///< pairs / points, below which ICP has failed
    double noise_floor = 0.02;            ///< metres; no residual counts as more certain than this
};

void describe(ConfigSchema& schema, IcpConfig& config);

/// Throws Error that names the keys (icp.*) of values that contradict each other.
void expect_consistent(const IcpConfig& config);

enum class IcpStatus {
    kConverged,
    kMaxIterations,  ///< usable, but still moving
    kTooFewPairs,    ///< failed: less overlap than min_overlap
    kDegenerate      ///< failed: the pairs do not determine the pose and no prior does
};
std::string_view to_string(IcpStatus status);

struct IcpResult {
    Pose2d reference_from_points;  ///< the guess when ICP failed
    IcpStatus status = IcpStatus::kTooFewPairs;
    int iterations = 0;
    std::size_t pairs = 0;  ///< at the result
    double overlap = 0.0;   ///< share of the points with a pair within min_distance; 0 when failed
    double rms = 0.0;       ///< metres, of the residuals of the metric
    /// Of (x, y, heading) of reference_from_points, from the normal equations at the solution
    /// without the prior: 1/m2, 1/m, 1/rad2.
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    /// Square root of the smaller eigenvalue of the translation's marginal information, relative to
    /// the larger: near 0 in a corridor, along `weak_direction` (unit vector in the reference
    /// frame).
    double weakness_ratio = 0.0;
    Eigen::Vector2d weak_direction = Eigen::Vector2d::Zero();

    bool usable() const {
        return status == IcpStatus::kConverged || status == IcpStatus::kMaxIterations;
    }
};

/// A guess with how far it is to be trusted: the information of (x, y, heading) of the guess. Zero
/// means a start and nothing more.
struct IcpGuess {
    IcpGuess() = default;
    IcpGuess(const Pose2d& pose, const Eigen::Matrix3d& information_in = Eigen::Matrix3d::Zero())
        : reference_from_points(pose), information(information_in) {}

    Pose2d reference_from_points;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

/// Iterative closest point: moves `scan` onto `reference` from `guess`. Never throws on data: too
/// few points or a degenerate scene are a status. The closed form of kPointToPoint has no place for
/// the guess's information and starts from the guess alone. For kPointToLine give a reference of
/// oriented points: lone points of a far wall, paired point to point, would claim to know the way
/// along it.
IcpResult align(const Surface& scan, const Reference& reference, const IcpGuess& guess,
                const IcpConfig& config = {});

}  // namespace hybrid_slam
