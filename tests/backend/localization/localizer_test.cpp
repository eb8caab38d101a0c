// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/localizer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "backend/localization/hall_drive.hpp"
#include "backend/localization/twin_halls.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

TEST(Localizer, FindsItselfFromNowhereAndKeepsItsPlace) {
    Localizer localizer(hall().map, {});
    const auto results = follow(localizer, hall().drive.frames);
    const std::size_t found = first_known(results);
    EXPECT_LT(found, 3U);
    expect_right(results, hall().drive.truth, found, results.size());
    ASSERT_TRUE(results[found].relocalization.has_value());
    EXPECT_EQ(results[found].relocalization->verdict, PlaceVerdict::kFound);
    for (const LocalizationResult& result : results) {
        EXPECT_FALSE(result.jump.has_value());
        EXPECT_EQ(result.particles, 0U);
        EXPECT_GE(result.score, 0.0);
        EXPECT_LE(result.score, 1.0);
    }
    EXPECT_GT(results.back().score, 0.8);
    EXPECT_EQ(results.back().prior_used, PriorKind::kWheel);
}

TEST(Localizer, StartsWhereItIsTold) {
    const TestDrive drive = part_of(hall().drive, 100, 200);
    Localizer localizer(hall().map, {});
    localizer.start_at(drive.truth.front().pose * Pose2d(0.1, -0.08, 0.04), kGivenDoubt);
    const auto results = follow(localizer, drive.frames);
    expect_right(results, drive.truth, 0, results.size());
    for (const LocalizationResult& result : results) {
        EXPECT_FALSE(result.relocalization.has_value());
        EXPECT_FALSE(result.jump.has_value());
    }
}

TEST(Localizer, ASquareRoomStaysOpen) {
    World world;
    const Points corners{{-4.0, -4.0}, {4.0, -4.0}, {4.0, 4.0}, {-4.0, 4.0}};
    add_outline(world, {}, corners);
    world.path = {{-2.0, -2.0}, {2.0, -2.0}, {2.0, 2.0}, {-2.0, 2.0}};
    const TestDrive drive = drive_in(world, s300_config(0.5));
    Localizer localizer(map_of(world), {});
    std::size_t most = 0;
    for (const Frame& frame : drive.frames) {
        const LocalizationResult result = localizer.process(frame);
        ASSERT_EQ(result.status, LocalizationStatus::kRelocalizing);
        EXPECT_FALSE(result.map_from_robot.has_value());
        ASSERT_TRUE(result.relocalization.has_value());
        EXPECT_EQ(result.relocalization->verdict, PlaceVerdict::kAmbiguous);
        EXPECT_LT(result.score, 0.6);
        EXPECT_GT(result.particles, 0U);
        most = std::max(most, result.relocalization->places.size());
        // The true one is always among them.
        const Pose2d& truth =
            drive.truth[static_cast<std::size_t>(&frame - drive.frames.data())].pose;
        EXPECT_TRUE(std::any_of(result.relocalization->places.begin(),
                                result.relocalization->places.end(), [&](const Place& place) {
                                    return between(place.map_from_robot, truth).translation.norm() <
                                           0.3;
                                }));
    }
    EXPECT_GE(most, 4U);
}

/// Down one of the halls, with a scanner that sees only 5 m far.
TestDrive down_the_hall(const Pose2d& world_from_hall) {
    World world = twin_halls();
    world.path = {world_from_hall * Point2(2.0, 2.0), world_from_hall * Point2(14.5, 2.0)};
    SimulatorConfig config = s300_config(0.5);
    config.range_max = 5.0;
    return drive_in(world, config);
}

TEST(Localizer, TwinHallsAreToldApartByDriving) {
    for (const Pose2d& world_from_hall : {Pose2d(), kOther}) {
        const TestDrive drive = down_the_hall(world_from_hall);
        Localizer localizer(halls(), {});
        const auto results = follow(localizer, drive.frames);
        EXPECT_EQ(results.front().status, LocalizationStatus::kRelocalizing);
        const std::size_t found = first_known(results);
        ASSERT_LT(found, results.size()) << "never found";
        // The recess at 13 m comes into sight at about 8.
        const double at = (drive.truth[found].pose.translation - world_from_hall.translation).x();
        EXPECT_GT(at, 7.9);
        EXPECT_LT(at, 13.5);
        expect_right(results, drive.truth, found, results.size());
        EXPECT_GT(results[found - 1].particles, 0U);
        EXPECT_EQ(results[found].particles, 0U);
    }
}

/// Images at 30 Hz along the truth.
std::vector<VisualMotion> images_along(const Trajectory& truth) {
    std::vector<VisualMotion> motions;
    const auto pose_at = [&](double stamp) {
        const auto next = std::find_if(truth.begin() + 1, truth.end() - 1,
                                       [&](const auto& pose) { return pose.stamp >= stamp; });
        const auto before = next - 1;
        return interpolate(before->pose, next->pose,
                           (stamp - before->stamp) / (next->stamp - before->stamp));
    };
    const double interval = 1.0 / 30.0;
    const double start = truth.front().stamp + 0.01;
    for (int i = 1; start + i * interval < truth.back().stamp; ++i) {
        VisualMotion motion;
        motion.from_stamp = motions.empty() ? start : motions.back().stamp;
        motion.stamp = start + i * interval;
        motion.before_from_now = between(pose_at(motion.from_stamp), pose_at(motion.stamp));
        motion.covariance = Eigen::Vector3d(1e-6, 1e-6, 1e-7).asDiagonal();
        motion.status = VisualStatus::kGood;
        motions.push_back(motion);
    }
    return motions;
}

TEST(Localizer, PredictsAtTheRateOfTheCamera) {
    TestDrive drive = part_of(hall().drive, 100, 250);
    const std::vector<VisualMotion> images = images_along(drive.truth);
    Localizer localizer(hall().map, {});
    std::size_t scan = 0;
    int predicted = 0;
    std::vector<VisualMotion> since_scan;
    for (const VisualMotion& image : images) {
        // Scans come 20 ms after their stamps, images at once.
        while (scan < drive.frames.size() && drive.frames[scan].scan.stamp + 0.02 < image.stamp) {
            drive.frames[scan].visual = std::exchange(since_scan, {});
            localizer.process(drive.frames[scan++]);
        }
        since_scan.push_back(image);
        const auto pose = localizer.predict(image);
        if (!pose) {
            EXPECT_LT(scan, 4U);
            continue;
        }
        ++predicted;
        EXPECT_EQ(pose->stamp, image.stamp);
        const auto next = std::find_if(drive.truth.begin(), drive.truth.end(),
                                       [&](const auto& p) { return p.stamp >= image.stamp; });
        ASSERT_NE(next, drive.truth.begin());
        const auto before = next - 1;
        const double ratio = (image.stamp - before->stamp) / (next->stamp - before->stamp);
        EXPECT_THAT(pose->map_from_robot,
                    PoseNear(interpolate(before->pose, next->pose, ratio), 0.03, radians(0.6)));
        EXPECT_GT(pose->covariance(0, 0), 0.0);
    }
    EXPECT_GT(predicted, static_cast<int>(images.size()) - 10);
}

TEST(Localizer, PredictsNothingAcrossAGapOrWithoutAPlace) {
    const TestDrive drive = part_of(hall().drive, 100, 103);
    VisualMotion image = images_along(drive.truth).front();
    EXPECT_FALSE(Localizer(hall().map, {}).predict(image).has_value());
    Localizer localizer(hall().map, {});
    const LocalizationResult result = localizer.process(drive.frames.front());
    ASSERT_TRUE(is_known(result));
    image.from_stamp = result.stamp;
    image.stamp = result.stamp + 0.05;
    ASSERT_TRUE(localizer.predict(image).has_value());
    VisualMotion dark = image;
    dark.from_stamp = image.stamp;
    dark.stamp = image.stamp + 0.03;
    dark.status = VisualStatus::kTooDark;
    EXPECT_FALSE(localizer.predict(dark).has_value());
    VisualMotion light = image;
    light.from_stamp = dark.stamp;
    light.stamp = dark.stamp + 0.03;
    EXPECT_FALSE(localizer.predict(light).has_value());
}

TEST(Localizer, SameInputSameResults) {
    const auto run = [] {
        const TestDrive drive = down_the_hall({});
        Localizer localizer(halls(), {});
        std::vector<double> numbers;
        for (std::size_t i = 0; i < 120; ++i) {
            const LocalizationResult result = localizer.process(drive.frames[i]);
            numbers.push_back(result.score);
            if (result.relocalization) {
                for (const Place& place : result.relocalization->places) {
                    numbers.insert(numbers.end(),
                                   {place.share, place.map_from_robot.x(), place.map_from_robot.y(),
                                    place.map_from_robot.heading});
                }
            }
        }
        return numbers;
    };
    const std::vector<double> first = run();
    EXPECT_GT(first.size(), 1000U);
    EXPECT_EQ(first, run());
}

TEST(Localizer, AMapOfElsewhereIsRefused) {
    // The drive is in the ring of the offices, the map is of the hall.
    World elsewhere;
    add_outline(elsewhere, {0.0, 0.0, 0.3},
                {{-9.0, -2.0},
                 {9.0, -2.0},
                 {9.0, 1.0},
                 {2.0, 1.0},
                 {2.0, 7.0},
                 {-1.0, 7.0},
                 {-1.0, 1.0},
                 {-9.0, 1.0}});
    elsewhere.path = {{-5.0, -2.0}, {0.5, -0.2}};
    const TestDrive drive = drive_in(elsewhere, s300_config(0.5));
    Localizer localizer(hall().map, {});
    for (const LocalizationResult& result : follow(localizer, drive.frames)) {
        EXPECT_EQ(result.status, LocalizationStatus::kRelocalizing);
        EXPECT_FALSE(result.map_from_robot.has_value());
    }
}

TEST(LocalizationConfig, ListsEachKeyOnceAndRefusesWhatIsOutOfRange) {
    LocalizationConfig config;
    ConfigSchema schema;
    describe(schema, config);
    std::set<std::string> keys;
    for (const ConfigField& field : schema.fields()) {
        EXPECT_TRUE(keys.insert(field.key).second) << field.key;
    }
    for (const std::string key : {"odometry.prior", "relocalization.method", "particles.beams",
                                  "tracking.window", "localization.search_every"}) {
        EXPECT_EQ(keys.count(key), 1U) << key;
    }
    config.search_every = 0.0;
    EXPECT_NE(error_of([&] { Localizer(hall().map, config); }).find("localization.search_every"),
              std::string::npos);
}

}  // namespace
}  // namespace hybrid_slam::test
