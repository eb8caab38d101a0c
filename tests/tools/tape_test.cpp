// SPDX-License-Identifier: Apache-2.0
#include "tape.hpp"

#include <gmock/gmock.h>

#include <cmath>

namespace hybrid_slam::test {
namespace {

using namespace tools;
using ::testing::ElementsAre;

/// Scans, wheels and images of a blinking camera, in turn.
class Drive : public Source {
  public:
    explicit Drive(int rounds) : rounds_(rounds) {}
    std::optional<Measurement> next() override {
        const int round = step_ / 3;
        const double stamp = 1.0 + 0.1 * round;
        if (round >= rounds_) {
            return std::nullopt;
        }
        switch (step_++ % 3) {
            case 0: {
                Scan scan;
                scan.stamp = stamp;
                scan.ranges.assign(4, 2.0F);
                scan.range_max = 10.0;
                return scan;
            }
            case 1:
                return WheelOdometry{stamp, Pose2d(0.1 * round, 0.0, 0.0)};
            default:
                return image(stamp + 0.01, round % 2 == 0);
        }
    }

  private:
    static Image image(double stamp, bool dark) {
        Image image;
        image.stamp = stamp;
        image.width = 160;
        image.height = 120;
        for (int i = 0; i < 160 * 120; ++i) {
            const int checkers = (i % 160 / 10 + i / 1600) % 2;
            image.pixels.push_back(static_cast<std::uint8_t>(dark ? 0 : 60 + 100 * checkers));
        }
        return image;
    }

    int rounds_;
    int step_ = 0;
};

class DriveInput : public Input {
  public:
    DriveInput(int rounds, bool camera) : drive_(rounds), has_camera_(camera) {
        camera_.model.width = 160;
        camera_.model.height = 120;
        camera_.model.fx = camera_.model.fy = 180.0;
        camera_.model.cx = 80.0;
        camera_.model.cy = 60.0;
    }
    Source& source() override { return drive_; }
    const CameraConfig* camera() const override { return has_camera_ ? &camera_ : nullptr; }
    nlohmann::ordered_json counts() const override { return {{"rounds", 7}}; }
    std::vector<std::string> warnings() const override { return {"it rattles: 1"}; }

  private:
    Drive drive_;
    bool has_camera_;
    CameraConfig camera_;
};

VisionConfig way(VisualMethod method) {
    VisionConfig config;
    config.odometry.method = method;
    return config;
}

/// What a source yields, one letter each.
std::string kinds_of(Source& source, std::vector<VisualMotion>* motions = nullptr) {
    std::string kinds;
    while (const auto measurement = source.next()) {
        kinds += "SIWV"[measurement->index()];
        if (motions != nullptr && std::holds_alternative<VisualMotion>(*measurement)) {
            motions->push_back(std::get<VisualMotion>(*measurement));
        }
    }
    return kinds;
}

Tape tape_of(DriveInput& input, const std::vector<VisionConfig>& ways) {
    Progress progress("", true);
    return Tape(input, ways, progress);
}

void expect_same_motions(const std::vector<VisualMotion>& a, const std::vector<VisualMotion>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].status, b[i].status);
        EXPECT_EQ(a[i].stamp, b[i].stamp);
        EXPECT_EQ(a[i].from_stamp, b[i].from_stamp);
        EXPECT_EQ(a[i].before_from_now.translation, b[i].before_from_now.translation);
        EXPECT_EQ(a[i].before_from_now.heading, b[i].before_from_now.heading);
        EXPECT_EQ(a[i].covariance, b[i].covariance);
    }
}

TEST(Tape, EachWayIsAsIfItHadLookedAlone) {
    const std::vector<VisionConfig> ways{way(VisualMethod::kJoint), way(VisualMethod::kThesis)};
    DriveInput input(6, true);
    const Tape tape = tape_of(input, ways);
    EXPECT_EQ(tape.images(), 6U);
    for (std::size_t i = 0; i < ways.size(); ++i) {
        DriveInput alone(6, true);
        VisualOdometry odometry(alone.camera()->model, alone.camera()->mounting, ways[i].odometry);
        VisualSource source(alone.source(), odometry);
        std::vector<VisualMotion> expected;
        EXPECT_EQ(kinds_of(source, &expected), "SWVSWVSWVSWVSWVSWV");
        for (int again = 0; again < 2; ++again) {
            std::vector<VisualMotion> motions;
            EXPECT_EQ(kinds_of(tape.replay(i)->source(), &motions), "SWVSWVSWVSWVSWVSWV");
            expect_same_motions(motions, expected);
        }
        EXPECT_EQ(tape.counts(i).statuses, source.counts().statuses);
    }
    EXPECT_GE(tape.counts(0).statuses.at(VisualStatus::kTooDark), 2U);
    EXPECT_NE(tape.counts(0).statuses, tape.counts(1).statuses) << "the two are told apart";
}

TEST(Tape, WithoutAWayThereIsNothingOfImages) {
    DriveInput input(3, true);
    const Tape tape = tape_of(input, {way(VisualMethod::kJoint)});
    const auto replay = tape.replay(std::nullopt);
    EXPECT_EQ(kinds_of(replay->source()), "SWSWSW");
    EXPECT_FALSE(replay->counts().contains("vision"));
    EXPECT_EQ(tape.replay(0)->counts()["vision"]["images"], 3U);
    EXPECT_EQ(replay->counts()["rounds"], 7);
    EXPECT_THAT(replay->warnings(), ElementsAre("it rattles: 1"));
}

TEST(Tape, ImagesWithoutACameraAreLeftOut) {
    DriveInput input(3, false);
    const Tape tape = tape_of(input, {way(VisualMethod::kJoint)});
    EXPECT_EQ(tape.images(), 0U);
    const auto replay = tape.replay(0);
    Scan first = std::get<Scan>(*replay->source().next());
    EXPECT_EQ(first.ranges.size(), 4U);
    EXPECT_EQ(kinds_of(replay->source()), "WSWSW");
    EXPECT_DOUBLE_EQ(replay->source().progress(), 1.0);
}

}  // namespace
}  // namespace hybrid_slam::test
