// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/can_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <thread>

#include "command_watchdog.hpp"
#include "deadline.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam {
namespace {

constexpr double kStartAgain = 0.5;     // seconds between starts of nodes that are silent
constexpr double kFaultLasts = 0.2;     // seconds; a fault that is shorter is seen by everybody too
constexpr double kFarewellTries = 0.2;  // seconds in which a bus that is busy is asked again

/// A config that was filled by code is held to the same ranges as a file.
CanDriveConfig in_range(CanDriveConfig config) {
    ConfigSchema schema;
    describe(schema, config);
    return config;
}

std::string fault_text(const DriveFeedback& feedback) {
    const auto text = [](const char* who, int code) {
        return code < 0 ? fmt::format("the {} reports a fault", who)
                        : fmt::format("the {} reports fault {}", who, code);
    };
    return feedback.drive_fault != 0 ? text("drive", feedback.drive_fault)
                                     : text("steering", feedback.steering_fault);
}

}  // namespace

void describe(ConfigSchema& schema, CanDriveConfig& config) {
    describe(schema, config.bus);
    describe(schema, config.layout);
    schema.add("rate", config.rate, 1.0, 200.0, "commands per second");
    schema.add("command_valid", config.command_valid, 0.02, 2.0,
               "s that a command holds; then speed zero");
    schema.add("release_after", config.release_after, 0.0, 60.0,
               "s of speed zero before power goes off");
    schema.add("feedback_valid", config.feedback_valid, 0.05, 10.0,
               "s; a truck that is silent for longer is not driven");
}

/// What the thread and its callers share. The bus and the codec are the thread's alone.
struct CanDrive::Shared {
    Shared(std::unique_ptr<CanBus> the_bus, const CanDriveConfig& how, const VehicleConfig& vehicle,
           Clock clock)
        : bus(std::move(the_bus)),
          codec(make_drive_codec(how.layout, vehicle)),
          config(how),
          now(std::move(clock)),
          watchdog(how.command_valid, how.release_after) {}

    void run();
    void step(std::size_t frames);
    void cycle();
    void take(const std::optional<CanFrame>& frame);
    void say_goodbye();
    void listen(double until);
    CommandWatchdog::Order order(double time);
    std::string obstacle(double time) const;
    bool send(const std::vector<CanFrame>& frames) const;
    bool ended() const;
    double last_feedback() const;
    void finish(const std::string& fault);

    std::unique_ptr<CanBus> bus;
    std::unique_ptr<DriveCodec> codec;
    CanDriveConfig config;
    Clock now;
    bool power_was_on = true;  // as far as the truck may think
    double last_start = -HUGE_VAL;

    mutable std::mutex mutex;
    CommandWatchdog watchdog;
    CanDriveStatus status;
    /// Seconds, by id: a truck with two controllers is as silent as the one that is.
    std::map<std::uint32_t, double> heard;
    std::string last_fault;  ///< that the truck told
    double faulty_at = -HUGE_VAL;
    bool end = false;
    bool silent = false;

    std::thread thread;  // last: everything else is there when it begins
};

/// Of all frames that the truck has ever told the one that is longest ago.
double CanDrive::Shared::last_feedback() const {
    double last = heard.empty() ? -HUGE_VAL : HUGE_VAL;
    for (const auto& [id, time] : heard) {
        last = std::min(last, time);
    }
    return last;
}

bool CanDrive::Shared::ended() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return end;
}

/// Why a command must not be obeyed now; empty when it may.
std::string CanDrive::Shared::obstacle(double time) const {
    if (!bus->hears()) {
        return "";
    }
    if (!(time - last_feedback() <= config.feedback_valid)) {
        return "the truck is silent";
    }
    if (!status.feedback.speed) {
        return "the truck does not tell its speed";
    }
    if (!status.feedback.steering) {
        return "the truck does not tell its steering angle";
    }
    return status.feedback.faulty() || time - faulty_at <= kFaultLasts ? last_fault : "";
}

CommandWatchdog::Order CanDrive::Shared::order(double time) {
    const std::lock_guard<std::mutex> lock(mutex);
    CommandWatchdog::Order order = watchdog.order(time);
    status.reason = obstacle(time);
    if (order.state == CanDriveState::kDriving && !status.reason.empty()) {
        order.state = CanDriveState::kHeld;
        order.command.speed = 0.0;
    }
    status.state = order.state;
    status.sent = order.command;
    return order;
}

bool CanDrive::Shared::send(const std::vector<CanFrame>& frames) const {
    bool all = true;
    for (const CanFrame& frame : frames) {
        all = bus->send(frame) && all;
    }
    return all;
}

void CanDrive::Shared::cycle() {
    const double time = now();
    bool truck_is_silent = false;
    bool must_be_silent = false;
    {
        const std::lock_guard<std::mutex> lock(mutex);
        truck_is_silent = !(time - last_feedback() <= config.feedback_valid);
        must_be_silent = silent;
    }
    const CommandWatchdog::Order wanted = order(time);
    if (must_be_silent && !wanted.enabled && !power_was_on) {
        return;
    }
    const bool first = std::isinf(last_start);
    if (truck_is_silent && (first || (bus->hears() && time - last_start >= kStartAgain))) {
        last_start = time;
        send(codec->start());
    }
    const bool sent = send(codec->encode(wanted.command, wanted.enabled));
    power_was_on = wanted.enabled || !sent;
}

void CanDrive::Shared::take(const std::optional<CanFrame>& frame) {
    const auto feedback = frame ? codec->decode(*frame) : std::nullopt;
    const std::lock_guard<std::mutex> lock(mutex);
    status.counts = bus->counts();
    if (feedback) {
        status.feedback = *feedback;
        constexpr std::uint32_t kFirstPdo = 0x180;  // below are emergencies
        if (frame->id >= kFirstPdo) {
            heard[frame->id] = now();
        }
        if (feedback->faulty()) {
            last_fault = fault_text(*feedback);
            faulty_at = now();
        }
    }
}

void CanDrive::Shared::listen(double until) {
    for (double left = until - now(); left > 0.0 && bus->fault().empty(); left = until - now()) {
        take(bus->receive(left));
    }
}

void CanDrive::Shared::step(std::size_t frames) {
    constexpr double kLongWait = 5.0;  // seconds, of the wall clock
    const std::uint64_t awaited = bus->counts().received + frames;
    while (const std::optional<CanFrame> frame =
               bus->receive(bus->counts().received < awaited ? kLongWait : 0.0)) {
        take(frame);
    }
    if (bus->fault().empty()) {
        cycle();
    }
    take(std::nullopt);
    if (!bus->fault().empty()) {
        finish(bus->fault());
    }
}

void CanDrive::Shared::finish(const std::string& fault) {
    const std::lock_guard<std::mutex> lock(mutex);
    status.counts = bus->counts();
    status.sent = {};
    status.state = fault.empty() ? CanDriveState::kOff : CanDriveState::kFault;
    status.reason = fault;
}

void CanDrive::Shared::run() {
    std::string trouble;
    try {
        double next = now();
        while (!ended() && bus->fault().empty()) {
            cycle();
            // After a hold-up the rhythm begins anew; what was missed is not made up for.
            next = std::max(next + 1.0 / config.rate, now());
            listen(next);
        }
    } catch (const std::exception& error) {
        trouble = error.what();
    }
    try {
        say_goodbye();
    } catch (const std::exception& error) {
        trouble = error.what();
    }
    finish(trouble.empty() ? bus->fault() : trouble);
}

void CanDrive::Shared::say_goodbye() {
    double steering = 0.0;
    {
        const std::lock_guard<std::mutex> lock(mutex);
        steering = status.sent.steering;
    }
    if (!power_was_on) {
        return;
    }
    const auto insist = [this](const std::vector<CanFrame>& frames) {
        const Deadline deadline(kFarewellTries);
        while (!send(frames) && bus->fault().empty() && !deadline.passed()) {
            bus->receive(0.005);
        }
    };
    insist(codec->encode({0.0, steering}, true));
    insist(codec->encode({}, false));
}

CanDrive::CanDrive(std::unique_ptr<CanBus> bus, const CanDriveConfig& config,
                   const VehicleConfig& vehicle, const Clock& clock)
    : shared_(std::make_unique<Shared>(std::move(bus), in_range(config), vehicle,
                                       clock ? clock : Clock(steady_seconds))) {
    if (!clock) {
        shared_->thread = std::thread([this] { shared_->run(); });
    }
}

CanDrive::~CanDrive() {
    if (!shared_->thread.joinable()) {
        shared_->say_goodbye();
        return;
    }
    {
        const std::lock_guard<std::mutex> lock(shared_->mutex);
        shared_->end = true;
    }
    shared_->thread.join();
}

void CanDrive::set_command(const DriveCommand& command) {
    const bool finite = std::isfinite(command.speed) && std::isfinite(command.steering);
    const std::lock_guard<std::mutex> lock(shared_->mutex);
    if (!finite) {
        shared_->watchdog.stop(shared_->now());
        throw Error("drive command: speed and steering must be finite");
    }
    shared_->watchdog.set(command, shared_->now());
}

void CanDrive::stop() {
    const std::lock_guard<std::mutex> lock(shared_->mutex);
    shared_->watchdog.stop(shared_->now());
}

void CanDrive::set_silent(bool silent) {
    const std::lock_guard<std::mutex> lock(shared_->mutex);
    shared_->silent = silent;
}

void CanDrive::step(std::size_t frames) {
    shared_->step(frames);
}

CanDriveStatus CanDrive::status() const {
    const std::lock_guard<std::mutex> lock(shared_->mutex);
    CanDriveStatus status = shared_->status;
    const double now = shared_->now();
    status.feedback_age = now - shared_->last_feedback();
    if (status.state != CanDriveState::kFault && status.state != CanDriveState::kHeld) {
        status.reason = shared_->obstacle(now);
    }
    return status;
}

}  // namespace hybrid_slam
