// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "hybrid_slam/link/codec.hpp"
#include "messages.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

template <typename Message>
Message client_round_trip(const Message& message) {
    return std::get<Message>(decode_client_json(encode_json(ClientMessage(message))));
}

template <typename Message>
Message server_round_trip(const Message& message) {
    return std::get<Message>(decode_server_json(encode_json(ServerMessage(message))));
}

std::string client_error(const std::string& line) {
    return error_of([&line] { decode_client_json(line); });
}

/// A good line with one member set to another JSON value, or removed.
std::string with(const ClientMessage& message, const char* key, const char* value) {
    nlohmann::json json = nlohmann::json::parse(encode_json(message));
    if (value == nullptr) {
        json.erase(key);
    } else {
        json[key] = nlohmann::json::parse(value);
    }
    return json.dump();
}

TEST(JsonCodec, KeepsAPoseToTheBit) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(-3.0, 3.0);
    for (int i = 0; i < 100; ++i) {
        LinkPose pose = test::some_pose(1000.0 * number(random));
        pose.map_from_robot = {number(random), number(random), number(random)};
        const LinkPose read = client_round_trip(pose);
        EXPECT_EQ(read.stamp, pose.stamp);
        EXPECT_EQ(read.map_from_robot.translation, pose.map_from_robot.translation);
        EXPECT_NEAR(read.map_from_robot.heading, pose.map_from_robot.heading, 1e-15);
        EXPECT_EQ(read.covariance, pose.covariance);
    }
}

TEST(JsonCodec, KeepsAllElseOfAPose) {
    const LinkPose read = client_round_trip(test::some_pose());
    EXPECT_EQ(read.map, "hall");
    EXPECT_EQ(read.age, 0.07);
    EXPECT_EQ(read.status, LinkPoseStatus::kTracking);
    EXPECT_EQ(read.score, 0.75);
    EXPECT_EQ(read.clear_ahead, 2.5);
    EXPECT_EQ(read.clear_behind, 0.3);
    EXPECT_FALSE(read.is_protective);
}

TEST(JsonCodec, TellsNoPoseWhenThereIsNone) {
    LinkPose pose = test::some_pose();
    pose.clear_ahead.reset();
    for (const LinkPoseStatus status : {LinkPoseStatus::kLost, LinkPoseStatus::kRelocalizing}) {
        pose.status = status;
        pose.map_from_robot.heading = kNan;
        const std::string line = encode_json(ClientMessage(pose));
        EXPECT_THAT(line, Not(HasSubstr("\"x\"")));
        EXPECT_THAT(line, Not(HasSubstr("covariance")));
        const LinkPose read = std::get<LinkPose>(decode_client_json(line));
        EXPECT_EQ(read.status, status);
        EXPECT_EQ(read.map_from_robot.heading, 0.0);
        EXPECT_FALSE(read.clear_ahead.has_value());
    }
}

TEST(JsonCodec, KeepsAHello) {
    for (const LinkRole role : {LinkRole::kPose, LinkRole::kGoal, LinkRole::kWatch}) {
        const LinkHello read = client_round_trip(LinkHello{role, 3, "secret", "truck \"7\"\n"});
        EXPECT_EQ(read.role, role);
        EXPECT_EQ(read.version, 3);
        EXPECT_EQ(read.token, "secret");
        EXPECT_EQ(read.name, "truck \"7\"\n");
    }
}

TEST(JsonCodec, KeepsAnInitialPoseBothWays) {
    const LinkInitialPose pose{{1.25, -0.1, 3.0}};
    EXPECT_EQ(client_round_trip(pose).map_from_robot.translation, pose.map_from_robot.translation);
    const auto told =
        std::get<LinkInitialPose>(decode_server_json(encode_json(ServerMessage(pose))));
    EXPECT_EQ(told.map_from_robot.heading, 3.0);
    EXPECT_THAT(error_of([] { decode_client_json(R"({"type":"initial_pose","x":1,"y":2})"); }),
                HasSubstr("heading: is missing"));
}

TEST(JsonCodec, KeepsGoals) {
    const LinkGoals read = client_round_trip(test::some_goals());
    ASSERT_EQ(read.waypoints.size(), 2u);
    EXPECT_EQ(read.waypoints[0].place, Eigen::Vector2d(1.3, -0.15));
    EXPECT_FALSE(read.waypoints[0].heading.has_value());
    EXPECT_EQ(read.waypoints[1].place, Eigen::Vector2d(-2.4, -1.6));
    EXPECT_EQ(read.waypoints[1].heading, 0.5);
    EXPECT_TRUE(read.append);
    EXPECT_EQ(read.id, "tour 7");
}

TEST(JsonCodec, KeepsCommands) {
    for (const LinkCommand command :
         {LinkCommand::kCancel, LinkCommand::kPause, LinkCommand::kResume, LinkCommand::kManual,
          LinkCommand::kAutomatic}) {
        EXPECT_EQ(client_round_trip(command), command);
    }
}

TEST(JsonCodec, KeepsAStatus) {
    const LinkStatus read = server_round_trip(test::some_status());
    EXPECT_EQ(read.mode, LinkMode::kAutomatic);
    EXPECT_EQ(read.state, LinkDriveState::kStopped);
    EXPECT_EQ(read.reason, "obstacle ahead");
    EXPECT_EQ(read.fault, "");
    EXPECT_EQ(read.goals, "tour 7");
    EXPECT_EQ(read.map, "hall");
    ASSERT_TRUE(read.map_from_robot.has_value());
    EXPECT_EQ(read.map_from_robot->vector(), Eigen::Vector3d(1.3, -0.15, 0.1234));
    EXPECT_EQ(read.pose_age, 0.052);
    EXPECT_EQ(read.speed, 0.25);
    EXPECT_EQ(read.steering, -0.125);
    EXPECT_EQ(read.waypoints_left, 2);
    EXPECT_EQ(read.remaining, 3.45);
    EXPECT_FALSE(server_round_trip(LinkStatus()).map_from_robot.has_value());
}

TEST(JsonCodec, KeepsWelcomesAndRefusals) {
    EXPECT_EQ(server_round_trip(LinkWelcome{4}).version, 4);
    EXPECT_EQ(server_round_trip(LinkRefusal{"no"}).reason, "no");
}

TEST(JsonCodec, CutsLongReasonsInsteadOfRefusingThem) {
    LinkStatus status = test::some_status();
    status.reason.clear();
    for (int i = 0; i < 300; ++i) {
        status.reason += "\u00e4";
    }
    const std::string read = server_round_trip(status).reason;
    EXPECT_GT(read.size(), 200u);
    EXPECT_EQ(read.substr(0, 200), status.reason.substr(0, 200));
    EXPECT_GT(server_round_trip(LinkRefusal{status.reason}).reason.size(), 200u);
    status.reason = "\xff\xfe not UTF-8";
    EXPECT_THAT(server_round_trip(status).reason, HasSubstr("not UTF-8"));
}

TEST(JsonCodec, IsDocumentedAsItIs) {
    // The example of docs/link.md, by hand.
    const auto message = decode_client_json(
        R"({"type":"pose","stamp":12.5,"map":"hall","status":"tracking","x":1.3,"y":-0.15,)"
        R"("heading":0.02,"covariance":[4e-4,0,0,4e-4,0,1e-4],"score":0.93,"clear_ahead":2.5,)"
        R"("protective":false,"battery":81})");
    const LinkPose& pose = std::get<LinkPose>(message);
    EXPECT_EQ(pose.map_from_robot.vector(), Eigen::Vector3d(1.3, -0.15, 0.02));
    EXPECT_EQ(pose.covariance(2, 2), 1e-4);
    EXPECT_FALSE(pose.clear_behind.has_value());
}

TEST(JsonCodec, PlacesTheCovarianceByRows) {
    const auto message =
        decode_client_json(with(test::some_pose(), "covariance", "[1, 0.2, 0.3, 2, 0.5, 3]"));
    Eigen::Matrix3d expected;
    expected << 1.0, 0.2, 0.3, 0.2, 2.0, 0.5, 0.3, 0.5, 3.0;
    EXPECT_EQ(std::get<LinkPose>(message).covariance, expected);
}

TEST(JsonCodec, WrapsHeadings) {
    const auto pose =
        std::get<LinkPose>(decode_client_json(with(test::some_pose(), "heading", "4")));
    EXPECT_NEAR(pose.map_from_robot.heading, 4.0 - 2.0 * kPi, 1e-12);
    const auto goals =
        std::get<LinkGoals>(decode_client_json(R"({"type":"goals","waypoints":[[1,2,-4]]})"));
    EXPECT_NEAR(goals.waypoints[0].heading.value(), 2.0 * kPi - 4.0, 1e-12);
    EXPECT_FALSE(goals.append);
}

TEST(JsonCodec, RefusesWhatIsNotAMessage) {
    for (const char* line : {"", "{", "[]", "17", "null", "\"pose\"", "{\"type\":\"pose\"} {}",
                             "GET / HTTP/1.1", "{\"a\":\"\xff\"}", "{\"stamp\":1e999}"}) {
        EXPECT_EQ(client_error(line), "not a JSON object in one line") << line;
    }
    EXPECT_EQ(client_error("{}"), "type: is missing");
    EXPECT_EQ(client_error(R"({"type":5})"), "type: must be a text");
    EXPECT_EQ(client_error(R"({"type":"fly"})"), R"(type: not one that this end takes: "fly")");
    EXPECT_THAT(client_error(encode_json(ServerMessage(test::some_status()))), HasSubstr("status"));
    EXPECT_THAT(error_of([] { decode_server_json(R"({"type":"cancel"})"); }), HasSubstr("cancel"));
}

TEST(JsonCodec, RefusesAPoseWithoutWhatIsNeeded) {
    for (const char* key : {"stamp", "status", "x", "y", "heading", "covariance", "protective"}) {
        EXPECT_EQ(client_error(with(test::some_pose(), key, nullptr)),
                  std::string(key) + ": is missing");
        EXPECT_EQ(client_error(with(test::some_pose(), key, "null")),
                  std::string(key) + ": is missing");
    }
    for (const char* key : {"map", "score", "clear_ahead", "clear_behind"}) {
        EXPECT_NO_THROW(decode_client_json(with(test::some_pose(), key, nullptr))) << key;
    }
}

TEST(JsonCodec, RefusesValuesThatCannotBe) {
    const std::pair<const char*, const char*> cases[] = {
        {"stamp", "\"now\""},
        {"stamp", "1e300"},
        {"status", "\"fine\""},
        {"status", "3"},
        {"x", "1000001"},
        {"y", "[1]"},
        {"heading", "1e9"},
        {"covariance", "[1,0,0,1,0]"},
        {"covariance", "[1,0,0,1,0,\"1\"]"},
        {"covariance", "[-1,0,0,1,0,1]"},
        {"covariance", "[1,1.5,0,1,0,1]"},
        {"covariance", "{}"},
        {"score", "1.5"},
        {"clear_ahead", "-0.1"},
        {"clear_behind", "true"},
        {"protective", "0"},
        {"map", "7"},
    };
    for (const auto& [key, value] : cases) {
        const std::string error = client_error(with(test::some_pose(), key, value));
        EXPECT_EQ(error.rfind(key, 0), 0u) << value << " gives: " << error;
    }
    for (const char* waypoints : {"[]", "[[1]]", "[[1,2,3,4]]", "[1,2]", "[[1,null]]", "7"}) {
        EXPECT_THAT(client_error(with(test::some_goals(), "waypoints", waypoints)),
                    HasSubstr("waypoints"));
    }
    EXPECT_THAT(client_error(with(test::some_goals(), "waypoints", "[[1,2000000]]")),
                HasSubstr("y"));
    EXPECT_THAT(client_error(with(LinkHello(), "version", "1.5")), HasSubstr("whole number"));
    EXPECT_THAT(client_error(with(LinkHello(), "version", "1e20")), HasSubstr("whole number"));
    const std::string text = '"' + std::string(300, 'a') + '"';
    EXPECT_THAT(client_error(with(LinkHello(), "token", text.c_str())), HasSubstr("at most"));
}

TEST(JsonCodec, DoesNotWriteWhatItWouldRefuse) {
    const auto refuses = [](const auto& change) {
        LinkPose pose = test::some_pose();
        change(pose);
        return !error_of([&pose] { encode_json(ClientMessage(pose)); }).empty();
    };
    EXPECT_TRUE(refuses([](LinkPose& pose) { pose.stamp = kNan; }));
    EXPECT_TRUE(refuses([](LinkPose& pose) { pose.map_from_robot.translation.x() = kInfinite; }));
    EXPECT_TRUE(refuses([](LinkPose& pose) { pose.map_from_robot.heading = kNan; }));
    EXPECT_TRUE(refuses([](LinkPose& pose) { pose.covariance(1, 0) = kNan; }));
    EXPECT_TRUE(refuses([](LinkPose& pose) { pose.clear_ahead = kInfinite; }));
    LinkStatus status = test::some_status();
    status.speed = kNan;
    EXPECT_THAT(error_of([&status] { encode_json(ServerMessage(status)); }), HasSubstr("speed"));
    EXPECT_THAT(error_of([] { encode_json(ClientMessage(LinkGoals())); }), HasSubstr("waypoints"));
}

}  // namespace
}  // namespace hybrid_slam
