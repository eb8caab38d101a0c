// SPDX-License-Identifier: Apache-2.0
#include "session.hpp"

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <map>
#include <optional>
#include <utility>

#include "hybrid_slam/core/frame.hpp"

namespace hybrid_slam {

namespace {

constexpr double kStampTolerance = 0.001;           // seconds
constexpr double kRelationTranslationSigma = 0.05;  // metres
constexpr double kRelationRotationSigma = radians(1.0);

double cpu_seconds() {
    return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// A scan as the graph knows it: a keyframe and the way from there by odometry.
struct Anchor {
    std::size_t keyframe;
    Pose2d keyframe_from_robot;
};

// Anchors of all scans by stamp. The keyframes are scans themselves and come in the same order.
class Anchors {
  public:
    explicit Anchors(const SlamMap& map) {
        std::size_t next = 0;
        std::size_t keyframe_scan = 0;
        for (std::size_t i = 0; i < map.odometry_trajectory.size(); ++i) {
            const StampedPose& scan = map.odometry_trajectory[i];
            if (next < map.keyframes.size() && is_keyframe(map.keyframes[next], scan)) {
                ++next;
                keyframe_scan = i;
            }
            by_stamp_.emplace(
                scan.stamp,
                Anchor{next - 1, between(map.odometry_trajectory[keyframe_scan].pose, scan.pose)});
        }
    }

    std::optional<Anchor> at(double stamp) const {
        auto best = by_stamp_.lower_bound(stamp - kStampTolerance);
        for (auto it = best; it != by_stamp_.end() && it->first <= stamp + kStampTolerance; ++it) {
            if (std::abs(it->first - stamp) < std::abs(best->first - stamp)) {
                best = it;
            }
        }
        if (best == by_stamp_.end() || std::abs(best->first - stamp) > kStampTolerance) {
            return std::nullopt;
        }
        return best->second;
    }

  private:
    static bool is_keyframe(const Keyframe& keyframe, const StampedPose& scan) {
        return keyframe.stamp == scan.stamp &&
               between(keyframe.local_from_robot, scan.pose).translation.norm() < 1e-9;
    }

    std::map<double, Anchor> by_stamp_;
};

PoseGraph graph_of_relations(const SlamMap& map, const std::vector<Relation>& relations) {
    PoseGraph graph;
    graph.nodes = map.graph.nodes;
    for (const Edge& edge : map.graph.edges) {
        if (edge.kind == EdgeKind::kOdometry) {
            graph.edges.push_back(edge);
        }
    }
    const Anchors anchors(map);
    for (const Relation& relation : relations) {
        const auto from = anchors.at(relation.from_stamp);
        const auto to = anchors.at(relation.to_stamp);
        if (!from || !to || from->keyframe == to->keyframe) {
            continue;
        }
        Edge edge;
        edge.from = from->keyframe;
        edge.to = to->keyframe;
        edge.from_from_to =
            from->keyframe_from_robot * relation.from_from_to * to->keyframe_from_robot.inverse();
        edge.information = Eigen::Vector3d(std::pow(kRelationTranslationSigma, -2),
                                           std::pow(kRelationTranslationSigma, -2),
                                           std::pow(kRelationRotationSigma, -2))
                               .asDiagonal();
        edge.kind = EdgeKind::kClosure;  // robust: some relations are off by themselves
        graph.edges.push_back(edge);
    }
    return graph;
}

void judge(const Closure& closure, const Pose2d& known, ClosureAudit& audit) {
    const Pose2d off = between(known, closure.from_from_to);
    audit.worst_translation = std::max(audit.worst_translation, off.translation.norm());
    audit.worst_rotation = std::max(audit.worst_rotation, std::abs(off.heading));
    if (off.translation.norm() > kWrongTranslation || std::abs(off.heading) > kWrongRotation) {
        ++audit.wrong;
    }
}

}  // namespace

SlamConfig slam_config(const std::vector<std::string>& overrides) {
    SlamConfig config;
    ConfigSchema schema;
    describe(schema, config);
    for (const std::string& assignment : overrides) {
        schema.override_with(assignment);
    }
    return config;
}

Session run_session(Source& source, const SlamConfig& config) {
    Session session;
    Slam slam(config);
    FrameAssembler assembler(FrameAssembler::kVisualWait);
    const auto process = [&session, &slam](const std::optional<Frame>& frame) {
        if (!frame) {
            return;
        }
        const SlamResult result = slam.process(*frame);
        ++session.scans;
        session.slowest_scan_ms = std::max(session.slowest_scan_ms, 1e3 * result.timings.total());
        session.not_aligned += result.status == OdometryStatus::kPriorOnly ? 1 : 0;
    };
    const double start = cpu_seconds();
    while (auto measurement = source.next()) {
        process(assembler.push(std::move(*measurement)));
    }
    process(assembler.flush());
    slam.refine();
    session.map = slam.map();
    session.cpu_seconds = cpu_seconds() - start;
    return session;
}

double peak_memory_mb() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

namespace {

/// What is in use, from where the peak begins anew: proc(5).
double resident_mb() {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << "5";
    return peak_memory_mb();
}

}  // namespace

MemoryGrowth::MemoryGrowth() : before_mb_(resident_mb()) {}

double MemoryGrowth::peak_mb() const {
    return peak_memory_mb() - before_mb_;
}

double MemoryGrowth::held_mb() {
    return resident_mb() - before_mb_;
}

ClosureAudit audit_by_relations(const SlamMap& map, const std::vector<Relation>& relations) {
    PoseGraph graph = graph_of_relations(map, relations);
    OptimizeOptions options;
    options.start = LinearStart::kNone;
    options.closure_kernel = RobustKernel::kCauchy;
    options.kernel_scale = 3.0;
    optimize(graph, options);
    ClosureAudit audit;
    for (const Closure& closure : map.closures) {
        if (closure.verdict != ClosureVerdict::kAccepted) {
            continue;
        }
        ++audit.accepted;
        const Eigen::Matrix3d covariance = relative_covariance(graph, closure.from, closure.to);
        if (std::sqrt(covariance(0, 0) + covariance(1, 1)) > 0.5 * kWrongTranslation ||
            std::sqrt(covariance(2, 2)) > 0.5 * kWrongRotation) {
            ++audit.undecided;
            continue;
        }
        judge(closure, between(graph.nodes[closure.from], graph.nodes[closure.to]), audit);
    }
    return audit;
}

ClosureAudit audit_by_truth(const SlamMap& map, const Trajectory& truth) {
    const TrajectoryIndex index(truth);
    ClosureAudit audit;
    for (const Closure& closure : map.closures) {
        if (closure.verdict != ClosureVerdict::kAccepted) {
            continue;
        }
        ++audit.accepted;
        const auto from = index.nearest(map.keyframes[closure.from].stamp, kStampTolerance);
        const auto to = index.nearest(map.keyframes[closure.to].stamp, kStampTolerance);
        if (!from || !to) {
            ++audit.undecided;
            continue;
        }
        judge(closure, between(*from, *to), audit);
    }
    return audit;
}

}  // namespace hybrid_slam
