// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/map_crop.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "hybrid_slam/core/error.hpp"
#include "map_files.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// Of a measurement that may say nothing of some direction.
Eigen::Matrix3d covariance_of(const Eigen::Matrix3d& information) {
    constexpr double kLeast = 1e-6;  // of the largest: no worse than a thousand times as unsure
    const double floor = std::max(kLeast * information.diagonal().maxCoeff(), kLeast);
    return (information + floor * Eigen::Matrix3d::Identity()).inverse();
}

/// A way through the graph: where it ends seen from where it starts, with the covariance in the
/// axes of the end.
struct Way {
    Pose2d from_from_to;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

    void append(const Pose2d& step, const Eigen::Matrix3d& step_covariance) {
        from_from_to = from_from_to * step;
        const Eigen::Matrix3d carried = step.inverse().adjoint();
        covariance = carried * covariance * carried.transpose() + step_covariance;
    }
};

class Sets {
  public:
    explicit Sets(std::size_t size) : parent_(size) {
        std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    }

    std::size_t root(std::size_t i) {
        while (parent_[i] != i) {
            parent_[i] = parent_[parent_[i]];
            i = parent_[i];
        }
        return i;
    }

    /// Whether they were apart.
    bool join(std::size_t a, std::size_t b) {
        const std::size_t root_a = root(a);
        const std::size_t root_b = root(b);
        parent_[root_b] = root_a;
        return root_a != root_b;
    }

  private:
    std::vector<std::size_t> parent_;
};

/// Finds the edges that take the place of those that are gone.
class Bridges {
  public:
    Bridges(const PoseGraph& graph, const std::vector<bool>& kept)
        : graph_(graph), kept_(kept), sets_(graph.nodes.size()) {
        for (const Edge& edge : graph.edges) {
            if (kept[edge.from] && kept[edge.to]) {
                sets_.join(edge.from, edge.to);
            }
        }
        grow();
    }

    /// Of the nodes of the whole graph, the shortest ways first.
    std::vector<Edge> build() {
        std::vector<const Edge*> gone;
        for (const Edge& edge : graph_.edges) {
            if (!(kept_[edge.from] && kept_[edge.to]) && home_[edge.from] != kNone &&
                home_[edge.to] != kNone) {
                gone.push_back(&edge);
            }
        }
        std::stable_sort(gone.begin(), gone.end(), [&](const Edge* a, const Edge* b) {
            return depth_[a->from] + depth_[a->to] < depth_[b->from] + depth_[b->to];
        });
        std::vector<Edge> bridges;
        for (const Edge* edge : gone) {
            if (sets_.join(home_[edge->from], home_[edge->to])) {
                bridges.push_back(bridge_over(*edge));
            }
        }
        return bridges;
    }

  private:
    /// Breadth first from all kept nodes at once: each node that is gone learns which of them is
    /// the fewest edges away, and by which edge.
    void grow() {
        std::vector<std::vector<std::size_t>> edges_at(graph_.nodes.size());
        for (std::size_t i = 0; i < graph_.edges.size(); ++i) {
            edges_at[graph_.edges[i].from].push_back(i);
            edges_at[graph_.edges[i].to].push_back(i);
        }
        home_.assign(graph_.nodes.size(), kNone);
        depth_.assign(graph_.nodes.size(), 0);
        edge_home_.assign(graph_.nodes.size(), kNone);
        std::deque<std::size_t> next;
        for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
            if (kept_[i]) {
                home_[i] = i;
                next.push_back(i);
            }
        }
        for (; !next.empty(); next.pop_front()) {
            for (const std::size_t i : edges_at[next.front()]) {
                const std::size_t other = other_end(graph_.edges[i], next.front());
                if (home_[other] == kNone) {
                    home_[other] = home_[next.front()];
                    depth_[other] = depth_[next.front()] + 1;
                    edge_home_[other] = i;
                    next.push_back(other);
                }
            }
        }
    }

    static std::size_t other_end(const Edge& edge, std::size_t end) {
        return edge.from == end ? edge.to : edge.from;
    }

    /// Along an edge from one of its ends, by the poses as they stand.
    void walk(Way& way, const Edge& edge, std::size_t start) const {
        const std::size_t end = other_end(edge, start);
        const Pose2d step = between(graph_.nodes[start], graph_.nodes[end]);
        Eigen::Matrix3d covariance = covariance_of(edge.information);
        if (edge.from != start) {
            const Eigen::Matrix3d turned = step.inverse().adjoint();
            covariance = turned * covariance * turned.transpose();
        }
        way.append(step, covariance);
    }

    Edge bridge_over(const Edge& gone) const {
        std::vector<std::size_t> down;  // from the first kept node to the edge that is gone
        for (std::size_t at = gone.from; !kept_[at];
             at = other_end(graph_.edges[down.back()], at)) {
            down.push_back(edge_home_[at]);
        }
        Way way;
        std::size_t at = home_[gone.from];
        for (auto i = down.rbegin(); i != down.rend(); ++i) {
            walk(way, graph_.edges[*i], at);
            at = other_end(graph_.edges[*i], at);
        }
        walk(way, gone, at);
        for (at = gone.to; !kept_[at];) {
            const Edge& edge = graph_.edges[edge_home_[at]];
            walk(way, edge, at);
            at = other_end(edge, at);
        }
        const Eigen::Matrix3d information = way.covariance.inverse();
        return {home_[gone.from], at, way.from_from_to,
                0.5 * (information + information.transpose()), EdgeKind::kClosure};
    }

    const PoseGraph& graph_;
    const std::vector<bool>& kept_;
    Sets sets_;
    std::vector<std::size_t> home_;       ///< the nearest kept node
    std::vector<std::size_t> depth_;      ///< edges to there
    std::vector<std::size_t> edge_home_;  ///< the first of them
};

PoseGraph cropped_graph(const PoseGraph& graph, const std::vector<bool>& kept) {
    std::vector<std::size_t> index_of(graph.nodes.size(), kNone);
    PoseGraph result;
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
        if (kept[i]) {
            index_of[i] = result.nodes.size();
            result.nodes.push_back(graph.nodes[i]);
        }
    }
    std::vector<Edge> edges = graph.edges;
    const std::vector<Edge> bridges = Bridges(graph, kept).build();
    edges.insert(edges.end(), bridges.begin(), bridges.end());
    for (Edge& edge : edges) {
        if (kept[edge.from] && kept[edge.to]) {
            edge.from = index_of[edge.from];
            edge.to = index_of[edge.to];
            // As it will be when it is read from the file.
            edge.kind = edge.to == edge.from + 1 ? EdgeKind::kOdometry : EdgeKind::kClosure;
            result.edges.push_back(edge);
        }
    }
    for (Prior prior : graph.priors) {
        if (kept[prior.node]) {
            prior.node = index_of[prior.node];
            result.priors.push_back(prior);
        }
    }
    for (const std::size_t node : graph.fixed) {
        if (kept[node]) {
            result.fixed.push_back(index_of[node]);
        }
    }
    return result;
}

Keyframe cropped(Keyframe keyframe, const Pose2d& map_from_robot, const MapArea& area) {
    Surface inside;
    for (std::size_t i = 0; i < keyframe.surface.size(); ++i) {
        if (area.contains(map_from_robot * keyframe.surface.points[i])) {
            inside.points.push_back(keyframe.surface.points[i]);
            inside.normals.push_back(keyframe.surface.normals[i]);
        }
    }
    keyframe.surface = std::move(inside);
    return keyframe;
}

/// Both trajectories are of the same scans; where they are not, that of the odometry stays whole.
void crop_trajectories(const StoredMap& map, const MapArea& area, SlamMap& result) {
    const bool paired = map.odometry_trajectory.size() == map.trajectory.size();
    for (std::size_t i = 0; i < map.trajectory.size(); ++i) {
        if (area.contains(map.trajectory[i].pose.translation)) {
            result.trajectory.push_back(map.trajectory[i]);
            if (paired) {
                result.odometry_trajectory.push_back(map.odometry_trajectory[i]);
            }
        }
    }
    if (!paired) {
        result.odometry_trajectory = map.odometry_trajectory;
    }
    if (result.trajectory.empty()) {
        for (std::size_t i = 0; i < result.keyframes.size(); ++i) {
            result.trajectory.push_back({result.keyframes[i].stamp, result.graph.nodes[i]});
        }
    }
}

}  // namespace

bool MapArea::contains(const Point2& point) const {
    bool inside = false;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Point2& a = polygon[i];
        const Point2& b = polygon[(i + 1) % polygon.size()];
        // Each edge holds its lower end, so that a ray through a corner counts it once.
        if ((a.y() > point.y()) != (b.y() > point.y())) {
            const double x = a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
            inside = inside != (point.x() < x);
        }
    }
    return inside != outside;
}

SlamMap crop(const StoredMap& map, const MapArea& area) {
    expect_keyframe_per_node(map.keyframes, map.graph);
    if (area.polygon.size() < 3) {
        throw Error("crop: an area needs three corners or more");
    }
    std::vector<bool> kept;
    SlamMap result;
    for (std::size_t i = 0; i < map.keyframes.size(); ++i) {
        const Pose2d& map_from_robot = map.graph.nodes[i];
        kept.push_back(area.contains(map_from_robot.translation));
        if (kept.back()) {
            result.keyframes.push_back(cropped(map.keyframes[i], map_from_robot, area));
        }
    }
    if (result.keyframes.empty()) {
        throw Error("crop: no keyframe of the map is in that area, so nothing would be left");
    }
    result.graph = cropped_graph(map.graph, kept);
    crop_trajectories(map, area, result);
    return result;
}

}  // namespace hybrid_slam
