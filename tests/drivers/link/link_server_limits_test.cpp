// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <random>
#include <vector>

#include "hybrid_slam/link/codec.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "link_test_support.hpp"
#include "messages.hpp"

namespace hybrid_slam {
namespace {

using test::Events;
using test::RawSocket;
using ::testing::HasSubstr;

const char* const kPoseHello = "{\"type\":\"hello\",\"role\":\"pose\",\"version\":1}\n";
const char* const kGoalHello = "{\"type\":\"hello\",\"role\":\"goal\",\"version\":1}\n";
const char* const kWatchHello = "{\"type\":\"hello\",\"role\":\"watch\",\"version\":1}\n";

std::string pose_line(double stamp) {
    return encode_json(ClientMessage(test::some_pose(stamp))) + "\n";
}

RawSocket admitted(const LinkServer& server, const std::string& hello) {
    RawSocket socket = RawSocket::connect(server.endpoint().port);
    socket.send(hello);
    EXPECT_THAT(socket.line().value_or(""), HasSubstr("welcome"));
    return socket;
}

/// That the server still serves.
void expect_alive(LinkServer& server) {
    RawSocket client = admitted(server, kPoseHello);
    client.send(pose_line(77.0));
    Events events(server);
    while (const auto pose = events.next_of<LinkPose>()) {
        if (pose->stamp == 77.0) {
            return;
        }
    }
    ADD_FAILURE() << "the server takes no pose any more";
}

TEST(LinkServerLimits, StrangersAreToldAndClosed) {
    LinkServer server(test::any_port());
    const std::pair<std::string, const char*> cases[] = {
        {"GET / HTTP/1.1\r\nHost: truck\r\n\r\n", "the first line must be a hello"},
        {pose_line(1.0), "type: must be hello"},
        {"{\"type\":\"hello\",\"role\":\"pose\",\"version\":2}\n", "only version 1"},
        {"{\"type\":\"hello\",\"role\":\"pilot\",\"version\":1}\n", "role: must be one of"},
        {"TEXT one pose\n", "version: must be a number"},
        {std::string("\x16\x03\x01\x00\n", 5), "the first line must be a hello"},
        {std::string(70000, 'a'), "a line has at most 32768 bytes"},
    };
    for (const auto& [bytes, reason] : cases) {
        RawSocket stranger = RawSocket::connect(server.endpoint().port);
        stranger.send(bytes);
        EXPECT_THAT(stranger.line().value_or("closed"), HasSubstr(reason));
        EXPECT_TRUE(stranger.is_closed());
    }
    EXPECT_EQ(server.counts().turned_away, 7u);
    EXPECT_TRUE(server.events().empty()) << "strangers are none of the owner's business";
    expect_alive(server);
}

TEST(LinkServerLimits, SilentStrangersAreClosed) {
    LinkServerConfig config = test::any_port();
    config.hello_timeout = 0.3;
    LinkServer server(config);
    RawSocket stranger = RawSocket::connect(server.endpoint().port);
    EXPECT_THAT(stranger.line().value_or(""), HasSubstr("no first line in time"));
    EXPECT_TRUE(stranger.is_closed());
    expect_alive(server);
}

TEST(LinkServerLimits, ClientsMayBeSilentOnceLetIn) {
    LinkServerConfig config = test::any_port();
    config.hello_timeout = 0.3;
    LinkServer server(config);
    RawSocket watcher = admitted(server, kWatchHello);
    EXPECT_FALSE(watcher.line(0.5).has_value());
    server.publish(LinkStatus());
    EXPECT_THAT(watcher.line().value_or(""), HasSubstr("status"));
}

TEST(LinkServerLimits, GarbageIsAnsweredAndAfterTooMuchClosed) {
    LinkServerConfig config = test::any_port();
    config.refusals = 3;
    LinkServer server(config);
    Events events(server);
    RawSocket client = admitted(server, kPoseHello);
    client.send("garbage\n" + pose_line(1.0) + "garbage\ngarbage\n" + pose_line(2.0));
    for (int i = 0; i < 3; ++i) {
        EXPECT_THAT(client.line().value_or("closed"), HasSubstr("not a JSON object"));
    }
    EXPECT_EQ(events.next_of<LinkPose>().value().stamp, 1.0);
    EXPECT_EQ(events.next_of<LinkPose>().value().stamp, 2.0);
    client.send("garbage\ngarbage\n" + pose_line(3.0));
    EXPECT_TRUE(client.is_closed());
    EXPECT_THAT(events.next_of<LinkDisconnected>().value().reason, HasSubstr("too many refused"));
    EXPECT_LE(server.counts().refused, 5u);
    EXPECT_TRUE(server.events().empty()) << "nothing after the farewell";
    expect_alive(server);
}

TEST(LinkServerLimits, RolesAreKept) {
    LinkServer server(test::any_port());
    const std::string goals = encode_json(ClientMessage(test::some_goals())) + "\n";
    const std::pair<const char*, std::string> cases[] = {
        {kPoseHello, goals},  {kPoseHello, "{\"type\":\"cancel\"}\n"}, {kGoalHello, pose_line(1.0)},
        {kWatchHello, goals}, {kWatchHello, pose_line(1.0)},           {kGoalHello, kGoalHello},
    };
    for (const auto& [hello, line] : cases) {
        RawSocket client = admitted(server, hello);
        client.send(line);
        EXPECT_THAT(client.line().value_or("closed"), HasSubstr("not for the role"))
            << hello << line;
    }
    EXPECT_EQ(server.counts().lines, 0u);
}

TEST(LinkServerLimits, ALineThatIsTooLongEndsTheConnection) {
    LinkServer server(test::any_port());
    Events events(server);
    RawSocket client = admitted(server, kPoseHello);
    client.send(std::string(100000, ' '));
    EXPECT_THAT(client.line().value_or("closed"), HasSubstr("a line has at most"));
    EXPECT_TRUE(client.is_closed());
    EXPECT_THAT(events.next_of<LinkDisconnected>().value().reason, HasSubstr("a line has at most"));
    expect_alive(server);
}

TEST(LinkServerLimits, TooManyLinesAtOnceAreRefused) {
    LinkServerConfig config = test::any_port();
    config.lines_per_second = 5;
    LinkServer server(config);
    RawSocket client = admitted(server, kPoseHello);
    std::string lines;
    for (int i = 0; i < 1000; ++i) {
        lines += pose_line(i);
    }
    client.send(lines);
    EXPECT_THAT(client.line().value_or("closed"), HasSubstr("at most 5 lines per second"));
    EXPECT_TRUE(client.is_closed());
    EXPECT_LT(server.counts().lines, 100u);
    expect_alive(server);
}

TEST(LinkServerLimits, WatchersMakeRoomForThoseWhoCanStopTheVehicle) {
    LinkServerConfig config = test::any_port();
    config.most_clients = 2;
    LinkServer server(config);
    Events events(server);
    RawSocket first = admitted(server, kWatchHello);
    RawSocket goal = admitted(server, kGoalHello);
    RawSocket operating = admitted(server, kGoalHello);
    EXPECT_THAT(first.line().value_or("closed"), HasSubstr("room is needed"));
    EXPECT_TRUE(first.is_closed());
    operating.send("{\"type\":\"cancel\"}\n");
    EXPECT_EQ(events.next_of<LinkCommand>().value(), LinkCommand::kCancel);
    RawSocket third = RawSocket::connect(server.endpoint().port);
    third.send(kGoalHello);
    EXPECT_THAT(third.line().value_or("closed"), HasSubstr("too many clients"));
}

TEST(LinkServerLimits, SilentStrangersMakeRoomForOthers) {
    LinkServer server(test::any_port());
    std::vector<RawSocket> silent;
    for (int i = 0; i < 100; ++i) {
        silent.push_back(RawSocket::connect(server.endpoint().port));
    }
    RawSocket client = admitted(server, kGoalHello);
    EXPECT_TRUE(silent.front().is_closed());
    EXPECT_GE(server.counts().turned_away, 60U);
}

TEST(LinkServerLimits, OnlySoManyClients) {
    LinkServerConfig config = test::any_port();
    config.most_clients = 2;
    LinkServer server(config);
    Events events(server);
    RawSocket first = admitted(server, kWatchHello);
    RawSocket second = admitted(server, kWatchHello);
    RawSocket third = RawSocket::connect(server.endpoint().port);
    third.send(kWatchHello);
    EXPECT_THAT(third.line().value_or("closed"), HasSubstr("too many clients"));
    EXPECT_TRUE(third.is_closed());
    first.close();
    ASSERT_TRUE(events.next_of<LinkDisconnected>());
    RawSocket fourth = admitted(server, kWatchHello);
}

TEST(LinkServerLimits, StrangersCannotUseUpTheSockets) {
    LinkServer server(test::any_port());
    std::vector<RawSocket> strangers;
    strangers.reserve(100);
    for (int i = 0; i < 100; ++i) {
        strangers.push_back(RawSocket::connect(server.endpoint().port));
    }
    EXPECT_TRUE(test::eventually([&] { return server.counts().turned_away == 100 - 32; }));
    strangers.clear();
    test::eventually([&] {
        RawSocket socket = RawSocket::connect(server.endpoint().port);
        socket.send(kPoseHello);
        return socket.line().has_value();
    });
    expect_alive(server);
}

TEST(LinkServerLimits, ASlowReaderLosesTheOldest) {
    LinkServer server(test::any_port());
    RawSocket slow = RawSocket::connect(server.endpoint().port, 2048);
    slow.send(kWatchHello);
    RawSocket quick = admitted(server, kWatchHello);
    LinkStatus status;
    status.reason = std::string(240, 'r');
    int published = 0;
    // More than the system's buffers hold; the quick reader is not held up by the slow one.
    while (server.counts().statuses_dropped < 100 && published < 100000) {
        status.waypoints_left = ++published;
        server.publish(status);
        ASSERT_EQ(std::get<LinkStatus>(decode_server_json(quick.line().value())).waypoints_left,
                  published);
    }
    ASSERT_LT(published, 100000);
    slow.line();  // the welcome
    int last = 0;
    int read = 0;
    while (last < published) {
        const auto line = slow.line();
        ASSERT_TRUE(line.has_value());
        const int number = std::get<LinkStatus>(decode_server_json(*line)).waypoints_left;
        ASSERT_GT(number, last);
        last = number;
        ++read;
    }
    EXPECT_EQ(static_cast<std::uint64_t>(published - read), server.counts().statuses_dropped);
}

TEST(LinkServerLimits, AnOwnerWhoDoesNotLookLosesOldPoses) {
    LinkServerConfig config = test::any_port();
    config.lines_per_second = 10000;
    LinkServer server(config);
    RawSocket client = admitted(server, kPoseHello);
    constexpr int kPoses = 1500;
    for (int i = 1; i <= kPoses; ++i) {
        client.send(pose_line(i));
    }
    ASSERT_TRUE(test::eventually([&] { return server.counts().lines == kPoses; }));
    const std::vector<LinkEvent> events = server.events();
    ASSERT_EQ(events.size(), 1024u);
    EXPECT_TRUE(std::holds_alternative<LinkConnected>(events.front().what));
    EXPECT_EQ(std::get<LinkPose>(events.back().what).stamp, kPoses);
    EXPECT_EQ(server.counts().poses_dropped, kPoses + 1u - 1024u);
}

TEST(LinkServerLimits, OrdersAreRefusedRatherThanLost) {
    LinkServerConfig config = test::any_port();
    config.lines_per_second = 10000;
    LinkServer server(config);
    RawSocket client = admitted(server, kGoalHello);
    for (int i = 1; i < 1024; ++i) {
        client.send("{\"type\":\"pause\"}\n");
    }
    client.send("{\"type\":\"resume\"}\n");
    EXPECT_THAT(client.line().value_or("closed"), HasSubstr("busy"));
    RawSocket second = RawSocket::connect(server.endpoint().port);
    second.send(kGoalHello);
    EXPECT_THAT(second.line().value_or("closed"), HasSubstr("busy"));
    EXPECT_EQ(server.events().size(), 1024u);
    client.send("{\"type\":\"cancel\"}\n");
    Events events(server);
    EXPECT_EQ(events.next_of<LinkCommand>().value(), LinkCommand::kCancel);
}

TEST(LinkServerLimits, RandomBytesDoNoHarm) {
    LinkServer server(test::any_port());
    std::mt19937 random(6);
    for (int round = 0; round < 30; ++round) {
        RawSocket client = RawSocket::connect(server.endpoint().port);
        std::string bytes = round % 2 == 0 ? kGoalHello : "";
        for (int i = 0; i < 3000; ++i) {
            bytes += random() % 40 == 0 ? '\n' : static_cast<char>(random() % 256);
        }
        client.send(bytes);
        EXPECT_TRUE(client.is_closed());
    }
    expect_alive(server);
}

TEST(LinkServerLimits, EndsWithClientsThatAreConnected) {
    std::vector<RawSocket> clients;
    {
        LinkServer server(test::any_port());
        clients.reserve(5);
        for (int i = 0; i < 5; ++i) {
            clients.push_back(admitted(server, kWatchHello));
        }
        server.publish(LinkStatus());
    }
    for (RawSocket& client : clients) {
        EXPECT_TRUE(client.is_closed());
    }
}

}  // namespace
}  // namespace hybrid_slam
