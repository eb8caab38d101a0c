// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/sensors/robot.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

constexpr auto kModel =
    "rate: 10, model: {width: 320, height: 240, fx: 366, fy: 354, cx: 160, cy: 118, "
    "k1: 0, k2: 0, p1: 0, p2: 0}";

/// The whole way from a drive to a robot's file, with few and small images.
TEST(CalibrateExtrinsicsDrive, FindsWhatTheFileHasWrong) {
    const TempFolder folder;
    folder.write("true.yaml", std::string("camera: {") + kModel + "}\n");
    folder.write("wrong.yaml",
                 std::string("name: truck 7\nlidar: {x: 1.33, yaw_deg: -1}\ncamera: {") + kModel +
                     ", latency: 0.055, mounting: {x: 1.16, y: 0.03, yaw_deg: 1.5}}\n");
    run_well(folder, "simulate '" HYBRID_SLAM_SOURCE_DIR
                     "/config/worlds/figure_eight.yaml' --robot true.yaml --out drive --quiet "
                     "--set distance=45 --set speed=0.6 --set turn_rate=0.8");
    const Json json = run_well(folder,
                               "calibrate extrinsics drive --robot wrong.yaml --out found.yaml "
                               "--json --quiet --set vo.features=120 --set scan.spacing=0.1")
                          .json();
    EXPECT_EQ(json["fit"], true);
    EXPECT_NEAR(json["camera_time_s"], 0.024, 0.004);  // images are up to 2 ms late besides
    // Within what the result itself says, which must be of use.
    const auto expect = [&](const char* key, double truth, double most_sigma, double known) {
        const Json parameter = json["parameters"][key];
        const double sigma = parameter["sigma"];
        EXPECT_LT(sigma, most_sigma) << key;
        EXPECT_NEAR(parameter["after"], truth, 3.0 * sigma + known) << key;
    };
    expect("lidar.x", 1.3, 0.005, 0.0);
    expect("lidar.yaw_deg", 0.0, 0.1, 0.0);
    expect("camera.mounting.x", 1.2, 0.02, 0.0);
    expect("camera.mounting.y", 0.0, 0.02, 0.0);
    expect("camera.mounting.yaw_deg", 0.0, 0.15, 0.0);
    expect("camera.latency", 0.031, 0.004, 0.001);
    const RobotConfig found = read_robot(folder / "found.yaml");
    EXPECT_EQ(found.name, "truck 7");
    EXPECT_EQ(found.camera.rate, 10.0);
    EXPECT_NEAR(found.camera.mounting.yaw,
                radians(json["parameters"]["camera.mounting.yaw_deg"]["after"]), 1e-4);
}

}  // namespace
}  // namespace hybrid_slam::test
