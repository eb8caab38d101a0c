// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/planner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "halls.hpp"
#include "hybrid_slam/vehicle/reeds_shepp.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

/// What holds for each way, however it was found.
void expect_drivable(const StateGrid& grid, const VehicleConfig& vehicle, const Route& route,
                     const PlannerConfig& config = {}) {
    ASSERT_EQ(route.status, PlanStatus::kFound);
    for (std::size_t i = 0; i < route.points.size(); ++i) {
        const PathPoint& point = route.points[i];
        ASSERT_FALSE(touches(grid, vehicle, point.map_from_robot)) << point.map_from_robot;
        ASSERT_LE(std::abs(point.curvature) * planned_radius(vehicle, config), 1.0 + 1e-9);
        if (i > 0) {
            const PathPoint& before = route.points[i - 1];
            const double way = point.travelled - before.travelled;
            ASSERT_LE(way, 0.05 + 1e-9);
            const double signed_way = before.direction * way;
            const Pose2d motion = Pose2d::exp({signed_way, 0.0, signed_way * before.curvature});
            ASSERT_THAT(before.map_from_robot * motion, PoseNear(point.map_from_robot, 1e-6, 1e-6));
        }
    }
    EXPECT_NEAR(route.length, route.points.back().travelled, 1e-9);
}

TEST(Planner, DrivesTheWaypointsOfTheThesis) {
    const VehicleConfig vehicle;
    const StateGrid grid = thesis_hall();
    const Route route = plan_route(ClearanceField(grid), vehicle, {0.0, 1.6, 0.0},
                                   {at(1.30, -0.15), at(-2.40, -1.60)});
    expect_drivable(grid, vehicle, route);
    ASSERT_EQ(route.waypoint_ends.size(), 2U);
    const Point2 first = route.points[route.waypoint_ends[0]].map_from_robot.translation;
    const Point2 second = route.points[route.waypoint_ends[1]].map_from_robot.translation;
    EXPECT_LT((first - Point2(1.30, -0.15)).norm(), 1e-6);
    EXPECT_LT((second - Point2(-2.40, -1.60)).norm(), 1e-6);
}

/// Every second goal has a heading.
void reach_random_places(const StateGrid& grid, unsigned seed, int count) {
    const VehicleConfig vehicle;
    const ClearanceField field(grid);
    Places places(field, vehicle, seed);
    for (int i = 0; i < count; ++i) {
        const Pose2d start = places.next();
        const Pose2d goal = places.next();
        const bool any_heading = i % 2 == 0;
        const Route route =
            plan_route(field, vehicle, start,
                       {any_heading ? anywhere(goal) : at(goal.x(), goal.y(), goal.heading)});
        expect_drivable(grid, vehicle, route);
        const Pose2d end = route.points.back().map_from_robot;
        EXPECT_THAT(end, PoseNear(goal, 1e-5, any_heading ? kPi : 1e-5));
        EXPECT_GE(route.length, (goal.translation - start.translation).norm() - 1e-6);
    }
}

TEST(Planner, RandomPlacesOfTheHallAreReached) {
    reach_random_places(thesis_hall(), 21, 40);
}

TEST(Planner, FindsItsWayThroughAWarehouse) {
    reach_random_places(warehouse(), 22, 10);
}

/// A bay beside a lane, 1.8 m longer than the truck.
TEST(Planner, ParkingBetweenObstaclesNeedsReversing) {
    const VehicleConfig vehicle;
    StateGrid grid = room(14.0, 4.6);
    add_box(grid, {-4.7, -1.6}, {5.0, 1.4});
    add_box(grid, {4.7, -1.6}, {5.0, 1.4});
    const ClearanceField field(grid);
    const Pose2d start(-4.0, 0.6, 0.0);
    const Route route = plan_route(field, vehicle, start, {at(-0.2, -1.45, 0.0)});
    expect_drivable(grid, vehicle, route);
    EXPECT_GE(route.reversals, 1);
    EXPECT_THAT(route.points.back().map_from_robot, PoseNear(Pose2d(-0.2, -1.45, 0.0), 1e-5, 1e-5));
}

TEST(Planner, SaysWhatIsInTheWay) {
    const VehicleConfig vehicle;
    StateGrid grid = room(20.0, 8.0);
    add_box(grid, {0.0, 0.0}, {0.1, 8.0});
    add_box(grid, {7.0, 2.0}, {1.0, 1.0}, CellState::kUnknown);
    const ClearanceField field(grid);
    const Pose2d start(-5.0, 0.0, 0.0);
    const auto status = [&](const Pose2d& from, const Waypoint& to) {
        return plan_route(field, vehicle, from, {to}).status;
    };
    EXPECT_EQ(status(start, at(-6.0, 2.0)), PlanStatus::kFound);
    EXPECT_EQ(status(start, at(5.0, 0.0)), PlanStatus::kNoWay);
    EXPECT_EQ(status(start, at(7.0, 2.0)), PlanStatus::kGoalBlocked);
    EXPECT_EQ(status(start, at(-50.0, 0.0)), PlanStatus::kGoalBlocked);
    EXPECT_EQ(status(start, at(-5.0, 3.0, kPi / 2.0)), PlanStatus::kGoalBlocked);
    EXPECT_EQ(status({-0.3, 0.0, 0.0}, at(-5.0, 0.0)), PlanStatus::kStartBlocked);
    PlannerConfig lazy;
    lazy.max_nodes = 10;
    add_box(grid, {-5.0, 0.0}, {0.1, 4.0});
    const Route route =
        plan_route(ClearanceField(grid), vehicle, {-7.5, 0.0, 0.0}, {at(-2.5, 0.0)}, lazy);
    EXPECT_EQ(route.status, PlanStatus::kUnfinished);
    EXPECT_LE(route.nodes, 30);
}

TEST(Planner, TellsHowFarItCameAndKeepsThatWay) {
    const VehicleConfig vehicle;
    StateGrid grid = room(20.0, 8.0);
    add_box(grid, {0.0, 0.0}, {0.1, 8.0});
    const ClearanceField field(grid);
    const Route route = plan_route(field, vehicle, {-5.0, 0.0, 0.0}, {at(-7.0, 1.0), at(5.0, 0.0)});
    EXPECT_EQ(route.status, PlanStatus::kNoWay);
    EXPECT_EQ(route.failed_waypoint, 1U);
    ASSERT_EQ(route.waypoint_ends.size(), 1U);
    EXPECT_EQ(route.waypoint_ends[0], route.points.size() - 1);
}

/// 5 cm from a wall along its side: within the margin, but nothing is touched.
TEST(Planner, AStartWithinTheMarginIsLeft) {
    const VehicleConfig vehicle;
    const StateGrid grid = room(12.0, 8.0);
    const ClearanceField field(grid);
    const Pose2d start(0.0, 4.0 - 0.45 - 0.12, 0.0);
    PlannerConfig config;
    config.margin = 0.25;
    ASSERT_FALSE(footprint_is_clear(field, vehicle, start, config.margin));
    const Route route = plan_route(field, vehicle, start, {at(0.0, -1.0)}, config);
    expect_drivable(grid, vehicle, route, config);
    EXPECT_TRUE(
        footprint_is_clear(field, vehicle, route.points.back().map_from_robot, config.margin));
}

TEST(Planner, KeepsItsMarginEverywhere) {
    const VehicleConfig vehicle;
    const StateGrid grid = thesis_hall();
    const ClearanceField field(grid);
    const Route route =
        plan_route(field, vehicle, {0.0, 1.6, 0.0}, {at(-3.5, 1.5), at(3.4, 2.4), at(3.2, -2.4)});
    expect_drivable(grid, vehicle, route);
    for (const PathPoint& point : route.points) {
        // The corners of a grown rectangle are sharp, those of a margin round; between two looks
        // of the search a corner may come nearer.
        EXPECT_FALSE(touches(grid, vehicle, point.map_from_robot, 0.6 * PlannerConfig().margin))
            << point.map_from_robot;
    }
}

TEST(Planner, TheSameInputGivesTheSameWay) {
    const VehicleConfig vehicle;
    const ClearanceField field(thesis_hall());
    const auto plan = [&] {
        return plan_route(field, vehicle, {-3.0, -1.0, 2.0}, {at(3.0, 1.0, -1.0), at(0.0, 0.0)});
    };
    const Route first = plan();
    const Route second = plan();
    ASSERT_EQ(first.points.size(), second.points.size());
    for (std::size_t i = 0; i < first.points.size(); ++i) {
        EXPECT_EQ(first.points[i].map_from_robot.vector(),
                  second.points[i].map_from_robot.vector());
    }
    EXPECT_EQ(first.nodes, second.nodes);
}

/// In the open the way is the Reeds-Shepp one or close to it in length.
TEST(Planner, InTheOpenTheWayIsHardlyLongerThanItMustBe) {
    const VehicleConfig vehicle;
    const ClearanceField field(room(40.0, 40.0, 0.1));
    PlannerConfig config;
    config.wall_cost = 0.0;
    config.cusp_cost = 0.0;
    config.steering_cost = 0.0;
    config.turning_cost = 0.0;
    config.reverse_cost = 0.0;
    const Pose2d start(0.0, 0.0, 0.3);
    for (const Pose2d& goal :
         {Pose2d(3.0, 4.0, 1.0), Pose2d(0.2, 1.5, 3.1), Pose2d(-6.0, 0.1, -2.0)}) {
        const Route route =
            plan_route(field, vehicle, start, {at(goal.x(), goal.y(), goal.heading)}, config);
        ASSERT_EQ(route.status, PlanStatus::kFound);
        EXPECT_NEAR(route.length,
                    reeds_shepp_length(between(start, goal), planned_radius(vehicle, config)),
                    1e-6);
    }
}

TEST(Planner, AWheelBehindIsNoOtherTruckForTheWay) {
    VehicleConfig vehicle;
    vehicle.wheelbase = -vehicle.wheelbase;
    const StateGrid grid = thesis_hall();
    const Route route =
        plan_route(ClearanceField(grid), vehicle, {0.0, 1.6, 0.0}, {at(-2.4, -1.6, 1.0)});
    expect_drivable(grid, vehicle, route);
}

TEST(Planner, NoWaypointsAreReachedAtOnce) {
    const ClearanceField field(thesis_hall());
    const Route route = plan_route(field, {}, {}, {});
    EXPECT_EQ(route.status, PlanStatus::kFound);
    EXPECT_EQ(route.points.size(), 1U);
    const Route standing = plan_route(field, {}, {}, {at(0.0, 0.0)});
    EXPECT_EQ(standing.status, PlanStatus::kFound);
    EXPECT_LT(standing.length, 1e-6);
}

TEST(Planner, RefusesWhatMakesNoSense) {
    const ClearanceField field(thesis_hall());
    EXPECT_EQ(error_of([&] { plan_route(field, {}, {}, {at(NAN, 0.0)}); }),
              "planner: a place that is not finite");
    VehicleConfig vehicle;
    vehicle.wheelbase = 0.0;
    EXPECT_EQ(error_of([&] { plan_route(field, vehicle, {}, {}); }),
              "planner: vehicle or search of an impossible size");
}

TEST(PlannerConfig, ItsValuesAreAllWithinTheirLimits) {
    PlannerConfig config;
    ConfigSchema schema;
    describe(schema, config);
    EXPECT_EQ(schema.fields().size(), 13U);
    for (const ConfigField& field : schema.fields()) {
        EXPECT_NO_THROW(field.set(field.get())) << field.key;
    }
}

}  // namespace
}  // namespace hybrid_slam::test
