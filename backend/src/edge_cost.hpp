// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// L^T with information = L L^T, so that |L^T r|^2 = r^T information r. Semidefinite is enough.
Eigen::Matrix3d square_root(const Eigen::Matrix3d& information);

/// Finite, symmetric and positive semidefinite, but for rounding.
bool is_semidefinite(const Eigen::Matrix3d& information);

/// The unweighed residual of a measured `from_from_to`. The scalar may be a ceres::Jet.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 1> between_residual(const Pose2d& measured, const Pose2<Scalar>& from,
                                             const Pose2<Scalar>& to) {
    return between(measured.cast<Scalar>(), between(from, to)).vector();
}

/// The residual with its derivatives by right perturbations of both poses (x and y along their own
/// axes, heading).
struct LinearizedEdge {
    Eigen::Vector3d residual;
    Eigen::Matrix3d by_from;
    Eigen::Matrix3d by_to;
};
LinearizedEdge linearize(const Pose2d& measured, const Pose2d& from, const Pose2d& to);

/// A pose as Ceres holds it, (x, y, heading), perturbed from the right: x and y along its own axes.
/// Plus leaves the heading unwrapped; Minus holds the only wrap, so that both stay smooth at +-pi.
class Se2Manifold final : public ceres::Manifold {
  public:
    int AmbientSize() const override { return 3; }
    int TangentSize() const override { return 3; }
    bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
    bool PlusJacobian(const double* x, double* jacobian) const override;
    bool Minus(const double* y, const double* x, double* y_minus_x) const override;
    bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// Whitened residual of a relative measurement; parameters (x, y, heading) of `from` and `to`.
class EdgeCost final : public ceres::SizedCostFunction<3, 3, 3> {
  public:
    EdgeCost(const Pose2d& from_from_to, const Eigen::Matrix3d& information)
        : to_from_from_(from_from_to.inverse()), whitening_(square_root(information)) {}
    bool Evaluate(double const* const* parameters, double* residuals,
                  double** jacobians) const override;

  private:
    Pose2d to_from_from_;
    Eigen::Matrix3d whitening_;
};

/// Whitened residual of a measurement in the frame of the map: an edge from the map's origin.
class PriorCost final : public ceres::SizedCostFunction<3, 3> {
  public:
    PriorCost(const Pose2d& map_from_node, const Eigen::Matrix3d& information)
        : edge_(map_from_node, information) {}
    bool Evaluate(double const* const* parameters, double* residuals,
                  double** jacobians) const override;

  private:
    EdgeCost edge_;
};

}  // namespace hybrid_slam
