// SPDX-License-Identifier: Apache-2.0
#include "commands.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {

void add_common_options(CLI::App& command, CommonOptions& options) {
    command.set_help_flag("-h,--help", "Print this help");
    command.add_flag("-q,--quiet", options.quiet, "No progress and no messages but errors");
    command.add_flag("--json", options.json, "Print the figures as JSON");
    command.parse_complete_callback([&options] {
        if (options.quiet) {
            silence_messages();
        }
    });
}

void add_config_option(CLI::App& command, std::filesystem::path& file, const std::string& of) {
    command.add_option("-c,--config", file, "Configuration (YAML)" + of)->type_name("FILE");
}

void add_set_option(CLI::App& command, std::vector<std::string>& overrides,
                    const std::string& example) {
    command.add_option("--set", overrides, "Overrides one key, e.g. " + example)
        ->allow_extra_args(false)
        ->type_name("KEY=VALUE");
}

}  // namespace hybrid_slam::tools
