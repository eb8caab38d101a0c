// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "serve_images.hpp"
#include "serve_lockstep.hpp"
#include "serve_options.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kSaveEvery = 5.0;  ///< seconds
constexpr const char* kGroup = "With --serve";

/// Microseconds since 1970.
std::int64_t wall_clock() {
    const auto since = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::microseconds>(since).count();
}

/// Once all can be opened: scripts wait for the file.
void announce(ServeStage& stage, const ServeOptions& options, const std::string& clock) {
    nlohmann::ordered_json endpoints = stage.devices().endpoints();
    endpoints["clock"] = clock.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(clock);
    print_info("the scanner: --lidar " + endpoints["lidar"].get<std::string>());
    if (endpoints["camera"].is_string()) {
        print_info("the camera:  --camera " + endpoints["camera"].get<std::string>());
    }
    print_info("the truck:   --can " + endpoints["can"].get<std::string>());
    if (!clock.empty()) {
        print_info("the clock:   --lockstep " + clock);
    }
    write_text(options.folder / "endpoints.json", endpoints.dump(2) + "\n");
}

bool ended(const ServeOptions& options, const ServeStage& stage) {
    return interrupted() || (options.duration > 0.0 && stage.now() >= options.duration);
}

/// Saves when it is time.
class Saving {
  public:
    explicit Saving(ServeStage& stage) : stage_(stage) {}
    void look() {
        if (stage_.now() >= next_) {
            stage_.save();
            next_ = stage_.now() + kSaveEvery;
        }
    }

  private:
    ServeStage& stage_;
    double next_ = kSaveEvery;
};

void serve_in_real_time(const ServeScene& scene, const ServeOptions& options, ServeStage& stage) {
    constexpr double kPoll = 0.001;  // seconds
    std::unique_ptr<MomentRenderer> renderer;
    if (stage.devices().has_camera()) {
        renderer = std::make_unique<MomentRenderer>(scene.world, scene.robot.camera, scene.config);
    }
    announce(stage, options, {});
    const RealTime clock;
    stage.start(wall_clock());
    std::optional<ServeImages> images;
    if (renderer) {
        images.emplace(std::move(renderer), stage.devices(), clock);
    }
    Saving saving(stage);
    while (!ended(options, stage)) {
        if (stage.devices().can() == nullptr) {
            std::this_thread::sleep_for(std::chrono::duration<double>(kPoll));
        }
        const std::vector<CanFrame> frames = stage.heard(kPoll);
        TruckWorld::Events events = stage.advance(clock.seconds());
        stage.obey(frames);
        for (const LidarBytes& telegram : events.lidar) {
            stage.say(telegram);
        }
        for (CameraMoment& moment : events.images) {
            images->push(std::move(moment));
        }
        saving.look();
    }
    if (images) {
        stage.counts().images = images->sent();
        stage.counts().images_dropped = images->dropped();
    }
}

void serve_in_lockstep(const ServeScene& scene, const ServeOptions& options, ServeStage& stage) {
    ServeLockstep lockstep(scene, stage);
    announce(stage, options, lockstep.url());
    stage.start(0);
    if (!lockstep.wait_for_clients(interrupted)) {
        return;
    }
    Saving saving(stage);
    while (!ended(options, stage) && lockstep.tick()) {
        saving.look();
    }
    if (!interrupted()) {
        lockstep.finish();
    }
}

/// What is in the folder is replaced, so it must be from a run like this.
void expect_own(const std::filesystem::path& folder) {
    if (std::filesystem::is_directory(folder) && !std::filesystem::is_empty(folder) &&
        !std::filesystem::exists(folder / "bus.log")) {
        throw Error(folder.string() +
                    ": is not empty and nothing was served in it, so it is left "
                    "alone");
    }
}

void forget_last_run(const std::filesystem::path& folder) {
    std::error_code ignored;
    std::filesystem::remove(folder / "endpoints.json", ignored);
    std::filesystem::remove(folder / "summary.json", ignored);
}

}  // namespace

int run_serve(const ServeOptions& options) {
    catch_interrupts();
    expect_own(options.folder);
    forget_last_run(options.folder);
    const ServeScene scene(options);
    ServeStage stage(scene, options);
    if (options.lockstep) {
        serve_in_lockstep(scene, options, stage);
    } else {
        serve_in_real_time(scene, options, stage);
    }
    stage.finish(interrupted() ? "signal" : ended(options, stage) ? "duration" : "drive left");
    const nlohmann::ordered_json summary = stage.summary();
    if (options.json) {
        print_json(summary);
    } else {
        print_result(fmt::format("{}: {} in {}, {:.2f} m driven, {}, seed {}", scene.world.name,
                                 counted(summary["scans"], "scan"), duration_text(stage.now()),
                                 summary["distance_m"].get<double>(),
                                 counted(stage.counts().contacts, "contact"), scene.config.seed));
    }
    return kOk;
}

void add_serve_options(CLI::App& command, ServeOptions& options) {
    command
        .add_option("--serve", options.folder,
                    "Serves a truck to drive: its lines and a log of the run go into this folder")
        ->expected(0, 1)
        ->default_str("sim")
        ->type_name("DIR");
    const auto in_group = [](CLI::Option* option) { return option->group(kGroup); };
    in_group(command.add_option("--start", options.start,
                                "Pose in the world: metres, metres, degrees (the path's start)"))
        ->delimiter(',')
        ->expected(3)
        ->type_name("X,Y,YAW");
    in_group(command.add_option("--duration", options.duration, "Seconds (0: until Ctrl-C)"))
        ->check(CLI::NonNegativeNumber);
    in_group(command.add_flag("--lockstep", options.lockstep,
                              "A virtual clock for 'localize' and 'drive' in place of real time"));
    in_group(command.add_flag("--images", options.images, "The camera in lockstep too"));
    in_group(command.add_option("--camera-port", options.camera_port, "TCP port (0: any)"))
        ->check(CLI::Range(0, 65535));
    in_group(command.add_option("--unplug", options.unplug,
                                "Pulls lidar, camera or can at T seconds, and plugs it at T2"))
        ->type_name("WHAT@T[:T2]");
}

void expect_served(const CLI::App& command) {
    for (const CLI::Option* option : command.get_options()) {
        if (option->get_group() == kGroup && option->count() > 0) {
            throw CLI::ValidationError(option->get_name() + " goes with --serve");
        }
    }
}

}  // namespace hybrid_slam::tools
