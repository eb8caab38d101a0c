// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/localization/anchored_session.hpp"

namespace hybrid_slam {
namespace {

constexpr int kSeenAround = 2;  ///< cells without a wall around what is seen through

/// The first scan of each keyframe, and one past the last of all.
std::vector<std::size_t> scans_of_keyframes(const SlamMap& session) {
    const bool odometry = session.odometry_trajectory.size() == session.trajectory.size();
    std::vector<std::size_t> first;
    for (std::size_t i = 0; i < session.trajectory.size(); ++i) {
        if (first.size() == session.keyframes.size()) {
            break;
        }
        const Keyframe& next = session.keyframes[first.size()];
        // Stamps alone do not tell where a log repeats them.
        const bool there = !odometry || (session.odometry_trajectory[i].pose.translation -
                                         next.local_from_robot.translation)
                                                .norm() < 1e-9;
        if (session.trajectory[i].stamp == next.stamp && there) {
            first.push_back(i);
        }
    }
    if (first.size() != session.keyframes.size()) {
        throw Error("map: a keyframe of the session is none of its scans");
    }
    first.push_back(session.trajectory.size());
    return first;
}

/// The scans follow their keyframes; where two of those moved one against the other, the difference
/// is spread over the scans between them.
Trajectory moved_trajectory(const SlamMap& session, const std::vector<Pose2d>& nodes) {
    const std::vector<Pose2d>& old = session.graph.nodes;
    const std::vector<std::size_t> first = scans_of_keyframes(session);
    Trajectory moved;
    for (std::size_t k = 0; k + 1 < first.size(); ++k) {
        Eigen::Vector3d gap = Eigen::Vector3d::Zero();
        if (k + 1 < nodes.size()) {
            gap = between(between(old[k], old[k + 1]), between(nodes[k], nodes[k + 1])).log();
        }
        for (std::size_t i = first[k]; i < first[k + 1]; ++i) {
            const double share =
                static_cast<double>(i - first[k]) / static_cast<double>(first[k + 1] - first[k]);
            const StampedPose& scan = session.trajectory[i];
            moved.push_back(
                {scan.stamp, nodes[k] * between(old[k], scan.pose) * Pose2d::exp(share * gap)});
        }
    }
    return moved;
}

std::size_t nearest_node(const PoseGraph& graph, const Point2& place) {
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
        const double squared = (graph.nodes[i].translation - place).squaredNorm();
        if (squared < least) {
            least = squared;
            nearest = i;
        }
    }
    return nearest;
}

/// Edges instead of priors, so that the map stays in one piece whatever moves it later.
void append_graph(PoseGraph& graph, const StoredMap& stored, const SlamMap& session,
                  const Anchoring& anchoring) {
    const std::size_t offset = stored.graph.nodes.size();
    graph.nodes.insert(graph.nodes.end(), anchoring.nodes.begin(), anchoring.nodes.end());
    for (Edge edge : session.graph.edges) {
        edge.from += offset;
        edge.to += offset;
        graph.edges.push_back(edge);
    }
    for (std::size_t k = 0; k < anchoring.anchors.size(); ++k) {
        const Anchor& anchor = anchoring.anchors[k];
        if (anchor.verdict != AnchorVerdict::kAccepted) {
            continue;
        }
        const std::size_t from = nearest_node(stored.graph, anchor.map_from_robot.translation);
        graph.edges.push_back({from, offset + k,
                               between(stored.graph.nodes[from], anchor.map_from_robot),
                               anchor.information, EdgeKind::kClosure});
    }
}

class SeenThrough {
  public:
    SeenThrough(const Keyframes& keyframes, const std::vector<Pose2d>& nodes) {
        PoseGraph graph;
        graph.nodes = nodes;
        grid_ = to_states(draw_grid(keyframes, graph));
    }

    bool operator()(const Point2& point) const {
        const Cell cell = grid_.geometry.cell_of(point);
        if (grid_.at(cell) != CellState::kFree) {
            return false;
        }
        for (int y = -kSeenAround; y <= kSeenAround; ++y) {
            for (int x = -kSeenAround; x <= kSeenAround; ++x) {
                if (grid_.at({cell.x + x, cell.y + y}) == CellState::kOccupied) {
                    return false;
                }
            }
        }
        return true;
    }

  private:
    StateGrid grid_;
};

/// The number of points left out.
template <typename Gone>
std::size_t leave_out(Keyframe& keyframe, const Pose2d& node, const Gone& gone) {
    Surface kept;
    const Surface& all = keyframe.surface;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (!gone(node * all.points[i])) {
            kept.points.push_back(all.points[i]);
            kept.normals.push_back(all.normals[i]);
        }
    }
    const std::size_t left_out = all.size() - kept.size();
    keyframe.surface = std::move(kept);
    return left_out;
}

}  // namespace

MergedMap merge(const StoredMap& stored, const SlamMap& session, const Anchoring& anchoring) {
    if (anchoring.nodes.size() != session.keyframes.size()) {
        throw Error("map: a session that is not anchored cannot be merged");
    }
    MergedMap merged;
    SlamMap& map = merged.map;
    map.keyframes = stored.keyframes;
    map.graph = stored.graph;
    map.trajectory = stored.trajectory;
    map.odometry_trajectory = stored.odometry_trajectory;
    append_graph(map.graph, stored, session, anchoring);

    const SeenThrough gone(session.keyframes, anchoring.nodes);
    for (std::size_t i = 0; i < stored.keyframes.size(); ++i) {
        merged.gone_points += leave_out(map.keyframes[i], map.graph.nodes[i], gone);
    }
    const Pose2d map_from_local =
        anchoring.nodes.front() * session.keyframes.front().local_from_robot.inverse();
    const double path = stored.keyframes.back().path;
    for (Keyframe keyframe : session.keyframes) {
        keyframe.path += path;
        keyframe.local_from_robot = map_from_local * keyframe.local_from_robot;
        map.keyframes.push_back(std::move(keyframe));
    }
    for (Closure closure : session.closures) {
        closure.from += stored.keyframes.size();
        closure.to += stored.keyframes.size();
        map.closures.push_back(closure);
    }
    const Trajectory moved = moved_trajectory(session, anchoring.nodes);
    map.trajectory.insert(map.trajectory.end(), moved.begin(), moved.end());
    for (const StampedPose& scan : session.odometry_trajectory) {
        map.odometry_trajectory.push_back({scan.stamp, map_from_local * scan.pose});
    }
    return merged;
}

}  // namespace hybrid_slam
