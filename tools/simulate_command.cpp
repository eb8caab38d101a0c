// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "hybrid_slam/simulator/simulator.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "progress.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {
namespace {

struct SimulateOptions {
    CommonOptions common;
    std::filesystem::path world;
    std::filesystem::path out;
    Overrides overrides;
    std::optional<int> seed;
};

constexpr auto kFooter =
    R"(The truth goes beside the log: hall.clf or hall.clf.gz gets hall.truth.tum. Keys of --set are those of the
section 'simulator' of a world file: speed, turn_rate, scan_rate, field_of_view, range_sigma, ...
Examples:
  hybrid-slam simulate config/worlds/hall.yaml --out hall.clf
  hybrid-slam simulate config/worlds/hall.yaml --out fast.clf.gz --seed 7 --set speed=1.5
)";

SimulatorConfig simulator_config(const SimulateOptions& options) {
    SimulatorConfig config;
    read_simulator_section(options.world, config);
    ConfigSchema schema;
    describe(schema, config);
    for (const std::string& assignment : options.overrides) {
        schema.override_with(assignment);
    }
    if (options.seed) {
        schema.override_with(fmt::format("seed={}", *options.seed));
    }
    return config;
}

struct Outcome {
    std::size_t scans = 0;
    bool interrupted = false;
};

Outcome record(Simulator& simulator, CarmenLogWriter& log, Progress& progress) {
    Outcome outcome;
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
    return outcome;
}

std::filesystem::path truth_file(const std::filesystem::path& log) {
    return log.parent_path() / (stem_of(log) + ".truth.tum");
}

int run_simulate(const SimulateOptions& options) {
    const SimulatorConfig config = simulator_config(options);
    const World world = read_world(options.world);
    Simulator simulator(world, config);
    CarmenLogWriter log(options.out);
    catch_interrupts();
    Outcome outcome;
    {
        Progress progress(world.name, options.common.quiet);
        outcome = record(simulator, log, progress);
    }
    const std::filesystem::path truth = truth_file(options.out);
    write_tum(truth, simulator.truth());
    log.close();
    if (outcome.interrupted) {
        print_warning("interrupted; saved what was driven so far");
    }
    const double duration = simulator.truth().back().stamp;
    if (options.common.json) {
        print_json({{"world", world.name},
                    {"seed", config.seed},
                    {"interrupted", outcome.interrupted},
                    {"scans", outcome.scans},
                    {"duration_s", duration},
                    {"log", options.out.string()},
                    {"truth", truth.string()}});
    } else {
        print_result(fmt::format("{}: {} in {}, seed {}\nlog    {}\ntruth  {}", world.name,
                                 counted(outcome.scans, "scan"), duration_text(duration),
                                 config.seed, options.out.string(), truth.string()));
    }
    return outcome.interrupted ? kInterrupted : kOk;
}

}  // namespace

void add_simulate_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<SimulateOptions>();
    CLI::App* command =
        program.add_subcommand("simulate", "Drive through a world and record a log with truth");
    command->add_option("WORLD", options->world, "World (YAML), see config/worlds")
        ->required()
        ->type_name("");
    command->add_option("-o,--out", options->out, "CARMEN log to write, .clf or .clf.gz")
        ->required()
        ->type_name("FILE");
    command->add_option("--seed", options->seed, "Of all random numbers (the world's, or 1)");
    add_set_option(*command, options->overrides, "speed=1.5");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback(
        [options, &action] { action = [options] { return run_simulate(*options); }; });
}

}  // namespace hybrid_slam::tools
