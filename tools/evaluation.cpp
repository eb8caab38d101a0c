// SPDX-License-Identifier: Apache-2.0
#include "evaluation.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "messages.hpp"
#include "table.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

std::string mean_text(const ErrorStatistics& error, double unit, int digits) {
    return fmt::format("{:.{}f} +- {:.{}f}", unit * error.mean, digits, unit * error.deviation,
                       digits);
}

std::string squared_text(const ErrorStatistics& error, double unit, int digits) {
    return fmt::format("{:.{}f} +- {:.{}f}", unit * unit * error.mean_squared, digits,
                       unit * unit * error.deviation_squared, digits);
}

/// `unit` turns what we count in into what is printed.
Json statistics_json(const ErrorStatistics& error, double unit, const std::string& name) {
    return {{"mean_" + name, unit * error.mean},
            {"deviation_" + name, unit * error.deviation},
            {"mean_squared_" + name + "2", unit * unit * error.mean_squared},
            {"deviation_squared_" + name + "2", unit * unit * error.deviation_squared},
            {"max_" + name, unit * error.maximum}};
}

Json to_json(const RelationsError& error) {
    return {{"metric", "relations"},
            {"used", error.used},
            {"unmatched", error.unmatched},
            {"translation", statistics_json(error.translation, 1.0, "m")},
            {"rotation", statistics_json(error.rotation, degrees(1.0), "deg")}};
}

Json to_json(const Evaluation& evaluation, const TruthError& error) {
    Json json = {{"metric", evaluation.drift ? "truth" : "difference"},
                 {"alignment", to_string(evaluation.alignment)},
                 {"used", error.used},
                 {"unmatched", error.unmatched},
                 {"ate_rmse_m", error.ate_rmse},
                 {"ate_max_m", error.ate_max},
                 {"x_rmse_m", error.x_rmse},
                 {"y_rmse_m", error.y_rmse},
                 {"heading_rmse_deg", degrees(error.heading_rmse)},
                 {"rpe_distance_m", error.rpe_distance},
                 {"rpe_pairs", error.rpe_pairs},
                 {"rpe_translation_rmse_m", error.rpe_translation_rmse},
                 {"rpe_rotation_rmse_deg", degrees(error.rpe_rotation_rmse)}};
    if (evaluation.drift) {
        const DriftError& drift = *evaluation.drift;
        json["best_fit_rmse_m"] = drift.best_fit_rmse;
        json["way_m"] = drift.way;
        json["final_position_m"] = drift.final_position;
        json["final_heading_deg"] = degrees(drift.final_heading);
        json["drift_over_m"] = drift.over;
        json["drift_percent"] = 100.0 * drift.translation;
        json["drift_deg"] = degrees(drift.rotation);
    }
    return json;
}

std::string report(const RelationsError& error) {
    const double deg = degrees(1.0);
    Table table({"", "mean +- deviation", "max", "mean square +- deviation"});
    table.add_row({"translation", mean_text(error.translation, 1.0, 4) + " m",
                   fmt::format("{:.3f} m", error.translation.maximum),
                   squared_text(error.translation, 1.0, 5) + " m2"});
    table.add_row({"rotation", mean_text(error.rotation, deg, 3) + " deg",
                   fmt::format("{:.2f} deg", deg * error.rotation.maximum),
                   squared_text(error.rotation, deg, 3) + " deg2"});
    return fmt::format("{} used, {} without a pose at a stamp\n{}", counted(error.used, "relation"),
                       with_commas(error.unmatched), table.text());
}

std::string report(const TruthError& error) {
    Table table({"", "root mean square", "max"});
    table.add_row({"position (ATE)", fmt::format("{:.4f} m", error.ate_rmse),
                   fmt::format("{:.3f} m", error.ate_max)});
    table.add_row({"along x", fmt::format("{:.4f} m", error.x_rmse)});
    table.add_row({"along y", fmt::format("{:.4f} m", error.y_rmse)});
    table.add_row({"heading", fmt::format("{:.3f} deg", degrees(error.heading_rmse))});
    const std::string over = fmt::format(" over {:g} m (RPE)", error.rpe_distance);
    table.add_row({"motion" + over, fmt::format("{:.4f} m", error.rpe_translation_rmse)});
    table.add_row({"rotation" + over, fmt::format("{:.3f} deg", degrees(error.rpe_rotation_rmse))});
    return fmt::format("{} used, {} without truth at the stamp\n{}", counted(error.used, "pose"),
                       with_commas(error.unmatched), table.text());
}

/// Beyond what truth_error says; `error` is that of the same trajectory.
DriftError drift_of(const Trajectory& trajectory, const Trajectory& truth,
                    const TruthError& error) {
    DriftError drift;
    TruthOptions options;  // best fit
    options.rpe_distance = drift.over;
    const TruthError over_more = truth_error(trajectory, truth, options);
    drift.best_fit_rmse = over_more.ate_rmse;
    drift.translation = over_more.rpe_translation_rmse / drift.over;
    drift.rotation = over_more.rpe_rotation_rmse;
    const TrajectoryIndex index(truth);
    Trajectory driven;
    for (const StampedPose& stamped : trajectory) {
        if (const auto pose = index.interpolated(stamped.stamp, options.max_gap)) {
            driven.push_back({stamped.stamp, *pose});
            const Pose2d off = between(*pose, error.truth_from_estimate * stamped.pose);
            drift.final_position = off.translation.norm();
            drift.final_heading = std::abs(off.heading);
        }
    }
    drift.way = length_of(driven);
    return drift;
}

/// A number for a table, with a dash for what there was not enough of.
ErrorFigure figure(const std::string& name, double value, int digits) {
    return {name, std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "-", value};
}

std::vector<ErrorFigure> figures_of(const RelationsError& error) {
    const double deg = degrees(1.0);
    return {{"translation error, m", mean_text(error.translation, 1.0, 4), error.translation.mean},
            figure("  largest, m", error.translation.maximum, 2),
            {"rotation error, deg", mean_text(error.rotation, deg, 3), error.rotation.mean},
            figure("  largest, deg", deg * error.rotation.maximum, 1),
            {"relations without a pose", with_commas(error.unmatched),
             static_cast<double>(error.unmatched)}};
}

/// Thesis Table 4.33 and equations 4.1 to 4.3, and what it leaves out.
std::vector<ErrorFigure> figures_of(const TruthError& error, const Evaluation& evaluation) {
    const bool fitted = evaluation.alignment == TruthAlignment::kBestFit;
    std::vector<ErrorFigure> figures{
        figure(fitted ? "ATE (RMSE), m" : "position (RMSE), m", error.ate_rmse, 4),
        figure("  largest, m", error.ate_max, 3), figure("x (RMSE), m", error.x_rmse, 4),
        figure("y (RMSE), m", error.y_rmse, 4),
        figure("heading (RMSE), deg", degrees(error.heading_rmse), 3)};
    if (evaluation.drift && !fitted) {
        figures.push_back(
            figure("ATE (RMSE after best fit), m", evaluation.drift->best_fit_rmse, 4));
    }
    figures.push_back(figure(fmt::format("RPE over {:g} m, m", error.rpe_distance),
                             error.rpe_translation_rmse, 4));
    figures.push_back(figure(fmt::format("RPE over {:g} m, deg", error.rpe_distance),
                             degrees(error.rpe_rotation_rmse), 3));
    if (evaluation.drift) {
        const DriftError& drift = *evaluation.drift;
        figures.push_back(figure("final position error, m", drift.final_position, 3));
        figures.push_back(figure("  of the way, %", 100.0 * drift.final_position / drift.way, 2));
        figures.push_back(figure("final heading error, deg", degrees(drift.final_heading), 2));
        figures.push_back(
            figure(fmt::format("drift over {:g} m, %", drift.over), 100.0 * drift.translation, 2));
        figures.push_back(
            figure(fmt::format("drift, deg per {:g} m", drift.over), degrees(drift.rotation), 2));
    }
    figures.push_back({evaluation.drift ? "poses without truth" : "poses without a counterpart",
                       with_commas(error.unmatched), static_cast<double>(error.unmatched)});
    return figures;
}

}  // namespace

std::string_view to_string(TruthAlignment alignment) {
    switch (alignment) {
        case TruthAlignment::kBestFit:
            return "best";
        case TruthAlignment::kFirstPose:
            return "first";
        case TruthAlignment::kNone:
            return "none";
    }
    return "unknown";
}

void add_yardstick_options(CLI::App& command, YardstickFiles& files, int least) {
    auto* yardstick = command.add_option_group("Truth");
    yardstick
        ->add_option("--relations", files.relations,
                     "Relative poses between stamps (Kuemmerle et al. 2009)")
        ->type_name("FILE");
    yardstick->add_option("--truth", files.truth, "True trajectory (TUM)")->type_name("FILE");
    yardstick->require_option(least, 1);
    const std::map<std::string, TruthAlignment> alignments{{"best", TruthAlignment::kBestFit},
                                                           {"first", TruthAlignment::kFirstPose},
                                                           {"none", TruthAlignment::kNone}};
    command
        .add_option("--align", files.alignment,
                    "Before comparing with --truth: best fit of the whole trajectory (best), first "
                    "pose onto the first true one (first), or none")
        ->transform(CLI::CheckedTransformer(alignments).description(""))
        ->type_name("best|first|none");
}

Yardstick::Yardstick(const YardstickFiles& files) : alignment_(files.alignment) {
    if (files.truth.empty()) {
        name_ = files.relations.filename().string();
        relations_ = read_relations(files.relations);
    } else {
        name_ = files.truth.filename().string();
        truth_ = read_tum(files.truth);
    }
}

Yardstick::Yardstick(std::string name, Trajectory other)
    : name_(std::move(name)),
      has_truth_(false),
      alignment_(TruthAlignment::kFirstPose),
      truth_(std::move(other)) {}

std::string Yardstick::description() const {
    if (truth_.empty()) {
        return name_;
    }
    const std::string how =
        alignment_ == TruthAlignment::kBestFit     ? "after the best fit of the whole"
        : alignment_ == TruthAlignment::kFirstPose ? "anchored at the first true pose"
                                                   : "in one frame with it";
    return name_ + (has_truth_ ? ", " + how : "");
}

Evaluation Yardstick::measure(const Trajectory& trajectory) const {
    Evaluation evaluation;
    if (truth_.empty()) {
        evaluation.relations = relations_error(trajectory, relations_);
        if (evaluation.relations->used == 0) {
            throw Error(name_ + ": none of its relations has poses at both stamps");
        }
    } else {
        try {
            TruthOptions options;
            options.alignment = alignment_;
            evaluation.alignment = alignment_;
            evaluation.truth = truth_error(trajectory, truth_, options);
            if (has_truth_) {
                evaluation.drift = drift_of(trajectory, truth_, *evaluation.truth);
            }
        } catch (const Error& error) {
            throw Error(name_ + ": " + error.what());
        }
    }
    return evaluation;
}

std::string Yardstick::report(const Evaluation& evaluation) {
    return evaluation.relations ? tools::report(*evaluation.relations)
                                : tools::report(evaluation.truth.value());
}

std::string Evaluation::brief() const {
    const double metres = relations ? relations->translation.mean : truth->ate_rmse;
    const double turn = relations ? relations->rotation.mean : truth->heading_rmse;
    const bool small = metres < 0.1;
    return fmt::format("{:.3g} {}, {:.3g} deg", small ? 100.0 * metres : metres, small ? "cm" : "m",
                       degrees(turn));
}

std::vector<ErrorFigure> Evaluation::figures() const {
    return relations ? figures_of(*relations) : figures_of(truth.value(), *this);
}

Json to_json(const Evaluation& evaluation) {
    return evaluation.relations ? to_json(*evaluation.relations)
                                : to_json(evaluation, evaluation.truth.value());
}

}  // namespace hybrid_slam::tools
