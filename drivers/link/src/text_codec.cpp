// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "message_limits.hpp"
#include "words.hpp"

namespace hybrid_slam {
namespace {

constexpr std::string_view kUnknown = "-";
constexpr std::string_view kHelloWord = "TEXT";

std::vector<std::string_view> split(std::string_view line) {
    constexpr std::string_view kBlank = " \t";
    std::vector<std::string_view> words;
    std::size_t begin = line.find_first_not_of(kBlank);
    while (begin != std::string_view::npos) {
        const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
        words.push_back(line.substr(begin, end - begin));
        begin = line.find_first_not_of(kBlank, end);
    }
    return words;
}

/// Gives the words of a line one after the other.
class Reader {
  public:
    explicit Reader(std::string_view line) : words_(split(line)) {}

    bool at_end() const { return next_ == words_.size(); }
    std::string_view word(const char* what) {
        if (at_end()) {
            throw Error(std::string(what) + ": is missing");
        }
        return words_[next_++];
    }
    double number(const char* what) {
        const std::optional<double> value = maybe_number(what);
        if (!value) {
            throw Error(std::string(what) + ": must be a number");
        }
        return *value;
    }
    std::optional<double> maybe_number(const char* what) {
        const std::string_view text = word(what);
        if (text == kUnknown) {
            return std::nullopt;
        }
        double value = 0.0;
        const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || stop != text.data() + text.size() || !std::isfinite(value)) {
            throw Error(std::string(what) + ": must be a number");
        }
        return value;
    }
    std::string maybe_word() {
        const std::string_view text = at_end() ? kUnknown : words_[next_++];
        return std::string(text == kUnknown ? std::string_view() : text);
    }
    void finish() const {
        if (!at_end()) {
            throw Error("more words than expected");
        }
    }

  private:
    std::vector<std::string_view> words_;
    std::size_t next_ = 0;
};

LinkHello read_hello(Reader& reader) {
    LinkHello hello;
    const double version = reader.number("version");
    if (!(std::abs(version) < 1e6) || version != std::floor(version)) {
        throw Error("version: must be a whole number");
    }
    hello.version = static_cast<int>(version);
    hello.role = value_of(kRoleWords, reader.word("role"), "role");
    hello.token = reader.maybe_word();
    hello.name = reader.maybe_word();
    check(hello);
    return hello;
}

double squared(double sigma) {
    if (sigma < 0.0) {
        throw Error("sigma: must not be negative");
    }
    return sigma * sigma;
}

LinkPose read_pose(Reader& reader) {
    LinkPose pose;
    pose.stamp = reader.number("stamp");
    const std::optional<double> x = reader.maybe_number("x");
    const std::optional<double> y = reader.maybe_number("y");
    const std::optional<double> heading = reader.maybe_number("heading");
    const std::optional<double> sigma = reader.maybe_number("sigma_xy");
    const std::optional<double> sigma_heading = reader.maybe_number("sigma_heading");
    pose.status = value_of(kPoseStatusWords, reader.word("status"), "status");
    pose.score = reader.number("score");
    pose.clear_ahead = reader.maybe_number("ahead");
    pose.clear_behind = reader.maybe_number("behind");
    const std::string_view protective = reader.word("protective");
    if (protective != "0" && protective != "1") {
        throw Error("protective: must be 0 or 1");
    }
    pose.is_protective = protective == "1";
    pose.age = reader.at_end() ? 0.0 : reader.number("age");
    if (pose.is_known()) {
        if (!x || !y || !heading || !sigma || !sigma_heading) {
            throw Error("x, y, heading and sigmas: must be numbers unless lost or relocalizing");
        }
        pose.map_from_robot = {*x, *y, *heading};
        pose.covariance.diagonal() << squared(*sigma), squared(*sigma), squared(*sigma_heading);
    }
    check(pose);
    normalize(pose);
    return pose;
}

/// A PLC has one place at a time to say: each is put behind those that wait.
LinkGoals read_goal(Reader& reader) {
    LinkWaypoint waypoint;
    waypoint.place.x() = reader.number("x");
    waypoint.place.y() = reader.number("y");
    if (!reader.at_end()) {
        waypoint.heading = reader.maybe_number("heading");
    }
    LinkGoals goals;
    goals.waypoints.push_back(waypoint);
    goals.append = true;
    check(goals);
    normalize(goals);
    return goals;
}

LinkInitialPose read_initial_pose(Reader& reader) {
    LinkInitialPose pose;
    const double x = reader.number("x");
    const double y = reader.number("y");
    pose.map_from_robot = {x, y, reader.number("heading")};
    check(pose);
    pose.map_from_robot.heading = normalize_angle(pose.map_from_robot.heading);
    return pose;
}

ClientMessage read_message(std::string_view kind, Reader& reader) {
    if (kind == kHelloWord) {
        return read_hello(reader);
    }
    if (kind == "P") {
        return read_pose(reader);
    }
    if (kind == "G") {
        return read_goal(reader);
    }
    if (kind == "S") {
        return LinkCommand::kCancel;
    }
    if (kind == "H") {
        return LinkCommand::kPause;
    }
    if (kind == "R") {
        return LinkCommand::kResume;
    }
    if (kind == "M") {
        const LinkMode mode = value_of(kModeWords, reader.word("mode"), "mode");
        return mode == LinkMode::kManual ? LinkCommand::kManual : LinkCommand::kAutomatic;
    }
    if (kind == "I") {
        return read_initial_pose(reader);
    }
    throw Error("a line starts with TEXT, P, G, S, H, R, M or I");
}

/// Without what would end the line early or steer a terminal.
std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(),
        [](char c) {
            const auto byte = static_cast<unsigned char>(c);
            return byte < 0x20 || byte == 0x7f;
        },
        ' ');
    return text.substr(0, kMostText);
}

struct ToText {
    std::string operator()(const LinkWelcome& welcome) const {
        return fmt::format("OK {}", welcome.version);
    }
    std::string operator()(const LinkStatus& status) const {
        std::string pose = "- - - -";
        if (status.map_from_robot) {
            const Pose2d& at = *status.map_from_robot;
            pose = fmt::format("{:.3f} {:.3f} {:.3f} {:.4f}", status.pose_age, at.x(), at.y(),
                               at.heading);
        }
        const std::string line =
            fmt::format("D {} {} {} {:.3f} {} {:.3f} {:.4f}", word_of(kModeWords, status.mode),
                        word_of(kDriveStateWords, status.state), status.waypoints_left,
                        status.remaining, pose, status.speed, status.steering);
        const std::string& why = status.fault.empty() ? status.reason : status.fault;
        return why.empty() ? line : line + " " + one_line(why);
    }
    std::string operator()(const LinkInitialPose& pose) const {
        check(pose);
        const Pose2d& at = pose.map_from_robot;
        return fmt::format("I {:.3f} {:.3f} {:.4f}", at.x(), at.y(), at.heading);
    }
    std::string operator()(const LinkRefusal& refusal) const {
        return "E " + one_line(refusal.reason);
    }
};

}  // namespace

bool is_text_hello(std::string_view line) {
    return line.substr(0, kHelloWord.size()) == kHelloWord;
}

ClientMessage decode_client_text(std::string_view line) {
    Reader reader(line);
    const std::string_view kind = reader.word("line");
    const ClientMessage message = read_message(kind, reader);
    reader.finish();
    return message;
}

std::string encode_text(const ServerMessage& message) {
    return std::visit(ToText{}, message);
}

}  // namespace hybrid_slam
