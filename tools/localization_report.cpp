// SPDX-License-Identifier: Apache-2.0
#include "localization_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "messages.hpp"
#include "place_report.hpp"
#include "summary.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr LocalizationStatus kStatuses[] = {
    LocalizationStatus::kTracking, LocalizationStatus::kDegraded, LocalizationStatus::kLost,
    LocalizationStatus::kRelocalizing};

double milliseconds(double seconds) {
    return rounded(1e3 * seconds);
}

double largest_jump(const LocalizationRun& run) {
    double largest = 0.0;
    for (const Jump& jump : run.jumps) {
        largest = std::max(largest, between(jump.from, jump.to).translation.norm());
    }
    return largest;
}

Json statuses_json(const LocalizationRun& run) {
    Json statuses = Json::object();
    for (const LocalizationStatus status : kStatuses) {
        statuses[std::string(to_string(status))] = {{"scans", run.with(status)},
                                                    {"share", rounded(run.share_of(status))}};
    }
    return statuses;
}

Json searches_json(const LocalizationRun& run) {
    Json searches = Json::object();
    for (const auto& [verdict, count] : run.searches) {
        searches[std::string(to_string(verdict))] = count;
    }
    return searches;
}

Json timings_json(const LocalizationRun& run) {
    return {{"scan_mean_ms", milliseconds(run.scan.mean())},
            {"slowest_scan_ms", milliseconds(run.scan.longest)},
            {"read_mean_ms", milliseconds(run.read.mean())},
            {"session_s", rounded(run.total)},
            {"session_cpu_s", rounded(run.cpu)},
            {"scans_per_s", rounded(static_cast<double>(run.scans) / run.total)},
            {"real_time_factor", rounded(run.recorded / run.total)}};
}

Json vision_json(const Vision& vision) {
    if (vision.images == 0) {
        return nullptr;
    }
    return {{"images", vision.images},
            {"statuses", statuses_json(vision)},
            {"extrapolated_scans", vision.extrapolated},
            {"late_scans", vision.late}};
}

std::string place_text(const LocalizationRun& run) {
    if (run.found_after) {
        return fmt::format("found after {:.1f} s", *run.found_after);
    }
    std::string said;
    for (const auto& [verdict, count] : run.searches) {
        said += fmt::format("{} {} x {}", said.empty() ? ":" : ",", count, words_for(verdict));
    }
    return "never found, " + words_for(run.why_not_found()) + " (searches" +
           (said.empty() ? ": none" : said) + ")";
}

std::string shares_text(const LocalizationRun& run) {
    std::string text;
    for (const LocalizationStatus status : kStatuses) {
        text += fmt::format("{}{} {:.1f} %", text.empty() ? "" : ", ", to_string(status),
                            100.0 * run.share_of(status));
    }
    return text;
}

std::string fit_text(const LocalizationRun& run) {
    return fmt::format(
        "fit        score {:.2f}, {:.1f} % of the beams on what the map does not have, misfit "
        "{:.1f} cm\njumps      {}{}\n",
        run.mean_of(run.score_sum), 100.0 * run.mean_of(run.unmapped_sum),
        100.0 * run.mean_of(run.misfit_sum), with_commas(run.jumps.size()),
        run.jumps.empty() ? "" : fmt::format(", the largest {:.2f} m", largest_jump(run)));
}

}  // namespace

Json summary_of(const LocalizationRun& run, const std::optional<RunTruth>& truth) {
    std::vector<std::string> warnings = run.warnings;
    const std::vector<std::string> more = run.vision.warnings();
    warnings.insert(warnings.end(), more.begin(), more.end());
    Json truth_json;
    if (truth) {
        truth_json = to_json(truth->evaluation);
        truth_json["against"] = truth->against;
    }
    return {{"drive", run.name},
            {"interrupted", run.interrupted},
            {"input", run.input},
            {"warnings", std::move(warnings)},
            {"scans", run.scans},
            {"duration_s", rounded(run.recorded)},
            {"path_length_m", rounded(run.path)},
            {"found_after_s", run.found_after ? Json(rounded(*run.found_after)) : Json()},
            {"statuses", statuses_json(run)},
            {"jumps", {{"count", run.jumps.size()}, {"largest_m", rounded(largest_jump(run))}}},
            {"searches", {{"by_verdict", searches_json(run)}, {"most_nodes", run.most_nodes}}},
            {"mean_score", rounded(run.mean_of(run.score_sum))},
            {"mean_unmapped", rounded(run.mean_of(run.unmapped_sum))},
            {"mean_misfit_rms_m", rounded(run.mean_of(run.misfit_sum))},
            {"priors_used", run.priors_used},
            {"camera_poses", run.camera_poses.size()},
            {"vision", vision_json(run.vision)},
            {"truth", std::move(truth_json)},
            {"timings", timings_json(run)},
            {"memory", {{"peak_mb", rounded(peak_memory_mb())}}}};
}

std::string summary_text(const LocalizationRun& run, const std::optional<RunTruth>& truth) {
    std::string text = fmt::format(
        "drive      {} in {}, {:.1f} m in the map{}\nplace      {}; {}\n",
        counted(run.scans, "scan"), duration_text(run.recorded), run.path,
        run.interrupted ? "; interrupted before its end" : "", place_text(run), shares_text(run));
    if (run.trusted > 0) {
        text += fit_text(run);
    }
    if (run.vision.images > 0) {
        text += fmt::format("camera     {} between the scans\n",
                            counted(run.camera_poses.size(), "pose"));
    }
    if (truth) {
        text += fmt::format("truth      RMSE {} against {}\n", truth->evaluation.brief(),
                            truth->against);
    }
    return text + fmt::format(
                      "time       {:.2f} s ({:.0f} x real time), {:.1f} ms a scan, slowest "
                      "{:.1f} ms\nmemory     {:.0f} MB at most",
                      run.total, run.recorded / run.total, 1e3 * run.scan.mean(),
                      1e3 * run.scan.longest, peak_memory_mb());
}

}  // namespace hybrid_slam::tools
