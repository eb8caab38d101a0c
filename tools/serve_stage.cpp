// SPDX-License-Identifier: Apache-2.0
#include "serve_stage.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "hybrid_slam/core/error.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using nlohmann::ordered_json;

SimulatedDriveConfig config_of(const ServeOptions& options) {
    SimulatedDriveConfig config;
    read_drive_section(options.world, config);
    ConfigSchema schema;
    describe(schema, config);
    override_with(schema, options.overrides, options.seed);
    config.camera = config.camera && !options.no_camera && (!options.lockstep || options.images);
    return config;
}

Pose2d start_of(const World& world, const ServeOptions& options) {
    if (!options.start.empty()) {
        for (const double number : options.start) {
            if (!std::isfinite(number)) {
                throw Error("--start: must be three numbers");
            }
        }
        return {options.start[0], options.start[1], normalize_angle(radians(options.start[2]))};
    }
    const Points& path = world.path_named(options.path);
    if (path.size() < 2) {
        throw Error("world " + world.name + ": has no path to start on; say --start");
    }
    const Eigen::Vector2d leg = path[1] - path[0];
    const double heading = std::atan2(leg.y(), leg.x());
    return {path[0].x(), path[0].y(),
            options.path.empty() ? world.start_heading.value_or(heading) : heading};
}

std::vector<Unplug> unplugs_of(const ServeOptions& options) {
    std::vector<Unplug> unplugs;
    for (const std::string& text : options.unplug) {
        unplugs.push_back(parse_unplug(text));
        const bool sensor = unplugs.back().device != ServedDevice::kCan;
        if (options.lockstep && sensor && unplugs.back().until) {
            throw Error("--unplug " + text +
                        ": in lockstep a sensor that was pulled cannot come back");
        }
    }
    return unplugs;
}

std::filesystem::path made(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) {
        throw Error(folder.string() + ": " + error.message());
    }
    return folder;
}

/// Metres, metres, degrees.
ordered_json json_of(const Pose2d& pose) {
    return {rounded(pose.x()), rounded(pose.y()), rounded(degrees(pose.heading))};
}

}  // namespace

ServeScene::ServeScene(const ServeOptions& options)
    : config(config_of(options)),
      robot(options.robot.empty() ? RobotConfig() : read_robot(options.robot)),
      world(read_world(options.world)),
      world_from_start(start_of(world, options)) {
    robot.camera.enabled = robot.camera.enabled && config.camera;
}

ServeStage::ServeStage(const ServeScene& scene, const ServeOptions& options)
    : folder_(made(options.folder)),
      seed_(scene.config.seed),
      devices_({folder_, scene.robot.camera.enabled, options.camera_port, options.lockstep}),
      log_(folder_),
      world_name_(scene.world.name),
      unplugs_(unplugs_of(options)),
      truck_(scene.world, scene.robot, scene.config, scene.world_from_start) {}

void ServeStage::start(std::int64_t epoch) {
    log_.set_epoch(epoch);
    event("start", {{"world", world_name_}, {"seed", seed_}, {"pose", where()["pose"]}});
}

void ServeStage::event(const std::string& what, const ordered_json& details) {
    log_.event(now(), what, details);
}

ordered_json ServeStage::where() const {
    return {{"pose", json_of(truck_.state().world_from_robot)},
            {"distance_m", rounded(truck_.distance())}};
}

void ServeStage::change_plugs(double now) {
    for (const UnplugSchedule::Change& change : unplugs_.due(now)) {
        change.plug ? devices_.plug(change.device) : devices_.pull(change.device);
        log_.event(now, change.plug ? "plug" : "unplug", {{"device", to_string(change.device)}});
    }
}

TruckWorld::Events ServeStage::advance(double now) {
    change_plugs(now);
    TruckWorld::Events events = truck_.advance(now);
    tell(events.frames);
    note_changes(events.contacts);
    return events;
}

void ServeStage::note_changes(const std::vector<TruckContact>& contacts) {
    for (const TruckContact& contact : contacts) {
        ++counts_.contacts;
        log_.event(contact.time, "contact",
                   {{"with", contact.with},
                    {"at", {rounded(contact.at.x()), rounded(contact.at.y())}},
                    {"pose", json_of(contact.world_from_robot)}});
    }
    const bool bus_open = devices_.can() != nullptr && devices_.can()->is_open();
    if (std::exchange(bus_open_, bus_open) != bus_open) {
        event(bus_open ? "bus opened" : "bus closed", ordered_json::object());
    }
    if (std::exchange(driven_, truck_.driven()) != truck_.driven()) {
        event(driven_ ? "driven" : "released", where());
    }
    const bool moves = truck_.state().speed != 0.0;
    if (std::exchange(moves_, moves) != moves) {
        event(moves ? "moves" : "stopped", where());
    }
}

std::vector<CanFrame> ServeStage::heard(double timeout) {
    return devices_.can() != nullptr ? devices_.can()->receive(timeout) : std::vector<CanFrame>();
}

void ServeStage::obey(const std::vector<CanFrame>& frames) {
    for (const CanFrame& frame : frames) {
        log_.frame(now(), frame);
        ++counts_.frames_received;
        tell(truck_.receive(frame));
    }
}

void ServeStage::tell(const std::vector<CanFrame>& frames) {
    for (const CanFrame& frame : frames) {
        log_.frame(now(), frame);
        if (devices_.can() != nullptr && devices_.can()->send(frame)) {
            ++counts_.frames_sent;
        }
    }
}

bool ServeStage::say(const LidarBytes& telegram) {
    PseudoTerminal* const line = devices_.lidar();
    if (line == nullptr || !line->has_reader()) {
        ++counts_.telegrams_unheard;
        if (line != nullptr) {
            line->write(telegram.bytes);  // so that it forgets what the last reader left
        }
        return false;
    }
    const std::uint64_t dropped = line->dropped();
    line->write(telegram.bytes);
    const bool whole = line->dropped() == dropped;
    ++(whole ? counts_.telegrams : counts_.telegrams_dropped);
    return whole;
}

void ServeStage::save() {
    log_.truth(truck_.truth());
    log_.flush();
}

void ServeStage::finish(const std::string& ended_by) {
    ended_by_ = ended_by;
    event("end", where());
    save();
    write_text(folder_ / "summary.json", summary().dump(2) + "\n");
}

ordered_json ServeStage::summary() const {
    return {{"seed", seed_},
            {"duration_s", rounded(now())},
            {"ended_by", ended_by_},
            {"scans", truck_.truth().size()},
            {"telegrams_unheard", counts_.telegrams_unheard},
            {"telegrams_dropped", counts_.telegrams_dropped},
            {"images", counts_.images},
            {"images_dropped", counts_.images_dropped},
            {"contacts", counts_.contacts},
            {"distance_m", rounded(truck_.distance())},
            {"worst_speed", rounded(truck_.worst_speed())},
            {"frames_received", counts_.frames_received},
            {"frames_sent", counts_.frames_sent},
            {"pose", json_of(truck_.state().world_from_robot)}};
}

}  // namespace hybrid_slam::tools
