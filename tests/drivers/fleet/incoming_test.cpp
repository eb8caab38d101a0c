// SPDX-License-Identifier: Apache-2.0
#include "incoming.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "messages.hpp"
#include "schema.hpp"
#include "support/error_of.hpp"
#include "support/shared_data.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using ::testing::HasSubstr;

const FleetIdentity kUs{"ExampleCo", "FL-0001"};

FleetProblem problem_of(const std::string& text) {
    try {
        parse_order(text, kUs);
    } catch (const FleetRefusal& refusal) {
        return refusal.problem;
    }
    ADD_FAILURE() << "taken: " << text;
    return {};
}

TEST(Incoming, OurMessagesAreWhatTheSchemasWant) {
    EXPECT_EQ(test::TopicSchema("order").fault(test::order("o", 0, 0, 3, 2)), "");
    const Json actions =
        Json::array({test::action("a", "startPause"), test::init_position("b", 1.0, 2.0, 0.5)});
    EXPECT_EQ(test::TopicSchema("instantActions").fault(test::instant(actions)), "");
}

TEST(Incoming, TheSchemasAreNotEmpty) {
    Json broken = test::order("o", 0, 0, 2);
    broken["nodes"][0].erase("released");
    EXPECT_NE(test::TopicSchema("order").fault(broken), "");
}

TEST(Incoming, AnOrderIsReadAsItWasWritten) {
    Json message = test::order("o", 3, 4, 2, 1);
    message["nodes"][1]["nodePosition"]["theta"] = 1.5;
    message["nodes"][1]["nodePosition"]["allowedDeviationXY"] = 0.25;
    message["edges"][0]["maxSpeed"] = 0.6;
    const Order order = parse_order(message.dump(), kUs);
    EXPECT_EQ(order.id, "o");
    EXPECT_EQ(order.update, 3u);
    ASSERT_EQ(order.nodes.size(), 3u);
    EXPECT_EQ(order.nodes[1].id, "n5");
    EXPECT_EQ(order.nodes[1].sequence, 10u);
    EXPECT_EQ(order.nodes[1].position->place, Eigen::Vector2d(5.0, 0.0));
    EXPECT_EQ(order.nodes[1].position->theta, 1.5);
    EXPECT_EQ(order.nodes[1].position->deviation, 0.25);
    EXPECT_EQ(order.nodes[1].position->map, "hall");
    EXPECT_FALSE(order.nodes[2].is_released);
    EXPECT_FALSE(order.nodes[0].position->theta);
    EXPECT_EQ(order.edges[0].most_speed, 0.6);
    EXPECT_EQ(order.edges[1].end, "n6");
}

TEST(Incoming, WholeNumbersMayHaveAPoint) {
    std::string text = test::order("o", 3, 0, 1).dump();
    text.replace(text.find("\"orderUpdateId\":3"), 17, "\"orderUpdateId\":3.0");
    EXPECT_EQ(parse_order(text, kUs).update, 3u);
}

TEST(Incoming, TheStandardsPiIsTaken) {
    Json message = test::order("o", 0, 0, 1);
    message["nodes"][0]["nodePosition"]["theta"] = 3.14159265359;
    EXPECT_NEAR(std::abs(*parse_order(message.dump(), kUs).nodes[0].position->theta), kPi, 1e-9);
}

/// Every member that the schema requires, in turn.
TEST(Incoming, EachMissingMemberIsNamed) {
    const Json good = test::order("o", 0, 0, 2);
    for (const char* path : {"/headerId",
                             "/timestamp",
                             "/version",
                             "/manufacturer",
                             "/serialNumber",
                             "/orderId",
                             "/orderUpdateId",
                             "/nodes",
                             "/edges",
                             "/nodes/1/nodeId",
                             "/nodes/1/sequenceId",
                             "/nodes/1/released",
                             "/nodes/1/actions",
                             "/nodes/1/nodePosition/x",
                             "/nodes/1/nodePosition/y",
                             "/nodes/1/nodePosition/mapId",
                             "/edges/0/edgeId",
                             "/edges/0/sequenceId",
                             "/edges/0/released",
                             "/edges/0/startNodeId",
                             "/edges/0/endNodeId",
                             "/edges/0/actions"}) {
        const Json::json_pointer pointer(path);
        Json missing = good;
        missing.at(pointer.parent_pointer()).erase(pointer.back());
        const FleetProblem problem = problem_of(missing.dump());
        EXPECT_EQ(problem.type, kValidationError) << path;
        EXPECT_THAT(problem.text, HasSubstr(pointer.back() + ": is missing")) << path;
        Json wrong = good;
        wrong[pointer] = Json::object({{"not", "this"}});
        EXPECT_THAT(problem_of(wrong.dump()).text, HasSubstr(pointer.back() + ": must be")) << path;
    }
}

struct Spoiled {
    const char* path;
    Json value;
    const char* reason;
};

TEST(Incoming, WhatIsNoChainIsRefused) {
    const std::vector<Spoiled> cases = {
        {"/nodes/0/released", false, "nodes[0]: must be released"},
        {"/nodes/1/released", false, "together with the node"},
        {"/nodes/1/sequenceId", 4, "sequenceId must count up"},
        {"/edges/0/sequenceId", 2, "sequenceId must count up"},
        {"/edges/1/endNodeId", "n9", "startNodeId and endNodeId"},
        {"/edges/0/released", false, "together with the node"},
        {"/edges", Json::array(), "edges: must be one less"},
        {"/nodes", Json::array(), "nodes: must be one at least"},
        {"/orderId", "", "orderId: must not be empty"},
        {"/version", "3.0.0", "only 2.x.y"},
        {"/serialNumber", "FL-0002", "is not FL-0001"},
        {"/manufacturer", "Other", "is not ExampleCo"},
        {"/orderUpdateId", -1, "whole number"},
        {"/orderUpdateId", 1.5, "whole number"},
        {"/orderUpdateId", 4294967296, "whole number"},
        {"/nodes/0/nodePosition/theta", 3.5, "from -pi to pi"},
        {"/nodes/0/nodePosition/x", 1e7, "within 1000 km"},
        {"/nodes/0/nodePosition/allowedDeviationXY", -0.1, "must not be negative"},
        {"/orderId", std::string(129, 'o'), "longer than 128 bytes"},
    };
    for (const Spoiled& spoiled : cases) {
        Json message = test::order("o", 0, 0, 3);
        message[Json::json_pointer(spoiled.path)] = spoiled.value;
        const FleetProblem problem = problem_of(message.dump());
        EXPECT_EQ(problem.type, kValidationError) << spoiled.path;
        EXPECT_THAT(problem.text, HasSubstr(spoiled.reason)) << spoiled.path;
    }
}

TEST(Incoming, TheReleasedPartComesFirst) {
    Json message = test::order("o", 0, 0, 1, 2);
    message["nodes"][2]["released"] = true;
    message["edges"][1]["released"] = true;
    EXPECT_THAT(problem_of(message.dump()).text, HasSubstr("nothing released may follow"));
}

TEST(Incoming, ASequenceDoesNotWrapAround) {
    Json message = test::order("o", 0, 0, 2);
    message["nodes"][0]["sequenceId"] = 4294967295;
    message["edges"][0]["sequenceId"] = 0;
    message["nodes"][1]["sequenceId"] = 1;
    EXPECT_THAT(problem_of(message.dump()).text, HasSubstr("count up"));
}

TEST(Incoming, WhatIsNoMessageIsRefused) {
    for (const std::string& text :
         {std::string(), std::string("{"), std::string("nonsense"), std::string("{\"a\":1e999}"),
          std::string("\xff\xfe"), std::string(200000, '['), std::string(300000, ' ')}) {
        EXPECT_EQ(problem_of(text).type, kValidationError);
    }
    EXPECT_THAT(problem_of("[]").text, HasSubstr("must be an object"));
    EXPECT_THAT(problem_of("null").text, HasSubstr("must be an object"));
}

TEST(Incoming, ARefusalTellsWhichMessageItWas) {
    Json message = test::order("o", 4, 0, 2);
    message["edges"][0].erase("endNodeId");
    const FleetProblem problem = problem_of(message.dump());
    const References wanted = {
        {"topic", "order"}, {"headerId", "7"}, {"orderId", "o"}, {"orderUpdateId", "4"}};
    EXPECT_EQ(problem.references, wanted);
}

TEST(Incoming, ActionsKeepTheirParameters) {
    const auto actions =
        parse_instant_actions(test::instant(test::init_position("b", 1.0, 2.0, 0.5)).dump(), kUs);
    ASSERT_EQ(actions.size(), 1u);
    EXPECT_EQ(actions[0].type, "initPosition");
    ASSERT_EQ(actions[0].parameters.size(), 5u);
    EXPECT_EQ(actions[0].parameters[1].first, "y");
    EXPECT_EQ(actions[0].parameters[1].second, 2.0);
}

TEST(Incoming, AnActionNeedsAGoodBlockingType) {
    Json action = test::action("a", "startPause");
    action["blockingType"] = "MAYBE";
    EXPECT_THAT(test::error_of([&] { parse_instant_actions(test::instant(action).dump(), kUs); }),
                HasSubstr("actions[0].blockingType: must be NONE, SOFT or HARD"));
}

TEST(Incoming, TheStoredExamplesAreTaken) {
    HYBRID_SLAM_SHARED_OR_SKIP(examples, "facts/vda5050_2.1.0/examples");
    EXPECT_EQ(parse_order(test::bytes_of(examples / "order.json"), kUs).nodes.size(), 2u);
    EXPECT_EQ(parse_instant_actions(test::bytes_of(examples / "instantActions.json"), kUs).size(),
              1u);
}

}  // namespace
}  // namespace hybrid_slam
