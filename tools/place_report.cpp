// SPDX-License-Identifier: Apache-2.0
#include "place_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "messages.hpp"
#include "table.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

std::string percent(double share) {
    return fmt::format("{:.1f} %", 100.0 * share);
}

std::string fit_text(const ScanFit& fit) {
    return fmt::format(
        "{:.2f}: of {} {} explained (misfit {:.1f} cm), {} through walls, {} unmapped, {} unknown",
        fit.score, counted(fit.points, "point"), percent(fit.explained), 100.0 * fit.rms,
        percent(fit.violated), percent(fit.unmapped), percent(fit.unknown));
}

std::string away_text(const Place& from, const Place& place) {
    const Pose2d step = between(from.map_from_robot, place.map_from_robot);
    return fmt::format("{:.2f} m and {:.0f} deg away", step.translation.norm(),
                       degrees(std::abs(step.heading)));
}

std::string best_text(const Relocalization& relocalization) {
    const Place& best = relocalization.places.front();
    std::string text = fmt::format("found      {}\nsigma      {}\nscore      {}\nrunner-up  ",
                                   pose_text(best.map_from_robot), sigmas_text(best.covariance),
                                   fit_text(best.fit));
    if (relocalization.places.size() < 2) {
        return text + "none";
    }
    const Place& second = relocalization.places[1];
    return text + fmt::format("{}: score {:.2f}, {}", pose_text(second.map_from_robot),
                              second.fit.score, away_text(best, second));
}

/// At most so many: nobody reads more.
std::string places_text(const std::vector<Place>& places) {
    constexpr std::size_t kMost = 12;
    Table table({"place", "x, m", "y, m", "heading, deg", "score", "explained", "through walls"});
    for (std::size_t i = 0; i < std::min(places.size(), kMost); ++i) {
        const Place& place = places[i];
        const Pose2d& pose = place.map_from_robot;
        table.add_row({std::to_string(i + 1), fmt::format("{:.3f}", pose.x()),
                       fmt::format("{:.3f}", pose.y()),
                       fmt::format("{:.2f}", degrees(pose.heading)),
                       fmt::format("{:.2f}", place.fit.score), percent(place.fit.explained),
                       percent(place.fit.violated)});
    }
    return table.text() +
           (places.size() > kMost ? fmt::format("\nand {} more", places.size() - kMost) : "");
}

std::string with_places(const std::string& text, const std::vector<Place>& places) {
    return places.empty() ? text : text + "\n" + places_text(places);
}

}  // namespace

std::string pose_text(const Pose2d& pose) {
    return fmt::format("x {:.3f} m, y {:.3f} m, heading {:.2f} deg", pose.x(), pose.y(),
                       degrees(pose.heading));
}

std::string words_for(PlaceVerdict verdict) {
    switch (verdict) {
        case PlaceVerdict::kFound:
            return "found";
        case PlaceVerdict::kAmbiguous:
            return "several places look alike";
        case PlaceVerdict::kUnfinished:
            return "not all of the map looked at";
        case PlaceVerdict::kNotInMap:
            break;
    }
    return "not in this map";
}

Json to_json(const Pose2d& pose) {
    return {{"x_m", rounded(pose.x())},
            {"y_m", rounded(pose.y())},
            {"heading_deg", rounded(degrees(pose.heading))}};
}

Eigen::Vector3d sigmas_of(const Eigen::Matrix3d& covariance) {
    const Eigen::Vector3d sigmas = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    return {sigmas.x(), sigmas.y(), degrees(sigmas.z())};
}

std::string sigmas_text(const Eigen::Matrix3d& covariance) {
    const Eigen::Vector3d sigmas = sigmas_of(covariance);
    return fmt::format("{:.2f} cm along x, {:.2f} cm along y, {:.3f} deg", 100.0 * sigmas.x(),
                       100.0 * sigmas.y(), sigmas.z());
}

Json sigmas_json(const Eigen::Matrix3d& covariance) {
    const Eigen::Vector3d sigmas = sigmas_of(covariance);
    return {{"x_m", rounded(sigmas.x())},
            {"y_m", rounded(sigmas.y())},
            {"heading_deg", rounded(sigmas.z())}};
}

Json matrix_json(const Eigen::Matrix3d& covariance) {
    Json rows = Json::array();
    for (int row = 0; row < 3; ++row) {
        rows.push_back({covariance(row, 0), covariance(row, 1), covariance(row, 2)});
    }
    return rows;
}

Json to_json(const ScanFit& fit) {
    return {{"points", fit.points},
            {"explained", rounded(fit.explained)},
            {"violated", rounded(fit.violated)},
            {"unmapped", rounded(fit.unmapped)},
            {"unknown", rounded(fit.unknown)},
            {"misfit_rms_m", rounded(fit.rms)},
            {"score", rounded(fit.score)}};
}

Json to_json(const Place& place) {
    return {{"pose", to_json(place.map_from_robot)},       {"sigma", sigmas_json(place.covariance)},
            {"covariance", matrix_json(place.covariance)}, {"fit", to_json(place.fit)},
            {"search_score", rounded(place.search_score)}, {"share", rounded(place.share)}};
}

Json to_json(const Relocalization& relocalization) {
    Json places = Json::array();
    for (const Place& place : relocalization.places) {
        places.push_back(to_json(place));
    }
    return {{"verdict", to_string(relocalization.verdict)},
            {"places", std::move(places)},
            {"nodes", relocalization.nodes}};
}

std::string text_of(const Relocalization& relocalization) {
    const std::vector<Place>& places = relocalization.places;
    switch (relocalization.verdict) {
        case PlaceVerdict::kFound:
            return best_text(relocalization);
        case PlaceVerdict::kAmbiguous:
            return with_places(fmt::format("ambiguous  {} look alike from here: drive a little, "
                                           "and look again with the scans of the way (--drive)",
                                           counted(places.size(), "place")),
                               places);
        case PlaceVerdict::kUnfinished:
            return with_places(
                "unfinished the effort ran out, or more places look alike than were looked at: as "
                "good as ambiguous; drive a little (--drive), or raise relocalization.max_nodes",
                places);
        case PlaceVerdict::kNotInMap:
            break;
    }
    return with_places(fmt::format("not in map no place explains what is seen{}",
                                   places.empty() ? "" : "; the nearest misses:"),
                       places);
}

}  // namespace hybrid_slam::tools
