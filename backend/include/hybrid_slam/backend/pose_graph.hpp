// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

enum class EdgeKind { kOdometry, kClosure };

/// A measurement of the pose of node `to` seen from node `from`. Its residual, as in g2o, is
/// from_from_to^-1 (map_from_from^-1 map_from_to) as (x, y, heading): what the measurement is off,
/// in the axes of the measured `to`. The information is in those axes too.
struct Edge {
    std::size_t from = 0;  ///< index into PoseGraph::nodes
    std::size_t to = 0;
    Pose2d from_from_to;
    Eigen::Matrix3d information = Eigen::Matrix3d::Identity();  ///< of the residual: 1/m2, 1/rad2
    EdgeKind kind = EdgeKind::kOdometry;
};

/// A measurement of one node in the frame of the map: a map anchor, or what fixes a graph. An edge
/// from the map's origin: residual and information are in the axes of the measured node.
struct Prior {
    std::size_t node = 0;
    Pose2d map_from_node;
    Eigen::Matrix3d information = Eigen::Matrix3d::Identity();
    /// Under the kernel of the options. False for what sums up many measurements, as a marginalised
    /// past: a kernel would let go of all of them at once.
    bool robust = true;
};

struct PoseGraph {
    std::vector<Pose2d> nodes;  ///< map_from_node
    std::vector<Edge> edges;
    std::vector<Prior> priors;
    /// Held where they are. Of each part of the graph that has neither one of these nor a prior,
    /// the first node is held: node 0 of a graph in one piece.
    std::vector<std::size_t> fixed;
};

enum class RobustKernel { kNone, kHuber, kCauchy };
enum class LinearStart {
    kNone,  ///< start from the nodes as they are
    /// Rotations first by linear relaxation, then positions, both blind to the nodes as they are
    /// and to kernels. Taken when it costs less than the nodes as they are; not used with priors.
    kChordal,
};

struct OptimizeOptions {
    LinearStart start = LinearStart::kChordal;
    RobustKernel closure_kernel =
        RobustKernel::kNone;    ///< on edges of kind kClosure and on robust priors
    double kernel_scale = 1.0;  ///< of the whitened residual's norm (sigmas)
    int max_iterations = 100;
    double function_tolerance = 1e-6;  ///< relative change of the cost
    double initial_trust_region = 1e10;
    int threads = 1;
};

struct OptimizeSummary {
    bool usable = false;  ///< the nodes were moved to a solution no worse than they were
    bool converged = false;
    int iterations = 0;
    double initial_chi2 = 0.0;  ///< sum of r^T Omega r of the nodes as given, kernels left out
    double start_chi2 = 0.0;    ///< after the linear start
    double final_chi2 = 0.0;
    double linear_start_seconds = 0.0;
    double solve_seconds = 0.0;  ///< problem building included
    std::string message = "optimize was not called";
};

/// Sum of r^T Omega r over edges and priors, as g2o counts it.
double chi2(const PoseGraph& graph);

/// The unweighed residual of one edge and its squared Mahalanobis norm.
Eigen::Vector3d residual(const Edge& edge, const Pose2d& map_from_from, const Pose2d& map_from_to);
double chi2(const Edge& edge, const Pose2d& map_from_from, const Pose2d& map_from_to);

/// Moves `graph.nodes` to the maximum a posteriori estimate (Ceres, Levenberg-Marquardt, sparse
/// normal Cholesky by SuiteSparse). Throws Error for an option out of range and for an edge or
/// prior that names no node, joins one to itself, is not finite, or whose information is not
/// symmetric positive semidefinite. Nodes without edges stay. A numerical failure leaves all as
/// they were and says so.
OptimizeSummary optimize(PoseGraph& graph, const OptimizeOptions& options = {});

/// Marginal covariance of the pose of `node` seen from `reference` (x, y, heading in the frame of
/// `reference`), at the present linearisation point, kernels left out. Throws Error when the graph
/// does not determine it.
Eigen::Matrix3d relative_covariance(const PoseGraph& graph, std::size_t reference,
                                    std::size_t node);

/// Marginal covariance of each node in the frame of the map (right perturbation: x and y along the
/// node's own axes, heading), in the order of `nodes`; zero for a fixed node. A graph with neither
/// fixed nodes nor priors counts as fixed at node 0. Throws Error as above.
std::vector<Eigen::Matrix3d> marginal_covariances(const PoseGraph& graph,
                                                  const std::vector<std::size_t>& nodes);

}  // namespace hybrid_slam
