// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "json_fields.hpp"
#include "message_limits.hpp"

namespace hybrid_slam {
namespace {

constexpr Words<LinkCommand, 3> kCommandTypes = {{{"cancel", LinkCommand::kCancel},
                                                  {"pause", LinkCommand::kPause},
                                                  {"resume", LinkCommand::kResume}}};

/// A reason may be any text: what is not UTF-8 in it is replaced.
std::string dump(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// So much shorter that replacements of a split character still fit.
std::string cut(const std::string& text) {
    return text.size() <= kMostText ? text : text.substr(0, kMostText - 16);
}

struct ToJson {
    Json operator()(const LinkHello& hello) const {
        check(hello);
        Json json = {{"type", "hello"},
                     {"role", word_of(kRoleWords, hello.role)},
                     {"version", hello.version}};
        put_text(json, "token", hello.token);
        put_text(json, "name", hello.name);
        return json;
    }

    Json operator()(const LinkPose& pose) const {
        check(pose);
        Json json = {{"type", "pose"},      {"stamp", pose.stamp},
                     {"age", pose.age},     {"status", word_of(kPoseStatusWords, pose.status)},
                     {"score", pose.score}, {"protective", pose.is_protective}};
        put_text(json, "map", pose.map);
        if (pose.is_known()) {
            put_pose(json, pose.map_from_robot);
            const Eigen::Matrix3d& p = pose.covariance;
            json["covariance"] = {p(0, 0), p(0, 1), p(0, 2), p(1, 1), p(1, 2), p(2, 2)};
        }
        put_number(json, "clear_ahead", pose.clear_ahead);
        put_number(json, "clear_behind", pose.clear_behind);
        return json;
    }

    Json operator()(const LinkGoals& goals) const {
        check(goals);
        Json waypoints = Json::array();
        for (const LinkWaypoint& waypoint : goals.waypoints) {
            Json numbers = Json::array({waypoint.place.x(), waypoint.place.y()});
            if (waypoint.heading) {
                numbers.push_back(*waypoint.heading);
            }
            waypoints.push_back(std::move(numbers));
        }
        Json json = {{"type", "goals"}, {"waypoints", std::move(waypoints)}};
        json["append"] = goals.append;
        put_text(json, "id", goals.id);
        return json;
    }

    Json operator()(LinkCommand command) const {
        if (command == LinkCommand::kManual || command == LinkCommand::kAutomatic) {
            const bool is_manual = command == LinkCommand::kManual;
            return {{"type", "mode"}, {"mode", is_manual ? "manual" : "automatic"}};
        }
        return {{"type", word_of(kCommandTypes, command)}};
    }

    Json operator()(const LinkInitialPose& pose) const {
        check(pose);
        Json json = {{"type", "initial_pose"}};
        put_pose(json, pose.map_from_robot);
        return json;
    }

    Json operator()(const LinkWelcome& welcome) const {
        return {{"type", "welcome"}, {"version", welcome.version}};
    }

    Json operator()(const LinkStatus& given) const {
        LinkStatus status = given;
        status.reason = cut(given.reason);
        status.fault = cut(given.fault);
        check(status);
        Json json = {{"type", "status"},
                     {"mode", word_of(kModeWords, status.mode)},
                     {"state", word_of(kDriveStateWords, status.state)},
                     {"speed", status.speed},
                     {"steering", status.steering},
                     {"pose_stamp", status.pose_stamp},
                     {"waypoints_left", status.waypoints_left},
                     {"remaining", status.remaining}};
        put_text(json, "reason", status.reason);
        put_text(json, "fault", status.fault);
        put_text(json, "goals", status.goals);
        put_text(json, "map", status.map);
        if (status.map_from_robot) {
            put_pose(json, *status.map_from_robot);
            json["pose_age"] = status.pose_age;
        }
        return json;
    }

    Json operator()(const LinkRefusal& refusal) const {
        return {{"type", "error"}, {"reason", cut(refusal.reason)}};
    }

    static void put_text(Json& json, const char* key, const std::string& text) {
        if (!text.empty()) {
            json[key] = text;
        }
    }
    static void put_number(Json& json, const char* key, const std::optional<double>& number) {
        if (number) {
            json[key] = *number;
        }
    }
    static void put_pose(Json& json, const Pose2d& pose) {
        json["x"] = pose.x();
        json["y"] = pose.y();
        json["heading"] = pose.heading;
    }
};

Json parse_object(std::string_view line) {
    Json json = Json::parse(line, nullptr, false);
    if (!json.is_object()) {
        throw Error("not a JSON object in one line");
    }
    return json;
}

Pose2d read_pose(const JsonFields& fields) {
    return {fields.number("x"), fields.number("y"), fields.number("heading")};
}

Eigen::Matrix3d read_covariance(const Json& numbers) {
    constexpr const char* kKey = "covariance";
    if (numbers.size() != 6) {
        throw Error("covariance: must have the 6 numbers xx, xy, xh, yy, yh, hh");
    }
    Eigen::Matrix3d covariance;
    int next = 0;
    for (int row = 0; row < 3; ++row) {
        for (int column = row; column < 3; ++column) {
            covariance(row, column) = JsonFields::as_number(kKey, numbers[next++]);
            covariance(column, row) = covariance(row, column);
        }
    }
    return covariance;
}

LinkHello read_hello(const JsonFields& fields) {
    LinkHello hello;
    hello.role = fields.word("role", kRoleWords);
    hello.version = fields.whole("version");
    hello.token = fields.maybe_text("token");
    hello.name = fields.maybe_text("name");
    check(hello);
    return hello;
}

LinkPose read_pose_message(const JsonFields& fields) {
    LinkPose pose;
    pose.stamp = fields.number("stamp");
    pose.age = fields.maybe_number("age").value_or(0.0);
    pose.map = fields.maybe_text("map");
    pose.status = fields.word("status", kPoseStatusWords);
    pose.score = fields.maybe_number("score").value_or(0.0);
    pose.is_protective = fields.flag("protective");
    if (pose.is_known()) {
        pose.map_from_robot = read_pose(fields);
        pose.covariance = read_covariance(fields.array("covariance"));
    }
    pose.clear_ahead = fields.maybe_number("clear_ahead");
    pose.clear_behind = fields.maybe_number("clear_behind");
    check(pose);
    normalize(pose);
    return pose;
}

LinkInitialPose read_initial_pose(const JsonFields& fields) {
    LinkInitialPose pose{read_pose(fields)};
    check(pose);
    pose.map_from_robot.heading = normalize_angle(pose.map_from_robot.heading);
    return pose;
}

LinkWaypoint read_waypoint(const Json& numbers) {
    constexpr const char* kKey = "waypoints";
    if (!numbers.is_array() || numbers.size() < 2 || numbers.size() > 3) {
        throw Error("waypoints: each must be [x, y] or [x, y, heading]");
    }
    LinkWaypoint waypoint;
    waypoint.place.x() = JsonFields::as_number(kKey, numbers[0]);
    waypoint.place.y() = JsonFields::as_number(kKey, numbers[1]);
    if (numbers.size() == 3) {
        waypoint.heading = JsonFields::as_number(kKey, numbers[2]);
    }
    return waypoint;
}

LinkGoals read_goals(const JsonFields& fields) {
    LinkGoals goals;
    for (const Json& waypoint : fields.array("waypoints")) {
        goals.waypoints.push_back(read_waypoint(waypoint));
    }
    goals.append = fields.maybe_flag("append");
    goals.id = fields.maybe_text("id");
    check(goals);
    normalize(goals);
    return goals;
}

LinkStatus read_status(const JsonFields& fields) {
    LinkStatus status;
    status.mode = fields.word("mode", kModeWords);
    status.state = fields.word("state", kDriveStateWords);
    status.reason = fields.maybe_text("reason");
    status.fault = fields.maybe_text("fault");
    status.goals = fields.maybe_text("goals");
    status.map = fields.maybe_text("map");
    if (fields.has("x")) {
        status.map_from_robot = read_pose(fields);
        status.pose_age = fields.number("pose_age");
    }
    status.pose_stamp = fields.maybe_number("pose_stamp").value_or(0.0);
    status.speed = fields.number("speed");
    status.steering = fields.number("steering");
    status.waypoints_left = fields.whole("waypoints_left");
    status.remaining = fields.number("remaining");
    check(status);
    return status;
}

[[noreturn]] void refuse_type(const std::string& type) {
    // The reason goes into a log and a terminal: a stranger's text is not for them as it is.
    throw Error("type: not one that this end takes" +
                (type.size() > 32 ? std::string() : ": " + dump(type)));
}

}  // namespace

std::string_view to_string(LinkMode mode) {
    return word_of(kModeWords, mode);
}

std::string_view to_string(LinkDriveState state) {
    return word_of(kDriveStateWords, state);
}

std::string encode_json(const ClientMessage& message) {
    return dump(std::visit(ToJson{}, message));
}

std::string encode_json(const ServerMessage& message) {
    return dump(std::visit(ToJson{}, message));
}

ClientMessage decode_client_json(std::string_view line) {
    const Json json = parse_object(line);
    const JsonFields fields(json);
    const std::string type = fields.text("type");
    if (type == "hello") {
        return read_hello(fields);
    }
    if (type == "pose") {
        return read_pose_message(fields);
    }
    if (type == "goals") {
        return read_goals(fields);
    }
    if (type == "mode") {
        const bool is_manual = fields.word("mode", kModeWords) == LinkMode::kManual;
        return is_manual ? LinkCommand::kManual : LinkCommand::kAutomatic;
    }
    if (type == "initial_pose") {
        return read_initial_pose(fields);
    }
    for (const auto& [name, command] : kCommandTypes) {
        if (type == name) {
            return command;
        }
    }
    refuse_type(type);
}

ServerMessage decode_server_json(std::string_view line) {
    const Json json = parse_object(line);
    const JsonFields fields(json);
    const std::string type = fields.text("type");
    if (type == "welcome") {
        return LinkWelcome{fields.whole("version")};
    }
    if (type == "status") {
        return read_status(fields);
    }
    if (type == "error") {
        return LinkRefusal{fields.text("reason")};
    }
    if (type == "initial_pose") {
        return read_initial_pose(fields);
    }
    refuse_type(type);
}

}  // namespace hybrid_slam
