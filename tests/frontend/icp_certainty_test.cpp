// SPDX-License-Identifier: Apache-2.0
// What ICP claims to know: degenerate scenes, information, and the weight of a prior.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "hybrid_slam/registration/icp.hpp"
#include "support/pose_matchers.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

IcpConfig to_lines() {
    IcpConfig config;
    config.metric = IcpMetric::kPointToLine;
    config.max_iterations = 200;
    config.max_distance = 2.0;
    config.translation_tolerance = 1e-6;
    config.rotation_tolerance = 1e-6;
    config.kernel = IcpKernel::kNone;
    config.trim = 1.0;
    config.min_overlap = 0.3;
    config.noise_floor = 0.02;
    return config;
}

Eigen::Matrix3d information(double translation_sigma, double rotation_sigma) {
    const double t = 1.0 / (translation_sigma * translation_sigma);
    return Eigen::Vector3d(t, t, 1.0 / (rotation_sigma * rotation_sigma)).asDiagonal();
}

// As odometry makes its references: far points at grazing angles, too far apart for a normal, would
// be paired point to point and hold the robot where it was.
Surface corridor_from(const Pose2d& pose) {
    Lidar lidar;
    lidar.range_max = 15.0;
    return oriented(surface_of(scan_at(endless_corridor(), pose, lidar)));
}

bool is_semidefinite(const Eigen::Matrix3d& matrix) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix);
    return eigen.eigenvalues()(0) >= -1e-9 * eigen.eigenvalues()(2);
}

TEST(IcpCertainty, AnExactCorridorWithoutAPriorIsDegenerate) {
    const IcpGuess guess{Pose2d(0.2, 0.05, 0.02)};
    const IcpResult result =
        align(corridor_from({}), Reference(corridor_from({})), guess, to_lines());
    EXPECT_EQ(result.status, IcpStatus::kDegenerate);
    EXPECT_THAT(result.reference_from_points, PoseNear(guess.reference_from_points, 0.0, 0.0));
}

TEST(IcpCertainty, ASingleWallWithoutAPriorIsDegenerate) {
    World wall;
    wall.walls.push_back({{-1000.0, 2.0}, {1000.0, 2.0}});
    Lidar lidar;
    lidar.range_max = 15.0;
    const Surface scan = oriented(surface_of(scan_at(wall, {}, lidar)));
    EXPECT_EQ(align(scan, Reference(scan), {}, to_lines()).status, IcpStatus::kDegenerate);
}

TEST(IcpCertainty, APriorDecidesAlongACorridorAndTheWallsAcross) {
    for (const double heading : {0.0, 0.5, 2.0, -3.0}) {
        const Pose2d place(3.0, -2.0, heading);  // the corridor in any direction of the reference
        const Reference reference(transform(place, corridor_from({})));
        const Pose2d truth = place * Pose2d(0.4, 0.1, 0.05);
        // The prior is wrong across and in heading, and believed to 10 cm and 3 degrees.
        const IcpGuess guess{place * Pose2d(0.4, 0.02, 0.0), information(0.1, 0.05)};
        const IcpResult result =
            align(corridor_from({0.4, 0.1, 0.05}), reference, guess, to_lines());
        ASSERT_EQ(result.status, IcpStatus::kConverged);
        EXPECT_THAT(result.reference_from_points, PoseNear(truth, 0.003, 0.002));
        EXPECT_LT(result.weakness_ratio, 0.01);
        EXPECT_NEAR(result.weak_direction.norm(), 1.0, 1e-9);
        EXPECT_GT(std::abs(result.weak_direction.dot(
                      Eigen::Vector2d(std::cos(heading), std::sin(heading)))),
                  0.999);
    }
}

TEST(IcpCertainty, TheInformationLeavesThePriorOut) {
    const Reference reference(corridor_from({}));
    const IcpResult loose =
        align(corridor_from({}), reference, {{}, information(1.0, 1.0)}, to_lines());
    const IcpResult tight =
        align(corridor_from({}), reference, {{}, information(1e-3, 1e-3)}, to_lines());
    ASSERT_TRUE(loose.usable() && tight.usable());
    EXPECT_LT((loose.information - tight.information).norm(), 1e-6 * loose.information.norm());
    EXPECT_LT(loose.information(0, 0), 1e-6 * loose.information(1, 1)) << "along and across";
}

TEST(IcpCertainty, ARoomIsStrongInEveryDirection) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const IcpResult result = align(room, Reference(room), {}, to_lines());
    EXPECT_GT(result.weakness_ratio, 0.3);
    EXPECT_LE(result.weakness_ratio, 1.0);
    EXPECT_TRUE(is_semidefinite(result.information));
}

TEST(IcpCertainty, APriorPullsAsHardAsItIsBelieved) {
    // Against walls that say "no motion", a prior that says "10 cm".
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const Reference reference(room);
    const Pose2d wrong(0.1, 0.0, 0.0);
    double last = 0.0;
    for (const double sigma : {1.0, 0.01, 0.001, 1e-5}) {
        const IcpResult result =
            align(room, reference, {wrong, information(sigma, sigma)}, to_lines());
        ASSERT_TRUE(result.usable());
        EXPECT_GE(result.reference_from_points.x(), last - 1e-9);
        last = result.reference_from_points.x();
    }
    EXPECT_GT(last, 0.09);
    EXPECT_LT(align(room, reference, {wrong, information(1.0, 1.0)}, to_lines())
                  .reference_from_points.x(),
              1e-4);
    EXPECT_LT(std::abs(align(room, reference, {wrong, Eigen::Matrix3d::Zero()}, to_lines())
                           .reference_from_points.x()),
              1e-6)
        << "no weight, no pull";
}

TEST(IcpCertainty, TheResultIsThePosteriorOfPriorAndScan) {
    // Near the optimum all is linear: (Omega_icp + Omega_prior) x = Omega_prior x_prior.
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const IcpResult alone = align(room, Reference(room), {}, to_lines());
    Eigen::Matrix3d prior = 0.5 * alone.information;
    prior(0, 1) = prior(1, 0) = 0.2 * prior(0, 0);
    const Eigen::Vector3d said(0.004, -0.003, 0.002);
    const IcpResult both =
        align(room, Reference(room), {{said.x(), said.y(), said.z()}, prior}, to_lines());
    const Eigen::Vector3d expected = (alone.information + prior).inverse() * (prior * said);
    EXPECT_LT((both.reference_from_points.vector() - expected).norm(), 0.03 * expected.norm());
}

// Many scans of one place with noise: how much the results scatter against how much they say they
// do.
TEST(IcpCertainty, ClaimsTheCovarianceThatItHas) {
    const World world = irregular_room();
    Lidar dense;
    dense.beams = 3600;
    const Reference reference(surface_of(scan_at(world, {}, dense)));
    Lidar noisy;
    noisy.sigma = 0.03;
    IcpConfig config = to_lines();
    config.noise_floor = 0.005;
    const Pose2d truth(0.1, 0.05, 0.4);
    Rng rng(31);
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d claimed = Eigen::Matrix3d::Zero();
    constexpr int kRuns = 300;
    for (int run = 0; run < kRuns; ++run) {
        const IcpResult result = align(surface_of(scan_at(world, truth, noisy, rng)), reference,
                                       {truth, Eigen::Matrix3d::Zero()}, config);
        ASSERT_TRUE(result.usable());
        Eigen::Vector3d error = result.reference_from_points.vector() - truth.vector();
        scatter += error * error.transpose() / kRuns;
        claimed += result.information.inverse() / kRuns;
    }
    // Of every combination of x, y and heading: variances of the one relative to the other.
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> ratios(scatter, claimed);
    EXPECT_GT(ratios.eigenvalues()(0), 0.4) << "claims to know less than it does";
    EXPECT_LT(ratios.eigenvalues()(2), 2.5) << "claims to know more than it does";
}

TEST(IcpCertainty, ThePointToPointMetricClaimsNoLessThanTheNoiseFloor) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    IcpConfig config = to_lines();
    config.metric = IcpMetric::kPointToPoint;
    config.noise_floor = 0.02;
    const IcpResult result = align(room, Reference(room), {}, config);
    // Exact points: n pairs, each of which fixes the translation to the floor.
    EXPECT_NEAR(result.information(0, 0), static_cast<double>(room.size()) / (0.02 * 0.02),
                1e-6 * result.information(0, 0));
}

// The noise of the normals must not pass for knowledge of where along the corridor the robot is.
TEST(IcpCertainty, ANoisyCorridorIsWeakAlongAndSaysSo) {
    Lidar noisy;
    noisy.range_max = 15.0;
    noisy.sigma = 0.01;
    Rng rng(32);
    for (int run = 0; run < 20; ++run) {
        const Reference reference(
            oriented(surface_of(scan_at(endless_corridor(), {}, noisy, rng))));
        const Surface scan = surface_of(scan_at(endless_corridor(), {0.3, 0.0, 0.0}, noisy, rng));
        const IcpGuess guess{{0.3, 0.05, 0.02}, information(0.05, 0.05)};
        const IcpResult result = align(scan, reference, guess, to_lines());
        ASSERT_TRUE(result.usable());
        EXPECT_LT(result.weakness_ratio, 0.2);
        EXPECT_GT(std::abs(result.weak_direction.x()), 0.98);
        EXPECT_THAT(result.reference_from_points, PoseNear(Pose2d(0.3, 0.0, 0.0), 0.1, 0.01));
    }
}

}  // namespace
}  // namespace hybrid_slam::test
