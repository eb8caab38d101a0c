// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/scan_filter.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Lets everything through.
ScanFilterConfig open_filter() {
    ScanFilterConfig config;
    config.range_min = 0.0;
    config.range_max = 1000.0;
    config.spacing = 0.0;
    return config;
}

Scan scan_of(std::vector<float> ranges) {
    Scan scan;
    scan.ranges = std::move(ranges);
    scan.angle_increment = radians(1.0);
    scan.range_min = 0.1;
    scan.range_max = 50.0;
    return scan;
}

std::vector<double> ranges_kept(const Scan& scan, const ScanFilterConfig& config) {
    std::vector<double> kept;
    for (const Point2& point : to_surface(scan, config).points) {
        kept.push_back(std::round(1000.0 * point.norm()) / 1000.0);
    }
    return kept;
}

TEST(ScanFilter, DropsWhatIsNoReturn) {
    const Scan scan =
        scan_of({kNan, 1.0F, kInf, 2.0F, -kInf, -1.0F, 0.0F, 0.05F, 50.0F, 51.0F, 3.0F});
    EXPECT_EQ(ranges_kept(scan, open_filter()), (std::vector<double>{1.0, 2.0, 3.0}));
}

TEST(ScanFilter, DropsWhatIsBeyondItsOwnLimits) {
    ScanFilterConfig config = open_filter();
    config.range_min = 0.5;
    config.range_max = 10.0;
    const Scan scan = scan_of({0.2F, 0.49F, 0.5F, 5.0F, 9.99F, 10.0F, 20.0F});
    EXPECT_EQ(ranges_kept(scan, config), (std::vector<double>{0.5, 5.0, 9.99}));
}

TEST(ScanFilter, NeverOpensTheLimitsOfTheScan) {
    ScanFilterConfig config = open_filter();
    config.range_max = 1000.0;
    EXPECT_EQ(ranges_kept(scan_of({0.05F, 60.0F}), config), std::vector<double>{});
}

TEST(ScanFilter, AnEmptyScanIsAnEmptySurface) {
    EXPECT_EQ(to_surface(scan_of({}), {}).size(), 0U);
    EXPECT_EQ(to_surface(blind_scan(), {}).size(), 0U);
}

TEST(ScanFilter, PutsPointsIntoTheRobotsFrame) {
    const World world = irregular_room();
    const Pose2d world_from_robot(0.4, -0.3, 0.7);
    Lidar lidar;
    lidar.robot_from_laser = Pose2d(0.8, -0.2, 2.5);
    const Surface surface = to_surface(scan_at(world, world_from_robot, lidar), open_filter());
    ASSERT_EQ(surface.size(), 360U);
    ASSERT_EQ(surface.normals.size(), 360U);
    std::size_t oriented_points = 0;
    for (std::size_t i = 0; i < surface.size(); ++i) {
        ASSERT_LT(distance_to(world, world_from_robot * surface.points[i]), 1e-5);
        const Point2 to_laser = lidar.robot_from_laser.translation - surface.points[i];
        ASSERT_GE(surface.normals[i].dot(to_laser), 0.0) << "normals face the laser";
        oriented_points += surface.normals[i].isZero(0.0) ? 0U : 1U;
    }
    EXPECT_GT(oriented_points, 300U);
}

TEST(ScanFilter, ThinsNeighboursOutButKeepsTheNormalsOfAllPoints) {
    World world;
    world.walls.push_back({{1.0, -50.0}, {1.0, 50.0}});
    Lidar fine;
    fine.beams = 3600;
    ScanFilterConfig config = open_filter();
    const Scan scan = scan_at(world, {}, fine);
    const Surface all = to_surface(scan, config);
    config.spacing = 0.05;
    const Surface thin = to_surface(scan, config);
    EXPECT_LT(thin.size(), all.size() / 2);
    for (std::size_t i = 1; i < thin.size(); ++i) {
        EXPECT_GE((thin.points[i] - thin.points[i - 1]).norm(), 0.05);
    }
    // Every point is kept or near one that was, and none was made up.
    for (std::size_t i = 0; i < all.size(); ++i) {
        const auto near = [&](const Point2& kept) { return (kept - all.points[i]).norm() < 0.05; };
        ASSERT_TRUE(std::any_of(thin.points.begin(), thin.points.end(), near));
    }
    for (std::size_t i = 0; i < thin.size(); ++i) {
        const auto original = std::find(all.points.begin(), all.points.end(), thin.points[i]);
        ASSERT_NE(original, all.points.end());
        EXPECT_EQ(thin.normals[i],
                  all.normals[static_cast<std::size_t>(original - all.points.begin())]);
    }
}

// A sweep of 80 ms while driving fast through a curve: 10 cm and 7 degrees from first to last beam.
struct Sweep {
    World world = irregular_room();
    Pose2d world_from_robot{-0.4, 0.2, 1.0};
    Eigen::Vector3d twist{1.2, 0.1, 1.5};
    Lidar lidar;
    Scan scan;

    Sweep() {
        lidar.time_increment = 0.08 / 360;
        lidar.robot_from_laser = Pose2d(0.5, 0.1, -0.3);
        Rng unused;
        scan = scan_at(world, world_from_robot, lidar, unused, twist);
    }
    double worst_distance(const Eigen::Vector3d& assumed_twist) const {
        double worst = 0.0;
        for (const Point2& point : to_surface(scan, open_filter(), assumed_twist).points) {
            worst = std::max(worst, distance_to(world, world_from_robot * point));
        }
        return worst;
    }
};

TEST(ScanFilter, DeskewPutsEveryPointOfAMovingSweepOntoTheWalls) {
    const Sweep sweep;
    EXPECT_LT(sweep.worst_distance(sweep.twist), 1e-5);
    EXPECT_GT(sweep.worst_distance(Eigen::Vector3d::Zero()), 0.05) << "it mattered";
    EXPECT_GT(sweep.worst_distance(-sweep.twist), 0.1) << "its sign too";
}

TEST(ScanFilter, DoesNotDeskewWithoutTheTimesOfTheBeams) {
    Sweep sweep;
    sweep.scan.time_increment = 0.0;
    EXPECT_EQ(to_surface(sweep.scan, open_filter(), sweep.twist).points,
              to_surface(sweep.scan, open_filter()).points);
}

TEST(ScanFilter, DeskewsASweepThatRunsBackwardsInTime) {
    // The first beam is then the latest: its stamp is the stamp of the scan, the others are older.
    Sweep sweep;
    sweep.lidar.time_increment = -0.08 / 360;
    Rng unused;
    sweep.scan = scan_at(sweep.world, sweep.world_from_robot, sweep.lidar, unused, sweep.twist);
    EXPECT_LT(sweep.worst_distance(sweep.twist), 1e-5);
}

}  // namespace
}  // namespace hybrid_slam::test
