// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "hybrid_slam/core/trajectory.hpp"

namespace hybrid_slam {

/// One line of a .relations file: the pose of the robot at `to_stamp` seen from `from_stamp`.
struct Relation {
    double from_stamp = 0.0;  ///< seconds
    double to_stamp = 0.0;    ///< seconds
    Pose2d from_from_to;
};

/// Reads `t1 t2 x y z roll pitch yaw` lines; '#' starts a comment. Throws Error with the file and
/// the line, and on a file without any relation.
std::vector<Relation> read_relations(const std::filesystem::path& file);

/// All NaN when there was nothing to count.
struct ErrorStatistics {
    double mean = 0.0;
    double deviation = 0.0;  ///< standard deviation of the whole population
    double mean_squared = 0.0;
    double deviation_squared = 0.0;
    double maximum = 0.0;
};

/// Kuemmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous Robots 2009, with
/// the translation and the rotation weighed apart.
struct RelationsError {
    std::size_t used = 0;
    std::size_t unmatched = 0;    ///< relations without a pose within the tolerance
    ErrorStatistics translation;  ///< metres
    ErrorStatistics rotation;     ///< radians
};

/// Stamps are matched to the nearest pose within `tolerance` seconds.
RelationsError relations_error(const Trajectory& trajectory, const std::vector<Relation>& relations,
                               double tolerance = 0.001);

/// Root mean square errors after one rigid alignment of the estimate to the truth (ATE), pose by
/// pose along the axes of the truth (thesis equations 4.1 to 4.3), and of the relative motion
/// (RPE).
struct TruthError {
    std::size_t used = 0;
    std::size_t unmatched = 0;  ///< estimated poses without truth at their stamp
    Pose2d truth_from_estimate;
    double ate_rmse = 0.0;              ///< metres
    double ate_max = 0.0;               ///< metres
    double x_rmse = 0.0;                ///< metres
    double y_rmse = 0.0;                ///< metres
    double heading_rmse = 0.0;          ///< radians
    double rpe_translation_rmse = 0.0;  ///< metres, over rpe_distance of true path
    double rpe_rotation_rmse = 0.0;     ///< radians
    double rpe_distance = 1.0;          ///< metres
    std::size_t rpe_pairs = 0;          ///< when 0, the RPE is NaN
};

/// What the estimate is moved by before it is compared.
enum class TruthAlignment {
    kBestFit,    ///< the whole trajectory, by least squares
    kFirstPose,  ///< onto the first true pose, heading included: as a map that starts there
    kNone        ///< both are in one frame
};

struct TruthOptions {
    TruthAlignment alignment = TruthAlignment::kBestFit;
    double max_gap = 0.2;  ///< seconds between neighbouring true poses that may be interpolated
    double rpe_distance =
        1.0;  ///< metres of true path, at least, between the two poses of an RPE pair
};

/// Throws Error when fewer than two estimated poses have truth at their stamp.
TruthError truth_error(const Trajectory& estimate, const Trajectory& truth,
                       const TruthOptions& options = {});

}  // namespace hybrid_slam
