// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/link/link_server.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "link_test_support.hpp"
#include "messages.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::Events;
using test::RawSocket;
using ::testing::HasSubstr;

const char* const kWelcome = R"({"type":"welcome","version":1})";

std::string hello(LinkRole role, const std::string& token = {}) {
    return encode_json(ClientMessage(LinkHello{role, kLinkVersion, token, "tester"})) + "\n";
}

RawSocket connected(const LinkServer& server, LinkRole role) {
    RawSocket socket = RawSocket::connect(server.endpoint().port);
    socket.send(hello(role));
    EXPECT_EQ(socket.line(), kWelcome);
    return socket;
}

TEST(LinkServer, ListensOnLoopbackUnlessToldOtherwise) {
    const LinkServer server(test::any_port());
    EXPECT_EQ(server.endpoint().host, "127.0.0.1");
    EXPECT_GT(server.endpoint().port, 0);
    LinkServerConfig open = test::any_port();
    open.listen = "0.0.0.0:0";
    EXPECT_EQ(LinkServer(open).endpoint().host, "0.0.0.0");
}

TEST(LinkServer, RefusesAPlaceThatItCannotHave) {
    const LinkServer server(test::any_port());
    LinkServerConfig config;
    config.listen = server.endpoint().text();
    EXPECT_THAT(error_of([&config] { LinkServer second(config); }), HasSubstr("cannot listen"));
    config.listen = "nonsense";
    EXPECT_THAT(error_of([&config] { LinkServer second(config); }), HasSubstr("no port"));
    config = test::any_port();
    config.most_clients = 0;
    EXPECT_THAT(error_of([&config] { LinkServer second(config); }), HasSubstr("most_clients"));
    config = test::any_port();
    config.token = "two words";
    EXPECT_THAT(error_of([&config] { LinkServer second(config); }), HasSubstr("token"));
}

TEST(LinkServer, HandsOverPoses) {
    LinkServer server(test::any_port());
    Events events(server);
    const double before = steady_seconds();
    RawSocket client = connected(server, LinkRole::kPose);
    client.send(encode_json(ClientMessage(test::some_pose(5.0))) + "\n");
    const auto first = events.next();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->client, 1u);
    EXPECT_EQ(first->role, LinkRole::kPose);
    ASSERT_TRUE(std::holds_alternative<LinkConnected>(first->what));
    EXPECT_EQ(std::get<LinkConnected>(first->what).name, "tester");
    const auto second = events.next();
    ASSERT_TRUE(second && std::holds_alternative<LinkPose>(second->what));
    EXPECT_EQ(std::get<LinkPose>(second->what).stamp, 5.0);
    EXPECT_GE(second->arrival, before);
    EXPECT_LE(second->arrival, steady_seconds());
    EXPECT_EQ(second->lateness, 0.0);
    client.close();
    const auto third = events.next();
    ASSERT_TRUE(third && std::holds_alternative<LinkDisconnected>(third->what));
    EXPECT_EQ(std::get<LinkDisconnected>(third->what).reason, "closed by the client");
    EXPECT_EQ(server.counts().lines, 1u);
}

TEST(LinkServer, TellsHowLateAPoseIs) {
    LinkServer server(test::any_port());
    Events events(server);
    RawSocket client = connected(server, LinkRole::kPose);
    client.send(encode_json(ClientMessage(test::some_pose(100.0))) + "\n");
    ASSERT_TRUE(events.next_of<LinkPose>());
    client.send(encode_json(ClientMessage(test::some_pose(99.0))) + "\n");
    const auto late = events.next();
    ASSERT_TRUE(late);
    EXPECT_GE(late->lateness, 1.0);
}

TEST(LinkServer, HandsOverGoalsAndCommandsInOrder) {
    LinkServer server(test::any_port());
    Events events(server);
    RawSocket client = connected(server, LinkRole::kGoal);
    client.send(encode_json(ClientMessage(LinkCommand::kAutomatic)) + "\n" +
                encode_json(ClientMessage(test::some_goals())) + "\r\n\n" +
                encode_json(ClientMessage(LinkCommand::kCancel)) + "\n");
    ASSERT_TRUE(events.next_of<LinkConnected>());
    const auto mode = events.next();
    const auto goals = events.next();
    const auto cancel = events.next();
    ASSERT_TRUE(mode && goals && cancel);
    EXPECT_EQ(std::get<LinkCommand>(mode->what), LinkCommand::kAutomatic);
    EXPECT_EQ(std::get<LinkGoals>(goals->what).waypoints.size(), 2u);
    EXPECT_EQ(std::get<LinkCommand>(cancel->what), LinkCommand::kCancel);
}

TEST(LinkServer, TellsItsStatusToAll) {
    LinkServer server(test::any_port());
    RawSocket poses = connected(server, LinkRole::kPose);
    RawSocket goals = connected(server, LinkRole::kGoal);
    RawSocket first = connected(server, LinkRole::kWatch);
    RawSocket second = connected(server, LinkRole::kWatch);
    server.publish(test::some_status());
    const std::string line = encode_json(ServerMessage(test::some_status()));
    EXPECT_EQ(poses.line(), line);
    EXPECT_EQ(goals.line(), line);
    EXPECT_EQ(first.line(), line);
    EXPECT_EQ(second.line(), line);
    RawSocket late = connected(server, LinkRole::kWatch);
    EXPECT_EQ(late.line(), line) << "the last status is told to who comes later";
}

TEST(LinkServer, PassesAnInitialPoseOnToPoseSourcesAlone) {
    LinkServer server(test::any_port());
    Events events(server);
    RawSocket poses = connected(server, LinkRole::kPose);
    RawSocket goals = connected(server, LinkRole::kGoal);
    RawSocket plc = RawSocket::connect(server.endpoint().port);
    plc.send("TEXT 1 pose\n");
    EXPECT_EQ(plc.line(), "OK 1");
    const LinkInitialPose pose{{1.5, -2.0, 0.25}};
    goals.send(encode_json(ClientMessage(pose)) + "\n");
    const auto asked = events.next_of<LinkInitialPose>();
    ASSERT_TRUE(asked.has_value());
    server.publish(*asked);
    EXPECT_EQ(poses.line(), encode_json(ServerMessage(pose)));
    EXPECT_EQ(plc.line(), "I 1.500 -2.000 0.2500");
    goals.send("x\n");  // its next line is the answer to this, so none came before
    EXPECT_THAT(goals.line().value_or(""), HasSubstr("not a JSON object"));
    EXPECT_THAT(error_of([&] {
                    server.publish(LinkInitialPose{{NAN, 0.0, 0.0}});
                }),
                HasSubstr("x"));
}

TEST(LinkServer, TellsOneClientWhatIsNotDone) {
    LinkServer server(test::any_port());
    Events events(server);
    RawSocket asking = connected(server, LinkRole::kGoal);
    asking.send(encode_json(ClientMessage(test::some_goals())) + "\n");
    RawSocket other = connected(server, LinkRole::kGoal);
    std::optional<LinkEvent> event;
    do {
        event = events.next();
    } while (event && !std::holds_alternative<LinkGoals>(event->what));
    ASSERT_TRUE(event.has_value());
    server.refuse(event->client, "waypoint 2 cannot be reached");
    server.refuse(987654, "nobody");
    EXPECT_EQ(asking.line(),
              encode_json(ServerMessage(LinkRefusal{"waypoint 2 cannot be reached"})));
    for (int i = 0; i < 30; ++i) {
        server.refuse(event->client, "no");  // is no fault of the client: it is not closed
    }
    asking.send(encode_json(ClientMessage(LinkCommand::kCancel)) + "\n");
    EXPECT_TRUE(events.next_of<LinkCommand>().has_value());
}

TEST(LinkServer, DoesNotPublishWhatIsNoNumber) {
    LinkServer server(test::any_port());
    LinkStatus status;
    status.speed = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(error_of([&] { server.publish(status); }), HasSubstr("speed"));
}

TEST(LinkServer, SpeaksWordsWithAPlc) {
    LinkServer server(test::any_port());
    Events events(server);
    RawSocket source = RawSocket::connect(server.endpoint().port);
    source.send("TEXT 1 pose\r\nP 12.5 1.3 -0.15 0.02 0.03 0.01 tracking 0.9 2.5 - 0\r\n");
    EXPECT_EQ(source.line(), "OK 1");
    EXPECT_EQ(events.next_of<LinkPose>().value().map_from_robot.x(), 1.3);
    source.send("G 1 2\n");
    EXPECT_EQ(source.line(), "E not for the role of this connection");

    RawSocket goals = RawSocket::connect(server.endpoint().port);
    goals.send("TEXT 1 goal - plc\nG 1 2\nS\n");
    EXPECT_EQ(goals.line(), "OK 1");
    EXPECT_EQ(events.next_of<LinkConnected>().value().name, "plc");
    EXPECT_EQ(events.next_of<LinkGoals>().value().waypoints[0].place.y(), 2.0);
    EXPECT_EQ(events.next_of<LinkCommand>().value(), LinkCommand::kCancel);
    server.publish(test::some_status());
    EXPECT_EQ(goals.line(), encode_text(ServerMessage(test::some_status())));
}

TEST(LinkServer, AsksForTheToken) {
    LinkServerConfig config = test::any_port();
    config.token = "secret";
    LinkServer server(config);
    for (const char* token : {"", "Secret", "secre", "secretsecret"}) {
        RawSocket stranger = RawSocket::connect(server.endpoint().port);
        stranger.send(hello(LinkRole::kGoal, token));
        EXPECT_EQ(stranger.line(), R"({"reason":"wrong token","type":"error"})") << token;
        EXPECT_TRUE(stranger.is_closed());
    }
    RawSocket friendly = RawSocket::connect(server.endpoint().port);
    friendly.send(hello(LinkRole::kGoal, "secret"));
    EXPECT_EQ(friendly.line(), kWelcome);
    RawSocket plc = RawSocket::connect(server.endpoint().port);
    plc.send("TEXT 1 watch secret\n");
    EXPECT_EQ(plc.line(), "OK 1");
    EXPECT_EQ(server.counts().turned_away, 4u);
    EXPECT_EQ(server.counts().connections, 2u);
}

TEST(LinkServer, NeedsNoTokenUnlessItHasOne) {
    const LinkServer server(test::any_port());
    RawSocket client = RawSocket::connect(server.endpoint().port);
    client.send(hello(LinkRole::kWatch, "any"));
    EXPECT_EQ(client.line(), kWelcome);
}

}  // namespace
}  // namespace hybrid_slam
