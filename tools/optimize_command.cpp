// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "drawings.hpp"
#include "hybrid_slam/backend/g2o.hpp"
#include "hybrid_slam/core/error.hpp"
#include "measure.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

struct OptimizeCommandOptions {
    CommonOptions common;
    std::filesystem::path in;
    std::filesystem::path out;
    std::filesystem::path picture;
    OptimizeOptions solver;
};

constexpr auto kFooter = R"(Vertices and edges of other kinds than SE2 are left out and counted.
Examples:
  hybrid-slam optimize M3500.g2o --out M3500_opt.g2o
  hybrid-slam optimize city10000.g2o.gz --out city.g2o.gz --kernel cauchy --png city.png --json
)";

struct Outcome {
    OptimizeSummary summary;
    double seconds = 0.0;
};

nlohmann::ordered_json to_json(const G2oFile& file, const Outcome& outcome) {
    const OptimizeSummary& summary = outcome.summary;
    return {{"nodes", file.graph.nodes.size()},
            {"edges", file.graph.edges.size()},
            {"priors", file.graph.priors.size()},
            {"skipped_lines", file.skipped_lines},
            {"chi2_before", summary.initial_chi2},
            {"chi2_after_start", summary.start_chi2},
            {"chi2_after", summary.final_chi2},
            {"iterations", summary.iterations},
            {"converged", summary.converged},
            {"message", summary.message},
            {"timings",
             {{"linear_start_s", summary.linear_start_seconds},
              {"solve_s", summary.solve_seconds},
              {"total_s", outcome.seconds}}},
            {"memory", {{"peak_mb", peak_memory_mb()}}}};
}

std::string to_text(const G2oFile& file, const Outcome& outcome) {
    const OptimizeSummary& summary = outcome.summary;
    return fmt::format("graph   {}, {}\nchi2    {:.3f} -> {:.3f} in {}{}\ntime    {:.3f} s",
                       counted(file.graph.nodes.size(), "node"),
                       counted(file.graph.edges.size(), "edge"), summary.initial_chi2,
                       summary.final_chi2,
                       counted(static_cast<std::size_t>(summary.iterations), "iteration"),
                       summary.converged ? "" : ", not converged", outcome.seconds);
}

void draw_graph(const OptimizeCommandOptions& options, const G2oFile& file,
                std::vector<Pose2d> before, const OptimizeSummary& summary) {
    GraphPicture picture;
    picture.title = "Pose graph of " + options.in.filename().string();
    picture.before_caption = fmt::format("before: chi2 {:.6g}", summary.initial_chi2);
    picture.after_caption = fmt::format("after: chi2 {:.6g}", summary.final_chi2);
    picture.before = std::move(before);
    picture.after = file.graph.nodes;
    add_edges(picture, file.graph);
    draw(picture).write_png(options.picture);
}

int run_optimize(const OptimizeCommandOptions& options) {
    G2oFile file = read_g2o(options.in);
    if (file.skipped_lines > 0) {
        print_info(fmt::format("{}: left out {} of other kinds", options.in.string(),
                               counted(file.skipped_lines, "line")));
    }
    std::vector<Pose2d> before = file.graph.nodes;
    const Stopwatch clock;
    const OptimizeSummary summary = optimize(file.graph, options.solver);
    const Outcome outcome{summary, clock.seconds()};
    if (!summary.usable) {
        throw Error(options.in.string() + ": cannot be optimised: " + summary.message);
    }
    if (!summary.converged) {
        print_warning("not converged: " + summary.message);
    }
    write_g2o(options.out, file.graph, file.ids);
    if (!options.picture.empty()) {
        draw_graph(options, file, std::move(before), summary);
    }
    if (options.common.json) {
        print_json(to_json(file, outcome));
    } else {
        print_result(to_text(file, outcome));
    }
    return kOk;
}

/// An option that takes one of a few names.
template <typename Enum>
void add_choice(CLI::App& command, const std::string& name, Enum& value,
                const std::map<std::string, Enum>& choices, const std::string& help) {
    command
        .add_option_function<std::string>(
            name, [&value, choices](const std::string& choice) { value = choices.at(choice); },
            help)
        ->check(CLI::IsMember(choices).description(""))
        ->type_name("NAME");
}

}  // namespace

void add_optimize_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<OptimizeCommandOptions>();
    CLI::App* command = program.add_subcommand("optimize", "Solve a 2D pose graph");
    command->add_option("IN", options->in, "Pose graph, .g2o or .g2o.gz")
        ->required()
        ->type_name("");
    command->add_option("-o,--out", options->out, "Solved graph, .g2o or .g2o.gz")
        ->required()
        ->type_name("FILE");
    add_choice(*command, "--kernel", options->solver.closure_kernel,
               {{"none", RobustKernel::kNone},
                {"huber", RobustKernel::kHuber},
                {"cauchy", RobustKernel::kCauchy}},
               "none, huber or cauchy, on edges between ids that are not neighbours");
    command
        ->add_option("--kernel-scale", options->solver.kernel_scale,
                     "Width of the kernel in sigmas (1)")
        ->check(CLI::Range(1e-6, 1e6).description(""));
    command->add_option("--max-iterations", options->solver.max_iterations, "At most so many (100)")
        ->check(CLI::Range(0, 1000000).description(""));
    add_choice(*command, "--start", options->solver.start,
               {{"chordal", LinearStart::kChordal}, {"none", LinearStart::kNone}},
               "chordal (a linear solution, the default) or none (as in the file)");
    command->add_option("--png", options->picture, "Draws the graph before and after")
        ->type_name("FILE");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback(
        [options, &action] { action = [options] { return run_optimize(*options); }; });
}

}  // namespace hybrid_slam::tools
