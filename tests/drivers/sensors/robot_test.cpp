// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/sensors/robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hybrid_slam/core/text_file.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kRobots =
    std::filesystem::path(HYBRID_SLAM_SOURCE_DIR) / "config" / "robots";

TEST(Robot, ReadsWhatItsFileSays) {
    const TempFolder folder;
    const RobotConfig robot =
        read_robot(folder.write("r.yaml",
                                "name: reach truck 4\n"
                                "lidar:\n"
                                "  port: tcp://10.0.0.7:4001\n"
                                "  baud: 115200\n"
                                "  yaw_deg: 180\n"
                                "  upside_down: true\n"
                                "  blind_sectors_deg: [-135, -120, 120, 135]\n"
                                "camera:\n"
                                "  enabled: false\n"
                                "  model: {fx: 500}\n"
                                "  mounting: {pitch_deg: 30}\n"
                                "vehicle:\n"
                                "  wheelbase: -1.4\n"));
    EXPECT_EQ(robot.name, "reach truck 4");
    EXPECT_EQ(robot.lidar.port, "tcp://10.0.0.7:4001");
    EXPECT_EQ(robot.lidar.baud, 115200);
    EXPECT_DOUBLE_EQ(robot.lidar.robot_from_laser().heading, kPi);
    EXPECT_TRUE(robot.lidar.upside_down);
    EXPECT_EQ(robot.lidar.blind_sectors_deg.size(), 4U);
    EXPECT_FALSE(robot.camera.enabled);
    EXPECT_EQ(robot.camera.model.fx, 500.0);
    EXPECT_DOUBLE_EQ(robot.camera.mounting.pitch, kPi / 6.0);
    EXPECT_EQ(robot.vehicle.wheelbase, -1.4);
}

TEST(Robot, MistakesNameTheLineAndTheKey) {
    const TempFolder folder;
    const auto mistake = [&](std::string_view text) {
        return error_of([&] { read_robot(folder.write("r.yaml", text)); });
    };
    EXPECT_THAT(mistake("name: a\nlidr: {baud: 1}\n"), HasSubstr("r.yaml:2"));
    EXPECT_THAT(mistake("lidar: {baud: fast}\n"), HasSubstr("lidar.baud"));
    EXPECT_THAT(mistake("lidar: {blind_sectors_deg: [10]}\n"),
                HasSubstr("r.yaml: lidar.blind_sectors_deg: must hold pairs"));
    EXPECT_THAT(mistake("camera:\n  model: {fx: 0}\n"),
                HasSubstr("r.yaml:2: key 'camera.model.fx'"));
}

TEST(Robot, ComesBackFromItsYaml) {
    const TempFolder folder;
    RobotConfig robot;
    robot.name = "it's #1";
    robot.lidar.blind_sectors_deg = {-10.5, 3.25};
    robot.lidar.yaw = 0.123456789;
    robot.camera.mounting.roll = -0.01;
    const std::string yaml = to_yaml(robot);
    EXPECT_EQ(to_yaml(read_robot(folder.write("r.yaml", yaml))), yaml);
}

/// So that the file shows every key. When a default changes, change it there too.
TEST(Robot, TheShippedForkliftIsTheDefault) {
    const std::string text = read_whole_file(kRobots / "forklift.yaml", 1U << 20U);
    const std::size_t first_key = text.find("name:");
    ASSERT_NE(first_key, std::string::npos);
    EXPECT_EQ(text.substr(first_key), to_yaml(RobotConfig()));
}

TEST(Robot, AllShippedOnesAreGood) {
    int robots = 0;
    for (const auto& entry : std::filesystem::directory_iterator(kRobots)) {
        EXPECT_FALSE(read_robot(entry.path()).name.empty()) << entry.path();
        ++robots;
    }
    EXPECT_GE(robots, 1);
}

}  // namespace
}  // namespace hybrid_slam::test
