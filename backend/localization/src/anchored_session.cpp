// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/anchored_session.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/uncertainty.hpp"
#include "scan_anchor.hpp"

namespace hybrid_slam {
namespace {

constexpr double kOtherScans = 0.25;   // of a query's path, by which two are apart at least
constexpr double kLeastJudged = 30.0;  ///< points of a scan that the map can judge, to anchor it

/// How far off the poses of the session may be at each pass over its keyframes.
struct Doubt {
    double translation;  ///< metres, sigma
    double rotation;     ///< radians
};
constexpr std::array<Doubt, 3> kPasses{Doubt{0.2, radians(1.5)}, Doubt{0.08, radians(0.7)},
                                       Doubt{0.03, radians(0.3)}};

// What a session's own graph may be off between two places found: at once, and by the metre.
constexpr double kApart = 0.5;                    ///< metres
constexpr double kApartByPath = 0.05;             ///< metres by metre
constexpr double kTurned = radians(5.0);          ///< radians
constexpr double kTurnedByPath = radians(0.1);    ///< radians by metre
constexpr double kMostTurned = radians(30.0);     ///< radians
constexpr Doubt kPlaceFloor{0.05, radians(0.5)};  ///< of a place found

Eigen::Matrix3d covariance_of(const Doubt& doubt) {
    return Eigen::Vector3d(doubt.translation * doubt.translation,
                           doubt.translation * doubt.translation, doubt.rotation * doubt.rotation)
        .asDiagonal();
}

Eigen::Matrix3d symmetric(const Eigen::Matrix3d& matrix) {
    return 0.5 * (matrix + matrix.transpose());
}

/// From the axes of the map to those of the robot.
Eigen::Matrix3d in_robot(const Eigen::Matrix3d& information, const Pose2d& map_from_robot) {
    return symmetric(turned(information, map_from_robot.rotation().transpose()));
}

Sweep sweep_of(const Keyframe& keyframe) {
    return {keyframe.robot_from_laser.translation, keyframe.surface};
}

double chi2_of(const Anchor& anchor, const Pose2d& node) {
    const Edge from_origin{0, 0, anchor.map_from_robot, anchor.information, EdgeKind::kClosure};
    return chi2(from_origin, Pose2d(), node);
}

bool agree(const SlamMap& session, const SessionPlace& a, const SessionPlace& b) {
    const Pose2d by_map =
        between(a.found.places.front().map_from_robot, b.found.places.front().map_from_robot);
    const Pose2d by_session =
        between(session.graph.nodes[a.keyframe], session.graph.nodes[b.keyframe]);
    const Eigen::Vector3d off = difference(by_map, by_session);
    const double path =
        std::abs(session.keyframes[a.keyframe].path - session.keyframes[b.keyframe].path);
    return off.head<2>().norm() <= kApart + kApartByPath * path &&
           std::abs(off.z()) <= std::min(kTurned + kTurnedByPath * path, kMostTurned);
}

/// Marks the largest group of places that agree with one of them; its size.
std::size_t mark_agreeing(const SlamMap& session, std::vector<SessionPlace>& searches) {
    const auto is_found = [](const SessionPlace& place) {
        return place.found.verdict == PlaceVerdict::kFound;
    };
    std::size_t most = 0;
    for (const SessionPlace& center : searches) {
        const auto in_group = [&](const SessionPlace& place) {
            return is_found(center) && is_found(place) && agree(session, center, place);
        };
        const auto size =
            static_cast<std::size_t>(std::count_if(searches.begin(), searches.end(), in_group));
        if (size <= most) {
            continue;
        }
        most = size;
        for (SessionPlace& place : searches) {
            place.agrees = in_group(place);
        }
    }
    return most;
}

AnchoringVerdict judge_places(std::vector<SessionPlace>& searches, std::size_t agreeing,
                              bool short_drive) {
    const auto with = [&](PlaceVerdict verdict) {
        return static_cast<std::size_t>(std::count_if(
            searches.begin(), searches.end(),
            [&](const SessionPlace& place) { return place.found.verdict == verdict; }));
    };
    const std::size_t found = with(PlaceVerdict::kFound);
    // A look-alike may be taken for a place once; more of them speak of a session that is broken.
    const std::size_t others = found - agreeing;
    if (others > 0 && (others >= agreeing || others > std::max<std::size_t>(1, agreeing / 4))) {
        return AnchoringVerdict::kContradictory;
    }
    // One place that nothing else confirms is not enough where more could have been found.
    if (agreeing >= 2 || (agreeing == 1 && short_drive)) {
        return AnchoringVerdict::kAnchored;
    }
    const std::size_t open = with(PlaceVerdict::kAmbiguous) + with(PlaceVerdict::kUnfinished);
    return open > 0 ? AnchoringVerdict::kAmbiguous : AnchoringVerdict::kNotInMap;
}

/// The session's graph in the map as the places found have it.
PoseGraph placed_graph(const SlamMap& session, const std::vector<SessionPlace>& searches) {
    PoseGraph graph;
    graph.nodes = session.graph.nodes;
    graph.edges = session.graph.edges;
    bool moved = false;
    for (const SessionPlace& search : searches) {
        if (!search.agrees) {
            continue;
        }
        const Place& place = search.found.places.front();
        const Pose2d& pose = place.map_from_robot;
        if (!std::exchange(moved, true)) {
            const Pose2d map_from_session = pose * graph.nodes[search.keyframe].inverse();
            for (Pose2d& node : graph.nodes) {
                node = map_from_session * node;
            }
        }
        const Eigen::Matrix3d information =
            (place.covariance + covariance_of(kPlaceFloor)).inverse();
        graph.priors.push_back({search.keyframe, pose, in_robot(information, pose), true});
    }
    return graph;
}

}  // namespace

std::string_view to_string(AnchorVerdict verdict) {
    switch (verdict) {
        case AnchorVerdict::kAccepted:
            return "accepted";
        case AnchorVerdict::kOutside:
            return "outside";
        case AnchorVerdict::kContradicted:
            return "contradicted";
        case AnchorVerdict::kDisagreeing:
            return "disagreeing";
    }
    return "unknown";
}

std::string_view to_string(AnchoringVerdict verdict) {
    switch (verdict) {
        case AnchoringVerdict::kAnchored:
            return "anchored";
        case AnchoringVerdict::kAmbiguous:
            return "ambiguous";
        case AnchoringVerdict::kNotInMap:
            return "not_in_map";
        case AnchoringVerdict::kContradictory:
            return "contradictory";
    }
    return "unknown";
}

std::size_t Anchoring::count(AnchorVerdict of) const {
    return static_cast<std::size_t>(
        std::count_if(anchors.begin(), anchors.end(),
                      [of](const Anchor& anchor) { return anchor.verdict == of; }));
}

namespace {

AnchoringConfig checked(AnchoringConfig config) {
    ConfigSchema schema;
    const ConfigSchema::Section section(schema, "anchoring");
    describe(schema, config);  // throws for values out of their ranges
    return config;
}

/// No vehicle waits for it, and the same session is to give the same map.
RelocalizationConfig unhurried(RelocalizationConfig config) {
    config.max_seconds = 0.0;
    return config;
}

}  // namespace

SessionAnchorer::SessionAnchorer(std::shared_ptr<const ReferenceMap> map,
                                 const AnchoringConfig& config,
                                 const RelocalizationConfig& relocalization, const IcpConfig& icp)
    : map_(map),
      config_(checked(config)),
      relocalizer_(std::move(map), unhurried(relocalization), icp),
      icp_(icp) {}

Anchoring SessionAnchorer::anchor(const SlamMap& session) const {
    Anchoring result;
    find_places(session, result);
    if (result.verdict != AnchoringVerdict::kAnchored) {
        return result;
    }
    PoseGraph graph = placed_graph(session, result.searches);
    settle(graph, session.keyframes, result);
    const std::size_t accepted = result.count(AnchorVerdict::kAccepted);
    const std::size_t inside = result.anchors.size() - result.count(AnchorVerdict::kOutside);
    if (accepted == 0 ||
        static_cast<double>(accepted) < config_.min_agreement * static_cast<double>(inside)) {
        result.verdict = AnchoringVerdict::kContradictory;
    } else {
        result.nodes = std::move(graph.nodes);
    }
    return result;
}

void SessionAnchorer::find_places(const SlamMap& session, Anchoring& result) const {
    if (session.keyframes.empty()) {
        throw Error("a session without keyframes cannot be anchored");
    }
    const double first = session.keyframes.front().path;
    const double rest = session.keyframes.back().path - config_.query_path - first;
    const int pieces =
        rest <= 0.0 ? 1 : 1 + static_cast<int>(std::ceil(2.0 * rest / config_.query_path));
    const int count = std::min(pieces, config_.max_searches);
    std::vector<double> asked;
    for (int i = 0; i < count; ++i) {
        const double share = count > 1 ? static_cast<double>(i) / (count - 1) : 0.0;
        asked.push_back(first + share * std::max(rest, 0.0));
        result.searches.push_back(search(session, asked.back()));
    }
    std::size_t agreeing = mark_agreeing(session, result.searches);
    if (agreeing == 1 && rest > 0.0) {
        // Only one, in a drive that was sampled sparsely: what lies beside it must confirm it.
        const auto lone = std::find_if(result.searches.begin(), result.searches.end(),
                                       [](const SessionPlace& place) { return place.agrees; });
        const double start = session.keyframes[lone->keyframe].path - config_.query_path;
        for (const double shift : {-0.5, 0.5}) {
            const double from = std::clamp(start + shift * config_.query_path, first, first + rest);
            // The same scans again would only confirm themselves.
            const bool is_new = std::all_of(asked.begin(), asked.end(), [&](double other) {
                return std::abs(from - other) >= kOtherScans * config_.query_path;
            });
            if (is_new) {
                result.searches.push_back(search(session, from));
            }
        }
        agreeing = mark_agreeing(session, result.searches);
    }
    result.verdict = judge_places(result.searches, agreeing, rest <= config_.query_path);
}

SessionPlace SessionAnchorer::search(const SlamMap& session, double from_path) const {
    std::vector<std::size_t> chosen;
    const Keyframes& keyframes = session.keyframes;
    const std::vector<Pose2d>& nodes = session.graph.nodes;
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
        if (keyframes[k].path < from_path || keyframes[k].surface.size() == 0 ||
            (!chosen.empty() && keyframes[k].path > from_path + config_.query_path)) {
            continue;
        }
        if (chosen.empty() ||
            keyframes[k].path - keyframes[chosen.back()].path >= config_.query_spacing ||
            std::abs(between(nodes[chosen.back()], nodes[k]).heading) >= config_.query_angle) {
            chosen.push_back(k);
        }
    }
    SessionPlace place;
    if (chosen.empty()) {
        return place;
    }
    place.keyframe = chosen.back();
    Query query;
    for (auto k = chosen.rbegin(); k != chosen.rend(); ++k) {
        query.push_back(
            transform(between(nodes[place.keyframe], nodes[*k]), sweep_of(keyframes[*k])));
    }
    place.found = relocalizer_.find(query);
    return place;
}

/// Each pass starts nearer to the truth, and so may look more closely.
void SessionAnchorer::settle(PoseGraph& graph, const Keyframes& keyframes,
                             Anchoring& result) const {
    OptimizeOptions options;
    options.start = LinearStart::kNone;
    options.closure_kernel = RobustKernel::kCauchy;
    options.kernel_scale = config_.kernel_scale;
    optimize(graph, options);
    for (int pass = 0; pass < static_cast<int>(kPasses.size()); ++pass) {
        result.anchors.clear();
        for (std::size_t k = 0; k < keyframes.size(); ++k) {
            result.anchors.push_back(look(keyframes[k], graph.nodes[k], pass));
        }
        solve(graph, result.anchors);
    }
    for (bool again = true; again;) {
        again = false;
        for (std::size_t k = 0; k < keyframes.size(); ++k) {
            Anchor& anchor = result.anchors[k];
            anchor.chi2 = chi2_of(anchor, graph.nodes[k]);
            if (anchor.verdict == AnchorVerdict::kAccepted && anchor.chi2 > config_.max_chi2) {
                anchor.verdict = AnchorVerdict::kDisagreeing;
                again = true;
            }
        }
        if (again) {
            solve(graph, result.anchors);
        }
    }
}

Anchor SessionAnchorer::look(const Keyframe& keyframe, const Pose2d& expected, int pass) const {
    Anchor result;
    result.map_from_robot = expected;
    if (keyframe.surface.size() == 0) {
        return result;
    }
    const Query query{sweep_of(keyframe)};
    ScanAnchorConfig config;
    config.translation_floor = config_.translation_floor;
    config.rotation_floor = config_.rotation_floor;
    const PoseBelief belief{expected, covariance_of(kPasses[static_cast<std::size_t>(pass)])};
    const ScanAnchor found = anchor_of(*map_, keyframe.surface, belief, config, icp_);
    if (found.found) {
        result.map_from_robot = found.anchor.map_from_robot;
        result.information = in_robot(found.anchor.information, result.map_from_robot);
    }
    result.fit = fit_of(*map_, query, result.map_from_robot);
    const double judged = 1.0 - result.fit.unknown;
    if (result.fit.unknown > config_.max_unknown ||
        judged * static_cast<double>(result.fit.points) < kLeastJudged) {
        result.verdict = AnchorVerdict::kOutside;
        return result;
    }
    const bool fits = found.found && result.fit.explained >= config_.min_explained * judged &&
                      result.fit.violated <= config_.max_violated * judged;
    result.verdict = fits ? AnchorVerdict::kAccepted : AnchorVerdict::kContradicted;
    return result;
}

void SessionAnchorer::solve(PoseGraph& graph, const std::vector<Anchor>& anchors) const {
    graph.priors.clear();
    for (std::size_t k = 0; k < anchors.size(); ++k) {
        const Anchor& anchor = anchors[k];
        if (anchor.verdict == AnchorVerdict::kAccepted) {
            graph.priors.push_back({k, anchor.map_from_robot, anchor.information, true});
        }
    }
    OptimizeOptions options;
    options.start = LinearStart::kNone;
    options.closure_kernel = RobustKernel::kCauchy;
    options.kernel_scale = config_.kernel_scale;
    if (!graph.priors.empty()) {
        optimize(graph, options);
    }
}

void describe(ConfigSchema& schema, AnchoringConfig& config) {
    schema.add("max_searches", config.max_searches, 1, 10000, "of the map, along the drive");
    schema.add("query_path", config.query_path, 0.1, 1000.0, "m of the drive that a search sees");
    schema.add("query_spacing", config.query_spacing, 0.01, 100.0, "m between its scans, or");
    schema.add_degrees("query_angle_deg", config.query_angle, 0.1, 180.0, "between its scans");
    schema.add("min_explained", config.min_explained, 0.0, 1.0,
               "share of what the map can judge in a scan; less contradicts the map");
    schema.add("max_violated", config.max_violated, 0.0, 1.0, "likewise, more contradicts it");
    schema.add("max_unknown", config.max_unknown, 0.0, 1.0,
               "share of a scan; with more it is outside of the map");
    schema.add("translation_floor", config.translation_floor, 1e-6, 1.0,
               "m, least sigma of an anchor");
    schema.add_degrees("rotation_floor_deg", config.rotation_floor, 5e-5, 50.0, "likewise");
    schema.add("kernel_scale", config.kernel_scale, 0.01, 100.0,
               "sigmas, Cauchy, of anchors and closures");
    schema.add("max_chi2", config.max_chi2, 0.1, 1e9, "anchors that end beyond are thrown out");
    schema.add("min_agreement", config.min_agreement, 0.0, 1.0,
               "share of the scans inside of the map that must fit it");
}

}  // namespace hybrid_slam
