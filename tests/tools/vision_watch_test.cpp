// SPDX-License-Identifier: Apache-2.0
#include "vision_watch.hpp"

#include <gmock/gmock.h>

namespace hybrid_slam::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using tools::Vision;
using tools::VisionWatch;

/// Ten images a second.
class Film {
  public:
    Film& show(VisualStatus status, int images) {
        for (int i = 0; i < images; ++i) {
            VisualMotion motion;
            motion.from_stamp = stamp_;
            motion.stamp = stamp_ += 0.1;
            motion.status = status;
            watch_.see(motion);
        }
        return *this;
    }
    Film& scan(std::optional<double> lag) {
        watch_.see_scan(lag);
        return *this;
    }
    Vision end() { return watch_.finish(); }

  private:
    double stamp_ = 1000.0;
    VisionWatch watch_;
};

TEST(VisionWatch, CountsImagesByStatus) {
    const Vision vision = Film()
                              .show(VisualStatus::kFirst, 1)
                              .show(VisualStatus::kGood, 7)
                              .show(VisualStatus::kGroundHidden, 2)
                              .show(VisualStatus::kBlurred, 1)
                              .end();
    EXPECT_EQ(vision.images, 11U);
    EXPECT_EQ(vision.with(VisualStatus::kGood), 7U);
    EXPECT_EQ(vision.with(VisualStatus::kTooDark), 0U);
    EXPECT_EQ(vision.usable(), 9U);
    EXPECT_THAT(vision.spells, IsEmpty()) << "all too short";
    EXPECT_THAT(vision.warnings(), IsEmpty());
}

TEST(VisionWatch, ALongSpellIsToldByWhatMostOfItWas) {
    const Vision vision = Film()
                              .show(VisualStatus::kGood, 5)
                              .show(VisualStatus::kBlurred, 3)
                              .show(VisualStatus::kTooDark, 47)
                              .show(VisualStatus::kGood, 5)
                              .end();
    ASSERT_EQ(vision.spells.size(), 1U);
    EXPECT_EQ(vision.spells[0].status, VisualStatus::kTooDark);
    EXPECT_NEAR(vision.spells[0].from, 1000.5, 1e-9);
    EXPECT_NEAR(vision.spells[0].duration(), 5.0, 1e-9);
    EXPECT_THAT(vision.warnings(), ElementsAre("camera too dark for 5.0 s"));
}

TEST(VisionWatch, SpellsOfOneKindAreSummed) {
    const Vision vision = Film()
                              .show(VisualStatus::kTooFewFeatures, 20)
                              .show(VisualStatus::kGood, 1)
                              .show(VisualStatus::kGroundHidden, 15)
                              .show(VisualStatus::kTooFewFeatures, 30)
                              .end();
    EXPECT_EQ(vision.spells.size(), 3U);
    EXPECT_THAT(vision.warnings(), ElementsAre("camera with too few features for 4.9 s in 2 spells",
                                               "camera ground hidden for 1.5 s"));
}

TEST(VisionWatch, LateIsMoreThanExtrapolated) {
    const Vision vision = Film()
                              .scan(std::nullopt)  // before the first image
                              .show(VisualStatus::kFirst, 1)
                              .scan(-0.02)
                              .scan(0.05)
                              .scan(0.3)
                              .scan(5.0)  // the camera has been silent for long
                              .end();
    EXPECT_EQ(vision.extrapolated, 3U);
    EXPECT_EQ(vision.late, 2U);
}

}  // namespace
}  // namespace hybrid_slam::test
