// SPDX-License-Identifier: Apache-2.0
#include "edge_cost.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace hybrid_slam {
namespace {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// d(R^T (t_to - t_from)) / d heading_from, for the vector R^T (t_to - t_from).
Eigen::Vector2d turned_back(const Eigen::Vector2d& vector) {
    return {vector.y(), -vector.x()};
}

/// The one place where residuals and derivatives are weighed: L^T times each.
struct Whitening {
    const Eigen::Matrix3d& transposed_root;

    void residual(const Eigen::Vector3d& plain, double* whitened) const {
        Eigen::Map<Eigen::Vector3d>(whitened).noalias() = transposed_root * plain;
    }
    void jacobian(const Eigen::Matrix3d& plain, double* whitened) const {
        Eigen::Map<RowMajor3>(whitened).noalias() = transposed_root * plain;
    }
};

}  // namespace

Eigen::Matrix3d square_root(const Eigen::Matrix3d& information) {
    const Eigen::LLT<Eigen::Matrix3d> cholesky(information);
    if (cholesky.info() == Eigen::Success) {
        return cholesky.matrixU();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information);
    const Eigen::Vector3d roots = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    return roots.asDiagonal() * eigen.eigenvectors().transpose();
}

bool is_semidefinite(const Eigen::Matrix3d& information) {
    if (!information.allFinite()) {
        return false;
    }
    const double tolerance = 1e-9 * information.cwiseAbs().maxCoeff();
    if ((information - information.transpose()).cwiseAbs().maxCoeff() > tolerance) {
        return false;
    }
    if (Eigen::LLT<Eigen::Matrix3d>(information).info() == Eigen::Success) {
        return true;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information, Eigen::EigenvaluesOnly);
    return eigen.info() == Eigen::Success && eigen.eigenvalues().minCoeff() >= -tolerance;
}

LinearizedEdge linearize(const Pose2d& measured, const Pose2d& from, const Pose2d& to) {
    const Pose2d found = between(from, to);
    LinearizedEdge edge;
    edge.residual = between_residual(measured, from, to);
    const Eigen::Matrix2d to_from = measured.rotation().transpose();
    edge.by_from = -Eigen::Matrix3d::Identity();
    edge.by_from.topLeftCorner<2, 2>() = -to_from;
    edge.by_from.topRightCorner<2, 1>() = to_from * turned_back(found.translation);
    edge.by_to = Eigen::Matrix3d::Identity();
    edge.by_to.topLeftCorner<2, 2>() = to_from * found.rotation();
    return edge;
}

bool Se2Manifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
    const double c = std::cos(x[2]);
    const double s = std::sin(x[2]);
    x_plus_delta[0] = x[0] + c * delta[0] - s * delta[1];
    x_plus_delta[1] = x[1] + s * delta[0] + c * delta[1];
    x_plus_delta[2] = x[2] + delta[2];
    return true;
}

bool Se2Manifold::PlusJacobian(const double* x, double* jacobian) const {
    Eigen::Map<RowMajor3> matrix(jacobian);
    matrix.setIdentity();
    matrix.topLeftCorner<2, 2>() = Pose2d(0.0, 0.0, x[2]).rotation();
    return true;
}

bool Se2Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
    const double c = std::cos(x[2]);
    const double s = std::sin(x[2]);
    const double dx = y[0] - x[0];
    const double dy = y[1] - x[1];
    y_minus_x[0] = c * dx + s * dy;
    y_minus_x[1] = c * dy - s * dx;
    y_minus_x[2] = normalize_angle(y[2] - x[2]);
    return true;
}

bool Se2Manifold::MinusJacobian(const double* x, double* jacobian) const {
    Eigen::Map<RowMajor3> matrix(jacobian);
    matrix.setIdentity();
    matrix.topLeftCorner<2, 2>() = Pose2d(0.0, 0.0, x[2]).rotation().transpose();
    return true;
}

bool EdgeCost::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
    const double* from = parameters[0];
    const double* to = parameters[1];
    // With R = R(from) R(measured): R^T (t_to - t_from) less the measured step in the axes of `to`.
    const Eigen::Matrix2d to_from_map =
        Pose2d(0.0, 0.0, to_from_from_.heading - from[2]).rotation();
    const Eigen::Vector2d step = to_from_map * Eigen::Vector2d(to[0] - from[0], to[1] - from[1]);
    const Eigen::Vector2d off = step + to_from_from_.translation;
    const Whitening whitening{whitening_};
    whitening.residual({off.x(), off.y(), normalize_angle(to[2] - from[2] + to_from_from_.heading)},
                       residuals);
    if (jacobians == nullptr) {
        return true;
    }
    Eigen::Matrix3d by_to = Eigen::Matrix3d::Identity();
    by_to.topLeftCorner<2, 2>() = to_from_map;
    if (jacobians[0] != nullptr) {
        Eigen::Matrix3d by_from = -by_to;
        by_from.topRightCorner<2, 1>() = turned_back(step);
        whitening.jacobian(by_from, jacobians[0]);
    }
    if (jacobians[1] != nullptr) {
        whitening.jacobian(by_to, jacobians[1]);
    }
    return true;
}

bool PriorCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
    constexpr double kOrigin[3] = {0.0, 0.0, 0.0};
    const double* both[2] = {kOrigin, parameters[0]};
    double* by_both[2] = {nullptr, jacobians == nullptr ? nullptr : jacobians[0]};
    return edge_.Evaluate(both, residuals, jacobians == nullptr ? nullptr : by_both);
}

}  // namespace hybrid_slam
