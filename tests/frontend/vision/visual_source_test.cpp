// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vision/visual_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace hybrid_slam::test {
namespace {

using testing::ElementsAre;

CameraModel small_camera() {
    CameraModel model;
    model.width = 160;
    model.height = 120;
    return model;
}

Image image_at(double stamp, int width = 160) {
    Image image;
    image.stamp = stamp;
    image.width = width;
    image.height = 120;
    image.pixels.resize(static_cast<std::size_t>(width * 120));
    return image;
}

Scan scan_at(double stamp) {
    Scan scan;
    scan.stamp = stamp;
    return scan;
}

VisualMotion motion_at(double stamp) {
    VisualMotion motion;
    motion.stamp = stamp;
    return motion;
}

class ListSource : public Source {
  public:
    explicit ListSource(std::vector<Measurement> list) : list_(std::move(list)) {}
    std::optional<Measurement> next() override {
        return at_ < list_.size() ? std::optional<Measurement>(list_[at_++]) : std::nullopt;
    }
    double progress() const override { return at_ < list_.size() ? 0.25 : 1.0; }

  private:
    std::vector<Measurement> list_;
    std::size_t at_ = 0;
};

/// What comes out: a letter for its kind and its stamp.
std::vector<std::string> written(Source& source) {
    std::vector<std::string> all;
    while (const auto measurement = source.next()) {
        const double stamp = std::visit([](const auto& any) { return any.stamp; }, *measurement);
        all.push_back("SIWV"[measurement->index()] + std::to_string(std::lround(stamp)));
    }
    return all;
}

TEST(VisualSource, ReplacesImagesAndPassesAllElseInOrder) {
    ListSource list({scan_at(1), image_at(2), WheelOdometry{3, {}}, image_at(4), scan_at(3),
                     image_at(5), motion_at(6)});
    VisualOdometry odometry(small_camera(), {});
    VisualSource source(list, odometry);
    EXPECT_EQ(source.progress(), 0.25);
    EXPECT_THAT(written(source), ElementsAre("S1", "V2", "W3", "V4", "S3", "V5", "V6"));
    EXPECT_EQ(source.progress(), 1.0);
    EXPECT_EQ(source.counts().images, 3U);
    EXPECT_EQ(source.counts().backward, 0U);
    EXPECT_EQ(source.counts().wrong_size, 0U);
    EXPECT_EQ(source.counts().statuses.at(VisualStatus::kTooDark), 3U);
    EXPECT_GT(source.counts().seconds, 0.0);
    EXPECT_FALSE(source.next().has_value());
}

TEST(VisualSource, StartsAnewWhenTheClockWasSetBack) {
    ListSource list({image_at(50), image_at(3), image_at(4), image_at(5)});
    VisualOdometry odometry(small_camera(), {});
    VisualSource source(list, odometry);
    EXPECT_THAT(written(source), ElementsAre("V50", "V3", "V4", "V5"));
    EXPECT_EQ(source.counts().backward, 1U);
}

TEST(VisualSource, LeavesOutImagesThatComeBackwardInTimeOrTwice) {
    ListSource list({image_at(5), image_at(5), image_at(4.5), scan_at(4), image_at(6),
                     image_at(std::numeric_limits<double>::quiet_NaN()), image_at(7)});
    VisualOdometry odometry(small_camera(), {});
    VisualSource source(list, odometry);
    EXPECT_THAT(written(source), ElementsAre("V5", "S4", "V6", "V7"));
    EXPECT_EQ(source.counts().backward, 3U);
    EXPECT_EQ(source.counts().images, 3U);
}

TEST(VisualSource, LeavesOutImagesOfAnotherSize) {
    ListSource list({image_at(1, 32), image_at(2), image_at(3, 80), image_at(4)});
    VisualOdometry odometry(small_camera(), {});
    VisualSource source(list, odometry);
    EXPECT_THAT(written(source), ElementsAre("V2", "V4"));
    EXPECT_EQ(source.counts().wrong_size, 2U);
}

TEST(VisualSource, TheMotionSpansTheImagesAroundIt) {
    ListSource list({image_at(1), image_at(1.5), image_at(9, 32), image_at(3)});
    VisualOdometry odometry(small_camera(), {});
    VisualSource source(list, odometry);
    source.next();
    const auto second = std::get<VisualMotion>(*source.next());
    EXPECT_EQ(second.from_stamp, 1.0);
    EXPECT_EQ(second.stamp, 1.5);
    EXPECT_EQ(second.status, VisualStatus::kTooDark);
    EXPECT_FALSE(second.usable());
    EXPECT_EQ(std::get<VisualMotion>(*source.next()).from_stamp, 1.5);
}

TEST(VisualStatus, HasNames) {
    EXPECT_EQ(to_string(VisualStatus::kFirst), "first");
    EXPECT_EQ(to_string(VisualStatus::kGood), "good");
    EXPECT_EQ(to_string(VisualStatus::kTooDark), "too_dark");
    EXPECT_EQ(to_string(VisualStatus::kBlurred), "blurred");
    EXPECT_EQ(to_string(VisualStatus::kTooFewFeatures), "too_few_features");
    EXPECT_EQ(to_string(VisualStatus::kGroundHidden), "ground_hidden");
    EXPECT_EQ(to_string(VisualStatus::kInconsistent), "inconsistent");
    VisualMotion motion;
    for (const auto& [status, usable] :
         {std::pair{VisualStatus::kFirst, false}, std::pair{VisualStatus::kGood, true},
          std::pair{VisualStatus::kGroundHidden, true}, std::pair{VisualStatus::kBlurred, false}}) {
        motion.status = status;
        EXPECT_EQ(motion.usable(), usable) << to_string(status);
    }
}

}  // namespace
}  // namespace hybrid_slam::test
