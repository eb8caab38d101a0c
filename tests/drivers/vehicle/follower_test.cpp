// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/follower.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "halls.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kPeriod = 0.02;

/// The truck, and poses of it as localization gives them: every 80 ms, 80 ms late, noisy.
class Loop {
  public:
    Loop(const VehicleConfig& vehicle, const Pose2d& start, unsigned seed)
        : vehicle_(vehicle), random_(seed) {
        truck.world_from_robot = start;
    }

    FollowerStep step(const Route& route, const FollowerConfig& config) {
        FollowerInput input = next_input;
        input.seconds = kPeriod;
        if (sends_poses && tick_ % 4 == 0) {
            waiting_.push_back(noisy(truck.world_from_robot));
            if (waiting_.size() > 1) {
                input.pose = PoseReading{waiting_.front(), 0.08};
                waiting_.pop_front();
            }
        }
        ++tick_;
        const FollowerStep result = follow(route, vehicle_, config, state, input);
        DriveCommand command = result.command;
        command.steering += steering_offset;
        truck = hybrid_slam::step(vehicle_, truck, command, kPeriod);
        return result;
    }

    double seconds() const { return tick_ * kPeriod; }

    VehicleState truck;
    FollowerState state;
    FollowerInput next_input;
    bool sends_poses = true;
    double steering_offset = 0.0;
    double sigma = 0.005;
    double sigma_heading = radians(0.1);

  private:
    Pose2d noisy(const Pose2d& pose) {
        std::normal_distribution<double> normal;
        const double x = sigma * normal(random_);
        const double y = sigma * normal(random_);
        return {pose.x() + x, pose.y() + y, pose.heading + sigma_heading * normal(random_)};
    }

    VehicleConfig vehicle_;
    std::mt19937 random_;
    std::deque<Pose2d> waiting_;
    int tick_ = 0;
};

/// What a whole drive did.
struct Drive {
    FollowerStatus status = FollowerStatus::kNoPose;
    double seconds = 0.0;
    double stop_error = 0.0;            ///< metres of the truth from the last waypoint
    double worst_cross_track = 0.0;     ///< metres of the truth from the way
    std::vector<double> passed_within;  ///< metres of the truth from each waypoint
    bool touched = false;
};

double distance_to_way(const Route& route, const Point2& point) {
    double nearest = HUGE_VAL;
    for (std::size_t i = 0; i + 1 < route.points.size(); ++i) {
        const Point2& from = route.points[i].map_from_robot.translation;
        const Point2 along = route.points[i + 1].map_from_robot.translation - from;
        const double share = std::clamp(along.dot(point - from) / along.squaredNorm(), 0.0, 1.0);
        nearest = std::min(nearest, (from + share * along - point).norm());
    }
    return nearest;
}

Drive drive(Loop& loop, const StateGrid& grid, const VehicleConfig& vehicle, const Route& route,
            const FollowerConfig& config = {}) {
    Drive result;
    result.passed_within.assign(route.waypoint_ends.size(), HUGE_VAL);
    while (loop.seconds() < 600.0) {
        result.status = loop.step(route, config).status;
        const Point2& place = loop.truck.world_from_robot.translation;
        result.touched = result.touched || touches(grid, vehicle, loop.truck.world_from_robot);
        for (std::size_t i = 0; i < route.waypoint_ends.size(); ++i) {
            const Point2& waypoint =
                route.points[route.waypoint_ends[i]].map_from_robot.translation;
            result.passed_within[i] = std::min(result.passed_within[i], (waypoint - place).norm());
        }
        result.worst_cross_track =
            std::max(result.worst_cross_track, distance_to_way(route, place));
        if (result.status == FollowerStatus::kArrived ||
            result.status == FollowerStatus::kOffPath) {
            break;
        }
    }
    result.seconds = loop.seconds();
    const Point2& end = route.points.back().map_from_robot.translation;
    result.stop_error = (loop.truck.world_from_robot.translation - end).norm();
    return result;
}

TEST(Follower, RandomDrivesInTheHallStopWhereTheyShould) {
    const VehicleConfig vehicle;
    const StateGrid grid = thesis_hall();
    const ClearanceField field(grid);
    Places places(field, vehicle, 31);
    for (unsigned i = 0; i < 100; ++i) {
        const Pose2d start = places.next();
        const Route route =
            plan_route(field, vehicle, start, {anywhere(places.next()), anywhere(places.next())});
        ASSERT_EQ(route.status, PlanStatus::kFound);
        Loop loop(vehicle, start, 100 + i);
        const Drive done = drive(loop, grid, vehicle, route);
        EXPECT_EQ(done.status, FollowerStatus::kArrived) << i << " " << done.stop_error;
        EXPECT_FALSE(done.touched) << i;
        EXPECT_LT(done.stop_error, 0.02) << i;
        EXPECT_LT(done.passed_within[0], 0.05) << i;
        EXPECT_LT(done.worst_cross_track, 0.02) << i;
        EXPECT_EQ(loop.state.waypoints_reached, 2U);
    }
}

/// A straight way forwards, then backwards to the side: a cusp between them.
struct Manoeuvre {
    VehicleConfig vehicle;
    StateGrid grid = room(20.0, 12.0);
    Pose2d start{-3.0, 0.0, 0.0};
    Route route =
        plan_route(ClearanceField(grid), vehicle, start, {at(2.0, 0.0, 0.0), at(-1.0, 1.5, 0.0)});
};

TEST(Follower, StandsAndTurnsTheWheelAtACusp) {
    const Manoeuvre way;
    ASSERT_GE(way.route.reversals, 1);
    Loop loop(way.vehicle, way.start, 1);
    std::size_t turns = 0;
    bool was_turning = false;
    FollowerStep result;
    while (result.status != FollowerStatus::kArrived && loop.seconds() < 120.0) {
        result = loop.step(way.route, {});
        const bool turning = result.status == FollowerStatus::kTurningWheel;
        EXPECT_FALSE(turning && result.command.speed != 0.0);
        turns += turning && !was_turning ? 1U : 0U;
        was_turning = turning;
    }
    EXPECT_EQ(result.status, FollowerStatus::kArrived);
    EXPECT_GE(turns, 1U);
    EXPECT_LE(turns, 4U);
    EXPECT_LT(result.remaining, 0.01);
    EXPECT_EQ(result.waypoints_reached, 2U);
    EXPECT_EQ(result.command.speed, 0.0);
}

TEST(Follower, KeepsItsSpeedLimitsAndDrivesAtThem) {
    const Manoeuvre way;
    Loop loop(way.vehicle, way.start, 2);
    const FollowerConfig config;
    double fastest = 0.0;
    double fastest_turn = 0.0;
    while (loop.step(way.route, config).status != FollowerStatus::kArrived &&
           loop.seconds() < 120.0) {
        fastest = std::max(fastest, std::abs(loop.truck.speed));
        fastest_turn = std::max(fastest_turn, std::abs(loop.truck.twist(way.vehicle).z()));
    }
    EXPECT_LE(fastest, config.speed_limit + 1e-9);
    EXPECT_GT(fastest, 0.95 * config.speed_limit);
    EXPECT_LT(fastest_turn, 1.25 * config.turn_rate_limit);
}

TEST(Follower, WaitsForAPoseAndStandsWhileHeld) {
    const Manoeuvre way;
    Loop loop(way.vehicle, way.start, 3);
    loop.sends_poses = false;
    for (int i = 0; i < 50; ++i) {
        const FollowerStep result = loop.step(way.route, {});
        EXPECT_EQ(result.status, FollowerStatus::kNoPose);
        EXPECT_EQ(result.command.speed, 0.0);
    }
    loop.sends_poses = true;
    for (int i = 0; i < 150; ++i) {
        loop.step(way.route, {});
    }
    EXPECT_GT(loop.truck.speed, 0.1);
    loop.next_input.hold = true;
    for (int i = 0; i < 100; ++i) {
        const FollowerStep result = loop.step(way.route, {});
        EXPECT_EQ(result.status, FollowerStatus::kHeld);
        EXPECT_EQ(result.command.speed, 0.0);
    }
    EXPECT_EQ(loop.truck.speed, 0.0);
    loop.next_input.hold = false;
    EXPECT_EQ(drive(loop, way.grid, way.vehicle, way.route).status, FollowerStatus::kArrived);
}

TEST(Follower, StopsShortOfAnObstacleAndGoesOnAfterIt) {
    const Manoeuvre way;
    Loop loop(way.vehicle, way.start, 4);
    const FollowerConfig config;
    FollowerStep result;
    const double obstacle = way.start.x() + 1.5;
    for (int i = 0; i < 1000; ++i) {
        loop.next_input.free_ahead = obstacle - loop.truck.world_from_robot.x();
        loop.next_input.free_behind = 0.0;
        result = loop.step(way.route, config);
    }
    EXPECT_EQ(result.status, FollowerStatus::kHeld);
    EXPECT_LT(loop.next_input.free_ahead, config.obstacle_gap + 0.02);
    EXPECT_GT(loop.next_input.free_ahead, config.obstacle_gap - 0.02);
    loop.next_input.free_ahead = NAN;
    EXPECT_EQ(loop.step(way.route, config).command.speed, 0.0);
    loop.next_input = {};
    EXPECT_EQ(drive(loop, way.grid, way.vehicle, way.route).status, FollowerStatus::kArrived);
}

TEST(Follower, StopsWhenItIsBesideTheWayOrAPoseJumps) {
    const Manoeuvre way;
    Loop beside(way.vehicle, way.start * Pose2d(0.0, 0.5, 0.0), 5);
    EXPECT_EQ(drive(beside, way.grid, way.vehicle, way.route).status, FollowerStatus::kOffPath);
    EXPECT_EQ(beside.truck.world_from_robot.x(), way.start.x()) << "it never moved";

    Loop jumping(way.vehicle, way.start, 6);
    for (int i = 0; i < 200; ++i) {
        jumping.step(way.route, {});
    }
    jumping.truck.world_from_robot.translation.y() += 1.0;
    EXPECT_EQ(drive(jumping, way.grid, way.vehicle, way.route).status, FollowerStatus::kOffPath);
    EXPECT_EQ(jumping.step(way.route, {}).command.speed, 0.0);
    const Route again = plan_route(ClearanceField(way.grid), way.vehicle,
                                   jumping.truck.world_from_robot, {at(2.0, 0.0)});
    jumping.state = begin_route(jumping.state);
    EXPECT_EQ(drive(jumping, way.grid, way.vehicle, again).status, FollowerStatus::kArrived);
}

TEST(Follower, StopsAtEachWaypointWhereThatIsWished) {
    const VehicleConfig vehicle;
    const StateGrid grid = room(20.0, 8.0);
    const Pose2d start(-6.0, 0.0, 0.0);
    const Route route =
        plan_route(ClearanceField(grid), vehicle, start, {at(0.0, 0.0), at(5.0, 0.0)});
    for (const bool stop : {false, true}) {
        FollowerConfig config;
        config.stop_at_each = stop;
        Loop loop(vehicle, start, 7);
        double slowest = HUGE_VAL;
        double stood_at = HUGE_VAL;
        FollowerStep result;
        while (result.status != FollowerStatus::kArrived && loop.seconds() < 120.0) {
            result = loop.step(route, config);
            const double away = loop.truck.world_from_robot.translation.norm();
            if (away < 0.5 && std::abs(loop.truck.speed) < slowest) {
                slowest = std::abs(loop.truck.speed);
                stood_at = away;
            }
        }
        EXPECT_EQ(result.waypoints_reached, 2U);
        EXPECT_EQ(slowest < 1e-3, stop) << slowest;
        EXPECT_TRUE(!stop || stood_at < 0.02) << stood_at;
    }
}

/// A wheel that stands a degree beside what it is told, and no noise that could hide it.
TEST(Follower, ABentSteeringCostsMillimetres) {
    const Manoeuvre way;
    Loop loop(way.vehicle, way.start, 8);
    loop.steering_offset = radians(1.0);
    loop.sigma = 0.0;
    loop.sigma_heading = 0.0;
    const Drive done = drive(loop, way.grid, way.vehicle, way.route);
    EXPECT_EQ(done.status, FollowerStatus::kArrived);
    EXPECT_LT(done.worst_cross_track, 0.015);
    EXPECT_LT(done.stop_error, 0.015);
}

/// What the truck tells of itself is worth more than what it was told.
TEST(Follower, UsesTheSpeedThatTheTruckTells) {
    const Manoeuvre way;
    Loop loop(way.vehicle, way.start, 9);
    for (int i = 0; i < 50; ++i) {
        loop.step(way.route, {});
    }
    loop.sends_poses = false;
    const double before = loop.state.vehicle.world_from_robot.x();
    loop.next_input.speed = 0.0;  // its wheels are blocked
    for (int i = 0; i < 50; ++i) {
        loop.step(way.route, {});
    }
    EXPECT_NEAR(loop.state.vehicle.world_from_robot.x(), before, 3e-3);
    loop.next_input.speed.reset();
    for (int i = 0; i < 50; ++i) {
        loop.step(way.route, {});
    }
    EXPECT_GT(loop.state.vehicle.world_from_robot.x(), before + 0.1);
}

TEST(Follower, LatePosesAreCarriedForward) {
    const Manoeuvre way;
    Loop loop(way.vehicle, way.start, 10);
    loop.sigma = 0.0;
    loop.sigma_heading = 0.0;
    for (int i = 0; i < 300; ++i) {
        const FollowerStep result = loop.step(way.route, {});
        if (result.status == FollowerStatus::kDriving) {
            // `truck` is one period ahead of what was known in the step.
            ASSERT_NEAR(result.map_from_robot.x(),
                        loop.truck.world_from_robot.x() - kPeriod * loop.truck.speed, 1e-3);
        }
    }
    FollowerState state = loop.state;
    FollowerInput input;
    input.pose = PoseReading{Pose2d(9.0, 9.0, 0.0), 5.0};
    follow(way.route, way.vehicle, {}, state, input);
    EXPECT_LT(state.vehicle.world_from_robot.x(), 3.0) << "too old to be used";
    input.pose = PoseReading{Pose2d(NAN, 9.0, 0.0), 0.0};
    input.speed = NAN;
    input.steering = NAN;
    follow(way.route, way.vehicle, {}, state, input);
    EXPECT_TRUE(state.vehicle.world_from_robot.vector().allFinite());
}

TEST(Follower, AWheelBehindIsSteeredTheOtherWay) {
    VehicleConfig vehicle;
    vehicle.wheelbase = -vehicle.wheelbase;
    const StateGrid grid = thesis_hall();
    const Pose2d start(0.0, 1.6, 0.0);
    const Route route =
        plan_route(ClearanceField(grid), vehicle, start, {at(1.30, -0.15), at(-2.40, -1.60)});
    Loop loop(vehicle, start, 11);
    const Drive done = drive(loop, grid, vehicle, route);
    EXPECT_EQ(done.status, FollowerStatus::kArrived);
    EXPECT_FALSE(done.touched);
    EXPECT_LT(done.stop_error, 0.02);
    EXPECT_LT(done.passed_within[0], 0.05);
}

TEST(Follower, ArrivesAtOnceWhereItStands) {
    const VehicleConfig vehicle;
    const ClearanceField field(room(10.0, 8.0));
    for (const auto& waypoints : {std::vector<Waypoint>{}, std::vector<Waypoint>{at(0.0, 0.0)}}) {
        const Route route = plan_route(field, vehicle, {}, waypoints);
        Loop loop(vehicle, {}, 12);
        const FollowerStep first = loop.step(route, {});
        EXPECT_EQ(first.status, FollowerStatus::kNoPose);
        FollowerStep result;
        for (int i = 0; i < 20; ++i) {
            result = loop.step(route, {});
        }
        EXPECT_EQ(result.status, FollowerStatus::kArrived);
        EXPECT_EQ(result.waypoints_reached, waypoints.size());
    }
}

TEST(Follower, RefusesWhatMakesNoSense) {
    FollowerState state;
    EXPECT_EQ(error_of([&] { follow({}, {}, {}, state, {}); }),
              "follower: there is no way to follow");
    const Manoeuvre way;
    FollowerInput input;
    input.seconds = 0.0;
    EXPECT_EQ(error_of([&] { follow(way.route, way.vehicle, {}, state, input); }),
              "follower: a time step must be positive");
    state.leg_end = way.route.points.size();
    EXPECT_EQ(error_of([&] { follow(way.route, way.vehicle, {}, state, {}); }),
              "follower: its state is that of another way");
}

TEST(FollowerConfig, ItsValuesAreAllWithinTheirLimits) {
    FollowerConfig config;
    ConfigSchema schema;
    describe(schema, config);
    EXPECT_EQ(schema.fields().size(), 13U);
    for (const ConfigField& field : schema.fields()) {
        EXPECT_NO_THROW(field.set(field.get())) << field.key;
    }
}

}  // namespace
}  // namespace hybrid_slam::test
