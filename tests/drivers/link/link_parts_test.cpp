// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "event_box.hpp"
#include "lateness.hpp"
#include "line_buffer.hpp"
#include "line_rate.hpp"
#include "mailbox.hpp"
#include "messages.hpp"

namespace hybrid_slam {
namespace {

TEST(LineBuffer, DoesNotCareHowBytesArrive) {
    const std::string stream = "one\n\ntwo\r\nthree\n\r\nend";
    const std::vector<std::string> expected = {"one", "", "two", "three", ""};
    std::mt19937 random(1);
    for (int round = 0; round < 50; ++round) {
        LineBuffer buffer(5);
        std::vector<std::string> lines;
        std::string line;
        for (std::size_t at = 0; at < stream.size();) {
            const std::size_t count = std::min<std::size_t>(1 + random() % 7, stream.size() - at);
            buffer.append(stream.data() + at, count);
            at += count;
            while (buffer.next(line)) {
                lines.push_back(line);
            }
        }
        EXPECT_EQ(lines, expected);
        EXPECT_FALSE(buffer.is_overlong());
    }
}

TEST(LineBuffer, StopsAtALineThatIsTooLong) {
    std::string line;
    for (const char* stream : {"abcdef\nx\n", "abcdef"}) {
        LineBuffer buffer(5);
        buffer.append(stream, std::string(stream).size());
        EXPECT_FALSE(buffer.next(line));
        EXPECT_TRUE(buffer.is_overlong());
        buffer.append("\nok\n", 4);
        EXPECT_FALSE(buffer.next(line)) << line;
    }
    LineBuffer buffer(5);
    buffer.append("abcde\n", 6);
    EXPECT_TRUE(buffer.next(line));
    EXPECT_EQ(line, "abcde");
}

TEST(LineRate, GivesWhatItPromises) {
    LineRate rate(10.0);
    int allowed = 0;
    for (int i = 0; i < 100; ++i) {
        allowed += rate.allows_one(1000.0) ? 1 : 0;
    }
    EXPECT_EQ(allowed, 10);
    EXPECT_FALSE(rate.allows_one(1000.05));
    EXPECT_TRUE(rate.allows_one(1000.16));
    EXPECT_FALSE(rate.allows_one(1000.16));
    allowed = 0;
    for (int i = 0; i < 100; ++i) {
        allowed += rate.allows_one(2000.0 + 0.2 * i) ? 1 : 0;
    }
    EXPECT_EQ(allowed, 100);
}

TEST(Lateness, IsAgainstThePromptest) {
    Lateness lateness;
    constexpr double kOffset = -1e5;  // of the other computer's clock
    EXPECT_EQ(lateness.of(100.0 + kOffset, 100.02), 0.0);
    EXPECT_NEAR(lateness.of(100.1 + kOffset, 100.15), 0.03, 1e-9);
    EXPECT_NEAR(lateness.of(100.2 + kOffset, 101.22), 1.0, 1e-9);
    EXPECT_EQ(lateness.of(100.3 + kOffset, 100.31), 0.0);
    EXPECT_NEAR(lateness.of(100.4 + kOffset, 100.42), 0.01, 1e-9);
}

TEST(Lateness, ToldOfAFrozenPose) {
    Lateness lateness;
    lateness.of(5.0, 50.0);
    EXPECT_NEAR(lateness.of(5.0, 50.4), 0.4, 1e-9);
}

TEST(Lateness, FollowsClocksThatDrift) {
    Lateness lateness;
    double worst = 0.0;
    for (int i = 0; i < 60000; ++i) {
        const double now = 0.1 * i;
        worst = std::max(worst, lateness.of(now * (1.0 - 1e-4), now));
    }
    EXPECT_LT(worst, 0.007);  // of 0.6 s in all
    EXPECT_GT(worst, 0.002);
}

/// What was held up for long must not look prompt because nothing else came meanwhile.
TEST(Lateness, RemembersThroughALongSilence) {
    Lateness lateness;
    lateness.of(100.0, 100.5);
    const double silence = 3600.0;
    EXPECT_NEAR(lateness.of(101.0, 101.5 + silence), silence, 1.0);
    Lateness other;
    other.of(100.0, 100.5);
    // A sender that was silent too, its clock a little slow, is prompt.
    EXPECT_LT(other.of(101.0 + silence * (1.0 - 5e-5), 101.5 + silence), 0.01);
}

LinkEvent event_of(std::uint64_t client, decltype(LinkEvent::what) what) {
    LinkEvent event;
    event.client = client;
    event.what = std::move(what);
    return event;
}

TEST(EventBox, LosesOldPosesOnly) {
    EventBox box(3);
    EXPECT_TRUE(box.push(event_of(1, LinkConnected{})));
    EXPECT_TRUE(box.push(event_of(1, test::some_pose(1.0))));
    EXPECT_TRUE(box.push(event_of(1, LinkCommand::kPause)));
    EXPECT_TRUE(box.push(event_of(1, test::some_pose(2.0))));
    EXPECT_TRUE(box.push(event_of(1, LinkCommand::kCancel)));
    EXPECT_FALSE(box.push(event_of(1, LinkCommand::kResume)));
    EXPECT_FALSE(box.push(event_of(2, LinkConnected{})));
    EXPECT_TRUE(box.push(event_of(1, test::some_pose(3.0))));  // dropped at once
    EXPECT_TRUE(box.push(event_of(1, LinkDisconnected{})));
    EXPECT_EQ(box.poses_dropped(), 3u);
    const std::vector<LinkEvent> events = box.take(0.0);
    ASSERT_EQ(events.size(), 4u);
    EXPECT_TRUE(std::holds_alternative<LinkConnected>(events[0].what));
    EXPECT_EQ(std::get<LinkCommand>(events[1].what), LinkCommand::kPause);
    EXPECT_EQ(std::get<LinkCommand>(events[2].what), LinkCommand::kCancel);
    EXPECT_TRUE(std::holds_alternative<LinkDisconnected>(events[3].what));
    EXPECT_TRUE(box.take(0.001).empty());
}

TEST(Mailbox, KeepsTheLatestPoseWhileItIsFresh) {
    Mailbox mailbox;
    mailbox.put_pose("first", 10.0);
    mailbox.put_pose("second", 10.1);
    EXPECT_EQ(mailbox.next_pose(10.39, 0.3), "second");
    EXPECT_FALSE(mailbox.next_pose(10.39, 0.3).has_value());
    mailbox.put_pose("third", 11.0);
    EXPECT_FALSE(mailbox.next_pose(11.31, 0.3).has_value());
    EXPECT_FALSE(mailbox.has_pose());
    const LinkClientReport report = mailbox.report();
    EXPECT_EQ(report.poses_replaced, 1u);
    EXPECT_EQ(report.poses_stale, 1u);
}

TEST(Mailbox, AnInvalidPoseTakesBackTheWaitingOne) {
    Mailbox mailbox;
    mailbox.put_pose("first", 10.0);
    mailbox.put_invalid_pose();
    EXPECT_FALSE(mailbox.has_pose());
    EXPECT_EQ(mailbox.report().poses_invalid, 1u);
}

TEST(Mailbox, OrdersDoNotOutliveTheConnection) {
    Mailbox mailbox;
    EXPECT_FALSE(mailbox.put_order("too early"));
    mailbox.connected();
    EXPECT_TRUE(mailbox.put_order("one"));
    EXPECT_TRUE(mailbox.put_order("two"));
    EXPECT_EQ(mailbox.next_order(), "one");
    mailbox.disconnected("gone");
    EXPECT_FALSE(mailbox.next_order().has_value());
    EXPECT_FALSE(mailbox.put_order("too late"));
    EXPECT_EQ(mailbox.report().trouble, "gone");
}

TEST(Mailbox, KeepsTheNewestOfWhatTheServerSaid) {
    Mailbox mailbox;
    for (int i = 0; i < 300; ++i) {
        LinkStatus status;
        status.waypoints_left = i;
        mailbox.came(status);
    }
    const std::vector<ServerMessage> messages = mailbox.take_received(0.0);
    ASSERT_EQ(messages.size(), 256u);
    EXPECT_EQ(std::get<LinkStatus>(messages.back()).waypoints_left, 299);
    EXPECT_EQ(mailbox.report().received_dropped, 44u);
}

}  // namespace
}  // namespace hybrid_slam
