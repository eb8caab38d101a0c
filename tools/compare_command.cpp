// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cctype>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "drawings.hpp"
#include "evaluation.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "progress.hpp"
#include "session.hpp"
#include "summary.hpp"
#include "table.hpp"

namespace hybrid_slam::tools {
namespace {

struct CompareOptions {
    CommonOptions common;
    std::filesystem::path drive;
    std::filesystem::path out;
    std::filesystem::path config;
    YardstickFiles yardstick;
    Overrides overrides;
};

constexpr auto kFooter =
    R"(Runs the drive three times through the same pipeline, with other values of its options:
  plain ICP           to the previous scan, point to point, without a prior, without the graph
  seeded ICP          as configured, prior included, without the graph
  seeded ICP + graph  as configured, with loop closures and graph
and writes compare.png, compare.txt, compare.json and the trajectories into the folder of --out.
Examples:
  hybrid-slam compare intel.clf.gz --relations intel.relations
  hybrid-slam compare sim1/                       # against its own truth.tum
  hybrid-slam compare hall.clf --truth hall.truth.tum --out hall_compare --json
)";

/// A simulated recording brings the truth along.
void take_own_truth(CompareOptions& options) {
    YardstickFiles& yardstick = options.yardstick;
    if (!yardstick.truth.empty() || !yardstick.relations.empty()) {
        return;
    }
    yardstick.truth = options.drive / RecordingFiles::kTruth;
    if (!std::filesystem::exists(yardstick.truth)) {
        throw CLI::RequiredError("--truth or --relations");
    }
}

/// What is kept of a run; its keyframes are not.
struct Result {
    Variant variant;
    Settings settings;  ///< the effective ones
    Session session;
    Evaluation evaluation;
    Points points;
    double peak_mb = 0.0;
};

struct Comparison {
    Trajectory wheels;
    std::optional<Evaluation> odometry;  ///< of the wheels, when the log has them
    std::vector<Result> results;
    bool interrupted = false;
};

Result run_variant(const CompareOptions& options, const Settings& base, const Variant& variant) {
    const Settings settings = with_overrides(base, variant.overrides);
    reset_peak_memory();
    Result result;
    result.variant = variant;
    result.settings = settings;
    const std::unique_ptr<Input> input = open_input(options.drive, settings.log);
    {
        Progress progress(variant.name, options.common.quiet);
        result.session = run_session(*input, name_of(options.drive), settings, progress);
    }
    result.peak_mb = peak_memory_mb();
    SlamMap& map = result.session.map;
    result.points = draw_points(map.keyframes, map.graph, settings.map.resolution);
    map.keyframes = Keyframes{};
    return result;
}

Comparison run_all(const CompareOptions& options, const Yardstick& yardstick) {
    const Settings base = load_settings(options.config, options.overrides);
    Comparison comparison;
    for (const Variant& variant : comparison_variants()) {
        Result result = run_variant(options, base, variant);
        if (result.session.interrupted) {
            comparison.interrupted = true;  // part of a drive compares with nothing
            break;
        }
        result.evaluation = yardstick.measure(result.session.map.trajectory);
        comparison.results.push_back(std::move(result));
    }
    if (comparison.results.empty()) {
        return comparison;
    }
    comparison.wheels = std::move(comparison.results.front().session.wheels);
    // Fewer than two poses have no error.
    if (comparison.wheels.size() > 1) {
        comparison.odometry = yardstick.measure(comparison.wheels);
    }
    return comparison;
}

/// How many scans used each kind of prior, in the order of the row's name.
std::string priors_text(const Session& session) {
    std::string text;
    for (const PriorKind kind :
         {PriorKind::kNone, PriorKind::kConstantVelocity, PriorKind::kWheel}) {
        const auto used = session.priors_used.find(std::string(to_string(kind)));
        text += fmt::format("{}{}", text.empty() ? "" : " / ",
                            used == session.priors_used.end() ? 0 : used->second);
    }
    return text;
}

/// Adds one row: what `cell` says of each run.
template <typename Cell>
void add_row(Table& table, const Comparison& comparison, const std::string& name, Cell&& cell) {
    std::vector<std::string> cells{name};
    if (comparison.odometry) {
        cells.emplace_back();
    }
    for (const Result& result : comparison.results) {
        cells.push_back(cell(result));
    }
    table.add_row(std::move(cells));
}

void add_error_rows(Table& table, const Comparison& comparison) {
    const auto names = comparison.results.front().evaluation.figures();
    for (std::size_t i = 0; i < names.size(); ++i) {
        std::vector<std::string> cells{names[i].first};
        if (comparison.odometry) {
            cells.push_back(comparison.odometry->figures()[i].second);
        }
        for (const Result& result : comparison.results) {
            cells.push_back(result.evaluation.figures()[i].second);
        }
        table.add_row(std::move(cells));
    }
}

std::string table_text(const Comparison& comparison) {
    std::vector<std::string> header{""};
    if (comparison.odometry) {
        header.emplace_back("raw odometry");
    }
    for (const Result& result : comparison.results) {
        header.push_back(result.variant.name);
    }
    Table table(header);
    add_error_rows(table, comparison);
    const auto row = [&](const std::string& name, const auto& cell) {
        add_row(table, comparison, name, cell);
    };
    row("scans where ICP failed",
        [](const Result& r) { return with_commas(r.session.icp_failures()); });
    row("prior: none / velocity / wheel", [](const Result& r) { return priors_text(r.session); });
    row("closures accepted / tried", [](const Result& r) {
        return fmt::format("{} / {}", r.session.closures_with(ClosureVerdict::kAccepted),
                           r.session.map.closures.size());
    });
    row("CPU time, s",
        [](const Result& r) { return fmt::format("{:.2f}", r.session.timings.cpu); });
    row("scans per second",
        [](const Result& r) { return fmt::format("{:.0f}", r.session.scans_per_second()); });
    row("times real time",
        [](const Result& r) { return fmt::format("{:.0f}", r.session.real_time_factor()); });
    row("slowest scan, ms", [](const Result& r) {
        return fmt::format("{:.1f}", 1e3 * r.session.timings.scan.longest);
    });
    row("peak memory, MB", [](const Result& r) { return fmt::format("{:.0f}", r.peak_mb); });
    return table.text();
}

nlohmann::ordered_json to_json(const Result& result) {
    const Session& session = result.session;
    return {{"name", result.variant.name},
            {"overrides", result.variant.overrides},
            {"error", to_json(result.evaluation)},
            {"icp_failures", session.icp_failures()},
            {"priors_used", session.priors_used},
            {"closures", closures_by_verdict(session)},
            {"timings",
             {{"cpu_s", session.timings.cpu},
              {"session_s", session.timings.total},
              {"scans_per_s", session.scans_per_second()},
              {"real_time_factor", session.real_time_factor()},
              {"slowest_scan_ms", 1e3 * session.timings.scan.longest}}},
            {"memory", {{"peak_mb", result.peak_mb}}}};
}

nlohmann::ordered_json to_json(const CompareOptions& options, const Yardstick& yardstick,
                               const Comparison& comparison) {
    nlohmann::ordered_json json = {{"log", name_of(options.drive)},
                                   {"yardstick", yardstick.name()},
                                   {"interrupted", comparison.interrupted},
                                   {"scans", comparison.results.front().session.scans},
                                   {"raw_odometry", nullptr},
                                   {"variants", nlohmann::ordered_json::array()}};
    if (comparison.odometry) {
        json["raw_odometry"] = to_json(*comparison.odometry);
    }
    for (const Result& result : comparison.results) {
        json["variants"].push_back(to_json(result));
    }
    return json;
}

/// "seeded ICP + graph" as "seeded_icp_graph".
std::string file_name(const std::string& variant) {
    std::string name;
    for (const char letter : variant) {
        if (std::isalnum(static_cast<unsigned char>(letter)) != 0) {
            name += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
        } else if (!name.empty() && name.back() != '_') {
            name += '_';
        }
    }
    return name;
}

void draw_picture(const std::filesystem::path& file, const std::string& title,
                  const Comparison& comparison) {
    std::vector<VariantPicture> variants;
    for (const Result& result : comparison.results) {
        variants.push_back({result.variant.name + ": " + result.evaluation.brief(), result.points,
                            result.session.map.trajectory});
    }
    const std::string subtitle =
        comparison.odometry ? "raw odometry: " + comparison.odometry->brief() : "";
    draw_comparison(title, subtitle, variants).write_png(file);
}

std::filesystem::path make_folder(const CompareOptions& options) {
    const std::filesystem::path folder =
        options.out.empty() ? std::filesystem::path(stem_of(name_of(options.drive)) + "_compare")
                            : options.out;
    if (std::filesystem::exists(folder / "manifest.json")) {
        throw Error(folder.string() + ": holds a map or a recording; the comparison needs its own");
    }
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error || !std::filesystem::is_directory(folder)) {
        throw Error(folder.string() + ": cannot be made a folder");
    }
    return folder;
}

int run_compare(const CompareOptions& options) {
    const Yardstick yardstick(options.yardstick);
    const std::filesystem::path folder = make_folder(options);
    catch_interrupts();
    const Comparison comparison = run_all(options, yardstick);
    if (comparison.results.empty()) {
        print_warning("interrupted before the first run was complete: nothing to compare");
        return kInterrupted;
    }
    if (comparison.interrupted) {
        print_warning("interrupted; the runs that were complete are compared");
    }
    const std::string title = name_of(options.drive) + " against " + yardstick.name();
    const std::string table = table_text(comparison);
    const nlohmann::ordered_json json = to_json(options, yardstick, comparison);
    draw_picture(folder / "compare.png", title, comparison);
    write_text(folder / "compare.txt", title + "\n" + table + "\n");
    write_text(folder / "compare.json",
               json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    for (const Result& result : comparison.results) {
        write_tum(folder / (file_name(result.variant.name) + ".tum"),
                  result.session.map.trajectory);
        write_text(folder / (file_name(result.variant.name) + ".yaml"), to_yaml(result.settings));
    }
    if (options.common.json) {
        print_json(json);
    } else {
        print_result(title + "\n" + table + "\npicture: " + (folder / "compare.png").string());
    }
    return comparison.interrupted ? kInterrupted : kOk;
}

}  // namespace

void add_compare_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<CompareOptions>();
    CLI::App* command = program.add_subcommand(
        "compare", "Compare plain ICP, seeded ICP and seeded ICP with graph");
    command
        ->add_option("DRIVE", options->drive, "Folder of a recording, or CARMEN log (plain or .gz)")
        ->required()
        ->type_name("");
    add_yardstick_options(*command, options->yardstick, 0);
    command->add_option("-o,--out", options->out, "Folder for the results (DRIVE_compare)")
        ->type_name("DIR");
    command->add_option("-c,--config", options->config, "Configuration (YAML) of all three")
        ->type_name("FILE");
    add_set_option(*command, options->overrides, "scan.range_max=20");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        take_own_truth(*options);
        action = [options] { return run_compare(*options); };
    });
}

}  // namespace hybrid_slam::tools
