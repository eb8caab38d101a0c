// SPDX-License-Identifier: Apache-2.0
// A network camera within LiveSensors, whose cable is pulled.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/live/collector.hpp"
#include "hybrid_slam/camera/mjpeg_server.hpp"
#include "mjpeg_support.hpp"

namespace hybrid_slam {
namespace {

using test::Collector;
using test::comes_true;
using test::numbered_image;

TEST(MjpegLive, ComesBackWithTheServerOnTheSamePort) {
    auto server = std::make_unique<MjpegServer>();
    const PseudoTerminal terminal;
    RobotConfig robot;
    robot.lidar.port = terminal.path();
    robot.camera.device = server->url();
    LiveOptions options;
    options.retry_every = 0.01;
    MjpegServerOptions same;
    same.port =
        static_cast<std::uint16_t>(std::stoi(server->url().substr(server->url().rfind(':') + 1)));

    LiveSensors sensors(robot, options);
    const Collector collector(sensors);
    for (std::uint32_t plugged = 1; plugged <= 3; ++plugged) {
        ASSERT_TRUE(comes_true([&] { return server->has_reader(); }));
        const auto has_come = [&] {
            server->publish(numbered_image(plugged));
            const auto images = collector.images();
            return !images.empty() && images.back() == numbered_image(plugged);
        };
        ASSERT_TRUE(comes_true(has_come));
        ASSERT_TRUE(
            comes_true([&] { return sensors.status().camera.state == DeviceState::kStreaming; }));
        EXPECT_FALSE(sensors.status().lidar_only);
        EXPECT_EQ(sensors.status().camera.connects, plugged);
        server.reset();
        ASSERT_TRUE(comes_true([&] { return sensors.status().lidar_only; }));
        EXPECT_THAT(sensors.status().camera.detail, ::testing::HasSubstr(robot.camera.device));
        server = std::make_unique<MjpegServer>(same);
    }
}

}  // namespace
}  // namespace hybrid_slam
