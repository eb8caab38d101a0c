// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "hybrid_slam/backend/correlative_matcher.hpp"
#include "hybrid_slam/backend/keyframe.hpp"
#include "hybrid_slam/backend/pose_graph.hpp"
#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/registration/icp.hpp"

namespace hybrid_slam {

struct LoopClosingConfig {
    bool enabled = true;
    int every = 2;            ///< keyframes between two searches
    int max_candidates = 2;   ///< places searched per keyframe
    double min_path = 10.0;   ///< metres driven between the two ends of a closure
    double reach = 4.0;       ///< metres; places farther than this plus 3 sigma are no candidates
    double max_window = 8.0;  ///< metres; the search goes 3 sigma far, but no farther
    double max_window_angle = 0.8;  ///< radians
    int reference_keyframes = 7;    ///< before and after the candidate
    int query_keyframes = 5;        ///< the newest, up to and including the one to be closed
    double resolution = 0.1;        ///< metres, of the likelihood pyramid
    double sigma = 0.1;             ///< metres, blur of the pyramid
    double angle_step = radians(1.0);
    double min_score = 0.55;
    double runner_up_ratio = 0.92;           ///< a runner-up this good makes the place ambiguous
    double runner_up_distance = 0.5;         ///< metres from the best place, or
    double runner_up_angle = radians(15.0);  ///< radians from it, to be another place
    int max_nodes = 200000;                  ///< effort of one search
    double icp_max_distance = 0.6;           ///< metres; the search left little to do for ICP
    double icp_gate_factor = 4.0;
    double min_overlap = 0.65;   ///< of ICP, at closure_gate
    double closure_gate = 0.15;  ///< metres, within which a point counts as explained
    double max_chi2 = 16.3;      ///< against the graph; 0.1 % of a chi2 with 3 degrees of freedom
    double trusted_distance = 0.3;  ///< metres; corrections larger than this need a second closure
    double trusted_angle = radians(4.0);
    double support_distance = 0.25;  ///< metres, within which two closures tell the same story
    double support_angle = radians(3.0);
    double support_path = 8.0;  ///< metres driven between two closures that support each other
    double odometry_translation_floor = 0.005;      ///< metres, sigma of a step between keyframes
    double odometry_rotation_floor = radians(0.1);  ///< radians
    double closure_translation_floor = 0.02;        ///< metres, sigma of a closure
    double closure_rotation_floor = radians(0.3);   ///< radians
};

void describe(ConfigSchema& schema, LoopClosingConfig& config);

enum class ClosureVerdict {
    kAccepted,
    kPending,       ///< plausible, but a large correction: waits for a second one
    kLowScore,      ///< no pose in the window fits well enough
    kAmbiguous,     ///< another place fits nearly as well
    kIcpFailed,     ///< refinement failed or explains too little
    kInconsistent,  ///< contradicts the graph beyond its uncertainty
    kExhausted,     ///< the search gave up
    kOutlier        ///< accepted once, thrown out by the final solution
};
std::string_view to_string(ClosureVerdict verdict);

/// A closure that was tried, with all that was learned.
struct Closure {
    std::size_t from = 0;  ///< older keyframe
    std::size_t to = 0;    ///< newer keyframe
    Pose2d from_from_to;
    Eigen::Matrix3d information = Eigen::Matrix3d::Identity();
    ClosureVerdict verdict = ClosureVerdict::kLowScore;
    double score = 0.0;
    double runner_up_score = 0.0;
    double overlap = 0.0;
    double rms = 0.0;         ///< metres
    double chi2 = 0.0;        ///< against the graph before the closure
    double correction = 0.0;  ///< metres, against the graph before the closure
    std::size_t nodes = 0;    ///< search effort
};

/// How uncertain the pose of `node` is, seen from each other node: covariances accumulated along
/// the shortest way through the graph (Dijkstra projection, Olson 2008); conservative, and cheap.
std::vector<Eigen::Matrix3d> relative_uncertainties(const PoseGraph& graph, std::size_t node);

/// Adds the floors to the noise of an information matrix: the covariance grows by diag(floor^2).
Eigen::Matrix3d with_floor(const Eigen::Matrix3d& information, double translation, double rotation);

/// Finds places seen before. Knows nothing of solving: the graph comes in, closures go out.
class LoopCloser {
  public:
    LoopCloser(const LoopClosingConfig& config, const IcpConfig& icp);

    /// Searches for closures of the newest keyframe. Those returned as kAccepted belong into the
    /// graph; earlier ones that waited may be among them.
    std::vector<Closure> search(const Keyframes& keyframes, const PoseGraph& graph);

    /// Tries one pair in a window around what the graph says, whatever lies between them.
    Closure match(const Keyframes& keyframes, const PoseGraph& graph, std::size_t from,
                  std::size_t to, const Eigen::Matrix3d& uncertainty) const;

  private:
    std::vector<std::size_t> candidates(const Keyframes& keyframes, const PoseGraph& graph,
                                        const std::vector<Eigen::Matrix3d>& uncertainties) const;
    Surface reference_around(const Keyframes& keyframes, const PoseGraph& graph, std::size_t from,
                             std::size_t to) const;
    Surface query_up_to(const Keyframes& keyframes, const PoseGraph& graph, std::size_t to) const;
    void refine(const Surface& query, const Surface& surface, const Pose2d& guess,
                Closure& closure) const;
    void judge(const PoseGraph& graph, const Eigen::Matrix3d& uncertainty, Closure& closure) const;
    bool supports(const Keyframes& keyframes, const PoseGraph& graph, const Closure& a,
                  const Closure& b) const;
    void release_supported(const Keyframes& keyframes, const PoseGraph& graph,
                           std::vector<Closure>& found);

    LoopClosingConfig config_;
    IcpConfig icp_;
    std::vector<Closure> pending_;
    std::vector<Closure> accepted_;
};

}  // namespace hybrid_slam
