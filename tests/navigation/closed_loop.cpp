// SPDX-License-Identifier: Apache-2.0
#include "navigation/closed_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <sstream>
#include <thread>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/metrics.hpp"
#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam::test {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience = 60.0;  ///< seconds of a loaded machine

void append(std::vector<std::string>& arguments, std::initializer_list<std::string> more) {
    arguments.insert(arguments.end(), more);
}

void must_work(const std::vector<std::string>& arguments, const fs::path& folder) {
    if (run_process(arguments, folder, folder / "said.txt", 300.0) != 0) {
        throw Error(arguments.at(1) + ": " + contents_of(folder / "said.txt"));
    }
}

bool is_over(const LinkStatus& status) {
    return status.state == LinkDriveState::kArrived ||
           (status.state == LinkDriveState::kIdle && status.waypoints_left == 0);
}

}  // namespace

LoopMap make_loop_map(const fs::path& program, const fs::path& world, const fs::path& folder) {
    const fs::path drive = folder / "drive";
    LoopMap map{program, world, folder / "map", {}};
    must_work({program, "simulate", world, "--out", drive, "--no-camera", "-q"}, folder);
    must_work({program, "map", drive, "--out", map.folder, "-q"}, folder);
    map.map_from_world =
        truth_error(read_tum(map.folder / "trajectory.tum"), read_tum(drive / "truth.tum"))
            .truth_from_estimate.inverse();
    return map;
}

ClosedLoop::ClosedLoop(const LoopMap& map, const LoopOptions& options)
    : map_(map), options_(options) {
    start_simulate();
    start_drive();
    start_localize();
    LinkClientConfig config;
    config.server = drive_at_;
    client_ = std::make_unique<LinkClient>(config, LinkRole::kGoal);
    if (!client_->wait_connected(kPatience)) {
        throw Error("drive: lets nobody in: " + drive_->output());
    }
}

ClosedLoop::~ClosedLoop() = default;

void ClosedLoop::start_simulate() {
    const Pose2d& start = options_.world_from_start;
    std::vector<std::string> arguments{map_.program, "simulate", map_.world, "--serve", "sim"};
    append(arguments,
           {"--start", fmt::format("{},{},{}", start.x(), start.y(), degrees(start.heading)),
            "--seed", std::to_string(options_.seed)});
    if (options_.lockstep) {
        append(arguments, {"--lockstep"});
    }
    if (!options_.camera) {
        append(arguments, {"--no-camera"});
    } else if (options_.lockstep) {
        append(arguments, {"--images"});
    }
    if (options_.duration > 0.0) {
        append(arguments, {"--duration", fmt::format("{}", options_.duration)});
    }
    for (const std::string& pull : options_.pull) {
        append(arguments, {"--unplug", pull});
    }
    simulate_ = std::make_unique<Process>(arguments, folder(), folder() / "simulate.txt");
    const fs::path file = folder() / "sim/endpoints.json";
    const Stopwatch clock;
    while (endpoints_.is_null() || endpoints_.is_discarded()) {
        if (!simulate_->running() || clock.seconds() > kPatience) {
            throw Error("simulate: " + simulate_->output());
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        if (fs::exists(file)) {
            endpoints_ = Json::parse(contents_of(file), nullptr, false);
        }
    }
}

void ClosedLoop::start_drive() {
    std::vector<std::string> arguments{map_.program, "drive", "--map", map_.folder};
    append(arguments, {"--can", endpoints_["can"], "--listen", "127.0.0.1:0", "--out", "drive"});
    if (options_.lockstep) {
        append(arguments, {"--clock", endpoints_["clock"]});
    }
    arguments.insert(arguments.end(), options_.drive.begin(), options_.drive.end());
    drive_ = std::make_unique<Process>(arguments, folder(), folder() / "drive.txt");
    drive_at_ = drive_->wait_for("listening on ", kPatience);
    if (options_.relay) {
        const int port = std::stoi(drive_at_.substr(drive_at_.rfind(':') + 1));
        relay_ = std::make_unique<PoseRelay>(static_cast<std::uint16_t>(port));
    }
}

void ClosedLoop::start_localize() {
    const std::string server = relay_ ? fmt::format("127.0.0.1:{}", relay_->port()) : drive_at_;
    std::vector<std::string> arguments{map_.program, "localize", map_.folder, "--live", "--lidar"};
    append(arguments, {endpoints_["lidar"], "--publish", "tcp://" + server});
    append(arguments, {"--out", fmt::format("run{}", ++localizers_)});
    if (endpoints_["camera"].is_string()) {
        append(arguments, {"--camera", endpoints_["camera"]});
    } else {
        append(arguments, {"--no-camera"});
    }
    if (options_.lockstep) {
        append(arguments, {"--clock", endpoints_["clock"]});
    }
    localize_.reset();
    localize_ = std::make_unique<Process>(arguments, folder(),
                                          folder() / fmt::format("localize{}.txt", localizers_));
}

void ClosedLoop::send_goals(const std::vector<Eigen::Vector2d>& world_places) {
    LinkGoals goals;
    for (const Eigen::Vector2d& place : world_places) {
        goals.waypoints.push_back({map_.map_from_world * place, std::nullopt});
    }
    goals.id = fmt::format("trip {}", wall_microseconds());
    goals_id_ = goals.id;
    refusal_.clear();
    longest_ = 0.0;
    if (!client_->send(goals)) {
        throw Error("drive: does not take goals: " + drive_->output());
    }
}

void ClosedLoop::take(const ServerMessage& message) {
    if (const auto* const status = std::get_if<LinkStatus>(&message)) {
        status_ = *status;
        longest_ = std::max(longest_, status->remaining);
    } else if (const auto* const refusal = std::get_if<LinkRefusal>(&message)) {
        refusal_ = refusal->reason;
    }
}

void ClosedLoop::listen(double seconds) {
    const Stopwatch clock;
    for (double left = seconds; left > 0.0; left = seconds - clock.seconds()) {
        for (const ServerMessage& message : client_->received(left)) {
            take(message);
        }
    }
}

Trip ClosedLoop::wait_for_arrival(double seconds) {
    const Stopwatch clock;
    Trip trip;
    while (trip.end == TripEnd::kTimeout && clock.seconds() < seconds) {
        for (const ServerMessage& message : client_->received(0.2)) {
            take(message);
        }
        const bool is_mine = status_.goals == goals_id_;
        if (!refusal_.empty()) {
            trip.end = TripEnd::kRefused;
        } else if (is_mine && is_over(status_)) {
            trip.end =
                status_.state == LinkDriveState::kArrived ? TripEnd::kArrived : TripEnd::kGivenUp;
        } else if (!drive_->running() || !simulate_->running() || !localize_->running()) {
            trip.end = TripEnd::kGivenUp;
            refusal_ = "a process has ended: " + drive_->output() + localize_->output() +
                       simulate_->output();
        }
    }
    trip.status = status_;
    trip.longest = longest_;
    trip.why = !refusal_.empty()        ? refusal_
               : !status_.fault.empty() ? status_.fault
                                        : status_.reason;
    return trip;
}

bool ClosedLoop::wait_for_speed(double speed, double seconds) {
    const Stopwatch clock;
    while (std::abs(status_.speed) < speed && clock.seconds() < seconds) {
        for (const ServerMessage& message : client_->received(0.1)) {
            take(message);
        }
    }
    return std::abs(status_.speed) >= speed;
}

int ClosedLoop::visit(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{map_.program, "goto", drive_at_};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run_process(all, folder(), folder() / "goto.txt", 120.0);
}

std::string ClosedLoop::place(const Eigen::Vector2d& world_place) const {
    const Eigen::Vector2d map_place = map_.map_from_world * world_place;
    return fmt::format("{:.4f},{:.4f}", map_place.x(), map_place.y());
}

int ClosedLoop::end() {
    drive_->send(SIGINT);
    const int drove = drive_->wait(kPatience).value_or(-1);
    localize_->send(SIGINT);
    localize_->wait(kPatience);
    simulate_->send(SIGINT);
    const int simulated = simulate_->wait(kPatience).value_or(-1);
    return std::max(std::abs(drove), std::abs(simulated));
}

int ClosedLoop::wait_for_end(double seconds) {
    const std::optional<int> simulated = simulate_->wait(seconds);
    if (!simulated) {
        throw Error("simulate: does not end: " + simulate_->output() + drive_->output() +
                    localize_->output());
    }
    return std::max(end(), std::abs(*simulated));
}

Trajectory ClosedLoop::truth() const {
    return read_tum(folder() / "sim/truth.tum");
}

Trajectory ClosedLoop::published() const {
    return read_tum(folder() / fmt::format("run{}/trajectory.tum", localizers_));
}

std::vector<Json> ClosedLoop::events(const std::string& what) const {
    std::istringstream lines(contents_of(folder() / "sim/events.jsonl"));
    std::vector<Json> events;
    for (std::string line; std::getline(lines, line);) {
        Json event = Json::parse(line);
        if (what.empty() || event["event"] == what) {
            events.push_back(std::move(event));
        }
    }
    return events;
}

Json ClosedLoop::summary() const {
    return Json::parse(contents_of(folder() / "sim/summary.json"));
}

}  // namespace hybrid_slam::test
