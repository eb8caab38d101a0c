// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/sensors/sensor_source.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace hybrid_slam::test {
namespace {

/// Says what it was given, one after the other.
class Script : public SensorStream {
  public:
    explicit Script(std::vector<SensorEvent> events) : events_(std::move(events)) {}

    std::optional<SensorEvent> next() override {
        if (next_ == events_.size()) {
            return std::nullopt;
        }
        return events_[next_++];
    }
    double progress() const override { return 0.5; }

  private:
    std::vector<SensorEvent> events_;
    std::size_t next_ = 0;
};

std::vector<std::uint8_t> telegram(std::uint32_t scan_number, std::uint16_t word = 250) {
    S300Telegram made;
    made.scan_number = scan_number;
    made.telegram_number = static_cast<std::uint16_t>(scan_number);
    made.field = 1;
    made.words.assign(541, word);
    return encode(made);
}

LidarBytes bytes_at(double arrival, std::vector<std::uint8_t> bytes) {
    return {arrival, std::move(bytes)};
}

CameraFrame image_at(double arrival) {
    Image image;
    image.width = 4;
    image.height = 2;
    image.channels = 3;
    image.pixels.assign(24, 90);
    return {arrival, encode_pnm(image)};
}

TEST(SensorSource, TurnsBytesAndImagesIntoMeasurementsInTheOrderOfArrival) {
    const RobotConfig robot;
    Script script({bytes_at(1.0, telegram(10)), image_at(1.02), bytes_at(1.08, telegram(12))});
    SensorSource source(script, robot, SensorSource::Images::kGray);
    const auto first = source.next();
    ASSERT_TRUE(first && std::holds_alternative<Scan>(*first));
    const Scan& scan = std::get<Scan>(*first);
    ASSERT_EQ(scan.ranges.size(), 541U);
    EXPECT_FLOAT_EQ(scan.ranges[270], 2.5F);
    EXPECT_EQ(scan.robot_from_laser.x(), robot.lidar.x);
    const double wire = robot.lidar.wire_time(telegram(10).size());
    EXPECT_NEAR(scan.stamp, 1.0 - wire - robot.lidar.latency, 1e-9);
    const auto second = source.next();
    ASSERT_TRUE(second && std::holds_alternative<Image>(*second));
    const Image& image = std::get<Image>(*second);
    EXPECT_EQ(image.channels, 1);
    EXPECT_EQ(image.width, 4);
    EXPECT_NEAR(image.stamp, 1.02 - robot.camera.latency, 1e-12);
    EXPECT_TRUE(std::holds_alternative<Scan>(*source.next()));
    EXPECT_FALSE(source.next());
    EXPECT_EQ(source.counts().lidar.scans, 2U);
    EXPECT_EQ(source.counts().images, 1U);
    EXPECT_EQ(source.progress(), 0.5);
}

TEST(SensorSource, OneEventMayHoldSeveralScansAndAScanSeveralEvents) {
    std::vector<std::uint8_t> both = telegram(10);
    const std::vector<std::uint8_t> second = telegram(12);
    both.insert(both.end(), second.begin(), second.end());
    const std::vector<std::uint8_t> third = telegram(14);
    const auto middle = third.begin() + 600;
    Script script({bytes_at(1.0, both), bytes_at(1.07, {third.begin(), middle}),
                   bytes_at(1.09, {middle, third.end()})});
    SensorSource source(script, {});
    int scans = 0;
    while (const auto measurement = source.next()) {
        scans += std::holds_alternative<Scan>(*measurement) ? 1 : 0;
    }
    EXPECT_EQ(scans, 3);
}

TEST(SensorSource, SkipsAndCountsWhatIsNoImage) {
    Script script({CameraFrame{1.0, {1, 2, 3}}, image_at(2.0), CameraFrame{3.0, {}}});
    SensorSource source(script, {}, SensorSource::Images::kColor);
    const auto image = source.next();
    ASSERT_TRUE(image);
    EXPECT_EQ(std::get<Image>(*image).channels, 3);
    EXPECT_FALSE(source.next());
    EXPECT_EQ(source.counts().bad_images, 2U);
}

TEST(SensorSource, ImagesThatNobodyWantsAreNotDecoded) {
    Script script({CameraFrame{1.0, {1, 2, 3}}, image_at(2.0)});
    SensorSource source(script, {});
    EXPECT_FALSE(source.next());
    EXPECT_EQ(source.counts().images, 0U);
    EXPECT_EQ(source.counts().bad_images, 0U);
}

}  // namespace
}  // namespace hybrid_slam::test
