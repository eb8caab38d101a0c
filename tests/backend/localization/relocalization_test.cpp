// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/relocalization.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "backend/localization/localization_support.hpp"
#include "hybrid_slam/core/error.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

Relocalizer relocalizer_in(const std::shared_ptr<const ReferenceMap>& map,
                           const RelocalizationConfig& config = {}) {
    return Relocalizer(map, config, IcpConfig());
}

std::shared_ptr<const ReferenceMap> hall_map() {
    static const auto map = map_of(world_named("thesis_hall"));
    return map;
}

Query seen_from(const World& world, const Pose2d& pose, unsigned seed = 5) {
    std::mt19937 random(seed);
    return {sweep_of(scan_at(world, pose, random))};
}

World square_room() {
    World world;
    add_outline(world, {{-3, -3}, {3, -3}, {3, 3}, {-3, 3}});
    world.path = {{-2, -2}, {2, -2}, {2, 2}, {-2, 2}, {-2, -2}};
    return world;
}

/// Two rooms of 6 x 4 m that are the same.
World twin_rooms() {
    World world;
    add_outline(world, {{0, 0}, {6, 0}, {6, 4}, {0, 4}});
    add_box(world, Pose2d(1.0, 3.2, 0.0), 1.0, 0.5);
    add_outline(world, {{8, 0}, {14, 0}, {14, 4}, {8, 4}});
    add_box(world, Pose2d(9.0, 3.2, 0.0), 1.0, 0.5);
    world.path = {{1, 1}, {5, 1}, {5, 3}};
    return world;
}

std::vector<Pose2d> in_both(const std::vector<Pose2d>& poses) {
    std::vector<Pose2d> both = poses;
    for (const Pose2d& pose : poses) {
        both.push_back(Pose2d(8.0, 0.0, 0.0) * pose);
    }
    return both;
}

TEST(Relocalization, FindsRandomPosesInTheHall) {
    const World hall = world_named("thesis_hall");
    const Relocalizer relocalizer = relocalizer_in(hall_map());
    Rng random(3);
    for (int i = 0; i < 25; ++i) {
        const Pose2d truth(uniform(random, -3.0, 3.0), uniform(random, -2.0, 2.0),
                           uniform(random, -kPi, kPi));
        const Relocalization found =
            relocalizer.find(seen_from(hall, truth, static_cast<unsigned>(i)));
        ASSERT_EQ(found.verdict, PlaceVerdict::kFound) << truth;
        const Place& place = found.places.front();
        ASSERT_THAT(place.map_from_robot, PoseNear(truth, 0.015, radians(0.2)));
        EXPECT_GT(place.fit.score, 0.9);
        // Sure of it to some millimetres, and not more.
        EXPECT_LT(place.covariance(0, 0), 0.01 * 0.01);
        EXPECT_GT(place.covariance(0, 0), 0.001 * 0.001);
        EXPECT_GT(found.nodes, 0U);
    }
}

TEST(Relocalization, LaserMayBeAnywhereOnTheRobot) {
    const World hall = world_named("thesis_hall");
    const Pose2d robot_from_laser(1.3, 0.1, 0.3);
    const Pose2d truth(-2.4, 1.0, 0.5);
    std::mt19937 random(1);
    const Query query{sweep_of(scan_at(hall, truth, random, 0.02, robot_from_laser))};
    const Relocalization found = relocalizer_in(hall_map()).find(query);
    ASSERT_EQ(found.verdict, PlaceVerdict::kFound);
    EXPECT_THAT(found.places.front().map_from_robot, PoseNear(truth, 0.015, radians(0.2)));
}

TEST(Relocalization, SquareRoomIsAmbiguousFourTimes) {
    const World room = square_room();
    const Relocalizer relocalizer = relocalizer_in(map_of(room));
    const Pose2d truth(1.0, 0.4, 0.7);
    const Relocalization found = relocalizer.find(seen_from(room, truth));
    ASSERT_EQ(found.verdict, PlaceVerdict::kAmbiguous);
    ASSERT_EQ(found.places.size(), 4U);
    for (int turn = 0; turn < 4; ++turn) {
        const Pose2d same = Pose2d(0.0, 0.0, turn * kPi / 2.0) * truth;
        EXPECT_TRUE(std::any_of(found.places.begin(), found.places.end(), [&](const Place& p) {
            return between(same, p.map_from_robot).translation.norm() < 0.03;
        })) << turn;
    }
}

TEST(Relocalization, TwinRoomsAreAmbiguousUntilOneDiffers) {
    World rooms = twin_rooms();
    const std::vector<Pose2d> poses = in_both(poses_along(rooms));
    const Pose2d truth(9.5 + 1.0, 1.2, 2.0);
    const auto same = reference_of(stored_map_of(rooms, poses));
    const Relocalization twins = relocalizer_in(same).find(seen_from(rooms, truth));
    EXPECT_EQ(twins.verdict, PlaceVerdict::kAmbiguous);
    ASSERT_EQ(twins.places.size(), 2U);
    add_box(rooms, Pose2d(13.0, 3.5, 0.0), 1.4, 0.8);
    const auto differing = reference_of(stored_map_of(rooms, poses));
    const Relocalization told = relocalizer_in(differing).find(seen_from(rooms, truth));
    ASSERT_EQ(told.verdict, PlaceVerdict::kFound);
    EXPECT_THAT(told.places.front().map_from_robot, PoseNear(truth, 0.02, radians(0.3)));
    ASSERT_GE(told.places.size(), 2U);  // the runner-up is the other room
    EXPECT_LT(told.places[1].map_from_robot.x(), 6.0);
}

std::shared_ptr<const ReferenceMap> map_of_room() {
    World room = irregular_room();
    room.path = {{-1.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}};
    return map_of(room);
}

TEST(Relocalization, OtherHallsAreNotInThisMap) {
    Rng random(4);
    const Relocalizer relocalizer = relocalizer_in(map_of_room());
    const World hall = world_named("thesis_hall");
    for (int i = 0; i < 5; ++i) {
        const Pose2d pose(uniform(random, -2.0, 2.0), uniform(random, -1.5, 1.5),
                          uniform(random, -kPi, kPi));
        EXPECT_NE(relocalizer.find(seen_from(hall, pose)).verdict, PlaceVerdict::kFound) << pose;
    }
}

/// What is new in the hall may hide three beams of ten.
TEST(Relocalization, ToleratesNewThings) {
    World changed = world_named("thesis_hall");
    add_box(changed, Pose2d(0.8, 1.4, 0.4), 1.2, 0.5);
    const Pose2d truth(-1.0, -0.5, 0.3);
    const Relocalization found = relocalizer_in(hall_map()).find(seen_from(changed, truth));
    ASSERT_EQ(found.verdict, PlaceVerdict::kFound);
    EXPECT_GT(found.places.front().fit.unmapped, 0.05);
    EXPECT_THAT(found.places.front().map_from_robot, PoseNear(truth, 0.015, radians(0.2)));
}

/// One scan in a corner of the first room fits both; a second one, tied by odometry, sees more.
TEST(Relocalization, SeveralScansTellMoreThanOne) {
    World rooms = twin_rooms();
    rooms.walls.clear();
    // A corridor of 30 m with one niche near its end.
    add_outline(rooms, {{0, 0}, {40, 0}, {40, 2}, {31, 2}, {31, 3}, {30, 3}, {30, 2}, {0, 2}});
    rooms.path = {{1, 1}, {39, 1}};
    const auto map = map_of(rooms);
    const Relocalizer relocalizer = relocalizer_in(map);
    const auto short_sighted = [&](const Pose2d& pose) {
        Sweep sweep = seen_from(rooms, pose).front();
        Sweep near{sweep.origin, {}};
        for (std::size_t i = 0; i < sweep.surface.size(); ++i) {
            if (sweep.surface.points[i].norm() < 5.0) {
                near.surface.points.push_back(sweep.surface.points[i]);
                near.surface.normals.push_back(sweep.surface.normals[i]);
            }
        }
        return near;
    };
    const Pose2d now(20.0, 1.0, 0.0);
    const Query one{short_sighted(now)};
    EXPECT_EQ(relocalizer.find(one).verdict, PlaceVerdict::kAmbiguous);
    Query more = one;
    for (double x = 21.0; x <= 33.0; x += 1.0) {
        const Pose2d then(x, 1.0, 0.0);
        more.push_back(transform(between(now, then), short_sighted(then)));
    }
    const Relocalization found = relocalizer.find(more);
    ASSERT_EQ(found.verdict, PlaceVerdict::kFound);
    EXPECT_THAT(found.places.front().map_from_robot, PoseNear(now, 0.03, radians(0.3)));
}

/// Thesis section 3.5.5: from the middle of the map its headings suffice.
TEST(Relocalization, HeadingsFindTheMiddle) {
    const World hall = world_named("thesis_hall");
    RelocalizationConfig config;
    config.method = RelocalizationMethod::kHeadings;
    const Relocalizer thesis = relocalizer_in(hall_map(), config);
    for (const double heading : {0.02, 1.6, 3.1, -1.5}) {
        const Pose2d truth(0.1, -0.1, heading);
        const Relocalization found = thesis.find(seen_from(hall, truth));
        ASSERT_EQ(found.verdict, PlaceVerdict::kFound);
        EXPECT_THAT(found.places.front().map_from_robot, PoseNear(truth, 0.015, radians(0.2)));
    }
}

TEST(Relocalization, GridOfHeadingsReachesTheCorners) {
    const World hall = world_named("thesis_hall");
    RelocalizationConfig config;
    config.method = RelocalizationMethod::kHeadings;
    config.heading_grid = 2.0;
    const Pose2d truth(3.4, -1.9, 2.0);
    const Relocalization found = relocalizer_in(hall_map(), config).find(seen_from(hall, truth));
    ASSERT_EQ(found.verdict, PlaceVerdict::kFound);
    EXPECT_THAT(found.places.front().map_from_robot, PoseNear(truth, 0.015, radians(0.2)));
}

TEST(Relocalization, SettleStaysWhereIcpFails) {
    const Query query = seen_from(world_named("thesis_hall"), Pose2d());
    const Pose2d far(50.0, 50.0, 1.0);
    const Place place = relocalizer_in(hall_map()).settle(query, far);
    EXPECT_THAT(place.map_from_robot, PoseNear(far, 1e-12, 1e-12));
    EXPECT_EQ(place.fit.explained, 0.0);
}

TEST(Relocalization, EffortThatRanOutIsSaid) {
    RelocalizationConfig config;
    config.max_nodes = 1000;
    const Relocalization found =
        relocalizer_in(hall_map(), config).find(seen_from(world_named("thesis_hall"), Pose2d()));
    EXPECT_EQ(found.verdict, PlaceVerdict::kUnfinished);
    EXPECT_LT(found.nodes, 3000U);
}

/// Square rooms in rows, all alike: four places in each.
World square_rooms(int rows) {
    World world;
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < rows; ++x) {
            const Point2 corner(4.3 * x, 4.3 * y);
            add_outline(world, transform(Pose2d(corner, 0.0), {{0, 0}, {3, 0}, {3, 3}, {0, 3}}));
        }
    }
    return world;
}

TEST(Relocalization, MoreLookAlikesThanAreLookedAtAreAmbiguous) {
    const int rows = 6;
    const World rooms = square_rooms(rows);
    std::vector<Pose2d> poses;
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < rows; ++x) {
            poses.emplace_back(4.3 * x + 1.5, 4.3 * y + 1.5, 0.0);
            poses.emplace_back(4.3 * x + 1.5, 4.3 * y + 1.5, kPi);
        }
    }
    const auto map = reference_of(stored_map_of(rooms, poses));
    const Pose2d truth(4.3 * 3 + 1.0, 4.3 * 2 + 1.7, 0.4);
    const Query query = seen_from(rooms, truth);
    RelocalizationConfig config;
    const Relocalization found = relocalizer_in(map, config).find(query);
    EXPECT_EQ(found.verdict, PlaceVerdict::kAmbiguous);
    EXPECT_GT(found.places.size(), 90U);
    EXPECT_LE(found.places.size(), 100U);
    config.max_places = 1000;
    const Relocalization all = relocalizer_in(map, config).find(query);
    EXPECT_EQ(all.verdict, PlaceVerdict::kAmbiguous);
    EXPECT_EQ(all.places.size(), 4U * rows * rows);
    EXPECT_TRUE(std::any_of(all.places.begin(), all.places.end(), [&](const Place& place) {
        return between(truth, place.map_from_robot).translation.norm() < 0.03;
    }));
}

TEST(Relocalization, NothingSeenIsNowhere) {
    const Relocalizer relocalizer = relocalizer_in(hall_map());
    // Earlier scans alone do not tell where it is now.
    const Query blind_now{Sweep(), seen_from(world_named("thesis_hall"), Pose2d()).front()};
    EXPECT_EQ(relocalizer.find(blind_now).verdict, PlaceVerdict::kNotInMap);
    EXPECT_EQ(relocalizer.find({}).verdict, PlaceVerdict::kNotInMap);
    EXPECT_EQ(relocalizer.find({Sweep()}).verdict, PlaceVerdict::kNotInMap);
}

TEST(Relocalization, SameQuerySameAnswer) {
    const Relocalizer relocalizer = relocalizer_in(hall_map());
    const Query query = seen_from(world_named("thesis_hall"), Pose2d(1.0, 1.0, 2.0));
    const Relocalization first = relocalizer.find(query);
    const Relocalization second = relocalizer.find(query);
    ASSERT_EQ(first.places.size(), second.places.size());
    EXPECT_EQ(first.nodes, second.nodes);
    EXPECT_EQ(first.places.front().map_from_robot.x(), second.places.front().map_from_robot.x());
    EXPECT_EQ(first.places.front().covariance, second.places.front().covariance);
}

Place place_at(double x, double score, double explained, double violated) {
    Place place;
    place.map_from_robot = Pose2d(x, 0.0, 0.0);
    place.fit.score = score;
    place.fit.explained = explained;
    place.fit.violated = violated;
    return place;
}

TEST(Relocalization, JudgesByTheScoreAndTheWalls) {
    const Relocalizer relocalizer = relocalizer_in(hall_map());
    const auto verdict = [&](std::vector<Place> places) {
        return relocalizer.judge(std::move(places)).verdict;
    };
    EXPECT_EQ(verdict({}), PlaceVerdict::kNotInMap);
    EXPECT_EQ(verdict({place_at(0, 0.95, 0.95, 0.0)}), PlaceVerdict::kFound);
    EXPECT_EQ(verdict({place_at(0, 0.6, 0.9, 0.3)}), PlaceVerdict::kNotInMap);
    EXPECT_EQ(verdict({place_at(0, 0.3, 0.3, 0.0)}), PlaceVerdict::kNotInMap);
    EXPECT_EQ(verdict({place_at(0, 0.9, 0.9, 0.0), place_at(5, 0.89, 0.89, 0.0)}),
              PlaceVerdict::kAmbiguous);
    // The same place twice.
    EXPECT_EQ(verdict({place_at(0, 0.9, 0.9, 0.0), place_at(0.1, 0.89, 0.89, 0.0)}),
              PlaceVerdict::kFound);
}

TEST(Relocalization, ValuesOutOfRangeAreNamed) {
    RelocalizationConfig config;
    config.max_places = 0;
    EXPECT_THAT(error_of([&] { relocalizer_in(hall_map(), config); }),
                testing::HasSubstr("relocalization.max_places"));
}

}  // namespace
}  // namespace hybrid_slam::test
