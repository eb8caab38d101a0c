// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/slam.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {

namespace {

Eigen::Matrix3d symmetric_inverse(const Eigen::Matrix3d& matrix) {
    const Eigen::Matrix3d inverse = matrix.inverse();
    return 0.5 * (inverse + inverse.transpose());
}

}  // namespace

struct Slam::State {
    explicit State(const SlamConfig& config_in)
        : config(config_in),
          odometry(config_in.odometry),
          closer(config_in.loop_closing, config_in.odometry.icp) {}

    // Where a scan was, tied to the keyframe before it, so that it follows when the graph moves.
    struct ScanPose {
        double stamp;
        std::size_t keyframe;
        Pose2d keyframe_from_robot;
    };

    void add_keyframe(const Frame& frame, OdometryResult& odometry_result);
    std::vector<Closure> close_loops(SlamTimings& timings, bool& optimized);
    OptimizeSummary optimize_graph(int max_iterations);
    void record(const Closure& closure);
    bool throw_out_outliers();

    SlamConfig config;
    Odometry odometry;
    LoopCloser closer;
    Keyframes keyframes;
    PoseGraph graph;
    std::vector<Closure> closures;
    std::vector<ScanPose> scans;
    std::size_t keyframes_at_optimization = 0;
    bool unoptimized_closures = false;
    Pose2d local_from_before;
    double path = 0.0;
};

Slam::Slam(const SlamConfig& config) {
    SlamConfig checked = config;
    ConfigSchema schema;
    describe(schema, checked);  // throws for values out of their ranges
    expect_consistent(checked.odometry.icp);
    state_ = std::make_unique<State>(checked);
}
Slam::~Slam() = default;
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;

SlamResult Slam::process(const Frame& frame) {
    State& s = *state_;
    SlamResult result;
    const Stopwatch odometry_time;
    OdometryResult odometry = s.odometry.register_frame(frame);
    result.timings.odometry = odometry_time.seconds();
    s.path += odometry.before_from_now.translation.norm();

    if (odometry.keyframe) {
        s.add_keyframe(frame, odometry);
        if (s.config.graph.enabled) {
            result.closures = s.close_loops(result.timings, result.optimized);
        }
    }
    const Pose2d keyframe_from_robot =
        between(s.keyframes.back().local_from_robot, odometry.local_from_robot);
    s.scans.push_back({frame.scan.stamp, s.keyframes.size() - 1, keyframe_from_robot});

    result.stamp = frame.scan.stamp;
    result.map_from_robot = s.graph.nodes.back() * keyframe_from_robot;
    result.covariance = odometry.covariance;
    result.status = odometry.status;
    result.prior_used = odometry.prior_used;
    result.visual_lag = odometry.visual_lag;
    result.icp = odometry.icp;
    result.keyframe = odometry.keyframe;
    return result;
}

void Slam::State::add_keyframe(const Frame& frame, OdometryResult& result) {
    const Pose2d local_from_keyframe = result.local_from_robot;
    if (keyframes.empty()) {
        graph.nodes.emplace_back();
    } else {
        const Pose2d& local_from_last = keyframes.back().local_from_robot;
        Edge edge;
        edge.from = keyframes.size() - 1;
        edge.to = keyframes.size();
        edge.from_from_to = between(local_from_last, local_from_keyframe);
        edge.information =
            with_floor(symmetric_inverse(
                           turned(result.covariance, local_from_keyframe.rotation().transpose())),
                       config.loop_closing.odometry_translation_floor,
                       config.loop_closing.odometry_rotation_floor);
        graph.nodes.push_back(graph.nodes.back() * edge.from_from_to);
        graph.edges.push_back(edge);
    }
    keyframes.push_back({frame.scan.stamp, path, local_from_keyframe, frame.scan.robot_from_laser,
                         std::move(result.surface)});
}

std::vector<Closure> Slam::State::close_loops(SlamTimings& timings, bool& optimized) {
    const Stopwatch search_time;
    std::vector<Closure> found = closer.search(keyframes, graph);
    timings.loop_closing = search_time.seconds();
    bool urgent = false;
    for (const Closure& closure : found) {
        record(closure);
        if (closure.verdict != ClosureVerdict::kAccepted) {
            continue;
        }
        graph.edges.push_back({closure.from, closure.to, closure.from_from_to, closure.information,
                               EdgeKind::kClosure});
        unoptimized_closures = true;
        urgent = urgent || closure.correction > config.graph.urgent_correction;
    }
    const bool due = keyframes.size() >= keyframes_at_optimization +
                                             static_cast<std::size_t>(config.graph.optimize_every);
    if (unoptimized_closures && (urgent || due)) {
        const Stopwatch optimize_time;
        optimize_graph(5);
        timings.optimization = optimize_time.seconds();
        optimized = true;
    }
    return found;
}

// A closure that waited is on the list already.
void Slam::State::record(const Closure& closure) {
    const auto same = [&](const Closure& other) {
        return other.from == closure.from && other.to == closure.to;
    };
    const auto listed = std::find_if(closures.rbegin(), closures.rend(), same);
    if (listed != closures.rend()) {
        *listed = closure;
    } else {
        closures.push_back(closure);
    }
}

OptimizeSummary Slam::State::optimize_graph(int max_iterations) {
    OptimizeOptions options;
    options.start = LinearStart::kNone;  // the graph is near its optimum already
    options.closure_kernel = config.graph.kernel;
    options.kernel_scale = config.graph.kernel_scale;
    options.max_iterations = max_iterations;
    keyframes_at_optimization = keyframes.size();
    unoptimized_closures = false;
    return hybrid_slam::optimize(graph, options);
}

OptimizeSummary Slam::refine() {
    State& s = *state_;
    if (!s.config.graph.enabled || s.graph.nodes.size() < 2) {
        return {};
    }
    OptimizeSummary summary = s.optimize_graph(100);
    const double initial_chi2 = summary.initial_chi2;
    while (s.throw_out_outliers()) {
        summary = s.optimize_graph(100);
    }
    summary.initial_chi2 = initial_chi2;
    return summary;
}

// True when there were any.
bool Slam::State::throw_out_outliers() {
    const auto is_outlier = [&](const Edge& edge) {
        return edge.kind == EdgeKind::kClosure &&
               chi2(edge, graph.nodes[edge.from], graph.nodes[edge.to]) > config.graph.outlier_chi2;
    };
    for (const Edge& edge : graph.edges) {
        if (!is_outlier(edge)) {
            continue;
        }
        for (Closure& closure : closures) {
            if (closure.from == edge.from && closure.to == edge.to &&
                closure.verdict == ClosureVerdict::kAccepted) {
                closure.verdict = ClosureVerdict::kOutlier;
            }
        }
    }
    const std::size_t edges = graph.edges.size();
    graph.edges.erase(std::remove_if(graph.edges.begin(), graph.edges.end(), is_outlier),
                      graph.edges.end());
    return graph.edges.size() < edges;
}

SlamMap Slam::map() const {
    const State& s = *state_;
    SlamMap map{s.keyframes, s.graph, s.closures, {}, {}};
    // Between two keyframes the graph may have moved one against the other: the difference is
    // spread over the scans between them.
    for (std::size_t first = 0; first < s.scans.size();) {
        const std::size_t k = s.scans[first].keyframe;
        std::size_t last = first;
        while (last < s.scans.size() && s.scans[last].keyframe == k) {
            ++last;
        }
        Eigen::Vector3d gap = Eigen::Vector3d::Zero();
        if (k + 1 < s.keyframes.size()) {
            const Pose2d by_odometry =
                between(s.keyframes[k].local_from_robot, s.keyframes[k + 1].local_from_robot);
            gap = between(by_odometry, between(s.graph.nodes[k], s.graph.nodes[k + 1])).log();
        }
        for (std::size_t i = first; i < last; ++i) {
            const double share = static_cast<double>(i - first) / static_cast<double>(last - first);
            const Pose2d& relative = s.scans[i].keyframe_from_robot;
            map.trajectory.push_back(
                {s.scans[i].stamp, s.graph.nodes[k] * relative * Pose2d::exp(share * gap)});
            map.odometry_trajectory.push_back(
                {s.scans[i].stamp, s.keyframes[k].local_from_robot * relative});
        }
        first = last;
    }
    return map;
}

void describe(ConfigSchema& schema, SlamConfig& config) {
    describe(schema, config.odometry);
    {
        const ConfigSchema::Section section(schema, "loop_closing");
        describe(schema, config.loop_closing);
    }
    const ConfigSchema::Section section(schema, "graph");
    schema.add("enabled", config.graph.enabled, "refine the trajectory by a pose graph");
    schema.add("optimize_every", config.graph.optimize_every, 1, 100000,
               "keyframes between two refinements while closures come in");
    schema.add("urgent_correction", config.graph.urgent_correction, 0.0, 100.0,
               "m, a closure that moves the robot this far is refined at once");
    schema.add("kernel", config.graph.kernel,
               {{"none", RobustKernel::kNone},
                {"huber", RobustKernel::kHuber},
                {"cauchy", RobustKernel::kCauchy}},
               "robust kernel on closures");
    schema.add("kernel_scale", config.graph.kernel_scale, 0.01, 100.0, "sigmas");
    schema.add("outlier_chi2", config.graph.outlier_chi2, 1e-12, 1e9,
               "closures that end beyond this are thrown out");
}

}  // namespace hybrid_slam
