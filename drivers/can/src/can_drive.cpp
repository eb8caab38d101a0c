// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/can_drive.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>

#include "command_watchdog.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kStartAgain = 0.5;  // seconds between starts of nodes that are silent

double seconds_now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

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
    Shared(std::unique_ptr<CanBus> the_bus, const CanDriveConfig& how, const VehicleConfig& vehicle)
        : bus(std::move(the_bus)),
          codec(make_drive_codec(how.layout, vehicle)),
          config(how),
          watchdog(how.command_valid, how.release_after) {}

    void run();
    void cycle();
    void listen(double until);
    CommandWatchdog::Order order(double now);
    std::string obstacle(double now) const;
    bool send(const std::vector<CanFrame>& frames) const;
    bool ended() const;
    void finish(const std::string& fault);

    std::unique_ptr<CanBus> bus;
    std::unique_ptr<DriveCodec> codec;
    CanDriveConfig config;
    double last_start = -HUGE_VAL;

    mutable std::mutex mutex;
    CommandWatchdog watchdog;
    CanDriveStatus status;
    double last_feedback = -HUGE_VAL;
    bool end = false;

    std::thread thread;  // last: everything else is there when it begins
};

bool CanDrive::Shared::ended() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return end;
}

/// Why a command must not be obeyed now; empty when it may.
std::string CanDrive::Shared::obstacle(double now) const {
    if (!bus->hears()) {
        return "";
    }
    if (!(now - last_feedback <= config.feedback_valid)) {
        return "the truck is silent";
    }
    return status.feedback.faulty() ? fault_text(status.feedback) : "";
}

CommandWatchdog::Order CanDrive::Shared::order(double now) {
    const std::lock_guard<std::mutex> lock(mutex);
    CommandWatchdog::Order order = watchdog.order(now);
    status.reason.clear();
    if (order.state == CanDriveState::kDriving) {
        status.reason = obstacle(now);
        if (!status.reason.empty()) {
            order.state = CanDriveState::kHeld;
            order.command.speed = 0.0;
        }
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
    const double now = seconds_now();
    bool silent = false;
    {
        const std::lock_guard<std::mutex> lock(mutex);
        silent = !(now - last_feedback <= config.feedback_valid);
    }
    const bool first = std::isinf(last_start);
    if (silent && (first || (bus->hears() && now - last_start >= kStartAgain))) {
        last_start = now;
        send(codec->start());
    }
    const CommandWatchdog::Order wanted = order(now);
    send(codec->encode(wanted.command, wanted.enabled));
}

void CanDrive::Shared::listen(double until) {
    for (double left = until - seconds_now(); left > 0.0 && bus->fault().empty();
         left = until - seconds_now()) {
        const std::optional<CanFrame> frame = bus->receive(left);
        const auto feedback = frame ? codec->decode(*frame) : std::nullopt;
        const std::lock_guard<std::mutex> lock(mutex);
        status.counts = bus->counts();
        if (feedback) {
            status.feedback = *feedback;
            last_feedback = seconds_now();
        }
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
    try {
        double next = seconds_now();
        while (!ended() && bus->fault().empty()) {
            cycle();
            // After a hold-up the rhythm begins anew; what was missed is not made up for.
            next = std::max(next + 1.0 / config.rate, seconds_now());
            listen(next);
        }
        double steering = 0.0;
        {
            const std::lock_guard<std::mutex> lock(mutex);
            steering = status.sent.steering;
        }
        send(codec->encode({0.0, steering}, true));
        send(codec->encode({}, false));
        finish(bus->fault());
    } catch (const std::exception& error) {
        finish(error.what());
    }
}

CanDrive::CanDrive(std::unique_ptr<CanBus> bus, const CanDriveConfig& config,
                   const VehicleConfig& vehicle)
    : shared_(std::make_unique<Shared>(std::move(bus), in_range(config), vehicle)) {
    shared_->thread = std::thread([this] { shared_->run(); });
}

CanDrive::~CanDrive() {
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
        shared_->watchdog.stop(seconds_now());
        throw Error("drive command: speed and steering must be finite");
    }
    shared_->watchdog.set(command, seconds_now());
}

void CanDrive::stop() {
    const std::lock_guard<std::mutex> lock(shared_->mutex);
    shared_->watchdog.stop(seconds_now());
}

CanDriveStatus CanDrive::status() const {
    const std::lock_guard<std::mutex> lock(shared_->mutex);
    CanDriveStatus status = shared_->status;
    status.feedback_age = seconds_now() - shared_->last_feedback;
    return status;
}

}  // namespace hybrid_slam
