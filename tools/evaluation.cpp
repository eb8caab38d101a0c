// SPDX-License-Identifier: Apache-2.0
#include "evaluation.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>

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

Json to_json(const TruthError& error) {
    return {{"metric", "truth"},
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

}  // namespace

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
            evaluation.truth = truth_error(trajectory, truth_, options);
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
    if (relations) {
        return fmt::format("{:.3g} m, {:.3g} deg", relations->translation.mean,
                           degrees(relations->rotation.mean));
    }
    return fmt::format("{:.3g} m, {:.3g} deg", truth->ate_rmse, degrees(truth->heading_rmse));
}

std::vector<std::pair<std::string, std::string>> Evaluation::figures() const {
    if (relations) {
        const RelationsError& error = *relations;
        const double deg = degrees(1.0);
        return {{"translation error, m", mean_text(error.translation, 1.0, 4)},
                {"  largest, m", fmt::format("{:.2f}", error.translation.maximum)},
                {"rotation error, deg", mean_text(error.rotation, deg, 3)},
                {"  largest, deg", fmt::format("{:.1f}", deg * error.rotation.maximum)},
                {"relations without a pose", with_commas(error.unmatched)}};
    }
    const TruthError& error = truth.value();
    return {{"ATE (RMSE), m", fmt::format("{:.4f}", error.ate_rmse)},
            {"  largest, m", fmt::format("{:.3f}", error.ate_max)},
            {"x (RMSE), m", fmt::format("{:.4f}", error.x_rmse)},
            {"y (RMSE), m", fmt::format("{:.4f}", error.y_rmse)},
            {"heading (RMSE), deg", fmt::format("{:.3f}", degrees(error.heading_rmse))},
            {fmt::format("RPE over {:g} m, m", error.rpe_distance),
             fmt::format("{:.4f}", error.rpe_translation_rmse)},
            {fmt::format("RPE over {:g} m, deg", error.rpe_distance),
             fmt::format("{:.3f}", degrees(error.rpe_rotation_rmse))},
            {"poses without truth", with_commas(error.unmatched)}};
}

Json to_json(const Evaluation& evaluation) {
    return evaluation.relations ? to_json(*evaluation.relations)
                                : to_json(evaluation.truth.value());
}

}  // namespace hybrid_slam::tools
