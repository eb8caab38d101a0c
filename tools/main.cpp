// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>
#include <new>
#include <opencv2/core/utility.hpp>

#include "commands.hpp"
#include "messages.hpp"

namespace {

using namespace hybrid_slam::tools;

constexpr auto kFooter = R"(Examples:
  hybrid-slam map intel.clf.gz --out intel_map
  hybrid-slam relocalize intel_map intel.clf.gz --at 60
  hybrid-slam localize intel_map intel.clf.gz --out intel_run
  hybrid-slam localize hall --live --robot forklift.yaml --publish tcp://truck:5000
  hybrid-slam drive --map hall --vehicle forklift.yaml --can can0
  hybrid-slam goto truck:5000 1.30,-0.15 -2.40,-1.60 --watch
  hybrid-slam compare intel.clf.gz --relations intel.relations
  hybrid-slam evaluate intel_map/trajectory.tum --relations intel.relations
  hybrid-slam optimize M3500.g2o --out M3500_opt.g2o
  hybrid-slam simulate config/worlds/hall.yaml --out hall.clf --seed 1
'hybrid-slam COMMAND --help' tells the options of a command.

Results go to standard output, messages and the progress bar to standard error.
Exit codes: 0 done, 1 bad input or another failure, 2 wrong usage,
            3 interrupted by Ctrl-C or SIGTERM, with everything up to there saved,
            4 a recording that is not fit for mapping (info), or a drive not fit for
              calibration (calibrate extrinsics),
            5 several places in the map look alike (relocalize, localize, map --onto),
            6 not in this map (likewise).
)";

void describe_program(CLI::App& program, Action& action) {
    program.name("hybrid-slam");
    program.set_version_flag("--version", "hybrid-slam " HYBRID_SLAM_VERSION, "Print the version");
    program.set_help_flag("-h,--help", "Print this help");
    program.get_formatter()->column_width(34);
    program.footer(kFooter);
    program.require_subcommand(1);
    add_record_command(program, action);
    add_map_command(program, action);
    add_relocalize_command(program, action);
    add_localize_command(program, action);
    add_drive_command(program, action);
    add_goto_command(program, action);
    add_info_command(program, action);
    add_export_command(program, action);
    add_crop_command(program, action);
    add_calibrate_command(program, action);
    add_compare_command(program, action);
    add_evaluate_command(program, action);
    add_optimize_command(program, action);
    add_simulate_command(program, action);
}

int usage_error(const CLI::App& program, const CLI::ParseError& error) {
    std::string command = "hybrid-slam";
    for (const CLI::App* chosen = &program; !chosen->get_subcommands().empty();) {
        chosen = chosen->get_subcommands().front();
        command += " " + chosen->get_name();
    }
    print_error(std::string(error.what()) + " (see '" + command + " --help')");
    return kUsage;
}

// CLI11 lets --help win over a command that it does not know.
bool is_unknown_command(const CLI::App& program, const std::string& word) {
    const auto named = [&](const CLI::App* command) { return command->get_name() == word; };
    return word.rfind('-', 0) != 0 && program.get_subcommands(named).empty();
}

int run(int argc, const char* const* argv) {
    CLI::App program(
        "Mapping, localization and navigation for vehicles with a 2D lidar and a camera: visual "
        "odometry seeds ICP, a pose graph refines the map. Records, calibrates, simulates and "
        "evaluates too.");
    Action action;
    describe_program(program, action);
    if (argc > 1 && is_unknown_command(program, argv[1])) {
        print_error(std::string("no command '") + argv[1] + "' (see 'hybrid-slam --help')");
        return kUsage;
    }
    try {
        program.parse(argc, argv);
    } catch (const CLI::Success& success) {  // --help or --version
        const int code = program.exit(success);
        return std::fflush(stdout) == 0 ? code : kFailure;
    } catch (const CLI::ParseError& error) {
        return usage_error(program, error);
    }
    const int code = action();
    if (std::fflush(stdout) != 0) {
        print_error("standard output: cannot be written");
        return kFailure;
    }
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    cv::setNumThreads(1);  // the same bytes on any machine, and the other cores are the vehicle's
    try {
        return run(argc, argv);
    } catch (const std::bad_alloc&) {
        print_error("out of memory");
    } catch (const std::exception& error) {
        print_error(error.what());
    }
    return kFailure;
}
