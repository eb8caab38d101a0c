// SPDX-License-Identifier: Apache-2.0
#include "outgoing.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace hybrid_slam {
namespace {

constexpr double kStandingSpeed = 0.005;  // m/s
constexpr double kMostPoseAge = 1.0;      // s
constexpr double kChiSquare95 = 5.991;    // two degrees of freedom
/// For a vehicle that does not measure it; the standard's number for "good".
constexpr double kUnknownBattery = 80.0;

double finite_or_zero(double value) {
    return std::isfinite(value) ? value : 0.0;
}

bool is_finite(const Pose2d& pose) {
    return pose.vector().allFinite();
}

Json position_json(const Pose2d& pose, const std::string& map, bool is_initialized) {
    return {{"x", pose.x()},
            {"y", pose.y()},
            {"theta", normalize_angle(pose.heading)},
            {"mapId", map},
            {"positionInitialized", is_initialized}};
}

/// A pose that is not known now is told as such, with the last place if there is one.
void add_position(Json& body, const FleetStatus& status, bool is_fresh) {
    const std::optional<Pose2d>& last = status.drive.map_from_robot;
    if (!is_fresh || !is_localized(status)) {
        if (last && is_finite(*last)) {
            body["agvPosition"] = position_json(*last, status.drive.map, false);
            body["agvPosition"]["localizationScore"] = 0.0;
        }
        return;
    }
    const LinkPose& pose = *status.pose;
    const std::string& map = pose.map.empty() ? status.drive.map : pose.map;
    Json position = position_json(pose.map_from_robot, map, true);
    position["localizationScore"] = std::clamp(finite_or_zero(pose.score), 0.0, 1.0);
    const double range = deviation_range(pose.covariance);
    if (std::isfinite(range)) {
        position["deviationRange"] = range;
    }
    body["agvPosition"] = std::move(position);
}

/// The fixed axle does not slip: vy = 0, and it turns with v tan(steering) / wheelbase.
void add_velocity(Json& body, const FleetStatus& status, double wheelbase) {
    const double speed = finite_or_zero(status.drive.speed);
    const double turn = finite_or_zero(speed * std::tan(status.drive.steering) / wheelbase);
    body["velocity"] = {{"vx", speed}, {"vy", 0.0}, {"omega", turn}};
}

Json error_json(const std::string& type, const std::string& text, const char* level,
                const References& references) {
    Json error = {{"errorType", type}, {"errorDescription", text}, {"errorLevel", level}};
    for (const auto& [key, value] : references) {
        error["errorReferences"].push_back({{"referenceKey", key}, {"referenceValue", value}});
    }
    return error;
}

Json errors_json(const StateView& view) {
    Json errors = Json::array();
    for (const FleetProblem& problem : view.problems) {
        errors.push_back(error_json(problem.type, problem.text, "WARNING", problem.references));
    }
    if (!view.is_fresh) {
        errors.push_back(error_json("driveSilent", "the drive tells nothing", "FATAL", {}));
        return errors;
    }
    const LinkStatus& drive = view.status.drive;
    if (!drive.fault.empty()) {
        errors.push_back(error_json("driveFault", drive.fault, "FATAL", {}));
    }
    if (view.is_held) {
        errors.push_back(error_json("driveStopped", drive.reason, "WARNING", {}));
    }
    if (!is_localized(view.status)) {
        errors.push_back(
            error_json("localizationError", "the position is not known", "WARNING", {}));
    }
    return errors;
}

const char* name_of(ActionStatus status) {
    switch (status) {
        case ActionStatus::kWaiting:
            return "WAITING";
        case ActionStatus::kRunning:
            return "RUNNING";
        case ActionStatus::kFinished:
            return "FINISHED";
        case ActionStatus::kFailed:
            break;
    }
    return "FAILED";
}

Json actions_json(const ActionStates& actions) {
    Json list = Json::array();
    for (const ActionState& action : actions.list()) {
        Json state = {{"actionId", action.id},
                      {"actionType", action.type},
                      {"actionStatus", name_of(action.status)}};
        if (!action.result.empty()) {
            state["resultDescription"] = action.result;
        }
        list.push_back(std::move(state));
    }
    return list;
}

void add_order(Json& body, const OrderBook& book) {
    body["orderId"] = book.order_id();
    body["orderUpdateId"] = book.update();
    body["lastNodeId"] = book.last_node();
    body["lastNodeSequenceId"] = book.last_sequence();
    body["newBaseRequest"] = book.wants_base();
    body["nodeStates"] = Json::array();
    for (const OrderNode& node : book.nodes()) {
        Json state = {
            {"nodeId", node.id}, {"sequenceId", node.sequence}, {"released", node.is_released}};
        Json position = {{"x", node.position->place.x()},
                         {"y", node.position->place.y()},
                         {"mapId", node.position->map}};
        if (node.position->theta) {
            position["theta"] = *node.position->theta;
        }
        state["nodePosition"] = std::move(position);
        body["nodeStates"].push_back(std::move(state));
    }
    body["edgeStates"] = Json::array();
    for (const OrderEdge& edge : book.edges()) {
        body["edgeStates"].push_back(
            {{"edgeId", edge.id}, {"sequenceId", edge.sequence}, {"released", edge.is_released}});
    }
}

void add_safety(Json& body, const FleetStatus& status) {
    const char* stop = status.is_emergency_stop ? "MANUAL"
                       : status.is_protective   ? "AUTOACK"
                                                : "NONE";
    body["safetyState"] = {{"eStop", stop}, {"fieldViolation", status.is_protective}};
}

void add_battery(Json& body, const FleetStatus& status) {
    const bool is_known = status.battery && std::isfinite(*status.battery);
    const double charge = is_known ? std::clamp(*status.battery, 0.0, 100.0) : kUnknownBattery;
    body["batteryState"] = {{"batteryCharge", charge}, {"charging", status.is_charging}};
    body["information"] = Json::array();
    if (!is_known) {
        body["information"].push_back({{"infoType", "batteryUnknown"},
                                       {"infoDescription", "the battery is not measured"},
                                       {"infoLevel", "INFO"}});
    }
}

}  // namespace

bool is_localized(const FleetStatus& status) {
    return status.pose && status.pose->is_known() && is_finite(status.pose->map_from_robot) &&
           status.drive.pose_age <= kMostPoseAge;
}

bool is_standing(const FleetStatus& status) {
    return std::abs(status.drive.speed) <= kStandingSpeed;
}

bool is_paused(const FleetStatus& status) {
    return status.is_paused || status.drive.state == LinkDriveState::kPaused;
}

double deviation_range(const Eigen::Matrix3d& covariance) {
    // The greater eigenvalue of a symmetric 2 x 2 matrix: mean + sqrt(half difference^2 + xy^2).
    const double mean = 0.5 * (covariance(0, 0) + covariance(1, 1));
    const double half = 0.5 * (covariance(0, 0) - covariance(1, 1));
    const double greater = mean + std::hypot(half, covariance(0, 1));
    return std::sqrt(kChiSquare95 * std::max(greater, 0.0));
}

Json state_body(const StateView& view) {
    const FleetStatus& status = view.status;
    Json body = Json::object();
    add_order(body, view.book);
    add_position(body, status, view.is_fresh);
    if (view.is_fresh) {
        add_velocity(body, status, view.wheelbase);
    }
    add_battery(body, status);
    add_safety(body, status);
    body["driving"] = view.is_fresh && !is_standing(status);
    body["paused"] = is_paused(status);
    body["operatingMode"] = status.drive.mode == LinkMode::kAutomatic ? "AUTOMATIC" : "MANUAL";
    body["actionStates"] = actions_json(view.actions);
    body["errors"] = errors_json(view);
    body["loads"] = Json::array();
    return body;
}

Json visualization_body(const FleetStatus& status, double wheelbase) {
    Json body = Json::object();
    add_position(body, status, true);
    add_velocity(body, status, wheelbase);
    return body;
}

std::string iso_time(std::chrono::system_clock::time_point time) {
    using std::chrono::milliseconds;
    const auto since = std::chrono::floor<milliseconds>(time.time_since_epoch());
    const auto seconds = std::chrono::floor<std::chrono::seconds>(since);
    const std::time_t whole = static_cast<std::time_t>(seconds.count());
    std::tm parts{};
    gmtime_r(&whole, &parts);
    char text[32];
    const std::size_t size = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
    const std::string digits = std::to_string(1000 + (since - seconds).count());
    return std::string(text, size) + "." + digits.substr(1) + "Z";
}

}  // namespace hybrid_slam
