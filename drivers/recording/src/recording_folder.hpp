// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hybrid_slam/recording/recording.hpp"

namespace hybrid_slam {

/// Makes the folder of a recording (and those above it) with manifest, robot.yaml and an empty
/// lidar.rec, which is returned; all of it is on the disk then. Throws Error, leaving nothing of
/// its own behind.
RecordFileWriter make_recording_folder(const std::filesystem::path& folder,
                                       const RobotConfig& robot, const RecordingManifest& manifest);

}  // namespace hybrid_slam
