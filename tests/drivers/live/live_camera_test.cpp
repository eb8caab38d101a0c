// SPDX-License-Identifier: Apache-2.0
// LiveSensors with a camera that does what the test says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>

#include "collector.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::Collector;
using test::comes_true;
using test::scan_numbers;
using test::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// The cable and the mood of a camera; shared with the captures that are opened on it.
struct FakeCamera {
    enum class Mood { kMissing, kStreaming, kStalled, kHanging };
    std::atomic<Mood> mood{Mood::kStreaming};
    std::atomic<std::uint32_t> images{0};
    std::atomic<bool> left{false};
};

class FakeCapture : public Capture {
  public:
    explicit FakeCapture(std::shared_ptr<FakeCamera> camera) : camera_(std::move(camera)) {}

    bool read(EncodedImage& image, double timeout) override {
        test::sleep_ms(1);
        while (camera_->mood == FakeCamera::Mood::kHanging) {
            test::sleep_ms(1);
        }
        switch (camera_->mood) {
            case FakeCamera::Mood::kMissing:
                camera_->left = true;
                throw Error("video0: unplugged");
            case FakeCamera::Mood::kStreaming: {
                const std::uint32_t number = camera_->images++;
                image = {static_cast<std::uint8_t>(number >> 8), static_cast<std::uint8_t>(number)};
                return true;
            }
            default:
                test::sleep_ms(static_cast<int>(std::min(timeout, 0.01) * 1e3));
                return false;
        }
    }

  private:
    std::shared_ptr<FakeCamera> camera_;
};

std::uint32_t number_of(const EncodedImage& image) {
    return static_cast<std::uint32_t>(image.at(0) << 8 | image.at(1));
}

class LiveCamera : public ::testing::Test {
  protected:
    using Mood = FakeCamera::Mood;

    LiveCamera() {
        robot_.lidar.port = terminal_.path();
        robot_.camera.device = "video0";
        robot_.camera.stall_after = 0.05;
        options_.retry_every = 0.01;
        options_.open_camera = [camera = camera_](const CameraConfig&) {
            if (camera->mood == Mood::kMissing) {
                throw Error("video0: No such file or directory (is it plugged in?)");
            }
            return std::make_unique<FakeCapture>(camera);
        };
    }

    static bool camera_is(const LiveSensors& sensors, DeviceState state, bool lidar_only) {
        return comes_true([&] {
            const LiveStatus status = sensors.status();
            return status.camera.state == state && status.lidar_only == lidar_only;
        });
    }

    std::shared_ptr<FakeCamera> camera_ = std::make_shared<FakeCamera>();
    PseudoTerminal terminal_;
    RobotConfig robot_;
    LiveOptions options_;
};

TEST_F(LiveCamera, GivesImagesAndBytesInTheOrderOfArrival) {
    options_.most_images = 1000000;
    LiveSensors sensors(robot_, options_);
    Collector collector(sensors);
    ASSERT_TRUE(comes_true([&] { return sensors.status().lidar.connects == 1; }));
    ASSERT_TRUE(test::send_telegrams(terminal_, collector, 20));
    ASSERT_TRUE(comes_true([&] { return collector.images().size() > 20; }));
    EXPECT_TRUE(camera_is(sensors, DeviceState::kStreaming, false));
    EXPECT_EQ(sensors.status().camera.detail, "");
    sensors.stop();
    collector.join();
    const auto arrivals = collector.arrivals();
    EXPECT_TRUE(std::is_sorted(arrivals.begin(), arrivals.end()));
    const auto images = collector.images();
    for (std::size_t i = 0; i < images.size(); ++i) {
        ASSERT_EQ(number_of(images[i]), i) << "each image once";
    }
}

TEST_F(LiveCamera, SwitchedOffItIsNotAsked) {
    robot_.camera.enabled = false;
    LiveSensors sensors(robot_, options_);
    ASSERT_TRUE(comes_true([&] { return sensors.status().lidar.connects == 1; }));
    EXPECT_EQ(sensors.status().camera.state, DeviceState::kOff);
    EXPECT_FALSE(sensors.status().lidar_only) << "it was not asked for";
    EXPECT_EQ(camera_->images, 0u);
}

TEST_F(LiveCamera, MissingUnpluggedAndBackAgain) {
    camera_->mood = Mood::kMissing;
    LiveSensors sensors(robot_, options_);
    const Collector collector(sensors);
    ASSERT_TRUE(camera_is(sensors, DeviceState::kConnecting, true));
    EXPECT_THAT(sensors.status().camera.detail,
                AllOf(HasSubstr("video0: No such file"), HasSubstr("with the lidar alone")));
    for (std::uint64_t plugged = 1; plugged <= 3; ++plugged) {
        camera_->mood = Mood::kStreaming;
        ASSERT_TRUE(camera_is(sensors, DeviceState::kStreaming, false));
        EXPECT_EQ(sensors.status().camera.connects, plugged);
        camera_->mood = Mood::kMissing;
        ASSERT_TRUE(camera_is(sensors, DeviceState::kConnecting, true));
    }
    ASSERT_TRUE(comes_true([&] { return sensors.status().lidar.connects == 1; }));
    terminal_.write(test::telegram_bytes(8));
    EXPECT_TRUE(comes_true([&] { return scan_numbers(collector.bytes()).size() == 1; }))
        << "the lidar goes on alone";
}

TEST_F(LiveCamera, AStallIsToldAndForgotten) {
    robot_.camera.stall_after = 0.1;
    LiveSensors sensors(robot_, options_);
    const Collector collector(sensors);
    ASSERT_TRUE(camera_is(sensors, DeviceState::kStreaming, false));
    camera_->mood = Mood::kStalled;
    ASSERT_TRUE(camera_is(sensors, DeviceState::kSilent, true));
    EXPECT_THAT(sensors.status().camera.detail,
                AllOf(HasSubstr("video0: no image for 0.1 s"), HasSubstr("with the lidar alone")));
    camera_->mood = Mood::kStreaming;
    EXPECT_TRUE(camera_is(sensors, DeviceState::kStreaming, false));
    EXPECT_EQ(sensors.status().camera.detail, "");
}

TEST_F(LiveCamera, ALongStallOpensItAnew) {
    camera_->mood = Mood::kStalled;
    LiveSensors sensors(robot_, options_);
    const Collector collector(sensors);
    EXPECT_TRUE(comes_true([&] { return sensors.status().camera.connects >= 3; }));
    camera_->mood = Mood::kStreaming;
    EXPECT_TRUE(camera_is(sensors, DeviceState::kStreaming, false));
}

TEST_F(LiveCamera, ASlowConsumerLosesTheOldestImagesAndNoBytes) {
    options_.most_images = 5;
    LiveSensors sensors(robot_, options_);
    ASSERT_TRUE(comes_true([&] { return sensors.status().lidar.connects == 1; }));
    for (std::uint32_t i = 0; i < 15; ++i) {
        terminal_.write(test::telegram_bytes(2 * i));
        test::sleep_ms(2);
    }
    ASSERT_TRUE(comes_true([&] { return camera_->images >= 50; }));
    camera_->mood = Mood::kStalled;
    ASSERT_TRUE(camera_is(sensors, DeviceState::kSilent, true));
    camera_->mood = Mood::kMissing;
    ASSERT_TRUE(camera_is(sensors, DeviceState::kConnecting, true));
    const LiveStatus status = sensors.status();
    EXPECT_EQ(status.camera.dropped + 5, camera_->images);
    EXPECT_EQ(status.lidar.dropped, 0u);
    std::vector<std::uint32_t> images;
    test::Bytes bytes;
    while (scan_numbers(bytes).size() < 15 || images.size() < 5) {
        const auto event = sensors.next_within(10.0);
        ASSERT_TRUE(event);
        if (const auto* frame = std::get_if<CameraFrame>(&*event)) {
            images.push_back(number_of(frame->image));
        } else {
            test::append(bytes, std::get<LidarBytes>(*event).bytes);
        }
    }
    const std::uint32_t last = camera_->images - 1;
    EXPECT_THAT(images, ::testing::ElementsAre(last - 4, last - 3, last - 2, last - 1, last));
}

TEST_F(LiveCamera, FilesThatEndAreNotPlayedAgain) {
    const TempFolder folder;
    for (const char* name : {"1.jpg", "2.jpg", "3.jpg"}) {
        folder.write(name, name);
    }
    robot_.camera.device = folder.path().string();
    robot_.camera.rate = 1000.0;
    options_.open_camera = open_capture;
    LiveSensors sensors(robot_, options_);
    const Collector collector(sensors);
    ASSERT_TRUE(camera_is(sensors, DeviceState::kOff, true));
    EXPECT_THAT(sensors.status().camera.detail, HasSubstr("ended"));
    ASSERT_TRUE(comes_true([&] { return collector.images().size() == 3; }));
    test::sleep_ms(100);  // some times retry_every
    EXPECT_EQ(sensors.status().camera.connects, 1u);
    EXPECT_EQ(collector.images().size(), 3u);
    EXPECT_FALSE(sensors.ended()) << "the lidar goes on";
}

TEST_F(LiveCamera, ACameraThatHangsDoesNotHoldUpTheEnd) {
    {
        LiveSensors sensors(robot_, options_);
        ASSERT_TRUE(camera_is(sensors, DeviceState::kStreaming, false));
        camera_->mood = Mood::kHanging;
    }
    camera_->mood = Mood::kMissing;  // not before the end, which would have waited for ever
    EXPECT_TRUE(comes_true([&] { return camera_->left.load(); }));
}

}  // namespace
}  // namespace hybrid_slam
