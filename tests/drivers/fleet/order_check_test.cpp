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
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(FleetOrderCheck, ALowerUpdateIsRefusedAndTheOrderGoesOn) {
    FleetTruck truck;
    truck.send_order(order("o", 3, 0, 2));
    truck.send_order(order("o", 2, 1, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("orderUpdateError"));
    EXPECT_EQ(truck.state()["orderUpdateId"], 3);
    truck.drive();
    EXPECT_EQ(truck.state()["lastNodeId"], "n1");
}

TEST(FleetOrderCheck, AnUpdateMustBeginAtTheEndOfTheBase) {
    for (const std::uint32_t first : {0u, 2u}) {
        FleetTruck truck;
        truck.send_order(order("o", 0, 0, 2, 2));
        truck.send_order(order("o", 1, first, 2));
        EXPECT_THAT(truck.error_types(), ElementsAre("orderUpdateError")) << first;
        EXPECT_EQ(test::nodes_left(truck.state()), "n1 (n2) (n3) ") << first;
    }
}

TEST(FleetOrderCheck, AnotherOrderMustWait) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2));
    truck.send_order(order("p", 0, 0, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("orderError"));
    truck.drive();
    truck.send_order(order("p", 0, 1, 2));
    EXPECT_THAT(truck.error_types(), IsEmpty()) << "gone with the next order";
    EXPECT_EQ(test::goals_of(truck), "o:0=1, p:0=2, ");
}

TEST(FleetOrderCheck, TheFirstNodeIsWhereTheVehicleStands) {
    FleetTruck truck;
    truck.status = test::status_at(0.5, 0.0, 0.0);
    truck.tell();
    truck.send_order(order("o", 0, 0, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("noRouteError"));
    Json wide = order("o", 0, 0, 2);
    wide["nodes"][0]["nodePosition"]["allowedDeviationXY"] = 0.6;
    truck.send_order(wide);
    EXPECT_THAT(truck.error_types(), IsEmpty());
    EXPECT_EQ(test::goals_of(truck), "o:0=1, ");
}

TEST(FleetOrderCheck, TheFirstNodesHeadingCounts) {
    FleetTruck truck;
    truck.status = test::status_at(0.0, 0.0, 3.1);
    truck.tell();
    Json message = order("o", 0, 0, 2);
    message["nodes"][0]["nodePosition"]["theta"] = 2.5;
    truck.send_order(message);
    EXPECT_THAT(truck.error_types(), ElementsAre("noRouteError"));
    message["nodes"][0]["nodePosition"]["allowedDeviationTheta"] = 0.7;
    truck.send_order(message);
    EXPECT_EQ(test::goals_of(truck), "o:0=1, ");
}

TEST(FleetOrderCheck, TheFirstNodesHeadingIsComparedAcrossPi) {
    FleetTruck truck;
    truck.status = test::status_at(0.0, 0.0, 3.1);
    truck.tell();
    Json message = order("o", 0, 0, 2);
    message["nodes"][0]["nodePosition"]["theta"] = -3.1;
    truck.send_order(message);
    EXPECT_EQ(test::goals_of(truck), "o:0=1, ");
}

TEST(FleetOrderCheck, AVehicleThatDoesNotKnowItsPlaceTakesNone) {
    for (const bool is_old : {false, true}) {
        FleetTruck truck;
        truck.status.drive.pose_age = is_old ? 2.0 : 0.0;
        truck.status.pose->status = is_old ? LinkPoseStatus::kTracking : LinkPoseStatus::kLost;
        truck.tell();
        truck.send_order(order("o", 0, 0, 2));
        EXPECT_THAT(test::goals_of(truck), IsEmpty());
        EXPECT_THAT(truck.error_types(), ElementsAre("noRouteError", "localizationError"));
    }
}

TEST(FleetOrderCheck, AVehicleOfASilentDriveTakesNone) {
    FleetTruck truck;
    truck.now += 10.0;
    truck.send_order(order("o", 0, 0, 2));
    EXPECT_THAT(truck.error_types(), ElementsAre("noRouteError", "driveSilent"));
}

struct Infeasible {
    const char* path;
    Json value;
    const char* key;  ///< of the reference that names the wrong member
};

TEST(FleetOrderCheck, WhatTheVehicleCannotDoIsRefused) {
    const Json action = Json::array({test::action("a", "pick")});
    const std::vector<Infeasible> cases = {
        {"/nodes/1/actions", action, "actionId"},
        {"/edges/0/actions", action, "actionId"},
        {"/nodes/1/nodePosition/mapId", "attic", "mapId"},
        {"/nodes/1/nodePosition", nullptr, "nodeId"},
        {"/zoneSetId", "zones", "zoneSetId"},
        {"/edges/0/maxSpeed", 0.29, "edge.maxSpeed"},
        {"/edges/0/maxHeight", 1.9, "edge.maxHeight"},
        {"/edges/0/minHeight", 0.1, "edge.minHeight"},
        {"/edges/0/orientation", 0.0, "edge.orientation"},
        {"/edges/0/direction", "left", "edge.direction"},
        {"/edges/0/rotationAllowed", false, "edge.rotationAllowed"},
        {"/edges/0/maxRotationSpeed", 1.0, "edge.maxRotationSpeed"},
        {"/edges/0/corridor", Json::object(), "edge.corridor"},
        {"/edges/0/trajectory", Json::object(), "edge.trajectory"},
    };
    for (const Infeasible& wrong : cases) {
        FleetTruck truck;
        Json message = order("o", 0, 0, 2);
        message[Json::json_pointer(wrong.path)] = wrong.value;
        truck.send_order(message);
        EXPECT_THAT(test::goals_of(truck), IsEmpty()) << wrong.path;
        const Json errors = truck.state()["errors"];
        ASSERT_EQ(errors.size(), 1u) << wrong.path;
        EXPECT_EQ(errors[0]["errorType"], "orderError");
        EXPECT_EQ(errors[0]["errorLevel"], "WARNING");
        EXPECT_THAT(errors[0]["errorReferences"].dump(), HasSubstr(wrong.key));
        EXPECT_THAT(errors[0]["errorReferences"].dump(), HasSubstr("\"orderId\""));
    }
}

TEST(FleetOrderCheck, WhatIsMetAnywayIsTaken) {
    FleetTruck truck;
    Json message = order("o", 0, 0, 2);
    message["edges"][0].update({{"maxSpeed", 0.3},
                                {"maxHeight", 2.0},
                                {"minHeight", 0.0},
                                {"rotationAllowed", true},
                                {"length", 1.0}});
    truck.send_order(message);
    EXPECT_EQ(test::goals_of(truck), "o:0=1, ");
}

TEST(FleetOrderCheck, HintsMayBeIgnoredButNotASpeedLimit) {
    FleetConfig config = test::example_config();
    config.ignore_edge_hints = true;
    FleetTruck truck(config);
    Json message = order("o", 0, 0, 2);
    message["edges"][0]["orientation"] = 0.0;
    message["edges"][0]["maxSpeed"] = 0.1;
    truck.send_order(message);
    EXPECT_THAT(test::goals_of(truck), IsEmpty());
    message["edges"][0]["maxSpeed"] = 1.0;
    truck.send_order(message);
    EXPECT_EQ(test::goals_of(truck), "o:0=1, ");
}

TEST(FleetOrderCheck, AnUpdateIsHeldToTheSame) {
    FleetTruck truck;
    truck.send_order(order("o", 0, 0, 2, 1));
    Json update = order("o", 1, 1, 2);
    update["edges"][0]["maxSpeed"] = 0.1;
    truck.send_order(update);
    EXPECT_THAT(truck.error_types(), ElementsAre("orderError"));
    EXPECT_EQ(test::nodes_left(truck.state()), "n1 (n2) ") << "nothing has changed";
    EXPECT_EQ(truck.state()["orderUpdateId"], 0);
}

TEST(FleetOrderCheck, ErrorsAreFewAndNotRepeated) {
    FleetTruck truck;
    for (int i = 0; i < 50; ++i) {
        truck.protocol.take_order("nonsense", truck.now);
    }
    EXPECT_THAT(truck.error_types(), ElementsAre("validationError"));
    for (int i = 0; i < 50; ++i) {
        Json broken = order("o", i, 0, 2);
        broken.erase("nodes");
        truck.send_order(broken);
    }
    EXPECT_EQ(truck.error_types().size(), 10u);
    EXPECT_EQ(truck.protocol.counts().orders_refused, 100u);
}

}  // namespace
}  // namespace hybrid_slam
