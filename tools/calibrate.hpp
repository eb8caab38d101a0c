// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "commands.hpp"

namespace hybrid_slam::tools {

/// The subcommands of `calibrate`.
void add_calibrate_camera_command(CLI::App& calibrate, Action& action);
void add_calibrate_ground_command(CLI::App& calibrate, Action& action);
void add_calibrate_extrinsics_command(CLI::App& calibrate, Action& action);

}  // namespace hybrid_slam::tools
