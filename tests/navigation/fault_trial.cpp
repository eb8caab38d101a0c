// SPDX-License-Identifier: Apache-2.0
#include "navigation/fault_trial.hpp"

#include <fmt/format.h>

#include <cmath>
#include <csignal>
#include <optional>

#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/simulator/truck_world.hpp"

namespace hybrid_slam::test {
namespace {

constexpr auto kBroker = "/usr/sbin/mosquitto";
constexpr double kFast = 0.2;       ///< m/s
constexpr double kUnderWay = 3.0;   ///< s of the simulator's clock until it drives, at least
constexpr double kWatched = 2.0;    ///< s after the fault
constexpr double kPatience = 60.0;  ///< s

std::int64_t micros(double seconds) {
    return std::llround(1e6 * seconds);
}

LoopOptions options_for(Fault fault, int seed, double after) {
    LoopOptions options;
    options.seed = seed;
    options.camera = fault == Fault::kCameraPulled;
    options.relay = true;
    const char* const device = fault == Fault::kLidarPulled    ? "lidar"
                               : fault == Fault::kCanPulled    ? "can"
                               : fault == Fault::kCameraPulled ? "camera"
                                                               : nullptr;
    if (device != nullptr) {
        options.pull.push_back(fmt::format("{}@{:.3f}", device, kUnderWay + after));
    }
    return options;
}

/// When the last telegram before `end` had come, by the simulator's clock: telegrams come when they
/// do, wherever the truck is (to the few milliseconds of their jitter).
double last_telegram(const LoopMap& map, int seed, double end) {
    SimulatedDriveConfig config;
    read_drive_section(map.world, config);
    config.seed = seed;
    config.camera = false;
    TruckWorld truck(read_world(map.world), RobotConfig(), config, Pose2d(0.0, 1.6, 0.0));
    double last = 0.0;
    for (const LidarBytes& telegram : truck.advance(end).lidar) {
        last = telegram.arrival;
    }
    return last;
}

/// Does it, if it is not the simulator who pulls a cable by itself; when that was.
std::int64_t strike(ClosedLoop& loop, Fault fault) {
    const std::int64_t now = wall_microseconds();
    switch (fault) {
        case Fault::kSlamKilled:
            loop.localize().send(SIGKILL);
            break;
        case Fault::kLinkCut:
            loop.relay().set(RelayMode::kSilent);
            break;
        case Fault::kLinkClosed:
            loop.relay().set(RelayMode::kClosed);
            break;
        case Fault::kPoseFrozen:
            loop.relay().set(RelayMode::kRepeatOld);
            break;
        case Fault::kPoseRestamped:
            loop.relay().set(RelayMode::kRepeatNew);
            break;
        default:
            break;
    }
    return now;
}

/// The last pose that reached the drive as SLAM had said it.
std::int64_t last_genuine(const std::vector<PassedPose>& passed, std::int64_t latest) {
    std::int64_t last = 0;
    for (const PassedPose& pose : passed) {
        if (pose.genuine && pose.known && pose.wall <= latest) {
            last = pose.wall;
        }
    }
    return last;
}

std::int64_t last_command(const std::vector<BusMoment>& bus, std::int64_t latest) {
    std::int64_t last = 0;
    for (const BusMoment& moment : bus) {
        if (moment.is_command && moment.wall <= latest) {
            last = moment.wall;
        }
    }
    return last;
}

/// Of an adapter that is pulled no command comes any more: the truck lets go by itself.
Stopping let_go(const ClosedLoop& loop, const std::vector<BusMoment>& bus, std::int64_t pulled) {
    Stopping stopping;
    stopping.speed_before = std::abs(speed_at(bus, pulled));
    for (const Json& event : loop.events("released")) {
        const std::int64_t when = epoch_of(bus) + micros(event["t"].get<double>());
        if (when >= pulled && !stopping.seconds) {
            stopping.seconds = 1e-6 * static_cast<double>(when - last_command(bus, pulled));
            stopping.rolled = rolled_since(bus, when);
        }
    }
    for (const BusMoment& moment : bus) {
        stopping.moved_later += moment.is_command && moment.wall > pulled + micros(0.01) ? 1 : 0;
    }
    return stopping;
}

Stopping judge(const ClosedLoop& loop, const LoopMap& map, Fault fault, int seed,
               std::int64_t struck, const std::vector<PassedPose>& passed) {
    const std::vector<BusMoment> bus = read_bus(loop.bus());
    if (fault != Fault::kLidarPulled && fault != Fault::kCanPulled) {
        return stopping_after(bus, struck, last_genuine(passed, wall_microseconds()));
    }
    const double pulled_at = loop.events("unplug").at(0)["t"].get<double>();
    const std::int64_t epoch = epoch_of(bus);
    if (fault == Fault::kCanPulled) {
        return let_go(loop, bus, epoch + micros(pulled_at));
    }
    constexpr double kTick = 0.003;  // what came within the last one went with the cable
    const double heard = last_telegram(map, seed, pulled_at - kTick);
    return stopping_after(bus, epoch + micros(pulled_at), epoch + micros(heard));
}

FaultOutcome try_to_stop(const LoopMap& map, Fault fault, int seed, double after) {
    ClosedLoop loop(map, options_for(fault, seed, after));
    loop.send_goals({{2.6, 1.2}, {-2.40, -1.60}});  // a straight start, since turns are slow
    FaultOutcome outcome;
    std::int64_t struck = 0;
    if (fault == Fault::kLidarPulled || fault == Fault::kCanPulled) {
        const Stopwatch clock;
        while (loop.events("unplug").empty() && clock.seconds() < kPatience) {
            loop.listen(0.05);
        }
    } else if (loop.wait_for_speed(kFast, kPatience)) {
        loop.listen(after);
        loop.wait_for_speed(kFast, kPatience);  // it may be turning round just now
        struck = strike(loop, fault);
    }
    loop.listen(kWatched);
    outcome.reason = loop.status().fault.empty() ? loop.status().reason : loop.status().fault;
    const std::vector<PassedPose> passed = loop.relay().passed();
    loop.end();
    outcome.stopping = judge(loop, map, fault, seed, struck, passed);
    outcome.drove = outcome.stopping.speed_before > kFast;
    outcome.reported = !outcome.reason.empty();
    return outcome;
}

FaultOutcome try_to_drive_on(const LoopMap& map, Fault fault, int seed, double after) {
    LoopOptions options = options_for(fault, seed, after);
    const WorkFolder folder;
    std::optional<Broker> broker;
    if (fault == Fault::kBrokerGone) {
        broker.emplace(folder.path());
        options.drive = {"--mqtt", broker->url()};
    }
    ClosedLoop loop(map, options);
    if (broker) {
        loop.drive().wait_for("fleet: connected", kPatience);
    }
    loop.send_goals({{2.6, 1.2}});
    FaultOutcome outcome;
    std::int64_t struck = 0;
    if (broker && loop.wait_for_speed(kFast, kPatience)) {
        loop.listen(after);
        struck = wall_microseconds();
        broker->die();
    }
    outcome.arrived = loop.wait_for_arrival(kPatience).end == TripEnd::kArrived;
    loop.listen(0.5);
    loop.end();
    const std::vector<BusMoment> bus = read_bus(loop.bus());
    if (!broker) {
        const std::vector<Json> pulled = loop.events("unplug");
        struck = pulled.empty() ? 0 : epoch_of(bus) + micros(pulled[0]["t"].get<double>());
    }
    outcome.stopping.speed_before = std::abs(speed_at(bus, struck));
    outcome.drove = outcome.stopping.speed_before > kFast;
    const std::string said = broker ? loop.drive().output() : loop.localize().output();
    const std::size_t at = said.find(broker ? "warning: fleet" : "warning: camera");
    outcome.reported = at != std::string::npos;
    outcome.reason =
        outcome.reported ? said.substr(at, said.find('\n', at) - at) : "nothing of it: " + said;
    return outcome;
}

}  // namespace

const char* name_of(Fault fault) {
    switch (fault) {
        case Fault::kSlamKilled:
            return "SLAM killed";
        case Fault::kLidarPulled:
            return "S300 cable pulled";
        case Fault::kLinkCut:
            return "TCP cut, silently";
        case Fault::kLinkClosed:
            return "TCP closed";
        case Fault::kCanPulled:
            return "CAN adapter pulled";
        case Fault::kPoseFrozen:
            return "pose frozen";
        case Fault::kPoseRestamped:
            return "pose frozen, new stamps";
        case Fault::kCameraPulled:
            return "camera pulled";
        case Fault::kBrokerGone:
            return "broker gone";
    }
    return "";
}

bool drives_on(Fault fault) {
    return fault == Fault::kCameraPulled || fault == Fault::kBrokerGone;
}

FaultOutcome try_fault(const LoopMap& map, Fault fault, int seed, double after) {
    return drives_on(fault) ? try_to_drive_on(map, fault, seed, after)
                            : try_to_stop(map, fault, seed, after);
}

bool Broker::is_there() {
    return std::filesystem::exists(kBroker);
}

Broker::Broker(const std::filesystem::path& folder)
    : port_(free_port()),
      process_({kBroker, "-p", std::to_string(port_), "-v"}, folder, folder / "broker.txt") {
    process_.wait_for("running", kPatience);
}

std::string Broker::url() const {
    return fmt::format("tcp://127.0.0.1:{}", port_);
}

}  // namespace hybrid_slam::test
