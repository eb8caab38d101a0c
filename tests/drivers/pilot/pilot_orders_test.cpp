// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "piloted_truck.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::PilotedTruck;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Section 4.4 of the thesis.
const Point2 kFirst{1.30, -0.15};
const Point2 kSecond{-2.40, -1.60};

TEST(PilotOrders, PassesTheFirstPlaceAndStopsAtTheSecond) {
    PilotedTruck truck;
    truck.go_to({kFirst, kSecond});
    double nearest_first = HUGE_VAL;
    int most_left = 0;
    EXPECT_TRUE(truck.run(120.0, [&] {
        nearest_first = std::min(nearest_first, truck.away_from(kFirst));
        most_left = std::max(most_left, truck.out.status.waypoints_left);
        return truck.arrived();
    }));
    EXPECT_EQ(most_left, 2);
    EXPECT_LT(nearest_first, 0.03);
    EXPECT_LT(truck.away_from(kSecond), 0.02);
    EXPECT_EQ(truck.out.status.waypoints_left, 0);
    EXPECT_EQ(truck.out.status.goals, "tour");
    EXPECT_EQ(truck.pilot().route(), nullptr);
    truck.run(1.0);
    EXPECT_FALSE(truck.out.command.has_value()) << "the power may go off";
    EXPECT_TRUE(truck.arrived()) << "still";
}

TEST(PilotOrders, AreAppendedOrReplaced) {
    PilotedTruck truck;
    truck.go_to({kFirst});
    truck.go_to({kSecond}, true);
    EXPECT_TRUE(truck.run(60.0, [&] { return truck.out.status.waypoints_left == 1; }));
    EXPECT_LT(truck.away_from(kFirst), 0.02) << "each order is an end of its own";
    truck.run(3.0);
    truck.go_to({kFirst});
    EXPECT_TRUE(truck.run(60.0, [&] { return truck.arrived(); }));
    EXPECT_LT(truck.away_from(kFirst), 0.02);
}

TEST(PilotOrders, CancelStopsAndForgets) {
    PilotedTruck truck;
    truck.go_to({kFirst, kSecond});
    ASSERT_TRUE(truck.run(20.0, [&] { return std::abs(truck.truck().speed) > 0.2; }));
    truck.tell(LinkCommand::kCancel);
    truck.run(0.04);
    EXPECT_EQ(truck.out.command->speed, 0.0);
    truck.run(2.0);
    EXPECT_TRUE(truck.stands());
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kIdle);
    EXPECT_EQ(truck.out.status.reason, "cancelled");
    truck.tell(LinkCommand::kResume);
    truck.run(5.0);
    EXPECT_TRUE(truck.stands());
}

TEST(PilotOrders, PauseHoldsUntilResume) {
    PilotedTruck truck;
    truck.go_to({kFirst});
    ASSERT_TRUE(truck.run(20.0, [&] { return std::abs(truck.truck().speed) > 0.2; }));
    truck.tell(LinkCommand::kPause);
    truck.run(3.0);
    EXPECT_TRUE(truck.stands());
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused);
    EXPECT_EQ(truck.out.status.waypoints_left, 1);
    truck.tell(LinkCommand::kResume);
    EXPECT_TRUE(truck.run(60.0, [&] { return truck.arrived(); }));
    EXPECT_LT(truck.away_from(kFirst), 0.02);
}

TEST(PilotOrders, ManualModeStopsThenSendsNothing) {
    PilotedTruck truck;
    truck.go_to({kFirst});
    ASSERT_TRUE(truck.run(20.0, [&] { return std::abs(truck.truck().speed) > 0.2; }));
    truck.tell(LinkCommand::kManual);
    truck.run(0.04);
    EXPECT_FALSE(truck.out.manual) << "it still rolls";
    EXPECT_EQ(truck.out.command->speed, 0.0);
    truck.run(2.0);
    EXPECT_TRUE(truck.out.manual);
    EXPECT_FALSE(truck.out.command.has_value());
    EXPECT_EQ(truck.out.status.mode, LinkMode::kManual);
    truck.go_to({kSecond});
    truck.run(1.0);
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("manual mode")));
    truck.tell(LinkCommand::kAutomatic);
    truck.run(1.0);
    EXPECT_FALSE(truck.out.manual);
    EXPECT_TRUE(truck.stands()) << "what was sent in manual mode or before is forgotten";
    truck.go_to({kSecond});
    EXPECT_TRUE(truck.run(90.0, [&] { return truck.arrived(); }));
}

TEST(PilotOrders, CanBeginInManualMode) {
    PilotConfig config;
    config.starts_automatic = false;
    PilotedTruck truck(config);
    truck.run(1.0);
    EXPECT_TRUE(truck.out.manual);
    truck.go_to({kFirst});
    truck.run(1.0);
    EXPECT_EQ(truck.refusals.size(), 1U);
}

TEST(PilotOrders, WhatCannotBeReachedIsRefusedByName) {
    PilotedTruck truck;
    truck.go_to({kFirst, {7.0, 0.0}});
    truck.go_to({kSecond}, true);
    truck.run(1.0);
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("waypoint 2 (7.00, 0.00)")));
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kIdle);
    EXPECT_THAT(truck.out.status.reason, HasSubstr("waypoint 2"));
    EXPECT_EQ(truck.out.status.waypoints_left, 0) << "what came behind it goes as well";
    EXPECT_TRUE(truck.stands());
}

TEST(PilotOrders, ALatePlanForWhatIsNotWantedAnyMoreIsPassedOver) {
    PilotedTruck truck;
    truck.plans = false;
    truck.go_to({kFirst});
    truck.run(1.0);
    const std::optional<RouteRequest> request = truck.pilot().wanted_route();
    ASSERT_TRUE(request.has_value());
    EXPECT_EQ(truck.out.status.reason, "looking for a way");
    truck.tell(LinkCommand::kCancel);
    truck.run(0.1);
    EXPECT_FALSE(truck.pilot().wanted_route().has_value());
    truck.pilot().take(request->number, Route());
    truck.run(0.1);
    EXPECT_TRUE(truck.refusals.empty());
    EXPECT_EQ(truck.out.status.reason, "cancelled");
}

TEST(PilotOrders, AnInitialPoseIsPassedOnWhileItStandsWithoutPlaces) {
    PilotedTruck truck;
    const LinkInitialPose told{{1.0, 2.0, 0.5}};
    bool passed = false;
    const auto look = [&] {
        passed = passed || truck.out.initial_pose.has_value();
        return false;
    };
    truck.slam_talks = false;
    truck.tell(told);
    truck.run(0.1, look);
    EXPECT_FALSE(passed);
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("no SLAM is connected")));
    truck.slam_talks = true;
    truck.run(0.5);
    truck.tell(told);
    truck.run(0.1, look);
    EXPECT_TRUE(passed);
    // The jump that follows is wanted.
    truck.spoil = [](LinkEvent&, LinkPose& pose) { pose.map_from_robot.translation.x() += 2.0; };
    truck.run(0.5);
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kIdle);
    truck.spoil = {};
    truck.run(0.5);
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused) << "and the next one is not";
    truck.tell(LinkCommand::kResume);
    truck.go_to({kFirst});
    truck.run(0.5);
    truck.refusals.clear();
    passed = false;
    truck.tell(told);
    truck.run(0.1, look);
    EXPECT_FALSE(passed);
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("must stand")));
}

/// SLAM was right already, so nothing jumps; a jump later on is none that somebody wanted.
TEST(PilotOrders, AnInitialPoseExcusesNoJumpOnTheWay) {
    PilotedTruck truck;
    truck.run(0.5);
    truck.tell(LinkInitialPose{truck.truck().world_from_robot});
    truck.run(0.5);
    truck.go_to({kFirst});
    ASSERT_TRUE(truck.run(20.0, [&] { return std::abs(truck.truck().speed) > 0.2; }));
    truck.spoil = [](LinkEvent&, LinkPose& pose) { pose.map_from_robot.translation.x() += 2.0; };
    truck.run(1.0);
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused);
}

TEST(PilotOrders, AreNotHoardedWithoutEnd) {
    PilotedTruck truck;
    truck.tell(LinkCommand::kPause);
    const std::vector<Point2> many(256, kFirst);
    for (int i = 0; i < 10; ++i) {
        truck.go_to(many, true);
        truck.run(0.02);
    }
    EXPECT_LE(truck.out.status.waypoints_left, 1300);
    EXPECT_THAT(truck.refusals.back(), HasSubstr("too many"));
}

TEST(PilotOrders, NothingButResumeEndsAPause) {
    PilotedTruck truck;
    truck.tell(LinkCommand::kPause);
    truck.go_to({kFirst});
    truck.run(3.0);
    EXPECT_TRUE(truck.stands());
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused);
    EXPECT_EQ(truck.out.status.waypoints_left, 1);
    truck.tell(LinkCommand::kCancel);
    truck.go_to({kSecond});
    truck.run(3.0);
    EXPECT_TRUE(truck.stands());
    truck.tell(LinkCommand::kResume);
    EXPECT_TRUE(truck.run(90.0, [&] { return truck.arrived(); }));
    EXPECT_LT(truck.away_from(kSecond), 0.02);
}

TEST(PilotOrders, AreRefusedWhileTheDriveHasAFault) {
    PilotedTruck truck;
    truck.drive_fault = "the truck is silent";
    truck.run(1.0);
    truck.go_to({kFirst});
    truck.run(1.0);
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("fault: the truck is silent")));
    truck.drive_fault.clear();
    truck.run(3.0);
    EXPECT_TRUE(truck.stands()) << "what was refused is not done later";
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kIdle);
    truck.go_to({kFirst});
    EXPECT_TRUE(truck.run(60.0, [&] { return truck.arrived(); }));
}

TEST(PilotOrders, ThatWaitedForADriveThatWasHeldUpAreRefused) {
    PilotedTruck truck;
    truck.run(0.5);
    truck.tell(LinkCommand::kPause);
    truck.run(0.1);
    LinkGoals goals;
    goals.waypoints.push_back({kFirst, std::nullopt});
    truck.tell(goals);
    truck.tell(LinkCommand::kResume);
    truck.hang(1.5);
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("goals: the drive was held up"),
                                            HasSubstr("resume: the drive was held up")));
    truck.run(3.0);
    EXPECT_TRUE(truck.stands());
    truck.tell(LinkCommand::kPause);
    truck.tell(LinkCommand::kCancel);
    truck.hang(1.5);
    EXPECT_EQ(truck.refusals.size(), 2U) << "to stop is never too late";
}

TEST(PilotOrders, AWayNotFoundEndsOnlyTheOrderThatItWasFor) {
    PilotedTruck truck;
    truck.plans = false;
    truck.go_to({kFirst});
    truck.run(1.0);
    const std::optional<RouteRequest> first = truck.pilot().wanted_route();
    ASSERT_TRUE(first);
    truck.told_speed = 0.01;  // rolls on a slope, so that the order waits for its end
    truck.run(0.1);
    truck.go_to({kSecond});
    truck.run(0.1);
    Route none;
    none.status = PlanStatus::kNoWay;
    truck.pilot().take(first->number, none);
    truck.told_speed.reset();
    truck.plans = true;
    EXPECT_TRUE(truck.run(90.0, [&] { return truck.arrived(); }));
    EXPECT_LT(truck.away_from(kSecond), 0.02);
    EXPECT_TRUE(truck.refusals.empty());
}

TEST(PilotOrders, AClientThatIsGoneMatters) {
    for (const bool needs : {false, true}) {
        PilotConfig config;
        config.needs_goal_client = needs;
        PilotedTruck truck(config);
        truck.go_to({kFirst});
        ASSERT_TRUE(truck.run(20.0, [&] { return std::abs(truck.truck().speed) > 0.2; }));
        truck.tell(LinkDisconnected{"closed"}, 77);
        truck.run(0.1);
        EXPECT_EQ(truck.out.status.state, LinkDriveState::kDriving) << "that was another client";
        truck.tell(LinkDisconnected{"closed"});
        EXPECT_EQ(truck.run(60.0, [&] { return truck.arrived(); }), !needs);
        if (needs) {
            EXPECT_TRUE(truck.stands());
            EXPECT_EQ(truck.out.status.reason, "the goal client is gone");
        }
    }
}

TEST(PilotOrders, TheSameInputGivesTheSameWay) {
    PilotedTruck first;
    PilotedTruck second;
    for (PilotedTruck* const truck : {&first, &second}) {
        truck->go_to({kFirst, kSecond});
        truck->run(30.0);
    }
    EXPECT_EQ(first.truck().world_from_robot.vector(), second.truck().world_from_robot.vector());
}

TEST(Pilot, ChecksItsConfig) {
    PilotConfig config;
    config.pose_valid = 100.0;
    VehicleConfig stub;
    stub.wheelbase = 0.0;
    EXPECT_THAT(error_of([&] { Pilot(stub, {}, ""); }), HasSubstr("vehicle.wheelbase"));
    EXPECT_THAT(error_of([&] { Pilot(VehicleConfig(), config, ""); }),
                HasSubstr("pilot.pose_valid"));
}

}  // namespace
}  // namespace hybrid_slam
