// SPDX-License-Identifier: Apache-2.0
#include "comparison_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "messages.hpp"
#include "summary.hpp"
#include "table.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kIncomparable = std::numeric_limits<double>::quiet_NaN();
constexpr PriorKind kPriors[] = {PriorKind::kNone, PriorKind::kConstantVelocity, PriorKind::kWheel,
                                 PriorKind::kVisual};
constexpr VisualStatus kFlaws[] = {VisualStatus::kTooDark, VisualStatus::kBlurred,
                                   VisualStatus::kTooFewFeatures, VisualStatus::kGroundHidden,
                                   VisualStatus::kInconsistent};

struct Cell {
    std::string text;
    double value = kIncomparable;
};
using CellOf = std::function<Cell(const VariantRun&)>;

enum class Better { kLess, kMore, kNeither };

const Cell kNothing{"-"};

Cell count_cell(std::size_t count) {
    return {with_commas(count), static_cast<double>(count)};
}

Cell number_cell(double value, int digits) {
    return {fmt::format("{:.{}f}", value, digits), value};
}

/// Those that read like the best one, unless all do.
std::vector<bool> best_of(const std::vector<Cell>& cells, Better better) {
    const Cell* best = nullptr;
    for (const Cell& cell : cells) {
        if (std::isfinite(cell.value) &&
            (best == nullptr ||
             (better == Better::kLess ? cell.value < best->value : cell.value > best->value))) {
            best = &cell;
        }
    }
    std::vector<bool> marks;
    marks.reserve(cells.size());
    for (const Cell& cell : cells) {
        marks.push_back(best != nullptr && better != Better::kNeither && cell.text == best->text);
    }
    const bool all = std::all_of(cells.begin(), cells.end(), [&](const Cell& cell) {
        return best == nullptr || !std::isfinite(cell.value) || cell.text == best->text;
    });
    return all ? std::vector<bool>(cells.size(), false) : marks;
}

ComparisonRow make_row(const std::string& name, const std::vector<Cell>& cells, Better better) {
    ComparisonRow row;
    row.name = name;
    for (const Cell& cell : cells) {
        row.cells.push_back(cell.text);
    }
    row.best = best_of(cells, better);
    return row;
}

/// What `cell` says of each run.
ComparisonRow row_of(const Comparison& comparison, const std::string& name, Better better,
                     const CellOf& cell) {
    std::vector<Cell> cells;
    if (comparison.odometry) {
        cells.emplace_back();
    }
    for (const VariantRun& run : comparison.runs) {
        cells.push_back(cell(run));
    }
    return make_row(name, cells, better);
}

std::vector<ComparisonRow> error_rows(const Comparison& comparison) {
    const VariantRun& first = comparison.runs.front();
    std::vector<ComparisonRow> rows;
    if (!first.evaluation) {
        return rows;  // a single run, and nothing to hold it against
    }
    const auto cell_of = [](const std::optional<Evaluation>& evaluation, std::size_t i) {
        if (!evaluation) {
            return kNothing;
        }
        const ErrorFigure figure = evaluation->figures()[i];
        return Cell{figure.text, figure.value};
    };
    const bool truth = comparison.has_truth();
    const std::vector<ErrorFigure> names = first.evaluation->figures();
    for (std::size_t i = 0; i < names.size(); ++i) {
        std::vector<Cell> cells;
        if (comparison.odometry) {
            cells.push_back(cell_of(comparison.odometry, i));
        }
        for (const VariantRun& run : comparison.runs) {
            cells.push_back(cell_of(run.evaluation, i));
        }
        // Who differs least is not the best.
        rows.push_back(make_row(truth ? names[i].name : names[i].name + " *", cells,
                                truth ? Better::kLess : Better::kNeither));
    }
    return rows;
}

Cell priors_cell(const VariantRun& run) {
    std::string text;
    for (const PriorKind kind : kPriors) {
        text += (text.empty() ? "" : " / ") + with_commas(run.session.with_prior(kind));
    }
    return {text};
}

/// Of variants that look at images; the others have a dash.
CellOf with_vision(const CellOf& cell) {
    return [cell](const VariantRun& run) { return run.vision ? cell(run) : kNothing; };
}

bool any_vision(const Comparison& comparison) {
    return std::any_of(comparison.runs.begin(), comparison.runs.end(),
                       [](const VariantRun& run) { return run.vision.has_value(); });
}

void add_vision_rows(const Comparison& comparison, std::vector<ComparisonRow>& rows) {
    const auto add = [&](const std::string& name, Better better, const CellOf& cell) {
        rows.push_back(row_of(comparison, name, better, with_vision(cell)));
    };
    add("scans whose prior was not visual", Better::kLess, [](const VariantRun& run) {
        const Session& session = run.session;
        const std::size_t first = session.scans > 0 ? 1 : 0;  // has no motion to be known
        return count_cell(session.scans - first - session.with_prior(PriorKind::kVisual));
    });
    add(fmt::format("scans whose image was late (> {:g} s)", Vision::kLateImage), Better::kNeither,
        [](const VariantRun& run) { return count_cell(run.session.vision.late); });
    add("images", Better::kNeither,
        [](const VariantRun& run) { return count_cell(run.session.vision.images); });
    for (const VisualStatus status : kFlaws) {
        const auto happened = [&](const VariantRun& run) {
            return run.session.vision.with(status) > 0;
        };
        if (std::any_of(comparison.runs.begin(), comparison.runs.end(), happened)) {
            add("  of them: " + words_for(status), Better::kLess, [status](const VariantRun& run) {
                return count_cell(run.session.vision.with(status));
            });
        }
    }
}

std::vector<ComparisonRow> result_rows(const Comparison& comparison) {
    std::vector<ComparisonRow> rows = error_rows(comparison);
    rows.push_back(
        row_of(comparison, "scans where ICP failed", Better::kLess, [](const VariantRun& run) {
            return run.uses_icp() ? count_cell(run.session.icp_failures()) : kNothing;
        }));
    if (any_vision(comparison)) {
        add_vision_rows(comparison, rows);
    }
    rows.push_back(row_of(comparison, "prior: none / velocity / wheel / visual", Better::kNeither,
                          priors_cell));
    rows.push_back(row_of(
        comparison, "closures accepted / tried", Better::kNeither, [](const VariantRun& run) {
            return Cell{fmt::format("{} / {}", run.session.closures_with(ClosureVerdict::kAccepted),
                                    run.session.map.closures.size())};
        }));
    return rows;
}

std::vector<ComparisonRow> cost_rows(const Comparison& comparison) {
    std::vector<ComparisonRow> rows;
    const auto add = [&](const std::string& name, Better better, const CellOf& cell) {
        rows.push_back(row_of(comparison, name, better, cell));
    };
    add("CPU time, s", Better::kLess,
        [](const VariantRun& run) { return number_cell(run.session.timings.cpu, 2); });
    if (any_vision(comparison)) {
        add("visual odometry, ms per image", Better::kLess, with_vision([](const VariantRun& run) {
                return number_cell(run.vision->milliseconds_per_image(), 2);
            }));
    }
    add("scans per second", Better::kMore,
        [](const VariantRun& run) { return number_cell(run.session.scans_per_second(), 0); });
    add("times real time", Better::kMore,
        [](const VariantRun& run) { return number_cell(run.session.real_time_factor(), 0); });
    add("slowest scan, ms", Better::kLess, [](const VariantRun& run) {
        return number_cell(1e3 * run.session.timings.scan.longest, 1);
    });
    add("peak memory, MB", Better::kLess,
        [](const VariantRun& run) { return number_cell(run.peak_mb, 0); });
    return rows;
}

Json vision_json(const VariantRun& run) {
    if (!run.vision) {
        return nullptr;
    }
    const Vision& vision = run.session.vision;
    return {{"method", to_string(run.settings.vision.odometry.method)},
            {"images", vision.images},
            {"statuses", statuses_json(vision)},
            {"extrapolated_scans", vision.extrapolated},
            {"late_scans", vision.late},
            {"warnings", vision.warnings()}};
}

Json to_json(const VariantRun& run) {
    const Session& session = run.session;
    Json json = {{"name", run.variant.name},
                 {"overrides", run.variant.overrides},
                 {"error", run.evaluation ? tools::to_json(*run.evaluation) : Json(nullptr)},
                 {"icp_failures", run.uses_icp() ? Json(session.icp_failures()) : Json(nullptr)},
                 {"priors_used", session.priors_used},
                 {"vision", vision_json(run)},
                 {"closures", closures_by_verdict(session)},
                 {"timings",
                  {{"cpu_s", session.timings.cpu},
                   {"session_s", session.timings.total},
                   {"scans_per_s", session.scans_per_second()},
                   {"real_time_factor", session.real_time_factor()},
                   {"slowest_scan_ms", 1e3 * session.timings.scan.longest}}},
                 {"memory", {{"peak_mb", run.peak_mb}}}};
    if (run.vision) {
        json["timings"]["vision_ms_per_image"] = run.vision->milliseconds_per_image();
    }
    return json;
}

}  // namespace

ComparisonTable table_of(const Comparison& comparison) {
    ComparisonTable table;
    if (comparison.odometry) {
        table.columns.emplace_back("raw odometry");
    }
    for (const VariantRun& run : comparison.runs) {
        table.columns.push_back(run.variant.name);
    }
    table.results = result_rows(comparison);
    table.cost = cost_rows(comparison);
    if (!comparison.has_truth()) {
        table.notes.push_back("* difference from " + comparison.yardstick->name() +
                              ", which may be wrong itself: there is no truth");
    }
    table.cost_notes.emplace_back(
        any_vision(comparison)
            ? "CPU time is without reading, decoding and visual odometry: done once for all"
            : "CPU time is without reading: done once for all");
    return table;
}

std::string text_of(const ComparisonTable& table) {
    std::vector<std::string> header{""};
    header.insert(header.end(), table.columns.begin(), table.columns.end());
    Table text(header);
    for (const auto* rows : {&table.results, &table.cost}) {
        for (const ComparisonRow& row : *rows) {
            std::vector<std::string> cells{row.name};
            cells.insert(cells.end(), row.cells.begin(), row.cells.end());
            text.add_row(std::move(cells));
        }
    }
    std::string result = text.text();
    for (const auto* notes : {&table.notes, &table.cost_notes}) {
        for (const std::string& note : *notes) {
            result += "\n" + note;
        }
    }
    return result;
}

Json to_json(const Comparison& comparison) {
    const bool truth = comparison.has_truth();
    Json json = {{"program", "hybrid-slam " HYBRID_SLAM_VERSION},
                 {"log", comparison.drive},
                 {"yardstick", truth ? Json(comparison.yardstick->name()) : Json(nullptr)},
                 {"held_against", comparison.yardstick->name()},
                 {"interrupted", comparison.interrupted},
                 {"scans", comparison.runs.front().session.scans},
                 {"input", comparison.input},
                 {"warnings", comparison.warnings},
                 {"raw_odometry", nullptr},
                 {"variants", Json::array()}};
    if (comparison.odometry) {
        json["raw_odometry"] = to_json(*comparison.odometry);
    }
    for (const VariantRun& run : comparison.runs) {
        json["variants"].push_back(to_json(run));
    }
    return json;
}

}  // namespace hybrid_slam::tools
