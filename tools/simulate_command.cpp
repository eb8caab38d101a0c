// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "hybrid_slam/simulator/simulator.hpp"
#include "input.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "progress.hpp"
#include "real_time.hpp"
#include "serve_options.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {
namespace {

struct SimulateOptions {
    CommonOptions common;
    std::filesystem::path world;
    std::filesystem::path out;
    std::filesystem::path serial;
    std::filesystem::path robot;
    std::string path;
    Overrides overrides;
    std::optional<int> seed;
    bool no_camera = false;
    ServeOptions serve;
};

constexpr auto kFooter =
    R"(What is made depends on --out:
  a folder         a recording as 'record' makes it: S300 telegrams, camera images, truth.tum. A forklift of
                   --robot is driven; keys of --set are those of the world's section 'drive': speed, distance,
                   range_sigma, range_bias, lidar_jitter, render.exposure, ...
  .clf or .clf.gz  a CARMEN log of ideal scans and wheel odometry, with the truth beside it (hall.clf gets
                   hall.truth.tum). Keys are those of the section 'simulator': speed, turn_rate, scan_rate,
                   field_of_view, range_sigma, ...
With --serial the telegrams of such a drive come out of a pseudo-terminal in real time, as from a scanner.
With --serve nothing drives the truck but CAN frames. In the folder appear s300, the scanner's line, and can, an
SLCAN adapter with the truck behind it; the camera is MJPEG over HTTP; endpoints.json names all once they can be
opened. It goes on until --duration or Ctrl-C and leaves truth.tum, bus.log (candump), events.jsonl and
summary.json. Keys of --set are those of the section 'drive' that the sensors have.
Examples:
  hybrid-slam simulate config/worlds/thesis_hall.yaml --path figure_eight --out sim1/
  hybrid-slam simulate config/worlds/thesis_hall.yaml --out fast/ --no-camera --seed 7 --set speed=1.5
  hybrid-slam simulate config/worlds/hall.yaml --out hall.clf
  hybrid-slam simulate config/worlds/hall.yaml --serial /tmp/s300 &
  hybrid-slam map --live --lidar /tmp/s300 --no-camera --out hall
  hybrid-slam simulate config/worlds/thesis_hall.yaml --serve sim --start 0,1.6,0 &
  hybrid-slam localize hall --live --lidar sim/s300 --no-camera --publish tcp://127.0.0.1:5000 &
  hybrid-slam drive --can slcan:sim/can --map hall
)";

/// The world's own values, overridden by --set and --seed.
template <typename Config>
void override_config(const SimulateOptions& options, Config& config) {
    ConfigSchema schema;
    describe(schema, config);
    override_with(schema, options.overrides, options.seed);
}

struct Outcome {
    std::size_t scans = 0;
    std::size_t images = 0;
    int seed = 0;
    double duration = 0.0;  ///< seconds
    std::filesystem::path truth;
    bool interrupted = false;
};

Outcome simulate_log(const SimulateOptions& options) {
    SimulatorConfig config;
    read_simulator_section(options.world, config);
    override_config(options, config);
    const World world = read_world(options.world);
    Simulator simulator(world, config);
    CarmenLogWriter log(options.out);
    catch_interrupts();
    Outcome outcome;
    outcome.seed = config.seed;
    Progress progress(world.name, options.common.quiet);
    while (!outcome.interrupted) {
        const std::optional<Measurement> measurement = simulator.next();
        if (!measurement) {
            break;
        }
        log.push(*measurement);
        // Only after a scan, so that log and truth end at the same stamp.
        if (const auto* scan = std::get_if<Scan>(&*measurement)) {
            ++outcome.scans;
            progress.update(simulator.progress(), outcome.scans, scan->stamp);
            outcome.interrupted = interrupted();
        }
    }
    outcome.truth = options.out.parent_path() / (stem_of(options.out) + ".truth.tum");
    write_tum(outcome.truth, simulator.truth());
    log.close();
    outcome.duration = simulator.truth().back().stamp;
    return outcome;
}

/// A drive of the forklift and where its sensors' bytes go.
class VehicleRun {
  public:
    explicit VehicleRun(const SimulateOptions& options)
        : options_(options),
          config_(config_of(options)),
          robot_(robot_of(options, config_)),
          world_(read_world(options.world)),
          vehicle_(world_, options.path, robot_, config_) {}

    Outcome record() {
        RecordingOptions recording;
        recording.origin = "simulated";
        RecordingWriter writer(options_.out, robot_, recording);
        const Outcome outcome = run([&](const SensorEvent& event) { writer.push(event); });
        writer.close();
        return outcome;
    }

    Outcome serve() {
        PseudoTerminal line(options_.serial);
        print_info(fmt::format("{}: speaking as a scanner; open it with --lidar {}",
                               options_.serial.string(), options_.serial.string()));
        RealTime clock;
        return run([&](const SensorEvent& event) {
            if (const auto* bytes = std::get_if<LidarBytes>(&event)) {
                clock.wait_until(bytes->arrival);
                line.write(bytes->bytes);
            }
        });
    }

  private:
    static SimulatedDriveConfig config_of(const SimulateOptions& options) {
        SimulatedDriveConfig config;
        read_drive_section(options.world, config);
        override_config(options, config);
        config.camera = config.camera && !options.no_camera && options.serial.empty();
        return config;
    }

    /// The recording is to say of the camera what there was.
    static RobotConfig robot_of(const SimulateOptions& options,
                                const SimulatedDriveConfig& config) {
        RobotConfig robot = options.robot.empty() ? RobotConfig() : read_robot(options.robot);
        robot.camera.enabled = robot.camera.enabled && config.camera;
        return robot;
    }

    template <typename Take>
    Outcome run(Take&& take) {
        catch_interrupts();
        if (const auto crash = vehicle_.first_crash()) {
            print_warning(fmt::format(
                "the path is too narrow: after {:.0f} s, at ({:.1f}, {:.1f}), the vehicle reaches "
                "through a wall",
                crash->stamp, crash->pose.x(), crash->pose.y()));
        }
        Outcome outcome;
        outcome.seed = config_.seed;
        Progress progress(world_.name, options_.common.quiet);
        while (!outcome.interrupted) {
            const std::optional<SensorEvent> event = vehicle_.next();
            if (!event) {
                break;
            }
            take(*event);
            outcome.images += std::holds_alternative<CameraFrame>(*event) ? 1 : 0;
            outcome.scans = vehicle_.truth().size();
            outcome.duration = arrival_of(*event);
            progress.update(vehicle_.progress(), outcome.scans, outcome.duration);
            outcome.interrupted = interrupted();
        }
        if (!options_.out.empty()) {
            outcome.truth = options_.out / RecordingFiles::kTruth;
            write_tum(outcome.truth, vehicle_.truth());
        }
        return outcome;
    }

    const SimulateOptions& options_;
    SimulatedDriveConfig config_;
    RobotConfig robot_;
    World world_;
    SimulatedVehicle vehicle_;
};

/// With what is not --serve's alone.
ServeOptions served(const SimulateOptions& options) {
    ServeOptions serve = options.serve;
    serve.world = options.world;
    serve.robot = options.robot;
    serve.path = options.path;
    serve.overrides = options.overrides;
    serve.seed = options.seed;
    serve.no_camera = options.no_camera;
    serve.json = options.common.json;
    return serve;
}

bool is_log(const std::filesystem::path& out) {
    return out.extension() == ".clf" ||
           (out.extension() == ".gz" && out.stem().extension() == ".clf");
}

int run_simulate(const SimulateOptions& options) {
    const Outcome outcome = is_log(options.out)      ? simulate_log(options)
                            : options.serial.empty() ? VehicleRun(options).record()
                                                     : VehicleRun(options).serve();
    if (outcome.interrupted && !options.out.empty()) {
        print_warning("interrupted; saved what was driven so far");
    }
    const std::string world = name_of(options.world);
    if (options.common.json) {
        print_json({{"world", world},
                    {"seed", outcome.seed},
                    {"interrupted", outcome.interrupted},
                    {"scans", outcome.scans},
                    {"images", outcome.images},
                    {"duration_s", outcome.duration},
                    {"out", options.out.string()},
                    {"truth", outcome.truth.string()}});
    } else {
        print_result(
            fmt::format("{}: {}{} in {}, seed {}", world, counted(outcome.scans, "scan"),
                        outcome.images > 0 ? " and " + counted(outcome.images, "image") : "",
                        duration_text(outcome.duration), outcome.seed));
        if (!options.out.empty()) {
            print_result(
                fmt::format("drive  {}\ntruth  {}", options.out.string(), outcome.truth.string()));
        }
    }
    return outcome.interrupted && !options.out.empty() ? kInterrupted : kOk;
}

}  // namespace

void add_simulate_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<SimulateOptions>();
    CLI::App* command = program.add_subcommand(
        "simulate", "Drive through a world and record it, as a log or byte for byte, with truth");
    command->add_option("WORLD", options->world, "World (YAML), see config/worlds")
        ->required()
        ->type_name("");
    command
        ->add_option("-o,--out", options->out,
                     "Folder of a recording, or CARMEN log (.clf, .clf.gz)")
        ->type_name("DIR|FILE");
    command
        ->add_option("--serial", options->serial, "Link to make to a pseudo-terminal that speaks")
        ->type_name("FILE");
    command->add_option("--path", options->path, "One of the world's paths by its name")
        ->type_name("NAME");
    command->add_option("--robot", options->robot, "Robot (YAML), see config/robots")
        ->type_name("FILE");
    command->add_option("--seed", options->seed, "Of all random numbers (the world's, or 1)");
    command->add_flag("--no-camera", options->no_camera, "The lidar alone");
    add_set_option(*command, options->overrides, "speed=1.5");
    add_serve_options(*command, options->serve);
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, command, &action] {
        const bool serve = command->count("--serve") > 0;
        if ((serve ? 1 : 0) + (options->out.empty() ? 0 : 1) + (options->serial.empty() ? 0 : 1) !=
            1) {
            throw CLI::RequiredError("one of --out, --serial and --serve");
        }
        if (serve) {
            if (options->serve.images && !options->serve.lockstep) {
                throw CLI::RequiresError("--images", "--lockstep");
            }
            action = [options] { return run_serve(served(*options)); };
            return;
        }
        expect_served(*command);
        if (is_log(options->out) &&
            (!options->path.empty() || !options->robot.empty() || options->no_camera)) {
            throw CLI::ValidationError(
                "--path, --robot and --no-camera go with a folder, not with a log");
        }
        action = [options] { return run_simulate(*options); };
    });
}

}  // namespace hybrid_slam::tools
