// SPDX-License-Identifier: Apache-2.0
#include "window_graph.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <utility>

#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {
namespace {

Eigen::Matrix3d symmetric(const Eigen::Matrix3d& matrix) {
    return 0.5 * (matrix + matrix.transpose());
}

Eigen::Matrix3d inverse(const Eigen::Matrix3d& positive) {
    return symmetric(positive.ldlt().solve(Eigen::Matrix3d::Identity()));
}

Eigen::Matrix2d turned_back(const Pose2d& pose) {
    return pose.rotation().transpose();
}

/// Turn of a step along the axes of `node` into the axes in which the prior's residual is given.
Eigen::Matrix2d residual_from_step(const Prior& prior, const Pose2d& node) {
    return between(prior.map_from_node, node).rotation();
}

/// With the weight that its kernel leaves it (iteratively reweighted least squares).
Prior weighted(const Prior& prior, const Pose2d& node, double kernel_scale) {
    Prior result = prior;
    if (prior.robust) {
        const Eigen::Vector3d r = between(prior.map_from_node, node).vector();
        const double ratio2 = r.dot(prior.information * r) / (kernel_scale * kernel_scale);
        result.information /= 1.0 + ratio2;
        result.robust = false;
    }
    return result;
}

Eigen::Matrix3d newest_covariance(const PoseGraph& graph, double kernel_scale) {
    PoseGraph weighed = graph;
    for (Prior& prior : weighed.priors) {
        prior = weighted(prior, graph.nodes[prior.node], kernel_scale);
    }
    const std::size_t newest = graph.nodes.size() - 1;
    const Eigen::Matrix3d own_axes = marginal_covariances(weighed, {newest}).front();
    return symmetric(turned(own_axes, graph.nodes[newest].rotation()));
}

}  // namespace

PoseBelief advanced(const PoseBelief& before, const MotionBelief& motion) {
    PoseBelief after;
    after.map_from_robot = before.map_from_robot * motion.before_from_now;
    const Eigen::Vector2d arm =
        after.map_from_robot.translation - before.map_from_robot.translation;
    after.covariance =
        swung(before.covariance, arm) + turned(motion.covariance, after.map_from_robot.rotation());
    return after;
}

double chi2(const PoseAnchor& anchor, const PoseBelief& belief) {
    const Eigen::Vector3d off = difference(anchor.map_from_robot, belief.map_from_robot);
    // (information^-1 + covariance)^-1 for an information that may be singular.
    const Eigen::Matrix3d blurred =
        Eigen::Matrix3d::Identity() + belief.covariance * anchor.information;
    return off.dot(anchor.information * blurred.partialPivLu().solve(off));
}

void WindowGraph::start(const PoseBelief& belief) {
    graph_ = PoseGraph();
    graph_.nodes = {belief.map_from_robot};
    const Eigen::Matrix3d own_axes = turned(belief.covariance, turned_back(belief.map_from_robot));
    graph_.priors = {{0, belief.map_from_robot, inverse(own_axes), false}};
    newest_ = belief;
}

PoseBelief WindowGraph::add(const MotionBelief& motion, const std::optional<PoseAnchor>& anchor,
                            bool keep) {
    PoseGraph graph = graph_;
    const std::size_t node = graph.nodes.size();
    graph.nodes.push_back(graph.nodes.back() * motion.before_from_now);
    graph.edges.push_back(
        {node - 1, node, motion.before_from_now, inverse(motion.covariance), EdgeKind::kOdometry});
    if (anchor) {
        const Pose2d& pose = anchor->map_from_robot;
        graph.priors.push_back(
            {node, pose, symmetric(turned(anchor->information, turned_back(pose))), true});
    }
    OptimizeOptions options;
    options.start = LinearStart::kNone;
    options.closure_kernel = RobustKernel::kCauchy;
    options.kernel_scale = kernel_scale_;
    options.max_iterations = 10;
    optimize(graph, options);
    PoseBelief belief{graph.nodes.back(), newest_covariance(graph, kernel_scale_)};
    if (keep) {
        graph_ = std::move(graph);
        newest_ = belief;
        if (graph_.nodes.size() > most_nodes_) {
            forget_oldest();
        }
    }
    return belief;
}

/// The Schur complement of the oldest node in the form of covariances: a chain passes on what is
/// known of a node along the edge to the next one, and nothing else.
void WindowGraph::forget_oldest() {
    const Pose2d oldest = graph_.nodes.front();
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    std::vector<Prior> later;
    for (Prior& prior : graph_.priors) {
        if (prior.node > 0) {
            --prior.node;
            later.push_back(prior);
            continue;
        }
        const Prior plain = weighted(prior, oldest, kernel_scale_);
        const Eigen::Vector3d off = between(plain.map_from_node, oldest).vector();
        Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
        turn.topLeftCorner<2, 2>() = residual_from_step(plain, oldest);
        information += turn.transpose() * plain.information * turn;
        gradient += turn.transpose() * plain.information * off;
    }
    const Eigen::Matrix3d covariance = inverse(information);
    const Eigen::Vector3d step = -covariance * gradient;
    const Pose2d best = oldest * Pose2d(step.x(), step.y(), step.z());

    const Edge edge = graph_.edges.front();
    const PoseBelief past = advanced({best, turned(covariance, oldest.rotation())},
                                     {edge.from_from_to, inverse(edge.information)});
    const Eigen::Matrix3d own_axes = turned(past.covariance, turned_back(past.map_from_robot));
    graph_.nodes.erase(graph_.nodes.begin());
    graph_.edges.erase(graph_.edges.begin());
    for (Edge& kept : graph_.edges) {
        --kept.from;
        --kept.to;
    }
    graph_.priors = {{0, past.map_from_robot, inverse(own_axes), false}};
    graph_.priors.insert(graph_.priors.end(), later.begin(), later.end());
}

}  // namespace hybrid_slam
