// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/localizer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "backend/localization/localization_support.hpp"
#include "backend/localization/twin_halls.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kScanRate = 12.5;
const Eigen::Matrix3d kGivenDoubt =
    Eigen::Vector3d(0.01, 0.01, radians(3.0) * radians(3.0)).asDiagonal();

/// Once around the thesis's hall, and its map.
struct Hall {
    Hall() : world(world_named("thesis_hall")) {
        world.laps = 1;
        map = map_of(world);
        drive = drive_in(world, s300_config());
    }
    World world;
    std::shared_ptr<const ReferenceMap> map;
    TestDrive drive;
};
const Hall& hall() {
    static const Hall hall;
    return hall;
}

TestDrive part_of(const TestDrive& drive, std::size_t first, std::size_t last) {
    TestDrive part;
    const auto frame = drive.frames.begin();
    const auto pose = drive.truth.begin();
    part.frames.assign(frame + static_cast<std::ptrdiff_t>(first),
                       frame + static_cast<std::ptrdiff_t>(last));
    part.truth.assign(pose + static_cast<std::ptrdiff_t>(first),
                      pose + static_cast<std::ptrdiff_t>(last));
    return part;
}

/// The second part follows in time on the first one; wheels do not notice that they were lifted.
TestDrive spliced(TestDrive drive, const TestDrive& then) {
    const double later = drive.truth.back().stamp + 1.0 / kScanRate - then.truth.front().stamp;
    const Pose2d shift =
        *drive.frames.back().odom_from_robot * then.frames.front().odom_from_robot->inverse();
    for (std::size_t i = 0; i < then.frames.size(); ++i) {
        drive.frames.push_back(then.frames[i]);
        drive.frames.back().scan.stamp += later;
        drive.frames.back().odom_from_robot = shift * *then.frames[i].odom_from_robot;
        drive.truth.push_back({then.truth[i].stamp + later, then.truth[i].pose});
    }
    return drive;
}

std::vector<LocalizationResult> follow(Localizer& localizer, const std::vector<Frame>& frames) {
    std::vector<LocalizationResult> results;
    results.reserve(frames.size());
    for (const Frame& frame : frames) {
        results.push_back(localizer.process(frame));
    }
    return results;
}

bool is_known(const LocalizationResult& result) {
    return result.status == LocalizationStatus::kTracking ||
           result.status == LocalizationStatus::kDegraded;
}

/// Whether all poses from a frame on are known and right.
void expect_right(const std::vector<LocalizationResult>& results, const Trajectory& truth,
                  std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
        ASSERT_TRUE(is_known(results[i])) << "frame " << i << ": " << to_string(results[i].status);
        ASSERT_THAT(*results[i].map_from_robot, PoseNear(truth[i].pose, 0.05, radians(1.0)))
            << "frame " << i;
    }
}

std::size_t first_known(const std::vector<LocalizationResult>& results, std::size_t from = 0) {
    std::size_t i = from;
    while (i < results.size() && !is_known(results[i])) {
        ++i;
    }
    return i;
}

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

TEST(Localizer, AWrongStartIsNoticedAndMended) {
    const TestDrive drive = part_of(hall().drive, 100, 200);
    Localizer localizer(hall().map, {});
    const Pose2d told = drive.truth.front().pose * Pose2d(1.5, 1.2, 0.9);
    localizer.start_at(told, kGivenDoubt);
    const auto results = follow(localizer, drive.frames);
    std::size_t lost = 0;
    while (lost < results.size() && results[lost].status != LocalizationStatus::kLost) {
        ++lost;
    }
    ASSERT_LT(lost, static_cast<std::size_t>(kScanRate));
    EXPECT_TRUE(results[lost].map_from_robot.has_value());
    EXPECT_EQ(results[lost].score, 0.0);
    const std::size_t found = first_known(results, lost);
    ASSERT_LT(found, lost + 3);
    expect_right(results, drive.truth, found, results.size());
    ASSERT_TRUE(results[found].jump.has_value());
    EXPECT_THAT(results[found].jump->to, PoseNear(drive.truth[found].pose, 0.05, radians(1.0)));
    EXPECT_GT((results[found].jump->from.translation - results[found].jump->to.translation).norm(),
              0.5);
}

TEST(Localizer, AStartDuringTheDriveIsAJump) {
    const TestDrive drive = part_of(hall().drive, 100, 200);
    Localizer localizer(hall().map, {});
    std::optional<Jump> jump;
    for (std::size_t i = 0; i < 100; ++i) {
        if (i == 50) {
            localizer.start_at(drive.truth[i].pose * Pose2d(2.0, 0.0, 0.0), kGivenDoubt);
        }
        const LocalizationResult result = localizer.process(drive.frames[i]);
        if (i == 50) {
            jump = result.jump;
        }
    }
    ASSERT_TRUE(jump.has_value());
    EXPECT_THAT(jump->from, PoseNear(drive.truth[50].pose, 0.05, radians(1.0)));
}

TEST(Localizer, KidnappedItIsLostAndFoundAgain) {
    // Places of the lap by frames, each with another heading or far away.
    const std::size_t places[][2] = {{150, 400}, {300, 520}, {200, 330}, {500, 120}};
    for (const auto& [before, after] : places) {
        const TestDrive drive = spliced(part_of(hall().drive, before - 40, before),
                                        part_of(hall().drive, after, after + 80));
        Localizer localizer(hall().map, {});
        const auto results = follow(localizer, drive.frames);
        const std::size_t kidnapped = 40;
        std::size_t noticed = kidnapped;
        while (noticed < results.size() && results[noticed].status != LocalizationStatus::kLost) {
            ++noticed;
        }
        ASSERT_LE(noticed, kidnapped + static_cast<std::size_t>(kScanRate)) << before;
        const std::size_t found = first_known(results, noticed);
        ASSERT_LE(found, kidnapped + static_cast<std::size_t>(3.0 * kScanRate)) << before;
        expect_right(results, drive.truth, found, results.size());
        ASSERT_TRUE(results[found].jump.has_value());
        EXPECT_THAT(results[found].jump->to, PoseNear(drive.truth[found].pose, 0.05, radians(1.0)));
    }
}

TEST(Localizer, CarriedAwayOnlyALittleItSaysSo) {
    // So little that odometry, which aligns scans, follows; and into the look-alike opposite
    // corner.
    const std::size_t places[][2] = {{512, 618}, {124, 53}, {176, 523}};
    for (const auto& [before, after] : places) {
        const TestDrive drive = spliced(part_of(hall().drive, before - 25, before),
                                        part_of(hall().drive, after, after + 25));
        Localizer localizer(hall().map, {});
        const auto results = follow(localizer, drive.frames);
        EXPECT_TRUE(std::any_of(results.begin() + 25, results.begin() + 37, [](const auto& result) {
            return result.jump || result.status == LocalizationStatus::kLost;
        })) << before;
        expect_right(results, drive.truth, 38, results.size());
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
