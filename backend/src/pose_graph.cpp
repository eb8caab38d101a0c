// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/pose_graph.hpp"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <utility>

#include "edge_cost.hpp"
#include "gauge.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "linear_start.hpp"

namespace hybrid_slam {
namespace {

std::unique_ptr<ceres::LossFunction> make_kernel(RobustKernel kernel, double scale) {
    switch (kernel) {
        case RobustKernel::kHuber:
            return std::make_unique<ceres::HuberLoss>(scale);
        case RobustKernel::kCauchy:
            return std::make_unique<ceres::CauchyLoss>(scale);
        case RobustKernel::kNone:
            break;
    }
    return nullptr;
}

/// Stops a converging solve one factorisation sooner than Ceres' own test, which must first make a
/// step to see that it is too small. Where the quadratic model foretold a step's gain to within a
/// share e, about e of that gain is left.
class ForetoldConvergence final : public ceres::IterationCallback {
  public:
    explicit ForetoldConvergence(double function_tolerance)
        : function_tolerance_(function_tolerance) {}

    ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
        constexpr double kSmallStep = 1e-2;
        constexpr double kSafety = 10.0;
        const double missed = std::abs(1.0 - step.relative_decrease) * step.cost_change;
        const bool converged = step.iteration > 0 && step.step_is_successful &&
                               step.cost_change < kSmallStep * step.cost &&
                               kSafety * missed < function_tolerance_ * step.cost;
        return converged ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
    }

  private:
    double function_tolerance_;
};

ceres::Problem::Options problem_options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;  // the graph has been checked
    return options;
}

/// The graph as a Ceres problem over a copy of its nodes.
class CeresGraph {
  public:
    CeresGraph(const PoseGraph& graph, const std::vector<Pose2d>& start, const Gauge& gauge,
               ceres::LossFunction* kernel)
        : problem_(problem_options()) {
        states_.reserve(start.size());
        for (const Pose2d& node : start) {
            states_.push_back({node.x(), node.y(), node.heading});
        }
        for (std::size_t node = 0; node < states_.size(); ++node) {
            problem_.AddParameterBlock(states_[node].data(), 3, &manifold_);
            if (gauge.held[node]) {
                problem_.SetParameterBlockConstant(states_[node].data());
            }
        }
        for (const Edge& edge : graph.edges) {
            edge_costs_.emplace_back(edge.from_from_to, edge.information);
            problem_.AddResidualBlock(&edge_costs_.back(),
                                      edge.kind == EdgeKind::kClosure ? kernel : nullptr,
                                      states_[edge.from].data(), states_[edge.to].data());
        }
        for (const Prior& prior : graph.priors) {
            prior_costs_.emplace_back(prior.map_from_node, prior.information);
            problem_.AddResidualBlock(&prior_costs_.back(), prior.robust ? kernel : nullptr,
                                      states_[prior.node].data());
        }
    }

    ceres::Solver::Summary solve(const OptimizeOptions& options) {
        ceres::Solver::Options solver;
        solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
        solver.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
        solver.max_num_iterations = options.max_iterations;
        solver.function_tolerance = options.function_tolerance;
        solver.initial_trust_region_radius = options.initial_trust_region;
        solver.max_num_consecutive_invalid_steps = kMaxInvalidSteps;
        solver.num_threads = options.threads;
        solver.logging_type = ceres::SILENT;
        solver.jacobi_scaling = false;  // Cholesky does not need it, and the damping scales itself
        ForetoldConvergence foretold(options.function_tolerance);
        solver.callbacks.push_back(&foretold);
        ceres::Solver::Summary summary;
        ceres::Solve(solver, &problem_, &summary);
        return summary;
    }

    std::vector<Pose2d> nodes() const {
        std::vector<Pose2d> nodes;
        nodes.reserve(states_.size());
        for (const auto& state : states_) {
            nodes.emplace_back(state[0], state[1], normalize_angle(state[2]));
        }
        return nodes;
    }

  private:
    /// From no damping at all, the trust region shrinks by 2, 4, 8, ... until a graph that its
    /// edges do not determine can be factored.
    static constexpr int kMaxInvalidSteps = 15;

    std::vector<std::array<double, 3>> states_;
    Se2Manifold manifold_;
    std::deque<EdgeCost> edge_costs_;
    std::deque<PriorCost> prior_costs_;
    ceres::Problem problem_;
};

/// Sum over edges and priors of rho(r^T Omega r) for nodes in place of the graph's own, rho being
/// the kernel where it applies; without one this is chi2.
double cost(const PoseGraph& graph, const std::vector<Pose2d>& nodes,
            const ceres::LossFunction* closure_kernel) {
    const auto robust = [closure_kernel](double squared_norm) {
        if (closure_kernel == nullptr) {
            return squared_norm;
        }
        double rho[3];
        closure_kernel->Evaluate(squared_norm, rho);
        return rho[0];
    };
    double sum = 0.0;
    for (const Edge& edge : graph.edges) {
        const double plain = chi2(edge, nodes[edge.from], nodes[edge.to]);
        sum += edge.kind == EdgeKind::kClosure ? robust(plain) : plain;
    }
    for (const Prior& prior : graph.priors) {
        const Eigen::Vector3d r =
            between_residual(prior.map_from_node, Pose2d(), nodes[prior.node]);
        const double plain = r.dot(prior.information * r);
        sum += prior.robust ? robust(plain) : plain;
    }
    return sum;
}

/// The nodes to start from: the linear start's where it is wanted and costs less than the graph's
/// own.
std::vector<Pose2d> start_nodes(const PoseGraph& graph, const Gauge& gauge,
                                const OptimizeOptions& options, const ceres::LossFunction* kernel) {
    if (options.start == LinearStart::kChordal && graph.priors.empty()) {
        std::vector<Pose2d> nodes = linear_start(graph, gauge);
        if (!nodes.empty() && cost(graph, nodes, kernel) < cost(graph, graph.nodes, kernel)) {
            return nodes;
        }
    }
    return graph.nodes;
}

void check(const OptimizeOptions& options) {
    const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
    if (!positive(options.kernel_scale) || !positive(options.initial_trust_region)) {
        throw Error("pose graph: kernel_scale and initial_trust_region must be above zero");
    }
    if (!(options.function_tolerance >= 0.0) || options.max_iterations < 0 || options.threads < 1) {
        throw Error("pose graph: function_tolerance, max_iterations or threads is out of range");
    }
}

}  // namespace

Eigen::Vector3d residual(const Edge& edge, const Pose2d& map_from_from, const Pose2d& map_from_to) {
    return between_residual(edge.from_from_to, map_from_from, map_from_to);
}

double chi2(const Edge& edge, const Pose2d& map_from_from, const Pose2d& map_from_to) {
    const Eigen::Vector3d r = residual(edge, map_from_from, map_from_to);
    return r.dot(edge.information * r);
}

double chi2(const PoseGraph& graph) {
    return cost(graph, graph.nodes, nullptr);
}

OptimizeSummary optimize(PoseGraph& graph, const OptimizeOptions& options) {
    check(graph);
    check(options);
    OptimizeSummary summary;
    summary.initial_chi2 = summary.start_chi2 = summary.final_chi2 = chi2(graph);
    if (!std::isfinite(summary.initial_chi2)) {
        summary.message = "a node is not finite, or too far away";
        return summary;
    }
    const Stopwatch starting;
    const Gauge gauge = find_gauge(graph);
    const auto kernel = make_kernel(options.closure_kernel, options.kernel_scale);
    const std::vector<Pose2d> start = start_nodes(graph, gauge, options, kernel.get());
    summary.start_chi2 = cost(graph, start, nullptr);
    summary.linear_start_seconds = starting.seconds();

    const Stopwatch solving;
    CeresGraph problem(graph, start, gauge, kernel.get());
    const ceres::Solver::Summary solved = problem.solve(options);
    std::vector<Pose2d> nodes = problem.nodes();
    const double final_chi2 = cost(graph, nodes, nullptr);
    summary.solve_seconds = solving.seconds();

    summary.usable = solved.IsSolutionUsable() && std::isfinite(final_chi2);
    summary.converged = summary.usable && solved.termination_type != ceres::NO_CONVERGENCE;
    summary.iterations = std::max(0, static_cast<int>(solved.iterations.size()) - 1);
    summary.message = solved.message;
    if (summary.usable) {
        graph.nodes = std::move(nodes);
        summary.final_chi2 = final_chi2;
    }
    return summary;
}

}  // namespace hybrid_slam
