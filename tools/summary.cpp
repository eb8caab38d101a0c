// SPDX-License-Identifier: Apache-2.0
#include "summary.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr ClosureVerdict kVerdicts[] = {ClosureVerdict::kAccepted,  ClosureVerdict::kPending,
                                        ClosureVerdict::kLowScore,  ClosureVerdict::kAmbiguous,
                                        ClosureVerdict::kIcpFailed, ClosureVerdict::kInconsistent,
                                        ClosureVerdict::kExhausted, ClosureVerdict::kOutlier};

double milliseconds(double seconds) {
    return rounded(1e3 * seconds);
}

Json closure_json(const Closure& closure, const Keyframes& keyframes) {
    return {{"from", closure.from},
            {"to", closure.to},
            {"from_stamp", keyframes[closure.from].stamp},
            {"to_stamp", keyframes[closure.to].stamp},
            {"verdict", to_string(closure.verdict)},
            {"x_m", rounded(closure.from_from_to.x())},
            {"y_m", rounded(closure.from_from_to.y())},
            {"heading_deg", rounded(degrees(closure.from_from_to.heading))},
            {"score", rounded(closure.score)},
            {"runner_up_score", rounded(closure.runner_up_score)},
            {"overlap", rounded(closure.overlap)},
            {"rms_m", rounded(closure.rms)},
            {"chi2", rounded(closure.chi2)},
            {"correction_m", rounded(closure.correction)},
            {"search_nodes", closure.nodes}};
}

Json closures_json(const Session& session) {
    Json tried = Json::array();
    for (const Closure& closure : session.map.closures) {
        tried.push_back(closure_json(closure, session.map.keyframes));
    }
    return {{"tried", session.map.closures.size()},
            {"by_verdict", closures_by_verdict(session)},
            {"most_search_nodes", session.most_search_nodes},
            {"list", std::move(tried)}};
}

Json graph_json(const Session& session) {
    const OptimizeSummary& refinement = session.refinement;
    return {{"nodes", session.map.graph.nodes.size()},
            {"edges", session.map.graph.edges.size()},
            {"optimizations", session.optimizations},
            {"refinement",
             {{"chi2_before", rounded(refinement.initial_chi2)},
              {"chi2_after", rounded(refinement.final_chi2)},
              {"iterations", refinement.iterations},
              {"usable", refinement.usable},
              {"converged", refinement.converged}}}};
}

Json stage_json(const StageTime& stage) {
    return {{"total_s", rounded(stage.total)},
            {"mean_ms", milliseconds(stage.mean())},
            {"max_ms", milliseconds(stage.longest)}};
}

Json timings_json(const Session& session, const OutputTimings& output) {
    const SessionTimings& timings = session.timings;
    return {{"read", stage_json(timings.read)},
            {"odometry", stage_json(timings.odometry)},
            {"loop_closing", stage_json(timings.loop_closing)},
            {"optimization", stage_json(timings.optimization)},
            {"scan", stage_json(timings.scan)},
            {"slowest_scan_ms", milliseconds(timings.scan.longest)},
            {"refine_s", rounded(timings.refine)},
            {"write_map_s", rounded(output.write_map)},
            {"draw_pictures_s", rounded(output.draw_pictures)},
            {"session_s", rounded(timings.total)},
            {"session_cpu_s", rounded(timings.cpu)},
            {"scans_per_s", rounded(session.scans_per_second())},
            {"real_time_factor", rounded(session.real_time_factor())}};
}

Json vision_json(const Session& session) {
    const Vision& vision = session.vision;
    if (vision.images == 0) {
        return nullptr;
    }
    Json spells = Json::array();
    for (const BadSpell& spell : vision.spells) {
        spells.push_back({{"status", to_string(spell.status)},
                          {"from_stamp", spell.from},
                          {"duration_s", rounded(spell.duration())}});
    }
    return {{"images", vision.images},
            {"statuses", statuses_json(vision)},
            {"extrapolated_scans", vision.extrapolated},
            {"late_scans", vision.late},
            {"bad_spells", std::move(spells)}};
}

std::vector<std::string> all_warnings(const Session& session) {
    std::vector<std::string> warnings = session.warnings;
    const std::vector<std::string> more = session.vision.warnings();
    warnings.insert(warnings.end(), more.begin(), more.end());
    return warnings;
}

std::string vision_text(const Session& session) {
    const Vision& vision = session.vision;
    return fmt::format(
        "vision     {}, {:.1f} % good; prior visual in {} of {}{}\n",
        counted(vision.images, "image"),
        100.0 * static_cast<double>(vision.with(VisualStatus::kGood)) /
            static_cast<double>(vision.images),
        with_commas(session.with_prior(PriorKind::kVisual)), counted(session.scans, "scan"),
        vision.late > 0 ? fmt::format("; image late in {}", with_commas(vision.late)) : "");
}

std::string counts_text(const std::map<std::string, std::size_t>& counts) {
    std::string text;
    for (const auto& [name, count] : counts) {
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, with_commas(count));
    }
    return text;
}

std::string closures_text(const Session& session) {
    std::string refused;
    for (const ClosureVerdict verdict : kVerdicts) {
        const std::size_t count = session.closures_with(verdict);
        if (verdict != ClosureVerdict::kAccepted && count > 0) {
            refused += fmt::format("{}{} {}", refused.empty() ? ": " : ", ", with_commas(count),
                                   to_string(verdict));
        }
    }
    return fmt::format("closures   {} accepted of {} tried{}",
                       with_commas(session.closures_with(ClosureVerdict::kAccepted)),
                       with_commas(session.map.closures.size()), refused);
}

}  // namespace

Json statuses_json(const Vision& vision) {
    Json counts = Json::object();
    for (const auto& [status, count] : vision.statuses) {
        counts[std::string(to_string(status))] = count;
    }
    return counts;
}

Json closures_by_verdict(const Session& session) {
    Json counts = Json::object();
    for (const ClosureVerdict verdict : kVerdicts) {
        counts[std::string(to_string(verdict))] = session.closures_with(verdict);
    }
    return counts;
}

Json summary_of(const Session& session, const OutputTimings& output) {
    return {{"program", "hybrid-slam " HYBRID_SLAM_VERSION},
            {"log", session.name},
            {"interrupted", session.interrupted},
            {"input", session.input},
            {"warnings", all_warnings(session)},
            {"scans", session.scans},
            {"keyframes", session.map.keyframes.size()},
            {"duration_s", rounded(session.recorded)},
            {"path_length_m", rounded(session.path)},
            {"priors_used", session.priors_used},
            {"odometry_status", session.statuses},
            {"icp_failures", session.icp_failures()},
            {"vision", vision_json(session)},
            {"closures", closures_json(session)},
            {"graph", graph_json(session)},
            {"timings", timings_json(session, output)},
            {"memory", {{"peak_mb", rounded(peak_memory_mb())}}}};
}

std::string summary_text(const Session& session) {
    const OptimizeSummary& refinement = session.refinement;
    const SessionTimings& timings = session.timings;
    std::string text = fmt::format("drive      {} in {}, {:.1f} m; {}{}\n",
                                   counted(session.scans, "scan"), duration_text(session.recorded),
                                   session.path, counted(session.map.keyframes.size(), "keyframe"),
                                   session.interrupted ? "; interrupted before its end" : "");
    text += fmt::format("odometry   {} without a usable ICP; prior: {}\n",
                        counted(session.icp_failures(), "scan"), counts_text(session.priors_used));
    if (session.vision.images > 0) {
        text += vision_text(session);
    }
    text += closures_text(session) + "\n";
    if (refinement.usable) {
        text += fmt::format("graph      chi2 {:.1f} -> {:.1f} in {} of the final refinement\n",
                            refinement.initial_chi2, refinement.final_chi2,
                            counted(static_cast<std::size_t>(refinement.iterations), "iteration"));
    }
    text += fmt::format(
        "time       {:.2f} s ({:.0f} scans/s, {:.0f} x real time), slowest scan {:.1f} ms\n",
        timings.total, session.scans_per_second(), session.real_time_factor(),
        1e3 * timings.scan.longest);
    text += fmt::format("memory     {:.0f} MB at most", peak_memory_mb());
    return text;
}

}  // namespace hybrid_slam::tools
