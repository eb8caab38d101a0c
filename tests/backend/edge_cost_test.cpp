// SPDX-License-Identifier: Apache-2.0
#include "edge_cost.hpp"

#include <ceres/autodiff_cost_function.h>
#include <ceres/gradient_checker.h>
#include <ceres/manifold_test_utils.h>
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "graph_support.hpp"

namespace hybrid_slam {
namespace {

using test::Random;

std::array<double, 3> state_of(const Pose2d& pose) {
    return {pose.x(), pose.y(), pose.heading};
}

TEST(Se2Manifold, KeepsCeresInvariantsNearZeroAndNearPi) {
    using namespace ceres;  // the macro names its matchers without it
    const Se2Manifold manifold;
    for (const double heading : {0.3, 3.1, -3.1, kPi}) {
        const Eigen::VectorXd x = Eigen::Vector3d(2.0, -1.0, heading);
        const Eigen::VectorXd y = Eigen::Vector3d(-4.0, 0.5, heading - 0.2);
        for (const double turn : {0.0, 0.2, -0.2, 1.0}) {
            const Eigen::VectorXd delta = Eigen::Vector3d(0.3, -0.7, turn);
            EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-9);
        }
    }
}

TEST(Se2Manifold, MinusGoesTheShortWayAcrossPi) {
    const std::array<double, 3> x{1.0, 2.0, 3.1};
    const std::array<double, 3> y{1.0, 2.0, -3.1};
    std::array<double, 3> delta{};
    ASSERT_TRUE(Se2Manifold().Minus(y.data(), x.data(), delta.data()));
    EXPECT_NEAR(delta[2], 2.0 * kPi - 6.2, 1e-12);
}

TEST(Se2Manifold, PlusIsTheProductFromTheRight) {
    Random random(1);
    for (int i = 0; i < 20; ++i) {
        const Pose2d pose = random.pose(5.0);
        const Pose2d step = random.pose(1.0);
        std::array<double, 3> moved{};
        Se2Manifold().Plus(state_of(pose).data(), state_of(step).data(), moved.data());
        const Pose2d expected = pose * step;
        EXPECT_NEAR(moved[0], expected.x(), 1e-12);
        EXPECT_NEAR(moved[1], expected.y(), 1e-12);
        EXPECT_NEAR(normalize_angle(moved[2] - expected.heading), 0.0, 1e-12);
    }
}

TEST(SquareRoot, GivesTheInformationBackEvenWhenSemidefinite) {
    Random random(2);
    for (int i = 0; i < 20; ++i) {
        Eigen::Matrix3d information = random.information();
        if (i % 2 == 1) {
            const Eigen::Vector3d direction(1.0, random.normal(1.0), random.normal(1.0));
            information = direction * direction.transpose();
        }
        const Eigen::Matrix3d root = square_root(information);
        EXPECT_TRUE((root.transpose() * root).isApprox(information, 1e-9)) << information;
    }
    EXPECT_TRUE(square_root(Eigen::Matrix3d::Zero()).isZero(0.0));
}

TEST(IsSemidefinite, RefusesNegativeCrookedAndUnfinite) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
    EXPECT_TRUE(is_semidefinite(matrix));
    EXPECT_TRUE(is_semidefinite(Eigen::Matrix3d::Zero()));
    matrix(2, 2) = -1e-3;
    EXPECT_FALSE(is_semidefinite(matrix));
    matrix(2, 2) = std::nan("");
    EXPECT_FALSE(is_semidefinite(matrix));
    matrix = Eigen::Matrix3d::Identity();
    matrix(0, 1) = 0.1;
    EXPECT_FALSE(is_semidefinite(matrix));
    matrix(1, 0) = 0.1;
    EXPECT_TRUE(is_semidefinite(matrix));
    matrix(0, 1) = matrix(1, 0) = 1.1;
    EXPECT_FALSE(is_semidefinite(matrix));
}

// With L in place of its transpose this fails, but only for a correlated matrix.
TEST(EdgeCost, WhitensSoThatItsSquareIsTheMahalanobisNorm) {
    Random random(3);
    for (int i = 0; i < 20; ++i) {
        Edge edge;
        edge.from_from_to = random.pose(2.0);
        edge.information = random.information();
        const Pose2d from = random.pose(5.0);
        const Pose2d to = random.pose(5.0);
        const auto a = state_of(from);
        const auto b = state_of(to);
        const double* parameters[] = {a.data(), b.data()};
        Eigen::Vector3d whitened;
        const EdgeCost cost(edge.from_from_to, edge.information);
        ASSERT_TRUE(cost.Evaluate(parameters, whitened.data(), nullptr));

        const Eigen::Vector3d r = (edge.from_from_to.inverse() * (from.inverse() * to)).vector();
        const double expected = r.dot(edge.information * r);
        EXPECT_NEAR(whitened.squaredNorm(), expected, 1e-9 * expected);
        EXPECT_NEAR(chi2(edge, from, to), expected, 1e-9 * expected);
        EXPECT_TRUE(residual(edge, from, to).isApprox(r, 1e-12));
    }
}

/// The same residual with Ceres' automatic derivatives.
struct AutomaticEdge {
    template <typename Scalar>
    bool operator()(const Scalar* from, const Scalar* to, Scalar* whitened) const {
        const Eigen::Matrix<Scalar, 3, 1> plain = between_residual(
            measured, Pose2<Scalar>(from[0], from[1], from[2]), Pose2<Scalar>(to[0], to[1], to[2]));
        Eigen::Map<Eigen::Matrix<Scalar, 3, 1>>{whitened} = root.cast<Scalar>() * plain;
        return true;
    }
    Pose2d measured;
    Eigen::Matrix3d root;
};

TEST(EdgeCost, DerivativesAreThoseOfAutomaticDifferentiation) {
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Random random(4);
    for (int i = 0; i < 50; ++i) {
        const Pose2d measured = random.pose(2.0);
        const Eigen::Matrix3d information = random.information();
        const EdgeCost analytic(measured, information);
        const ceres::AutoDiffCostFunction<AutomaticEdge, 3, 3, 3> automatic(
            new AutomaticEdge{measured, square_root(information)});
        const auto from = state_of(random.pose(5.0));
        const auto to = state_of(random.pose(5.0));
        const double* parameters[] = {from.data(), to.data()};
        Eigen::Vector3d r[2];
        RowMajor j[2][2];
        double* first[] = {j[0][0].data(), j[0][1].data()};
        double* second[] = {j[1][0].data(), j[1][1].data()};
        ASSERT_TRUE(analytic.Evaluate(parameters, r[0].data(), first));
        ASSERT_TRUE(automatic.Evaluate(parameters, r[1].data(), second));
        EXPECT_TRUE(r[0].isApprox(r[1], 1e-12));
        EXPECT_TRUE(j[0][0].isApprox(j[1][0], 1e-12));
        EXPECT_TRUE(j[0][1].isApprox(j[1][1], 1e-12));
    }
}

/// Headings at which a derivative could meet a wrap.
constexpr double kHeadings[] = {0.0, 0.3, 3.1, -3.1, kPi, -kPi, kPi - 1e-9, -kPi + 1e-9};

TEST(EdgeCost, PassesTheGradientCheckerAtHeadingsNearPi) {
    Random random(5);
    const Se2Manifold manifold;
    const std::vector<const ceres::Manifold*> manifolds{&manifold, &manifold};
    for (const double from_heading : kHeadings) {
        for (const double to_heading : kHeadings) {
            const EdgeCost cost({0.5, -1.0, to_heading - from_heading + 0.2}, random.information());
            ceres::GradientChecker checker(&cost, &manifolds, ceres::NumericDiffOptions());
            const std::array<double, 3> from{1.0, 2.0, from_heading};
            const std::array<double, 3> to{-0.5, 4.0, to_heading};
            const double* parameters[] = {from.data(), to.data()};
            ceres::GradientChecker::ProbeResults results;
            EXPECT_TRUE(checker.Probe(parameters, 1e-6, &results)) << results.error_log;
        }
    }
}

TEST(PriorCost, PassesTheGradientCheckerAtHeadingsNearPi) {
    Random random(6);
    const Se2Manifold manifold;
    const std::vector<const ceres::Manifold*> manifolds{&manifold};
    for (const double heading : kHeadings) {
        const PriorCost cost({0.5, -1.0, heading + 0.1}, random.information());
        ceres::GradientChecker checker(&cost, &manifolds, ceres::NumericDiffOptions());
        const std::array<double, 3> node{1.0, 2.0, heading};
        const double* parameters[] = {node.data()};
        ceres::GradientChecker::ProbeResults results;
        EXPECT_TRUE(checker.Probe(parameters, 1e-6, &results)) << results.error_log;
    }
}

TEST(Linearize, HasTheDerivativesByRightPerturbations) {
    constexpr double kStep = 1e-6;
    Random random(7);
    const Pose2d measured = random.pose(2.0);
    const Pose2d from = random.pose(5.0);
    const Pose2d to = random.pose(5.0);
    const LinearizedEdge edge = linearize(measured, from, to);
    for (int i = 0; i < 3; ++i) {
        Eigen::Vector3d step = Eigen::Vector3d::Zero();
        step[i] = kStep;
        const Pose2d plus(step.x(), step.y(), step.z());
        const Pose2d minus(-step.x(), -step.y(), -step.z());
        const Eigen::Vector3d by_from = between_residual(measured, from * plus, to) -
                                        between_residual(measured, from * minus, to);
        const Eigen::Vector3d by_to = between_residual(measured, from, to * plus) -
                                      between_residual(measured, from, to * minus);
        EXPECT_TRUE(edge.by_from.col(i).isApprox(by_from / (2.0 * kStep), 1e-8));
        EXPECT_TRUE(edge.by_to.col(i).isApprox(by_to / (2.0 * kStep), 1e-8));
    }
}

}  // namespace
}  // namespace hybrid_slam
