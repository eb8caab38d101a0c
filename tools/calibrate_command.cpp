// SPDX-License-Identifier: Apache-2.0
#include "calibrate.hpp"
#include "commands.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr auto kFooter =
    R"(In this order, each once for a vehicle, and again when the camera was moved:
  hybrid-slam calibrate camera boards/*.jpg --board 9x6 --square 0.025 --out camera.yaml
  hybrid-slam calibrate ground floor.png --camera camera.yaml --tile 0.6 --out camera.yaml
  hybrid-slam calibrate extrinsics drive1/ --out forklift.yaml
)";

}  // namespace

void add_calibrate_command(CLI::App& program, Action& action) {
    CLI::App* command = program.add_subcommand(
        "calibrate", "Find the camera's optics, its place above the floor, and where sensors sit");
    command->require_subcommand(1);
    command->footer(kFooter);
    add_calibrate_camera_command(*command, action);
    add_calibrate_ground_command(*command, action);
    add_calibrate_extrinsics_command(*command, action);
}

}  // namespace hybrid_slam::tools
