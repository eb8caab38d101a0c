// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid_slam/localization/relocalization.hpp"

namespace hybrid_slam::tools {

/// "x 1.234 m, y -0.500 m, heading 12.34 deg"
std::string pose_text(const Pose2d& pose);
nlohmann::ordered_json to_json(const Pose2d& pose);

/// "not in this map" and the like, for people.
std::string words_for(PlaceVerdict verdict);

/// Standard deviations of (x, y, heading): metres, metres, degrees.
Eigen::Vector3d sigmas_of(const Eigen::Matrix3d& covariance);
/// "0.4 cm along x, 0.5 cm along y, 0.05 deg"
std::string sigmas_text(const Eigen::Matrix3d& covariance);
nlohmann::ordered_json sigmas_json(const Eigen::Matrix3d& covariance);
/// Rows of m2, m rad, rad2, with all their digits.
nlohmann::ordered_json matrix_json(const Eigen::Matrix3d& covariance);

nlohmann::ordered_json to_json(const ScanFit& fit);
nlohmann::ordered_json to_json(const Place& place);
/// Verdict, places and effort.
nlohmann::ordered_json to_json(const Relocalization& relocalization);

/// The answer for people, in a few lines.
std::string text_of(const Relocalization& relocalization);

}  // namespace hybrid_slam::tools
