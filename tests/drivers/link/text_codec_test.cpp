// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/link/codec.hpp"
#include "messages.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using ::testing::HasSubstr;

template <typename Message>
Message read(const char* line) {
    return std::get<Message>(decode_client_text(line));
}

TEST(TextCodec, ReadsAHello) {
    EXPECT_TRUE(is_text_hello("TEXT 1 pose"));
    EXPECT_FALSE(is_text_hello("{\"type\":\"hello\"}"));
    EXPECT_FALSE(is_text_hello(""));
    const LinkHello hello = read<LinkHello>("TEXT 1 goal secret plc_7");
    EXPECT_EQ(hello.role, LinkRole::kGoal);
    EXPECT_EQ(hello.version, 1);
    EXPECT_EQ(hello.token, "secret");
    EXPECT_EQ(hello.name, "plc_7");
    EXPECT_EQ(read<LinkHello>("TEXT 2 watch").version, 2);
    const LinkHello named = read<LinkHello>("TEXT  1 \t pose - plc ");
    EXPECT_EQ(named.token, "");
    EXPECT_EQ(named.name, "plc");
}

TEST(TextCodec, ReadsAPose) {
    const LinkPose pose = read<LinkPose>("P 12.5 1.3 -0.15 0.02 0.03 0.01 degraded 0.9 2.5 - 1");
    EXPECT_EQ(pose.stamp, 12.5);
    EXPECT_EQ(pose.status, LinkPoseStatus::kDegraded);
    EXPECT_EQ(pose.map_from_robot.translation, Eigen::Vector2d(1.3, -0.15));
    EXPECT_NEAR(pose.map_from_robot.heading, 0.02, 1e-15);
    const Eigen::Vector3d variances(9e-4, 9e-4, 1e-4);
    EXPECT_TRUE(pose.covariance.isApprox(Eigen::Matrix3d(variances.asDiagonal()), 1e-12));
    EXPECT_EQ(pose.score, 0.9);
    EXPECT_EQ(pose.clear_ahead, 2.5);
    EXPECT_FALSE(pose.clear_behind.has_value());
    EXPECT_TRUE(pose.is_protective);
    EXPECT_EQ(pose.age, 0.0);
    EXPECT_EQ(read<LinkPose>("P 12.5 1.3 -0.15 0.02 0.03 0.01 tracking 0.9 2.5 - 1 0.08").age,
              0.08);
}

TEST(TextCodec, ReadsALostPoseWithoutNumbers) {
    const LinkPose pose = read<LinkPose>("P 12.5 - - - - - lost 0 - - 0");
    EXPECT_EQ(pose.status, LinkPoseStatus::kLost);
    EXPECT_FALSE(pose.is_protective);
    // What it says beside that is not believed.
    EXPECT_EQ(read<LinkPose>("P 1 7 8 1 1 1 relocalizing 0 - - 0").map_from_robot.x(), 0.0);
}

TEST(TextCodec, ReadsGoalsOneByOne) {
    const LinkGoals goals = read<LinkGoals>("G 1.3 -0.15");
    ASSERT_EQ(goals.waypoints.size(), 1u);
    EXPECT_EQ(goals.waypoints[0].place, Eigen::Vector2d(1.3, -0.15));
    EXPECT_FALSE(goals.waypoints[0].heading.has_value());
    EXPECT_TRUE(goals.append);
    EXPECT_NEAR(read<LinkGoals>("G 1 2 4").waypoints[0].heading.value(), 4.0 - 2.0 * kPi, 1e-12);
}

TEST(TextCodec, ReadsCommands) {
    EXPECT_EQ(read<LinkCommand>("S"), LinkCommand::kCancel);
    EXPECT_EQ(read<LinkCommand>("H"), LinkCommand::kPause);
    EXPECT_EQ(read<LinkCommand>("R"), LinkCommand::kResume);
    EXPECT_EQ(read<LinkCommand>("M manual"), LinkCommand::kManual);
    EXPECT_EQ(read<LinkCommand>("M automatic"), LinkCommand::kAutomatic);
    EXPECT_EQ(read<LinkInitialPose>("I 1 2 0.5").map_from_robot.y(), 2.0);
}

TEST(TextCodec, RefusesWhatItDoesNotKnow) {
    const std::pair<const char*, const char*> cases[] = {
        {"", "line: is missing"},
        {"X 1 2", "a line starts with"},
        {"p 1 2", "a line starts with"},
        {"S now", "more words"},
        {"G 1", "y: is missing"},
        {"G 1 2 3 4", "more words"},
        {"G 1 1,5", "y: must be a number"},
        {"G nan 1", "x: must be a number"},
        {"G 1 inf", "y: must be a number"},
        {"G 1e7 1", "x: must be a number from"},
        {"G - 1", "x: must be a number"},
        {"M off", "mode: must be one of manual, automatic"},
        {"TEXT 1", "role: is missing"},
        {"TEXT 1.5 pose", "version: must be a whole number"},
        {"TEXT 1 pilot", "role: must be one of"},
        {"P 12.5 1.3 -0.15 0.02 0.03 0.01 tracking 0.9 2.5 -", "protective: is missing"},
        {"P 12.5 1.3 -0.15 0.02 0.03 0.01 tracking 0.9 2.5 - 2", "protective: must be 0 or 1"},
        {"P 12.5 1.3 -0.15 - 0.03 0.01 tracking 0.9 2.5 - 0", "unless lost"},
        {"P 12.5 1.3 -0.15 0 -0.03 0.01 tracking 0.9 2.5 - 0", "sigma: must not be negative"},
        {"P 12.5 1.3 -0.15 0 0.03 0.01 fine 0.9 2.5 - 0", "status: must be one of tracking"},
        {"P - 1.3 -0.15 0 0.03 0.01 tracking 0.9 2.5 - 0", "stamp: must be a number"},
    };
    for (const auto& [line, reason] : cases) {
        EXPECT_THAT(error_of([line = line] { decode_client_text(line); }), HasSubstr(reason))
            << line;
    }
}

TEST(TextCodec, WritesWhatTheServerSays) {
    EXPECT_EQ(encode_text(LinkWelcome()), "OK 1");
    EXPECT_EQ(encode_text(LinkRefusal{"line\nbreak"}), "E line break");
    EXPECT_EQ(encode_text(test::some_status()),
              "D automatic stopped 2 3.450 0.052 1.300 -0.150 0.1234 0.250 -0.1250 obstacle ahead");
    LinkStatus status;
    EXPECT_EQ(encode_text(status), "D manual idle 0 0.000 - - - - 0.000 0.0000");
    status.reason = "paused";
    status.fault = "no heartbeat\r\n";
    EXPECT_EQ(encode_text(status), "D manual idle 0 0.000 - - - - 0.000 0.0000 no heartbeat  ");
}

}  // namespace
}  // namespace hybrid_slam
