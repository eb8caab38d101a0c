// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet_truck.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using test::action;
using test::FleetTruck;
using test::init_position;
using test::Json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

LinkCommand last_command(const FleetTruck& truck) {
    return std::get<LinkCommand>(truck.events.back());
}

TEST(FleetAction, APauseIsFinishedWhenTheVehicleStands) {
    FleetTruck truck;
    truck.status.drive.speed = 0.3;
    truck.send_actions(action("a", "startPause"));
    EXPECT_EQ(last_command(truck), LinkCommand::kPause);
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "RUNNING");
    EXPECT_EQ(truck.state()["paused"], true);
    truck.status.drive.speed = 0.0;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
    truck.send_actions(action("b", "stopPause"));
    EXPECT_EQ(last_command(truck), LinkCommand::kResume);
    truck.tell();
    EXPECT_EQ(truck.action_status("b"), "FINISHED");
    EXPECT_EQ(truck.state()["paused"], false);
}

TEST(FleetAction, ADriveThatOnlyTellsItsStateCanBePaused) {
    FleetTruck truck;
    truck.send_actions(action("a", "startPause"));
    truck.status.is_paused = false;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "RUNNING");
    truck.status.drive.state = LinkDriveState::kPaused;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
}

TEST(FleetAction, APauseIsOvertakenByItsEnd) {
    FleetTruck truck;
    truck.status.drive.speed = 0.3;
    truck.send_actions(Json::array({action("a", "startPause"), action("b", "stopPause")}));
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FAILED");
    EXPECT_EQ(truck.action_status("b"), "FINISHED");
}

TEST(FleetAction, AnOrderOutlastsAPause) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    truck.send_actions(action("a", "startPause"));
    truck.tell();
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 n2 ");
    truck.send_actions(action("b", "stopPause"));
    truck.drive();
    EXPECT_EQ(test::nodes_left(truck.state()), "n2 ");
}

/// New goals set a drive going, as the truck here does too.
TEST(FleetAction, APauseOutlastsANewOrder) {
    FleetTruck truck;
    truck.send_actions(action("a", "startPause"));
    truck.tell();
    truck.send_order(test::order("o", 0, 0, 3));
    truck.tell();
    EXPECT_EQ(truck.state()["paused"], true);
    truck.send_actions(action("b", "stopPause"));
    truck.tell();
    EXPECT_EQ(truck.state()["paused"], false);
    EXPECT_EQ(truck.action_status("b"), "FINISHED");
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 n2 ");
}

TEST(FleetAction, APauseThatTheDriveHasNotTakenYetOutlastsANewOrder) {
    FleetTruck truck;
    truck.protocol.take_instant_actions(test::instant(action("a", "startPause")).dump(), truck.now);
    truck.send_order(test::order("o", 0, 0, 3));
    EXPECT_EQ(last_command(truck), LinkCommand::kPause);
    EXPECT_EQ(truck.events.size(), 3u);
}

TEST(FleetAction, ByHandNothingIsPaused) {
    FleetTruck truck;
    truck.status.drive.mode = LinkMode::kManual;
    truck.tell();
    truck.send_actions(action("a", "startPause"));
    EXPECT_THAT(truck.events, IsEmpty());
    EXPECT_EQ(truck.action_status("a"), "FAILED");
}

TEST(FleetAction, TakingOverEndsWhatWaitsForTheDrive) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    truck.status.drive.speed = 0.3;
    truck.send_actions(Json::array({action("a", "startPause"), action("b", "cancelOrder")}));
    truck.queue.resize(2);
    truck.tell();
    EXPECT_EQ(truck.action_status("b"), "RUNNING");
    truck.status.drive.mode = LinkMode::kManual;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FAILED");
    EXPECT_EQ(truck.action_status("b"), "FINISHED");
    EXPECT_EQ(test::nodes_left(truck.state()), "");
}

TEST(FleetAction, ACancelledOrderEndsWhenTheVehicleStands) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    truck.drive();
    truck.send_actions(action("a", "cancelOrder"));
    EXPECT_EQ(last_command(truck), LinkCommand::kCancel);
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "RUNNING");
    EXPECT_EQ(test::nodes_left(truck.state()), "n2 ");
    truck.send_order(test::order("p", 0, 1, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("orderError")) << "not before it stands";
    truck.status.drive.speed = 0.0;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
    const Json state = truck.state();
    EXPECT_EQ(test::nodes_left(state), "");
    EXPECT_EQ(state["edgeStates"].size(), 0u);
    EXPECT_EQ(state["orderId"], "o");
    EXPECT_EQ(state["lastNodeId"], "n1");
}

TEST(FleetAction, ACancelledOrderCannotGoOnButANewOneCan) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    truck.send_actions(action("a", "cancelOrder"));
    truck.tell();
    truck.send_order(test::order("o", 1, 2, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("orderUpdateError"));
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
    truck.send_order(test::order("p", 0, 0, 2));
    EXPECT_THAT(truck.error_types(), IsEmpty());
    EXPECT_EQ(truck.action_status("a"), "") << "forgotten with the new order";
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 ");
}

TEST(FleetAction, TwoCancelsEndTogether) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    truck.status.drive.speed = 0.3;
    truck.send_actions(action("a", "cancelOrder"));
    truck.send_actions(action("b", "cancelOrder"));
    truck.status.drive.speed = 0.0;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
    EXPECT_EQ(truck.action_status("b"), "FINISHED");
    EXPECT_THAT(truck.error_types(), IsEmpty());
}

TEST(FleetAction, ACancelEndsThoughOthersGoalsAreDriven) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    truck.tell();
    truck.protocol.take_instant_actions(test::instant(action("a", "cancelOrder")).dump(),
                                        truck.now);
    truck.status.drive.goals = "a person's";
    truck.status.drive.speed = 0.3;
    truck.protocol.update(truck.status, truck.now);
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
}

TEST(FleetAction, WithoutAnOrderACancelFails) {
    FleetTruck truck;
    truck.send_actions(action("a", "cancelOrder"));
    EXPECT_THAT(truck.events, IsEmpty());
    EXPECT_EQ(truck.action_status("a"), "FAILED");
    const Json errors = truck.state()["errors"];
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_EQ(errors[0]["errorType"], "noOrderToCancel");
    EXPECT_EQ(errors[0]["errorLevel"], "WARNING");
    EXPECT_EQ(errors[0]["errorReferences"][0]["referenceKey"], "actionId");
    EXPECT_EQ(errors[0]["errorReferences"][0]["referenceValue"], "a");
}

TEST(FleetAction, TheSameActionAgainIsIgnored) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    truck.send_actions(action("a", "cancelOrder"));
    truck.tell();
    truck.send_actions(action("a", "cancelOrder"));
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
    EXPECT_THAT(truck.error_types(), IsEmpty());
}

TEST(FleetAction, AnInitialPoseIsFinishedWhenAPoseAgrees) {
    FleetTruck truck;
    truck.send_actions(init_position("a", 5.0, 2.0, 1.5));
    const auto& start = std::get<FleetInitialPose>(truck.events.back());
    EXPECT_EQ(start.map, "hall");
    EXPECT_THAT(start.map_from_robot, test::PoseNear(Pose2d(5.0, 2.0, 1.5), 0.0, 0.0));
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "RUNNING") << "the pose is still the old one";
    truck.status.pose->map_from_robot = {5.2, 1.9, 1.4};
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
    const Json state = truck.state();
    EXPECT_EQ(state["lastNodeId"], "dock");
    EXPECT_EQ(state["lastNodeSequenceId"], 0);
}

TEST(FleetAction, AnInitialPoseNeedsANewPose) {
    FleetTruck truck;
    truck.send_actions(init_position("a", 0.0, 0.0, 0.0));
    truck.protocol.update(truck.status, truck.now + 0.02);
    EXPECT_EQ(truck.action_status("a"), "RUNNING") << "this one was there before";
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
}

TEST(FleetAction, AnInitialPoseThatIsNotFoundFails) {
    FleetTruck truck;
    truck.send_actions(init_position("a", 5.0, 2.0, 1.5));
    truck.now += 9.0;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "RUNNING");
    truck.now += 1.0;
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FAILED");
    EXPECT_EQ(truck.state()["lastNodeId"], "");
}

TEST(FleetAction, ALaterInitialPoseOvertakes) {
    FleetTruck truck;
    truck.send_actions(init_position("a", 5.0, 2.0, 1.5));
    truck.send_actions(init_position("b", 0.0, 0.0, 0.0));
    truck.tell();
    EXPECT_EQ(truck.action_status("a"), "FAILED");
    EXPECT_EQ(truck.action_status("b"), "FINISHED");
}

TEST(FleetAction, AnInitialPoseIsRefusedInTheMiddleOfAnOrder) {
    FleetTruck truck;
    truck.send_order(test::order("o", 0, 0, 3));
    const std::size_t before = truck.events.size();
    truck.send_actions(init_position("a", 0.0, 0.0, 0.0));
    EXPECT_EQ(truck.events.size(), before);
    EXPECT_EQ(truck.action_status("a"), "FAILED");
}

TEST(FleetAction, AnInitialPoseMustBeComplete) {
    for (std::size_t missing = 0; missing < 5; ++missing) {
        FleetTruck truck;
        Json message = init_position("a", 0.0, 0.0, 0.0);
        message["actionParameters"].erase(missing);
        truck.send_actions(message);
        EXPECT_THAT(truck.events, IsEmpty()) << missing;
        EXPECT_EQ(truck.action_status("a"), "FAILED") << missing;
        EXPECT_THAT(truck.error_types(), ElementsAre("validationError")) << missing;
        message = init_position("a", 0.0, 0.0, 0.0);
        message["actionParameters"][missing]["value"] = Json::array();
        FleetTruck other;
        other.send_actions(message);
        EXPECT_EQ(other.action_status("a"), "FAILED") << missing;
    }
    FleetTruck truck;
    Json attic = init_position("a", 0.0, 0.0, 0.0);
    attic["actionParameters"][3]["value"] = "attic";
    truck.send_actions(attic);
    EXPECT_EQ(truck.action_status("a"), "FAILED");
}

TEST(FleetAction, AStateIsSentAtOnce) {
    FleetTruck truck;
    truck.state();
    EXPECT_THAT(truck.protocol.due(truck.now), IsEmpty());
    truck.send_actions(action("a", "stateRequest"));
    const auto messages = truck.protocol.due(truck.now);
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_EQ(test::topic_name(messages[0]), "state");
    EXPECT_EQ(Json::parse(messages[0].payload)["actionStates"][0]["actionStatus"], "FINISHED");
}

TEST(FleetAction, AFactsheetIsSentAtOnce) {
    FleetTruck truck;
    truck.state();
    truck.send_actions(action("a", "factsheetRequest"));
    const auto messages = truck.protocol.due(truck.now);
    ASSERT_EQ(messages.size(), 2u);
    EXPECT_EQ(test::topic_name(messages[0]), "factsheet");
    EXPECT_TRUE(messages[0].is_retained);
    EXPECT_EQ(truck.action_status("a"), "FINISHED");
}

TEST(FleetAction, AnUnknownOneFailsAndTheNextIsDone) {
    FleetTruck truck;
    truck.send_actions(Json::array({action("a", "dance"), action("b", "stateRequest")}));
    EXPECT_EQ(truck.action_status("a"), "FAILED");
    EXPECT_EQ(truck.action_status("b"), "FINISHED");
    EXPECT_THAT(truck.error_types(), ElementsAre("validationError"));
    EXPECT_EQ(truck.protocol.counts().actions, 1u);
    EXPECT_EQ(truck.protocol.counts().actions_refused, 1u);
}

TEST(FleetAction, ManyAreForgottenButNotThoseThatRun) {
    FleetTruck truck;
    truck.send_actions(init_position("first", 5.0, 2.0, 1.5));
    for (int i = 0; i < 300; ++i) {
        truck.send_actions(action("a" + std::to_string(i), "stateRequest"));
    }
    EXPECT_EQ(truck.state()["actionStates"].size(), 100u);
    EXPECT_EQ(truck.action_status("first"), "RUNNING");
    EXPECT_EQ(truck.action_status("a299"), "FINISHED");
    EXPECT_EQ(truck.action_status("a0"), "");
}

TEST(FleetAction, TooManyThatRunAreRefused) {
    FleetTruck truck;
    truck.status.drive.speed = 0.3;
    for (int i = 0; i < 101; ++i) {
        truck.send_actions(action("a" + std::to_string(i), "startPause"));
    }
    EXPECT_EQ(truck.state()["actionStates"].size(), 100u);
    EXPECT_THAT(truck.error_types(), ElementsAre("validationError"));
}

}  // namespace
}  // namespace hybrid_slam
