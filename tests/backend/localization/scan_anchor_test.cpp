// SPDX-License-Identifier: Apache-2.0
#include "scan_anchor.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "backend/localization/localization_support.hpp"
#include "hybrid_slam/core/uncertainty.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

Eigen::Matrix3d diagonal(double translation, double rotation) {
    return Eigen::Vector3d(translation * translation, translation * translation,
                           rotation * rotation)
        .asDiagonal();
}

const World& hall() {
    static const World world = world_named("thesis_hall");
    return world;
}
const ReferenceMap& hall_map() {
    static const auto map = map_of(hall());
    return *map;
}

/// Two walls without ends along x, as far as a scan sees.
World corridor() {
    World world;
    world.walls = {{{-100.0, -1.2}, {100.0, -1.2}}, {{100.0, 1.2}, {-100.0, 1.2}}};
    world.path = {{-8.0, 0.0}, {8.0, 0.0}};
    return world;
}

ScanAnchor look(const ReferenceMap& map, const World& world, const Pose2d& truth,
                const PoseBelief& expected, unsigned seed = 1) {
    std::mt19937 random(seed);
    const Sweep sweep = sweep_of(scan_at(world, truth, random));
    return anchor_of(map, sweep.surface, expected, ScanAnchorConfig(), IcpConfig());
}

const Pose2d kTruth(-1.0, 0.5, 0.7);

TEST(ScanAnchor, FindsThePoseFromGuessesInDoubt) {
    for (const double off : {0.0, 0.02, 0.3}) {
        const PoseBelief expected{{kTruth.x() + off, kTruth.y() - off, kTruth.heading + 0.3 * off},
                                  diagonal(0.005 + off, 0.001 + 0.3 * off)};
        const ScanAnchor found = look(hall_map(), hall(), kTruth, expected);
        ASSERT_TRUE(found.found);
        EXPECT_GT(found.near, 0.9);
        EXPECT_THAT(found.anchor.map_from_robot, PoseNear(kTruth, 0.008, 0.002)) << off;
    }
}

TEST(ScanAnchor, IsThatOfTheScanWhateverWasExpected) {
    const PoseBelief sure{kTruth * Pose2d(0.01, 0.01, 0.004), diagonal(0.003, 0.001)};
    const PoseBelief unsure{kTruth, diagonal(0.05, 0.02)};
    const ScanAnchor a = look(hall_map(), hall(), kTruth, sure);
    const ScanAnchor b = look(hall_map(), hall(), kTruth, unsure);
    EXPECT_THAT(a.anchor.map_from_robot, PoseNear(b.anchor.map_from_robot, 0.001, 0.0003));
}

TEST(ScanAnchor, ThingsThatTheMapDoesNotHaveDoNotPull) {
    // A wall of boxes 12 cm before the wall below, and things all over the right side.
    World changed = hall();
    changed.walls.push_back({{-3.5, -3.48}, {3.0, -3.48}});
    changed.walls.push_back({{2.0, -2.0}, {2.0, 2.5}});
    changed.posts.push_back({{-2.0, 2.0}, 0.3});
    const PoseBelief expected{kTruth * Pose2d(0.005, -0.005, 0.002), diagonal(0.005, 0.002)};
    const ScanAnchor found = look(hall_map(), changed, kTruth, expected);
    ASSERT_TRUE(found.found);
    EXPECT_LT(found.near, 0.65);
    EXPECT_THAT(found.anchor.map_from_robot, PoseNear(kTruth, 0.012, 0.003));
}

TEST(ScanAnchor, AlongACorridorItSaysNothing) {
    const auto map = map_of(corridor());
    const PoseBelief expected{{0.0, 0.0, 0.3}, diagonal(0.02, 0.005)};
    const ScanAnchor found = look(*map, corridor(), {0.01, 0.02, 0.3}, expected);
    ASSERT_TRUE(found.found);
    EXPECT_LT(found.anchor.information(0, 0), 1.0);  // sigma beyond a metre
    EXPECT_GT(found.anchor.information(1, 1), 1e4);
    EXPECT_GT(found.anchor.information(2, 2), 1e5);
    EXPECT_NEAR(found.anchor.map_from_robot.y(), 0.02, 0.01);
}

TEST(ScanAnchor, IsNotFoundWithoutAnyWalls) {
    const PoseBelief expected{kTruth, diagonal(0.005, 0.002)};
    EXPECT_FALSE(anchor_of(hall_map(), Surface(), expected, ScanAnchorConfig(), IcpConfig()).found);
    // Far outside of the map.
    const PoseBelief outside{{60.0, 60.0, 0.0}, diagonal(0.005, 0.002)};
    EXPECT_FALSE(look(hall_map(), hall(), kTruth, outside).found);
}

}  // namespace
}  // namespace hybrid_slam::test
