// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/live/lockstep_sensors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "hybrid_slam/camera/mjpeg_server.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "hybrid_slam/lockstep/lockstep_server.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"
#include "talk.hpp"

namespace hybrid_slam::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::testing::HasSubstr;

constexpr double kLong = 30.0;  // seconds: only a broken test waits for so long

Bytes piece(std::size_t number, std::size_t size) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) {
        bytes[i] = static_cast<std::uint8_t>(number * 31 + i);
    }
    return bytes;
}

EncodedImage picture(std::uint8_t gray) {
    Image image;
    image.width = 16;
    image.height = 8;
    image.channels = 1;
    image.pixels.assign(128, gray);
    return encode_jpeg(image, 90);
}

RobotConfig robot_at(const PseudoTerminal& line, const MjpegServer* camera) {
    RobotConfig robot;
    robot.lidar.port = line.path();
    robot.camera.enabled = camera != nullptr;
    robot.camera.device = camera != nullptr ? camera->url() : std::string();
    return robot;
}

/// What the sensors' end yields until the simulator ends.
class Reader {
  public:
    Reader(const RobotConfig& robot, const std::string& url)
        : thread_([this, robot, url] {
              LockstepSensors sensors(robot, url);
              while (auto event = sensors.next()) {
                  events_.push_back(std::move(*event));
              }
              EXPECT_TRUE(sensors.ended());
          }) {}
    ~Reader() { thread_.join(); }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;

    std::vector<SensorEvent> events() {
        if (thread_.joinable()) {
            thread_.join();
        }
        thread_ = std::thread([] {});
        return events_;
    }

  private:
    std::vector<SensorEvent> events_;
    std::thread thread_;
};

/// Both kinds in turn; each piece larger than a terminal hands over at once.
void serve(LockstepServer& server, PseudoTerminal& line, MjpegServer* camera) {
    for (std::size_t i = 0; i < 20; ++i) {
        const double now = 0.08 * static_cast<double>(i);
        server.wait_until_read();
        line.write(piece(i, 1000 + 97 * i));
        server.lidar(now, 1000 + 97 * i);
        if (camera != nullptr) {
            server.wait_until_read();
            camera->publish(picture(static_cast<std::uint8_t>(10 * i)));
            server.image(now + 0.01);
        }
    }
    server.wait_until_read();
}

TEST(LockstepSensors, YieldEachPieceAndEachImageWithItsArrival) {
    MjpegServerOptions options;
    options.lossless = true;
    MjpegServer camera(options);
    PseudoTerminal line;
    std::optional<LockstepServer> server(std::in_place);
    Reader reader(robot_at(line, &camera), server->url());
    Talker drive(server->url());
    drive.say("hello drive 1\n");
    ASSERT_TRUE(server->wait_for_clients(kLong));
    serve(*server, line, &camera);
    server.reset();
    const std::vector<SensorEvent> events = reader.events();
    ASSERT_EQ(events.size(), 40U);
    for (std::size_t i = 0; i < 20; ++i) {
        const auto& lidar = std::get<LidarBytes>(events[2 * i]);
        EXPECT_EQ(lidar.arrival, 0.08 * static_cast<double>(i));
        EXPECT_EQ(lidar.bytes, piece(i, 1000 + 97 * i));
        const auto& image = std::get<CameraFrame>(events[2 * i + 1]);
        EXPECT_EQ(image.arrival, 0.08 * static_cast<double>(i) + 0.01);
        EXPECT_EQ(image.image, picture(static_cast<std::uint8_t>(10 * i)));
    }
}

TEST(LockstepSensors, ImagesThatNobodyAskedForArePassedOver) {
    PseudoTerminal line;
    std::optional<LockstepServer> server(std::in_place);
    Reader reader(robot_at(line, nullptr), server->url());
    Talker drive(server->url());
    drive.say("hello drive 1\n");
    ASSERT_TRUE(server->wait_for_clients(kLong));
    server->image(0.01);
    server->image(0.02);
    serve(*server, line, nullptr);
    server.reset();
    EXPECT_EQ(reader.events().size(), 20U);
}

TEST(LockstepSensors, MoreBytesThanSaidAreAnError) {
    PseudoTerminal line;
    LockstepServer server;
    LockstepSensors sensors(robot_at(line, nullptr), server.url());
    Talker drive(server.url());
    drive.say("hello drive 1\n");
    ASSERT_TRUE(server.wait_for_clients(kLong));
    EXPECT_FALSE(sensors.next_within(0.01)) << "nothing yet";
    line.write(piece(1, 10));
    server.lidar(0.0, 4);
    EXPECT_THAT(error_of([&] { sensors.next(); }), HasSubstr("more bytes"));
}

TEST(LockstepSensors, ALineThatIsPulledIsAnError) {
    std::optional<PseudoTerminal> line(std::in_place);
    LockstepServer server;
    LockstepSensors sensors(robot_at(*line, nullptr), server.url());
    Talker drive(server.url());
    drive.say("hello drive 1\n");
    ASSERT_TRUE(server.wait_for_clients(kLong));
    line.reset();
    server.lidar(0.0, 4);
    EXPECT_THROW(sensors.next(), Error);
}

TEST(LockstepSensors, OpenTheirDevicesFirst) {
    LockstepServer server;
    RobotConfig robot;
    robot.lidar.port = "/dev/no_such_scanner";
    EXPECT_THAT(error_of([&] { LockstepSensors sensors(robot, server.url()); }),
                HasSubstr("no_such_scanner"));
}

}  // namespace
}  // namespace hybrid_slam::test
