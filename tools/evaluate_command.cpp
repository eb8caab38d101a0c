// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "error_plot.hpp"
#include "evaluation.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

struct EvaluateOptions {
    CommonOptions common;
    std::filesystem::path trajectory;
    YardstickFiles yardstick;
    std::filesystem::path plot;
};

constexpr auto kFooter =
    R"(Against relations: errors of relative motions between given stamps; no alignment is needed.
Against a true trajectory: root mean square errors after one alignment (--align).
Examples:
  hybrid-slam evaluate intel_map/trajectory.tum --relations intel.relations
  hybrid-slam evaluate hall_map/trajectory.tum --truth hall.truth.tum --plot error.png
  hybrid-slam evaluate intel_map/odometry.tum --relations intel.relations --json
)";

int run_evaluate(const EvaluateOptions& options) {
    const Trajectory trajectory = read_tum(options.trajectory);
    const Yardstick yardstick(options.yardstick);
    const Evaluation evaluation = yardstick.measure(trajectory);
    const std::string title =
        options.trajectory.filename().string() + " against " + yardstick.name();
    if (!options.plot.empty()) {
        draw_errors("Errors of " + title,
                    (evaluation.relations ? "mean " : "root mean square ") + evaluation.brief(),
                    errors_over_time(trajectory, yardstick, evaluation))
            .write_png(options.plot);
        print_info("wrote " + options.plot.string());
    }
    if (options.common.json) {
        print_json(to_json(evaluation));
    } else {
        print_result(title + ": " + Yardstick::report(evaluation));
    }
    return kOk;
}

}  // namespace

void add_evaluate_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<EvaluateOptions>();
    CLI::App* command = program.add_subcommand("evaluate", "Tell how good a trajectory is");
    command->add_option("TRAJECTORY", options->trajectory, "Trajectory (TUM)")
        ->required()
        ->type_name("");
    add_yardstick_options(*command, options->yardstick);
    command->add_option("--plot", options->plot, "Draws the errors over time into this PNG")
        ->type_name("FILE");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback(
        [options, &action] { action = [options] { return run_evaluate(*options); }; });
}

}  // namespace hybrid_slam::tools
