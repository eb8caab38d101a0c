// SPDX-License-Identifier: Apache-2.0
#include "skyline.hpp"

#include <gtest/gtest.h>

#include <random>

#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam::test {
namespace {

constexpr int kFaceEntries = 900;

/// The direction, of depth 1 before its face, that an index of a skyline of all faces looks at.
Eigen::Vector2d direction_of(int index) {
    const int face = index / kFaceEntries;
    const double left = 2.0 * (index % kFaceEntries + 0.5) / kFaceEntries - 1.0;
    const double turn = (face - 1) * kPi / 2.0;
    return Pose2d(0.0, 0.0, turn) * Point2(1.0, left);
}

World random_walls(std::mt19937& random) {
    std::uniform_real_distribution<double> anywhere(-9.0, 9.0);
    World world;
    for (int i = 0; i < 40; ++i) {
        const Point2 start(anywhere(random), anywhere(random));
        world.walls.push_back({start, start + Point2(anywhere(random), anywhere(random)) / 3.0});
    }
    return world;
}

Skyline skyline_of(const World& world) {
    HorizonFaces faces;
    faces.entries = kFaceEntries;
    Skyline skyline(faces, 0, HorizonFaces::kFaces * kFaceEntries - 1);
    skyline.clear();
    for (std::size_t i = 0; i < world.walls.size(); ++i) {
        skyline.add_wall(world.walls[i].start, world.walls[i].end, static_cast<int>(i));
    }
    skyline.finish();
    return skyline;
}

TEST(Skyline, IsAsNearAsTheRayCasterSays) {
    std::mt19937 random(5);
    int hits = 0;
    for (int round = 0; round < 10; ++round) {
        const World world = random_walls(random);
        const Skyline skyline = skyline_of(world);
        for (int i = 0; i < skyline.size(); ++i) {
            const Eigen::Vector2d direction = direction_of(i);
            const double range = world.cast_ray(Point2::Zero(), direction);
            const auto at = static_cast<std::size_t>(i);
            ASSERT_NEAR(skyline.walls().nearness[at], std::isinf(range) ? 0.0 : 1.0 / range, 1e-4)
                << "entry " << i << " of round " << round;
            hits += std::isinf(range) ? 0 : 1;
        }
    }
    EXPECT_GT(hits, 10000);
}

TEST(Skyline, LeavesNoGapBetweenWallsThatShareACorner) {
    World world;
    constexpr int kCorners = 97;
    const auto corner = [](int i) {
        const double angle = 2.0 * kPi * i / kCorners;
        return Point2(0.3 + 7.3 * std::cos(angle), -0.2 + 7.3 * std::sin(angle));
    };
    for (int i = 0; i < kCorners; ++i) {
        world.walls.push_back({corner(i), corner(i + 1)});
    }
    const Skyline skyline = skyline_of(world);
    for (int i = 0; i < skyline.size(); ++i) {
        ASSERT_NE(skyline.walls().slot[static_cast<std::size_t>(i)], Skyline::kNone) << i;
    }
}

TEST(Skyline, KnowsHowFarAWallGoesOn) {
    std::mt19937 random(6);
    const Skyline skyline = skyline_of(random_walls(random));
    const std::vector<int>& slots = skyline.walls().slot;
    for (int i = 0; i < skyline.size(); ++i) {
        int end = i;
        while (end + 1 < skyline.size() &&
               slots[static_cast<std::size_t>(end) + 1] == slots[static_cast<std::size_t>(i)]) {
            ++end;
        }
        ASSERT_EQ(skyline.run_end()[static_cast<std::size_t>(i)], end);
        ASSERT_EQ(skyline.next_person()[static_cast<std::size_t>(i)], skyline.size());
    }
}

}  // namespace
}  // namespace hybrid_slam::test
