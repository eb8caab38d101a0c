// SPDX-License-Identifier: Apache-2.0
#include "map_onto.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "hybrid_slam/core/stopwatch.hpp"
#include "input.hpp"
#include "messages.hpp"
#include "stored_map.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const SessionPlace& place) {
    Json json = {{"keyframe", place.keyframe},
                 {"verdict", to_string(place.found.verdict)},
                 {"believed", place.agrees}};
    if (!place.found.places.empty()) {
        const Place& best = place.found.places.front();
        json["x_m"] = rounded(best.map_from_robot.x());
        json["y_m"] = rounded(best.map_from_robot.y());
        json["heading_deg"] = rounded(degrees(best.map_from_robot.heading));
        json["score"] = rounded(best.fit.score);
    }
    return json;
}

std::string why_not(const OntoResult& result) {
    switch (result.anchoring.verdict) {
        case AnchoringVerdict::kAmbiguous:
            return "several places in it look alike";
        case AnchoringVerdict::kContradictory:
            return result.anchoring.anchors.empty() ? "the places found in it contradict each other"
                                                    : "too few of the scans fit it";
        default:
            return "no piece of the drive was found in it for sure";
    }
}

}  // namespace

std::size_t OntoResult::places(PlaceVerdict verdict) const {
    return static_cast<std::size_t>(
        std::count_if(anchoring.searches.begin(), anchoring.searches.end(),
                      [&](const SessionPlace& p) { return p.found.verdict == verdict; }));
}

std::size_t OntoResult::believed() const {
    return static_cast<std::size_t>(
        std::count_if(anchoring.searches.begin(), anchoring.searches.end(),
                      [](const SessionPlace& place) { return place.agrees; }));
}

OntoMap::OntoMap(const std::filesystem::path& folder)
    : name_(name_of(folder)), stored_(open_map_folder(folder)), reference_(reference_of(stored_)) {}

OntoResult OntoMap::anchor(SlamMap& map, const Settings& settings) const {
    const Stopwatch clock;
    const SessionAnchorer anchorer(reference_, settings.anchoring,
                                   settings.localization.relocalization,
                                   settings.slam.odometry.icp);
    OntoResult result;
    result.map = name_;
    result.stored_keyframes = stored_.keyframes.size();
    result.stored_scans = stored_.trajectory.size();
    result.anchoring = anchorer.anchor(map);
    if (result.anchored()) {
        MergedMap merged = merge(stored_, map, result.anchoring);
        result.gone_points = merged.gone_points;
        map = std::move(merged.map);
    }
    result.seconds = clock.seconds();
    return result;
}

Json to_json(const OntoResult& result) {
    const Anchoring& anchoring = result.anchoring;
    Json searches = Json::array();
    for (const SessionPlace& place : anchoring.searches) {
        searches.push_back(to_json(place));
    }
    const std::size_t outside = anchoring.count(AnchorVerdict::kOutside);
    return {{"map", result.map},
            {"verdict", to_string(anchoring.verdict)},
            {"anchors",
             {{"tried", anchoring.anchors.size() - outside},
              {"accepted", anchoring.count(AnchorVerdict::kAccepted)},
              {"contradicted", anchoring.count(AnchorVerdict::kContradicted)},
              {"disagreeing", anchoring.count(AnchorVerdict::kDisagreeing)},
              {"outside", outside}}},
            {"searches", std::move(searches)},
            {"stored_keyframes", result.stored_keyframes},
            {"stored_scans", result.stored_scans},
            {"gone_points", result.gone_points}};
}

std::string text_of(const OntoResult& result) {
    const Anchoring& anchoring = result.anchoring;
    if (!result.anchored()) {
        return fmt::format("not anchored to {}: {} ({} of {} searches found a place, {} ambiguous)",
                           result.map, why_not(result), result.places(PlaceVerdict::kFound),
                           anchoring.searches.size(), result.places(PlaceVerdict::kAmbiguous));
    }
    const std::size_t outside = anchoring.count(AnchorVerdict::kOutside);
    return fmt::format(
        "onto       {}, {}; placed by {} of {} searches; {} of things gone left out\n"
        "anchors    {} accepted of {} tried: {} contradicted by the map, {} disagreeing; {} beyond "
        "its border",
        result.map, counted(result.stored_keyframes, "keyframe"), result.believed(),
        anchoring.searches.size(), counted(result.gone_points, "point"),
        with_commas(anchoring.count(AnchorVerdict::kAccepted)),
        with_commas(anchoring.anchors.size() - outside),
        with_commas(anchoring.count(AnchorVerdict::kContradicted)),
        with_commas(anchoring.count(AnchorVerdict::kDisagreeing)), with_commas(outside));
}

}  // namespace hybrid_slam::tools
