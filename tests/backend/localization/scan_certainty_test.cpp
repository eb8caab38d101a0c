// SPDX-License-Identifier: Apache-2.0
#include "scan_certainty.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

namespace hybrid_slam::test {
namespace {

/// The information of point to line ICP with sigma 2 cm.
Eigen::Matrix3d information_of(const std::vector<WallSighting>& walls) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    for (const WallSighting& wall : walls) {
        const Eigen::Vector3d row(wall.normal.x(), wall.normal.y(),
                                  wall.normal.dot(Point2(-wall.arm.y(), wall.arm.x())));
        information += row * row.transpose() / 4e-4;
    }
    return information;
}

/// `count` points on the wall at `distance` whose normal has the heading `facing`, with normals
/// that err by `noise` radians.
void add_wall(std::vector<WallSighting>& walls, double facing, double distance, int count,
              double noise) {
    std::mt19937 random(7);
    std::normal_distribution<double> error(0.0, noise);
    const Point2 out(std::cos(facing), std::sin(facing));
    for (int i = 0; i < count; ++i) {
        const double along = -4.0 + 8.0 * i / count;
        const double angle = facing + (noise > 0.0 ? error(random) : 0.0);
        walls.push_back({-distance * out + along * Point2(-out.y(), out.x()),
                         {std::cos(angle), std::sin(angle)}});
    }
}

TEST(ScanCertainty, ARoomCountsAsItIs) {
    std::vector<WallSighting> walls;
    for (int side = 0; side < 4; ++side) {
        add_wall(walls, 0.3 + 0.5 * kPi * side, 2.0 + side, 100, 0.05);
    }
    const Eigen::Matrix3d claimed = information_of(walls);
    const ScanCertainty certainty(claimed, walls);
    EXPECT_LT((certainty.information() - claimed).norm(), 0.1 * claimed.norm());
    const Eigen::Vector3d gradient(100.0, -50.0, 70.0);
    EXPECT_LT((certainty.solve(gradient) - claimed.ldlt().solve(gradient)).norm(), 1e-9);
}

TEST(ScanCertainty, AlongACorridorNothingIsKnownHoweverItLies) {
    for (const double heading : {0.0, 0.7, 2.5}) {
        std::vector<WallSighting> walls;
        add_wall(walls, heading + 0.5 * kPi, 1.2, 200, 0.1);
        add_wall(walls, heading - 0.5 * kPi, 1.2, 200, 0.1);
        const Eigen::Matrix3d claimed = information_of(walls);
        const ScanCertainty certainty(claimed, walls);
        const Eigen::Vector3d along(std::cos(heading), std::sin(heading), 0.0);
        const Eigen::Vector3d across(-std::sin(heading), std::cos(heading), 0.0);
        EXPECT_GT(along.dot(claimed * along), 5e3);  // a sigma of 14 mm, out of nothing
        EXPECT_LT(along.dot(certainty.information() * along), 400.0);
        EXPECT_GT(across.dot(certainty.information() * across), 0.9 * across.dot(claimed * across));
        EXPECT_LT(std::abs(along.dot(certainty.solve(1e3 * along))), 0.01);
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(certainty.information());
        EXPECT_GE(eigen.eigenvalues()(0), -1e-6);
    }
}

TEST(ScanCertainty, AFewBeamsOnItsEndWallAreKnowledge) {
    std::vector<WallSighting> walls;
    add_wall(walls, 0.5 * kPi, 1.2, 200, 0.1);
    add_wall(walls, -0.5 * kPi, 1.2, 200, 0.1);
    const double noise = information_of(walls)(0, 0);
    add_wall(walls, kPi, 9.0, 8, 0.0);
    const ScanCertainty certainty(information_of(walls), walls);
    EXPECT_GT(certainty.information()(0, 0), 0.4 * 8.0 / 4e-4);
    EXPECT_LT(certainty.information()(0, 0), 8.0 / 4e-4 + 0.3 * noise);
}

TEST(ScanCertainty, APostTellsBothWays) {
    std::vector<WallSighting> walls;
    add_wall(walls, 0.5 * kPi, 1.2, 200, 0.0);
    for (int i = 0; i < 20; ++i) {
        walls.push_back({{2.0, 0.01 * i}, Point2::Zero()});
    }
    Eigen::Matrix3d claimed = information_of(walls);
    claimed(0, 0) += 20.0 * 0.3 / 4e-4;
    EXPECT_GT(ScanCertainty(claimed, walls).information()(0, 0), 0.5 * 20.0 * 0.3 / 4e-4);
}

TEST(ScanCertainty, InARoundRoomTheHeadingIsUnknown) {
    std::vector<WallSighting> walls;
    std::mt19937 random(3);
    std::normal_distribution<double> error(0.0, 0.05);
    for (int i = 0; i < 300; ++i) {
        const double angle = 2.0 * kPi * i / 300.0;
        const double facing = angle + kPi + error(random);
        walls.push_back(
            {{3.0 * std::cos(angle), 3.0 * std::sin(angle)}, {std::cos(facing), std::sin(facing)}});
    }
    const Eigen::Matrix3d claimed = information_of(walls);
    const Eigen::Matrix3d kept = ScanCertainty(claimed, walls).information();
    EXPECT_GT(claimed(2, 2), 5e3);
    EXPECT_LT(kept(2, 2), 0.02 * claimed(2, 2));
    EXPECT_GT(kept(0, 0), 0.8 * claimed(0, 0));
}

}  // namespace
}  // namespace hybrid_slam::test
