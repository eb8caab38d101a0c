// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/link/link_client.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <memory>

#include "hybrid_slam/link/codec.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "link_test_support.hpp"
#include "messages.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::Events;
using test::eventually;
using test::kLongWait;
using test::RawSocket;
using ::testing::HasSubstr;
using ::testing::Not;

const char* const kWelcome = "{\"type\":\"welcome\",\"version\":1}\n";

LinkClientConfig client_of(std::uint16_t port) {
    LinkClientConfig config;
    config.server = "tcp://127.0.0.1:" + std::to_string(port);
    config.name = "tester";
    config.retry_least = 0.02;
    config.retry_most = 0.1;
    config.stale_after = 5.0;  // a busy machine makes no pose stale where that is not the question
    return config;
}

double stamp_of(const std::optional<std::string>& line) {
    return std::get<LinkPose>(decode_client_json(line.value())).stamp;
}

/// Speaks first as a server does, by hand.
RawSocket welcomed(RawSocket& listener) {
    RawSocket peer = listener.accept();
    EXPECT_THAT(peer.line().value_or(""), HasSubstr("\"type\":\"hello\""));
    peer.send(kWelcome);
    return peer;
}

TEST(LinkClient, RefusesABadConfig) {
    LinkClientConfig config = client_of(5000);
    config.server = "truck";
    EXPECT_THAT(error_of([&] { LinkClient client(config, LinkRole::kPose); }),
                HasSubstr("no port"));
    config.server = "truck:0";
    EXPECT_THAT(error_of([&] { LinkClient client(config, LinkRole::kPose); }), HasSubstr("port"));
    config = client_of(5000);
    config.retry_least = 5.0;
    EXPECT_THAT(error_of([&] { LinkClient client(config, LinkRole::kPose); }),
                HasSubstr("retry_most"));
    config.retry_least = -1.0;
    EXPECT_THAT(error_of([&] { LinkClient client(config, LinkRole::kPose); }),
                HasSubstr("retry_least"));
}

TEST(LinkClient, BringsPosesToAServer) {
    LinkServer server(test::any_port());
    Events events(server);
    LinkClient client(client_of(server.endpoint().port), LinkRole::kPose);
    ASSERT_TRUE(client.wait_connected(kLongWait));
    EXPECT_EQ(events.next_of<LinkConnected>().value().name, "tester");
    for (int i = 1; i <= 20; ++i) {
        client.send(test::some_pose(i));
        EXPECT_EQ(events.next_of<LinkPose>().value().stamp, i);
    }
    EXPECT_TRUE(eventually([&] { return client.report().sent == 20; }));
    const LinkClientReport report = client.report();
    EXPECT_EQ(report.state, LinkState::kConnected);
    EXPECT_EQ(report.trouble, "");
    EXPECT_EQ(report.poses_replaced + report.poses_stale, 0u);
}

TEST(LinkClient, BringsGoalsAndHearsTheStatus) {
    LinkServer server(test::any_port());
    Events events(server);
    LinkClient client(client_of(server.endpoint().port), LinkRole::kGoal);
    ASSERT_TRUE(client.wait_connected(kLongWait));
    EXPECT_TRUE(client.send(LinkCommand::kAutomatic));
    EXPECT_TRUE(client.send(test::some_goals()));
    EXPECT_EQ(events.next_of<LinkCommand>().value(), LinkCommand::kAutomatic);
    EXPECT_EQ(events.next_of<LinkGoals>().value().id, "tour 7");
    server.publish(test::some_status());
    const std::vector<ServerMessage> messages = client.received(kLongWait);
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_EQ(std::get<LinkStatus>(messages[0]).goals, "tour 7");
    EXPECT_THAT(error_of([&] { client.send(LinkGoals()); }), HasSubstr("waypoints"));
}

TEST(LinkClient, HearsWhyItIsRefused) {
    LinkServerConfig config = test::any_port();
    config.token = "secret";
    LinkServer server(config);
    LinkClient stranger(client_of(server.endpoint().port), LinkRole::kGoal);
    EXPECT_TRUE(eventually([&] { return stranger.report().refusals >= 2; })) << "it tries again";
    EXPECT_THAT(stranger.report().trouble, HasSubstr("wrong token"));
    EXPECT_EQ(stranger.report().connections, 0u);
    EXPECT_FALSE(stranger.send(LinkCommand::kCancel));
    LinkClientConfig known = client_of(server.endpoint().port);
    known.token = "secret";
    LinkClient client(known, LinkRole::kGoal);
    EXPECT_TRUE(client.wait_connected(kLongWait));
}

TEST(LinkClient, ComesBackWhenTheServerDoes) {
    auto server = std::make_unique<LinkServer>(test::any_port());
    LinkServerConfig same_place = test::any_port();
    same_place.listen = server->endpoint().text();
    LinkClient client(client_of(server->endpoint().port), LinkRole::kPose);
    ASSERT_TRUE(client.wait_connected(kLongWait));
    server.reset();
    ASSERT_TRUE(eventually([&] { return client.report().attempts >= 3; }));
    EXPECT_NE(client.report().state, LinkState::kConnected);
    EXPECT_THAT(client.report().trouble, HasSubstr(same_place.listen));
    client.send(test::some_pose(1.0));
    server = std::make_unique<LinkServer>(same_place);
    ASSERT_TRUE(client.wait_connected(kLongWait));
    EXPECT_EQ(client.report().connections, 2u);
    EXPECT_EQ(client.report().trouble, "");
    client.send(test::some_pose(2.0));
    Events events(*server);
    while (events.next_of<LinkPose>().value().stamp != 2.0) {
    }
}

TEST(LinkClient, DoesNotBlockWithoutAServer) {
    const std::uint16_t nobody = RawSocket::listen().port();
    LinkClient client(client_of(nobody), LinkRole::kPose);
    for (int i = 0; i < 1000; ++i) {
        client.send(test::some_pose(i));
    }
    EXPECT_FALSE(client.wait_connected(0.05));
    EXPECT_EQ(client.report().poses_replaced, 999u);
    EXPECT_EQ(client.report().sent, 0u);
    EXPECT_TRUE(eventually([&] { return client.report().attempts >= 2; }));
}

TEST(LinkClient, SendsTheLatestPoseOnly) {
    RawSocket listener = RawSocket::listen();
    LinkClientConfig config = client_of(listener.port());
    LinkClient client(config, LinkRole::kPose);
    RawSocket peer = listener.accept();
    ASSERT_TRUE(peer.line());
    for (int i = 1; i <= 5; ++i) {
        client.send(test::some_pose(i));  // it is not welcome yet
    }
    peer.send(kWelcome);
    EXPECT_EQ(stamp_of(peer.line()), 5.0);
    EXPECT_EQ(client.report().poses_replaced, 4u);
}

TEST(LinkClient, DoesNotSendAStalePose) {
    RawSocket listener = RawSocket::listen();
    LinkClientConfig config = client_of(listener.port());
    config.stale_after = 0.3;
    LinkClient client(config, LinkRole::kPose);
    RawSocket peer = listener.accept();
    ASSERT_TRUE(peer.line());
    client.send(test::some_pose(1.0));
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    peer.send(kWelcome);
    ASSERT_TRUE(eventually([&] { return client.report().poses_stale == 1; }));
    client.send(test::some_pose(2.0));
    EXPECT_EQ(stamp_of(peer.line()), 2.0);
}

TEST(LinkClient, AddsNothingToWhatAStalledNetworkHolds) {
    RawSocket listener = RawSocket::listen(0, 2048);
    LinkClientConfig config = client_of(listener.port());
    config.stale_after = 0.5;
    config.patience = 30.0;  // the stall must not end the connection here
    LinkClient client(config, LinkRole::kPose);
    RawSocket peer = welcomed(listener);
    // A peer that does not read stalls the wire once its window is full.
    double stamp = 0.0;
    std::uint64_t sent = 0;
    int unchanged = 0;  // rounds of some 2 ms
    ASSERT_TRUE(eventually([&] {
        client.send(test::some_pose(++stamp));
        unchanged = client.report().sent == sent ? unchanged + 1 : 0;
        sent = client.report().sent;
        return sent > 0 && unchanged > 350;
    }));
    EXPECT_LT(sent, 1000u) << "the system would take thousands";
    client.send(test::some_pose(1e6));
    int lines = 0;
    double newest = 0.0;
    while (newest < 1e6) {
        newest = stamp_of(peer.line());
        ++lines;
    }
    EXPECT_EQ(lines, static_cast<int>(sent) + 1) << "of all that waited only the latest is sent";
}

TEST(LinkClient, AnInvalidPoseIsNotSent) {
    RawSocket listener = RawSocket::listen();
    LinkClient client(client_of(listener.port()), LinkRole::kPose);
    RawSocket peer = welcomed(listener);
    ASSERT_TRUE(client.wait_connected(kLongWait));
    client.send(test::some_pose(std::numeric_limits<double>::quiet_NaN()));
    client.send(test::some_pose(3.0));
    EXPECT_EQ(stamp_of(peer.line()), 3.0);
    EXPECT_EQ(client.report().poses_invalid, 1u);
}

TEST(LinkClient, LeavesWhatIsNoLinkServer) {
    RawSocket listener = RawSocket::listen();
    LinkClient client(client_of(listener.port()), LinkRole::kWatch);
    RawSocket peer = listener.accept();
    peer.send("220 mail.example.com ESMTP\r\n");
    EXPECT_TRUE(peer.is_closed());
    EXPECT_TRUE(eventually(
        [&] { return client.report().trouble.find("not a link server") != std::string::npos; }));
    RawSocket second = listener.accept();
    second.send(std::string(100000, 'x'));
    EXPECT_TRUE(second.is_closed());
    EXPECT_TRUE(
        eventually([&] { return client.report().trouble.find("too long") != std::string::npos; }));
}

TEST(LinkClient, DoesNotWaitForEverForAWelcome) {
    RawSocket listener = RawSocket::listen();
    LinkClientConfig config = client_of(listener.port());
    config.patience = 0.1;
    LinkClient client(config, LinkRole::kWatch);
    RawSocket peer = listener.accept();
    EXPECT_TRUE(peer.is_closed());
    EXPECT_TRUE(
        eventually([&] { return client.report().trouble.find("no answer") != std::string::npos; }));
}

TEST(LinkClient, IgnoresWhatANewerServerSays) {
    RawSocket listener = RawSocket::listen();
    LinkClient client(client_of(listener.port()), LinkRole::kWatch);
    RawSocket peer = welcomed(listener);
    peer.send("{\"type\":\"weather\"}\nnonsense\n" +
              encode_json(ServerMessage(test::some_status())) + "\n");
    const std::vector<ServerMessage> messages = client.received(kLongWait);
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_TRUE(std::holds_alternative<LinkStatus>(messages[0]));
}

TEST(LinkClient, SeveralPublishersAndListenersAtOnce) {
    LinkServer first(test::any_port());
    LinkServer second(test::any_port());
    LinkClient to_first(client_of(first.endpoint().port), LinkRole::kPose);
    LinkClient to_second(client_of(second.endpoint().port), LinkRole::kPose);
    ASSERT_TRUE(to_first.wait_connected(kLongWait));
    ASSERT_TRUE(to_second.wait_connected(kLongWait));
    to_first.send(test::some_pose(1.0));
    to_second.send(test::some_pose(1.0));
    Events first_events(first);
    Events second_events(second);
    EXPECT_TRUE(first_events.next_of<LinkPose>());
    EXPECT_TRUE(second_events.next_of<LinkPose>());
}

}  // namespace
}  // namespace hybrid_slam
