// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace hybrid_slam::tools {

enum ExitCode : int {
    kOk = 0,
    kFailure = 1,
    kUsage = 2,
    kInterrupted = 3,
    kNotFit = 4,
    kAmbiguous = 5,
    kNotInMap = 6
};

/// What the command line asked for; returns the exit code.
using Action = std::function<int()>;

/// Each adds its subcommand, which puts what is to be done into `action` when it is chosen.
void add_map_command(CLI::App& program, Action& action);
void add_relocalize_command(CLI::App& program, Action& action);
void add_localize_command(CLI::App& program, Action& action);
void add_compare_command(CLI::App& program, Action& action);
void add_evaluate_command(CLI::App& program, Action& action);
void add_optimize_command(CLI::App& program, Action& action);
void add_drive_command(CLI::App& program, Action& action);
void add_goto_command(CLI::App& program, Action& action);
void add_simulate_command(CLI::App& program, Action& action);
void add_record_command(CLI::App& program, Action& action);
void add_info_command(CLI::App& program, Action& action);
void add_export_command(CLI::App& program, Action& action);
void add_crop_command(CLI::App& program, Action& action);
void add_calibrate_command(CLI::App& program, Action& action);

/// Options that all subcommands have.
struct CommonOptions {
    bool quiet = false;
    bool json = false;
};
void add_common_options(CLI::App& command, CommonOptions& options);

/// -c, --config; `of` ends what the help says of it.
void add_config_option(CLI::App& command, std::filesystem::path& file,
                       const std::string& of = "; config/default.yaml has all keys");

/// --set key=value, as often as one likes.
void add_set_option(CLI::App& command, std::vector<std::string>& overrides,
                    const std::string& example);

}  // namespace hybrid_slam::tools
