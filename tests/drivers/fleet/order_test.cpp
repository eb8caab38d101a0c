// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet_truck.hpp"

namespace hybrid_slam {
namespace {

using test::FleetTruck;
using test::Json;
using test::order;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(FleetOrder, ReleasedNodesBehindTheFirstAreDriven) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 3, 2));
    EXPECT_EQ(test::goals_of(truck), "o:0=1,2, ");
    const Json state = truck.state();
    EXPECT_EQ(state["orderId"], "o");
    EXPECT_EQ(state["orderUpdateId"], 0);
    EXPECT_EQ(state["lastNodeId"], "n0");
    EXPECT_EQ(test::nodes_left(state), "n1 n2 (n3) (n4) ");
    EXPECT_EQ(state["edgeStates"].size(), 4u);
    EXPECT_EQ(state["edgeStates"][0]["edgeId"], "e0");
    EXPECT_EQ(state["edgeStates"][2]["released"], false);
    EXPECT_THAT(truck.error_types(), IsEmpty());
}

TEST(FleetOrder, AHeadingIsPassedOnAndNoneIsAny) {
    FleetTruck truck;
    Json message = order("o", 0, 0, 3);
    message["nodes"][1]["nodePosition"]["theta"] = 1.5;
    truck.send_order(message);
    const auto& goals = std::get<LinkGoals>(truck.events.at(0));
    EXPECT_EQ(goals.waypoints[0].heading, 1.5);
    EXPECT_FALSE(goals.waypoints[1].heading);
}

TEST(FleetOrder, NodesArePassedOneByOne) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 3));
    truck.tell();
    EXPECT_EQ(truck.state()["lastNodeId"], "n0");
    truck.drive();
    Json state = truck.state();
    EXPECT_EQ(state["lastNodeId"], "n1");
    EXPECT_EQ(state["lastNodeSequenceId"], 2);
    EXPECT_EQ(test::nodes_left(state), "n2 ");
    EXPECT_EQ(state["edgeStates"].size(), 1u);
    truck.drive();
    state = truck.state();
    EXPECT_EQ(state["lastNodeId"], "n2");
    EXPECT_EQ(test::nodes_left(state), "");
    EXPECT_EQ(state["orderId"], "o") << "kept until a new order comes";
    EXPECT_THAT(truck.error_types(), IsEmpty());
}

TEST(FleetOrder, AnUpdateContinuesWhileDriving) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2, 2));
    truck.tell();
    truck.send_order(order("o", 1, 1, 3, 1));
    EXPECT_EQ(test::goals_of(truck), "o:0=1, o:1+2,3, ");
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 n2 n3 (n4) ");
    truck.drive();
    EXPECT_EQ(truck.state()["lastNodeId"], "n1");
    truck.drive();
    truck.drive();
    const Json state = truck.state();
    EXPECT_EQ(state["lastNodeId"], "n3");
    EXPECT_EQ(state["orderUpdateId"], 1);
    EXPECT_EQ(test::nodes_left(state), "(n4) ");
}

/// Before the drive took the second goals its count is of the first.
TEST(FleetOrder, AnUpdateThatTheDriveHasNotTakenYetIsNotPassed) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2));
    truck.tell();
    truck.protocol.take_order(order("o", 1, 1, 3).dump(), truck.now);
    truck.drive();  // tells "o:0" and none left
    EXPECT_EQ(truck.state()["lastNodeId"], "n1");
    EXPECT_EQ(test::nodes_left(truck.state()), "n2 n3 ");
    truck.tell();
    truck.drive();
    truck.drive();
    EXPECT_EQ(truck.state()["lastNodeId"], "n3");
}

TEST(FleetOrder, AnUpdateContinuesADoneOrder) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2));
    truck.drive();
    truck.send_order(order("o", 5, 1, 2));
    EXPECT_EQ(test::goals_of(truck), "o:0=1, o:5+2, ");
    truck.drive();
    EXPECT_EQ(truck.state()["lastNodeId"], "n2");
    EXPECT_EQ(truck.state()["orderUpdateId"], 5);
}

TEST(FleetOrder, AnUpdateMayOnlyChangeTheHorizon) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2, 3));
    truck.send_order(order("o", 1, 1, 1, 1));
    EXPECT_EQ(test::goals_of(truck), "o:0=1, ");
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 (n2) ");
    truck.send_order(order("o", 2, 1, 1));
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 ");
    truck.drive();
    EXPECT_EQ(test::nodes_left(truck.state()), "");
}

TEST(FleetOrder, ABaseIsRequestedBeforeItEnds) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 3, 1));
    EXPECT_EQ(truck.state()["newBaseRequest"], false);
    truck.drive();
    EXPECT_EQ(truck.state()["newBaseRequest"], true);
    truck.drive();
    EXPECT_EQ(truck.state()["newBaseRequest"], true);
    truck.send_order(order("o", 1, 2, 2));
    EXPECT_EQ(truck.state()["newBaseRequest"], false) << "nothing more was announced";
}

TEST(FleetOrder, AnOrderMayReturnToANode) {
    FleetTruck truck;
    Json message = order("o", 0, 0, 3);
    message["nodes"][2]["nodeId"] = "n0";
    message["nodes"][2]["nodePosition"]["x"] = 0.0;
    message["edges"][1]["endNodeId"] = "n0";
    truck.send_order(message);
    truck.drive();
    EXPECT_EQ(test::nodes_left(truck.state()), "n0 ");
    truck.drive();
    EXPECT_EQ(truck.state()["lastNodeId"], "n0");
    EXPECT_EQ(truck.state()["lastNodeSequenceId"], 4);
}

TEST(FleetOrder, OneNodeUnderTheVehicleIsDoneAtOnce) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 1));
    EXPECT_THAT(truck.events, IsEmpty());
    EXPECT_EQ(truck.state()["lastNodeId"], "n0");
    EXPECT_EQ(test::nodes_left(truck.state()), "");
    truck.send_order(order("p", 0, 0, 2));
    EXPECT_EQ(test::goals_of(truck), "p:0=1, ");
}

TEST(FleetOrder, TheSameUpdateAgainIsNoError) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2));
    truck.send_order(order("o", 0, 0, 2));
    EXPECT_EQ(test::goals_of(truck), "o:0=1, ");
    EXPECT_THAT(truck.error_types(), IsEmpty());
    EXPECT_EQ(truck.protocol.counts().orders_repeated, 1u);
}

TEST(FleetOrder, WhatAnUpdateSaysOfItsFirstNodeIsNotRead) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2, 1));
    Json update = order("o", 1, 1, 2);
    update["nodes"][0].erase("nodePosition");
    update["nodes"][0]["actions"].push_back(test::action("a", "pick"));
    truck.send_order(update);
    EXPECT_EQ(test::goals_of(truck), "o:0=1, o:1+2, ");
}

TEST(FleetOrder, ByHandNoneIsTakenAndTheOneThereIsGoes) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 3));
    truck.tell();
    truck.status.drive.mode = LinkMode::kManual;
    truck.tell();
    EXPECT_EQ(std::get<LinkCommand>(truck.events.back()), LinkCommand::kCancel);
    EXPECT_EQ(truck.state()["operatingMode"], "MANUAL");
    EXPECT_EQ(test::nodes_left(truck.state()), "");
    EXPECT_THAT(truck.error_types(), ElementsAre("orderCleared"));
    truck.send_order(order("p", 0, 0, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("orderCleared", "orderError"));
    truck.status.drive.mode = LinkMode::kAutomatic;
    truck.tell();
    truck.send_order(order("o", 1, 2, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("orderCleared", "orderError", "orderUpdateError"));
    truck.send_order(order("p", 0, 0, 2));
    EXPECT_EQ(test::goals_of(truck), "o:0=1,2, p:0=1, ");
    EXPECT_THAT(truck.error_types(), IsEmpty());
}

TEST(FleetOrder, OthersGoalsTakeItsPlace) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 3));
    truck.tell();
    truck.status.drive.goals = "a person's";
    truck.queue.resize(1);
    truck.tell();
    EXPECT_THAT(truck.error_types(), ElementsAre("orderCleared"));
    EXPECT_EQ(test::nodes_left(truck.state()), "");
    EXPECT_EQ(truck.state()["lastNodeId"], "n0");
}

/// The drive's first statuses after an order may still be of the time before.
TEST(FleetOrder, WhatTheDriveDidBeforeIsNotTheOrders) {
    FleetTruck truck;
    truck.status.drive.goals = "a person's";
    truck.status.drive.state = LinkDriveState::kArrived;
    truck.tell();
    truck.protocol.take_order(order("o", 0, 0, 3).dump(), truck.now);
    truck.protocol.update(truck.status, truck.now);
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 n2 ");
    truck.take_events();
    truck.drive();
    EXPECT_EQ(test::nodes_left(truck.state()), "n2 ");
}

TEST(FleetOrder, AfterOthersGoalsADoneOrderCanGoOn) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2));
    truck.drive();
    truck.status.drive.goals = "a person's";
    truck.tell();
    truck.protocol.take_order(order("o", 1, 1, 2).dump(), truck.now);
    truck.protocol.update(truck.status, truck.now);
    EXPECT_EQ(test::nodes_left(truck.state()), "n2 ");
    truck.take_events();
    truck.drive();
    EXPECT_EQ(truck.state()["lastNodeId"], "n2");
}

TEST(FleetOrder, GoalsThatAreGivenUpAreTold) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 3));
    truck.tell();
    truck.queue.clear();
    truck.status.drive.state = LinkDriveState::kIdle;
    truck.status.drive.reason = "there is no way to it";
    truck.tell();
    const Json state = truck.state();
    EXPECT_THAT(truck.error_types(), ElementsAre("orderCleared"));
    EXPECT_EQ(state["errors"][0]["errorDescription"],
              "the drive gave the goals up: there is no way to it");
    EXPECT_EQ(test::nodes_left(state), "");
}

TEST(FleetOrder, WhatTheDriveRefusesIsOver) {
    FleetTruck truck;
    truck.protocol.refuse("nothing to refuse");
    EXPECT_THAT(truck.error_types(), IsEmpty());
    truck.send_order(order("o", 0, 0, 3));
    truck.protocol.refuse("too many goals");
    EXPECT_THAT(truck.error_types(), ElementsAre("orderError"));
    EXPECT_EQ(truck.state()["errors"][0]["errorDescription"], "too many goals");
    EXPECT_EQ(test::nodes_left(truck.state()), "");
}

}  // namespace
}  // namespace hybrid_slam
