// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/fleet/fleet_protocol.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "fleet_limits.hpp"
#include "incoming.hpp"
#include "instant_actions.hpp"
#include "order_book.hpp"
#include "outgoing.hpp"

namespace hybrid_slam {
namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();

FleetConfig checked(FleetConfig config) {
    check(config);
    return config;
}

/// What of a status is told at once when it changes, and not with the next state in time.
std::string key_of(const FleetStatus& status, bool is_fresh, bool is_held) {
    std::string key;
    for (const bool flag : {is_fresh, is_held, is_standing(status), is_paused(status),
                            status.is_protective, status.is_emergency_stop, status.is_charging,
                            is_localized(status), status.drive.mode == LinkMode::kAutomatic}) {
        key += flag ? '1' : '0';
    }
    // A reason may count metres, but a new word of it is news.
    for (const char c : status.drive.fault + "|" + (is_held ? status.drive.reason : "")) {
        if (std::string_view("0123456789.-").find(c) == std::string_view::npos) {
            key += c;
        }
    }
    return key;
}

}  // namespace

struct FleetProtocol::Impl {
    Impl(const FleetConfig& fleet_config, const FleetVehicle& fleet_vehicle, WallClock wall_clock)
        : config(checked(fleet_config)),
          vehicle(fleet_vehicle),
          clock(std::move(wall_clock)),
          identity{config.manufacturer, config.serial_number},
          book(config, vehicle),
          actions(config, book) {}

    bool is_fresh(double now) const { return now - told_at <= kMostSilence; }

    /// A drive also stops to plan a way or to turn its wheel, which is no news.
    bool is_held(double now) const {
        return status.drive.state == LinkDriveState::kStopped && now - moved_at >= kHeldAfter;
    }

    /// What the drive will be once it has done what it was told.
    bool will_be_paused() const {
        return (is_paused(status) || actions.states().is_running("startPause")) &&
               !actions.states().is_running("stopPause");
    }

    std::string topic(std::string_view name) const {
        return config.interface_name + "/v2/" + config.manufacturer + "/" + config.serial_number +
               "/" + std::string(name);
    }

    /// The ids count per topic.
    FleetMessage message(const char* name, Json body, int qos = 0, bool is_retained = false) {
        auto& id = std::find_if(header_ids.begin(), header_ids.end(), [name](const auto& counter) {
                       return std::string_view(counter.first) == name;
                   })->second;
        body["headerId"] = id++;
        body["timestamp"] = iso_time(clock());
        body["version"] = "2.1.0";
        body["manufacturer"] = config.manufacturer;
        body["serialNumber"] = config.serial_number;
        return {topic(name), dump(body), qos, is_retained};
    }

    FleetMessage connection(const char* state) {
        return message("connection", {{"connectionState", state}}, 1, true);
    }

    void add_problem(FleetProblem problem) {
        is_changed = true;
        problems.erase(std::remove(problems.begin(), problems.end(), problem), problems.end());
        problems.push_back(std::move(problem));
        if (problems.size() > kMostProblems) {
            problems.pop_front();
        }
    }

    void end_order(const char* type, const std::string& reason) {
        const References ids = {{"orderId", book.order_id()},
                                {"orderUpdateId", std::to_string(book.update())}};
        book.end();
        add_problem({type, reason, ids});
    }

    void take(const Order& order, double now) {
        if (book.has(order)) {
            ++counts.orders_repeated;
            return;
        }
        if (actions.states().is_running("cancelOrder")) {
            throw FleetRefusal(kOrderError, "the order before is still being cancelled",
                               order.references());
        }
        const bool is_new = order.id != book.order_id();
        std::optional<Pose2d> pose;
        if (is_fresh(now) && is_localized(status)) {
            pose = status.pose->map_from_robot;
        }
        std::optional<LinkGoals> goals =
            book.take(order, {status.drive.mode, status.drive.map, pose, status.drive.goals});
        ++counts.orders;
        problems.clear();
        if (is_new) {
            actions.forget_over();
        }
        if (goals) {
            // Whatever a drive makes of goals in a pause, the fleet's own pause outlasts them.
            const bool is_paused_on = will_be_paused() && !goals->append;
            events.emplace_back(std::move(*goals));
            if (is_paused_on) {
                events.emplace_back(LinkCommand::kPause);
            }
        }
    }

    void start(const FleetAction& action, double now) {
        InstantActions::Outcome out = actions.start(action, status, now);
        ++(out.is_refused ? counts.actions_refused : counts.actions);
        events.insert(events.end(), out.events.begin(), out.events.end());
        for (FleetProblem& problem : out.problems) {
            add_problem(std::move(problem));
        }
        wants_factsheet |= out.wants_factsheet;
        wants_state |= out.wants_state;
    }

    void follow_mode(LinkMode before) {
        if (status.drive.mode == before) {
            return;
        }
        // "When AGV enters or leaves this mode, it immediately clears all the orders."
        actions.drop_for_manual();
        if (book.is_active()) {
            end_order("orderCleared", "the vehicle was taken over by hand");
            events.emplace_back(LinkCommand::kCancel);
        }
    }

    void follow_order() {
        const std::uint32_t sequence = book.last_sequence();
        const std::string ended = book.follow(status.drive);
        is_changed |= book.last_sequence() != sequence;
        if (ended.empty()) {
            return;
        }
        if (!actions.states().is_running("cancelOrder")) {
            end_order("orderCleared", ended);
        } else if (status.drive.waypoints_left > 0) {
            book.end();  // these are others' goals; else it ends when the vehicle stands
        }
    }

    bool is_state_due(double now) {
        std::string key = key_of(status, is_fresh(now), is_held(now));
        is_changed |= key != told_key;
        told_key = std::move(key);
        if (wants_state || now - last_state >= config.state_period) {
            return true;
        }
        return is_changed && now - last_state >= kLeastStateInterval;
    }

    FleetMessage state(double now) {
        wants_state = false;
        is_changed = false;
        last_state = now;
        return message("state", state_body({book, actions.states(), problems, status,
                                            vehicle.wheelbase, is_held(now), is_fresh(now)}));
    }

    const FleetConfig config;
    const FleetVehicle vehicle;
    const WallClock clock;
    const FleetIdentity identity;
    OrderBook book;
    InstantActions actions;
    std::deque<FleetProblem> problems;
    std::vector<FleetEvent> events;
    FleetStatus status;
    FleetCounts counts;
    std::array<std::pair<const char*, std::uint32_t>, 4> header_ids = {
        {{"connection", 0}, {"state", 0}, {"visualization", 0}, {"factsheet", 0}}};
    std::string told_key;
    double told_at = kNever;   ///< when the drive told its status
    double moved_at = kNever;  ///< when the drive was last not stopped
    double last_state = kNever;
    double last_visualization = kNever;
    bool is_status_new = false;
    bool is_changed = true;
    bool wants_state = true;
    bool wants_factsheet = true;
};

FleetProtocol::FleetProtocol(const FleetConfig& config, const FleetVehicle& vehicle,
                             WallClock clock)
    : impl_(std::make_unique<Impl>(config, vehicle, std::move(clock))) {}

FleetProtocol::~FleetProtocol() = default;

std::string FleetProtocol::topic(std::string_view name) const {
    return impl_->topic(name);
}

void FleetProtocol::take_order(std::string_view text, double now) {
    impl_->is_changed = true;
    try {
        impl_->take(parse_order(text, impl_->identity), now);
    } catch (const FleetRefusal& refusal) {
        ++impl_->counts.orders_refused;
        impl_->add_problem(refusal.problem);
    }
}

void FleetProtocol::take_instant_actions(std::string_view text, double now) {
    impl_->is_changed = true;
    try {
        for (const FleetAction& action : parse_instant_actions(text, impl_->identity)) {
            impl_->start(action, now);
        }
    } catch (const FleetRefusal& refusal) {
        ++impl_->counts.actions_refused;
        impl_->add_problem(refusal.problem);
    }
}

void FleetProtocol::update(const FleetStatus& status, double now) {
    const LinkMode before = impl_->status.drive.mode;
    impl_->status = status;
    impl_->told_at = now;
    if (status.drive.state != LinkDriveState::kStopped) {
        impl_->moved_at = now;
    }
    impl_->is_status_new = true;
    impl_->follow_mode(before);
    impl_->follow_order();
    impl_->is_changed |= impl_->actions.follow(status, now);
}

void FleetProtocol::refuse(const std::string& reason) {
    if (impl_->book.is_active()) {
        impl_->end_order(kOrderError, reason);
    }
}

std::vector<FleetEvent> FleetProtocol::events() {
    return std::exchange(impl_->events, {});
}

FleetMessage FleetProtocol::will() {
    return impl_->connection("CONNECTIONBROKEN");
}
FleetMessage FleetProtocol::online() {
    return impl_->connection("ONLINE");
}
FleetMessage FleetProtocol::offline() {
    return impl_->connection("OFFLINE");
}

void FleetProtocol::announce() {
    impl_->wants_state = true;
    impl_->wants_factsheet = true;
}

std::vector<FleetMessage> FleetProtocol::due(double now) {
    std::vector<FleetMessage> messages;
    if (std::exchange(impl_->wants_factsheet, false)) {
        messages.push_back(
            impl_->message("factsheet", factsheet_body(impl_->config, impl_->vehicle), 0, true));
    }
    if (impl_->is_state_due(now)) {
        messages.push_back(impl_->state(now));
    }
    const double period = impl_->config.visualization_period;
    if (impl_->is_status_new && period > 0.0 && now - impl_->last_visualization >= period) {
        impl_->is_status_new = false;
        impl_->last_visualization = now;
        messages.push_back(impl_->message(
            "visualization", visualization_body(impl_->status, impl_->vehicle.wheelbase)));
    }
    return messages;
}

const FleetCounts& FleetProtocol::counts() const {
    return impl_->counts;
}

}  // namespace hybrid_slam
