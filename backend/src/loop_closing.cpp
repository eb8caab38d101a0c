// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/loop_closing.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "hybrid_slam/core/uncertainty.hpp"
#include "hybrid_slam/odometry/local_map.hpp"

namespace hybrid_slam {

namespace {

constexpr double kMergeResolution = 0.05;  // metres
constexpr double kMinHalfWidth = 0.5;      // metres
constexpr double kMinHalfAngle = 0.1;      // radians
constexpr double kMaxIcpShift = 0.4;       // metres that refinement may move the search's result
constexpr double kMaxIcpTurn = 0.12;       // radians

double translation_sigma(const Eigen::Matrix3d& covariance) {
    return std::sqrt(covariance(0, 0) + covariance(1, 1));
}

// The search sums over points: about one per cell of the pyramid keeps near walls from outvoting
// far ones.
Points one_per_cell(const Surface& surface, double resolution) {
    return merge({surface}, resolution).points;
}

double explained_share(const Surface& query, const Reference& reference, const Pose2d& pose,
                       double gate) {
    NearestNeighbors::Answer answer;
    reference.neighbors().find(transform(pose, query.points), answer);
    const auto near =
        std::count_if(answer.squared_distances.begin(), answer.squared_distances.end(),
                      [&](double squared) { return squared <= gate * gate; });
    return static_cast<double>(near) / static_cast<double>(query.size());
}

bool within(const Pose2d& difference, double metres, double angle) {
    return difference.translation.norm() <= metres && std::abs(difference.heading) <= angle;
}

}  // namespace

std::string_view to_string(ClosureVerdict verdict) {
    switch (verdict) {
        case ClosureVerdict::kAccepted:
            return "accepted";
        case ClosureVerdict::kPending:
            return "pending";
        case ClosureVerdict::kLowScore:
            return "low_score";
        case ClosureVerdict::kAmbiguous:
            return "ambiguous";
        case ClosureVerdict::kIcpFailed:
            return "icp_failed";
        case ClosureVerdict::kInconsistent:
            return "inconsistent";
        case ClosureVerdict::kExhausted:
            return "exhausted";
        case ClosureVerdict::kOutlier:
            return "outlier";
    }
    return "unknown";
}

LoopCloser::LoopCloser(const LoopClosingConfig& config, const IcpConfig& icp)
    : config_(config), icp_(icp) {
    icp_.metric = IcpMetric::kPointToLine;
    icp_.max_distance = config.icp_max_distance;
    icp_.gate_factor = config.icp_gate_factor;
    icp_.min_distance = std::min(icp_.min_distance, icp_.max_distance);
}

std::vector<Closure> LoopCloser::search(const Keyframes& keyframes, const PoseGraph& graph) {
    std::vector<Closure> found;
    if (!config_.enabled || keyframes.size() % static_cast<std::size_t>(config_.every) != 0) {
        return found;
    }
    const std::size_t newest = keyframes.size() - 1;
    if (keyframes[newest].path < config_.min_path) {
        return found;
    }
    const auto uncertainties = relative_uncertainties(graph, newest);
    for (const std::size_t candidate : candidates(keyframes, graph, uncertainties)) {
        found.push_back(match(keyframes, graph, candidate, newest, uncertainties[candidate]));
    }
    release_supported(keyframes, graph, found);
    for (const Closure& closure : found) {
        if (closure.verdict == ClosureVerdict::kAccepted) {
            accepted_.push_back(closure);
        }
    }
    return found;
}

std::vector<std::size_t> LoopCloser::candidates(
    const Keyframes& keyframes, const PoseGraph& graph,
    const std::vector<Eigen::Matrix3d>& uncertainties) const {
    const std::size_t newest = keyframes.size() - 1;
    const auto closed_here = [&](std::size_t k) {
        return std::any_of(accepted_.rbegin(), accepted_.rend(), [&](const Closure& closure) {
            return closure.to + 4 > newest && closure.from < k + 6 && k < closure.from + 6;
        });
    };
    // Runs of neighbouring keyframes are one visit: its nearest keyframe stands for it.
    struct Visit {
        double distance;
        std::size_t keyframe;
    };
    std::vector<Visit> visits;
    bool in_run = false;
    for (std::size_t k = 0; k < newest; ++k) {
        const double distance =
            (graph.nodes[k].translation - graph.nodes[newest].translation).norm();
        const bool near = keyframes[newest].path - keyframes[k].path >= config_.min_path &&
                          distance <= config_.reach + 3.0 * translation_sigma(uncertainties[k]);
        if (near && !in_run) {
            visits.push_back({distance, k});
        } else if (near && distance < visits.back().distance) {
            visits.back() = {distance, k};
        }
        in_run = near;
    }
    std::stable_sort(visits.begin(), visits.end(),
                     [](const Visit& a, const Visit& b) { return a.distance < b.distance; });
    std::vector<std::size_t> chosen;
    for (const Visit& visit : visits) {
        if (chosen.size() < static_cast<std::size_t>(config_.max_candidates) &&
            !closed_here(visit.keyframe)) {
            chosen.push_back(visit.keyframe);
        }
    }
    return chosen;
}

Surface LoopCloser::reference_around(const Keyframes& keyframes, const PoseGraph& graph,
                                     std::size_t from, std::size_t to) const {
    const auto reach = static_cast<std::size_t>(config_.reference_keyframes);
    const auto query = static_cast<std::size_t>(config_.query_keyframes);
    const std::size_t first = from > reach ? from - reach : 0;
    const std::size_t last = std::min(from + reach, to > query ? to - query : 0);
    std::deque<Surface> surfaces;
    for (std::size_t k = first; k <= last; ++k) {
        surfaces.push_back(
            transform(between(graph.nodes[from], graph.nodes[k]), oriented(keyframes[k].surface)));
    }
    return merge(surfaces, kMergeResolution);
}

Surface LoopCloser::query_up_to(const Keyframes& keyframes, const PoseGraph& graph,
                                std::size_t to) const {
    const auto count = static_cast<std::size_t>(config_.query_keyframes);
    std::deque<Surface> surfaces;
    for (std::size_t k = to + 1 > count ? to + 1 - count : 0; k <= to; ++k) {
        surfaces.push_back(
            transform(between(graph.nodes[to], graph.nodes[k]), oriented(keyframes[k].surface)));
    }
    return merge(surfaces, kMergeResolution);
}

Closure LoopCloser::match(const Keyframes& keyframes, const PoseGraph& graph, std::size_t from,
                          std::size_t to, const Eigen::Matrix3d& uncertainty) const {
    Closure closure;
    closure.from = from;
    closure.to = to;
    const Surface reference = reference_around(keyframes, graph, from, to);
    const Surface query = query_up_to(keyframes, graph, to);
    if (reference.size() == 0 || query.size() == 0) {
        return closure;
    }
    constexpr int kLevels = 5;
    const LikelihoodPyramid pyramid(reference.points, config_.resolution, config_.sigma, kLevels);
    SearchWindow window;
    window.center = between(graph.nodes[from], graph.nodes[to]);
    window.half_width =
        std::clamp(3.0 * translation_sigma(uncertainty), kMinHalfWidth, config_.max_window);
    window.half_angle =
        std::clamp(3.0 * std::sqrt(uncertainty(2, 2)), kMinHalfAngle, config_.max_window_angle);
    window.angle_step = config_.angle_step;
    SearchLimits limits;
    limits.min_score = config_.min_score;
    limits.runner_up_ratio = config_.runner_up_ratio;
    limits.runner_up_distance = config_.runner_up_distance;
    limits.runner_up_angle = config_.runner_up_angle;
    limits.max_nodes = static_cast<std::size_t>(config_.max_nodes);
    const SearchResult found =
        branch_and_bound(pyramid, one_per_cell(query, config_.resolution), window, limits);
    closure.runner_up_score = found.runner_up_score();
    closure.nodes = found.nodes;
    closure.score = found.places.empty() ? 0.0 : found.places.front().score;
    closure.from_from_to = found.found ? found.places.front().reference_from_query : window.center;
    if (!found.found) {
        closure.verdict = found.exhausted ? ClosureVerdict::kExhausted : ClosureVerdict::kLowScore;
    } else if (found.places.size() > 1) {
        closure.verdict = ClosureVerdict::kAmbiguous;
    } else {
        refine(query, reference, closure.from_from_to, closure);
        if (closure.verdict != ClosureVerdict::kIcpFailed) {
            judge(graph, uncertainty, closure);
        }
    }
    return closure;
}

void LoopCloser::refine(const Surface& query, const Surface& surface, const Pose2d& guess,
                        Closure& closure) const {
    const Reference reference(surface);
    const IcpResult icp = align(query, reference, IcpGuess(guess), icp_);
    closure.verdict = ClosureVerdict::kIcpFailed;
    if (!icp.usable() ||
        !within(between(guess, icp.reference_from_points), kMaxIcpShift, kMaxIcpTurn)) {
        return;
    }
    closure.from_from_to = icp.reference_from_points;
    closure.rms = icp.rms;
    closure.overlap =
        explained_share(query, reference, icp.reference_from_points, config_.closure_gate);
    if (closure.overlap < config_.min_overlap || icp.information.determinant() <= 0.0) {
        return;
    }
    // ICP speaks in the axes of the reference, an edge in those of the pose that it measures.
    closure.information =
        with_floor(turned(icp.information, closure.from_from_to.rotation().transpose()),
                   config_.closure_translation_floor, config_.closure_rotation_floor);
    closure.verdict = ClosureVerdict::kPending;
}

void LoopCloser::judge(const PoseGraph& graph, const Eigen::Matrix3d& uncertainty,
                       Closure& closure) const {
    const Pose2d believed = between(graph.nodes[closure.from], graph.nodes[closure.to]);
    const Eigen::Vector3d error = difference(closure.from_from_to, believed);
    const Eigen::Matrix3d covariance =
        uncertainty + turned(closure.information.inverse(), closure.from_from_to.rotation());
    closure.chi2 = error.dot(covariance.ldlt().solve(error));
    closure.correction = error.head<2>().norm();
    if (!(closure.chi2 <= config_.max_chi2)) {
        closure.verdict = ClosureVerdict::kInconsistent;
    } else if (closure.correction <= config_.trusted_distance &&
               std::abs(error.z()) <= config_.trusted_angle) {
        closure.verdict = ClosureVerdict::kAccepted;
    } else {
        closure.verdict = ClosureVerdict::kPending;
    }
}

bool LoopCloser::supports(const Keyframes& keyframes, const PoseGraph& graph, const Closure& a,
                          const Closure& b) const {
    // Queries that share keyframes would repeat each other's mistake.
    const std::size_t apart = a.to > b.to ? a.to - b.to : b.to - a.to;
    if (apart < static_cast<std::size_t>(config_.query_keyframes) ||
        std::abs(keyframes[a.to].path - keyframes[b.to].path) > config_.support_path) {
        return false;
    }
    // Around the loop a.from -> b.from -> b.to -> a.to -> a.from; the ways between neighbours are
    // short.
    const Pose2d there = between(graph.nodes[a.from], graph.nodes[b.from]) * b.from_from_to *
                         between(graph.nodes[b.to], graph.nodes[a.to]);
    return within(between(a.from_from_to, there), config_.support_distance, config_.support_angle);
}

void LoopCloser::release_supported(const Keyframes& keyframes, const PoseGraph& graph,
                                   std::vector<Closure>& found) {
    std::vector<Closure> released;
    for (Closure& closure : found) {
        if (closure.verdict != ClosureVerdict::kPending) {
            continue;
        }
        for (Closure& waiting : pending_) {
            if (supports(keyframes, graph, closure, waiting)) {
                closure.verdict = ClosureVerdict::kAccepted;
                if (waiting.verdict == ClosureVerdict::kPending) {
                    waiting.verdict = ClosureVerdict::kAccepted;
                    released.push_back(waiting);
                }
            }
        }
        if (closure.verdict == ClosureVerdict::kPending) {
            pending_.push_back(closure);
        }
    }
    const double path = keyframes.back().path;
    pending_.erase(std::remove_if(pending_.begin(), pending_.end(),
                                  [&](const Closure& waiting) {
                                      return waiting.verdict != ClosureVerdict::kPending ||
                                             path - keyframes[waiting.to].path >
                                                 config_.support_path;
                                  }),
                   pending_.end());
    found.insert(found.end(), released.begin(), released.end());
}

void describe(ConfigSchema& schema, LoopClosingConfig& config) {
    schema.add("enabled", config.enabled, "look for places seen before");
    schema.add("every", config.every, 1, 1000, "keyframes from one search to the next");
    schema.add("max_candidates", config.max_candidates, 1, 100, "places searched per keyframe");
    schema.add("min_path", config.min_path, 0.0, 1e4, "m, driven between the ends of a closure");
    schema.add("reach", config.reach, 0.1, 100.0, "m, candidates are this near plus 3 sigma");
    schema.add("max_window", config.max_window, 0.1, 100.0, "m, searched at most, to each side");
    schema.add("max_window_angle", config.max_window_angle, 0.01, kPi, "rad, to each side");
    schema.add("reference_keyframes", config.reference_keyframes, 0, 100,
               "before and after the candidate, to match against");
    schema.add("query_keyframes", config.query_keyframes, 1, 100, "the newest, to be matched");
    schema.add("resolution", config.resolution, 0.01, 1.0, "m, cells of the search");
    schema.add("sigma", config.sigma, 0.01, 1.0, "m, blur of the search");
    schema.add("angle_step", config.angle_step, 1e-3, 0.5, "rad, of the search");
    schema.add("min_score", config.min_score, 0.0, 1.0, "mean likelihood that a place needs");
    schema.add("runner_up_ratio", config.runner_up_ratio, 0.1, 1.0,
               "another place this good makes it ambiguous");
    schema.add("runner_up_distance", config.runner_up_distance, 0.01, 100.0,
               "m from the best place, or");
    schema.add("runner_up_angle", config.runner_up_angle, 0.01, kPi,
               "rad from it, to be another place");
    schema.add("max_nodes", config.max_nodes, 1000, 1000000000, "effort of one search");
    schema.add("icp_max_distance", config.icp_max_distance, 0.01, 10.0,
               "m, in place of icp.max_distance");
    schema.add("icp_gate_factor", config.icp_gate_factor, 1.0, 1000.0,
               "in place of icp.gate_factor");
    schema.add("min_overlap", config.min_overlap, 0.0, 1.0, "share of explained points needed");
    schema.add("closure_gate", config.closure_gate, 0.01, 1.0, "m, within it a point is explained");
    schema.add("max_chi2", config.max_chi2, 0.1, 1e6, "against the graph, 3 degrees of freedom");
    schema.add("trusted_distance", config.trusted_distance, 0.0, 100.0,
               "m, larger corrections need a second closure");
    schema.add("trusted_angle", config.trusted_angle, 0.0, kPi, "rad, likewise");
    schema.add("support_distance", config.support_distance, 0.0, 10.0,
               "m, within it two closures agree");
    schema.add("support_angle", config.support_angle, 0.0, kPi, "rad, likewise");
    schema.add("support_path", config.support_path, 0.0, 1000.0,
               "m, driven between two closures that support each other");
    schema.add("odometry_translation_floor", config.odometry_translation_floor, 0.0, 1.0,
               "m, least sigma of a step between keyframes");
    schema.add("odometry_rotation_floor", config.odometry_rotation_floor, 0.0, 1.0,
               "rad, likewise");
    schema.add("closure_translation_floor", config.closure_translation_floor, 0.0, 1.0,
               "m, least sigma of a closure");
    schema.add("closure_rotation_floor", config.closure_rotation_floor, 0.0, 1.0, "rad, likewise");
}

}  // namespace hybrid_slam
