// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/corridor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hybrid_slam {
namespace {

constexpr double kStep = 0.001;  ///< metres

/// Drives on in small steps until a point is inside.
double slow_free_way(const VehicleConfig& vehicle, const Corridor& corridor,
                     const Points& obstacles) {
    const double side = vehicle.footprint_width / 2.0 + corridor.margin;
    const double curvature = std::tan(corridor.steering) / vehicle.wheelbase;
    for (double way = 0.0; way < corridor.most; way += kStep) {
        const double signed_way = corridor.direction * way;
        const Pose2d then = Pose2d::exp({signed_way, 0.0, signed_way * curvature});
        for (const Point2& point : obstacles) {
            const Point2 seen = then.inverse() * point;
            if (seen.x() >= -vehicle.footprint_rear && seen.x() <= vehicle.footprint_front &&
                std::abs(seen.y()) <= side) {
                return way;
            }
        }
    }
    return corridor.most;
}

TEST(Corridor, AgreesWithDrivingOn) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> place(-5.0, 5.0);
    std::uniform_real_distribution<double> angle(-radians(75.0), radians(75.0));
    int met = 0;
    for (int i = 0; i < 1000; ++i) {
        VehicleConfig vehicle;
        vehicle.wheelbase = i % 3 == 0 ? -1.4 : 1.2;
        Corridor corridor;
        corridor.steering = i % 7 == 0 ? 0.0 : angle(random);
        corridor.direction = i % 2 == 0 ? 1 : -1;
        corridor.most = 4.0;
        const Points obstacles = {{place(random), place(random)}, {place(random), place(random)}};
        const double expected = slow_free_way(vehicle, corridor, obstacles);
        const double found = free_way(vehicle, corridor, obstacles);
        // A point may clip a corner between two steps.
        if (expected - found > 2.0 * kStep) {
            Corridor inside = corridor;
            inside.margin -= 0.002;
            EXPECT_GT(free_way(vehicle, inside, obstacles), found) << i;
        } else {
            EXPECT_NEAR(found, expected, 2.0 * kStep) << i;
        }
        met += expected > 0.0 && expected < corridor.most ? 1 : 0;
    }
    EXPECT_GT(met, 80) << "else this shows little";
}

TEST(Corridor, StraightAheadAndBehind) {
    const VehicleConfig vehicle;  // reaches 1.5 m ahead, 1.1 m behind, 0.45 m to each side
    const Points obstacles = {{3.0, 0.2}, {-2.0, -0.49}, {0.0, 0.6}};
    Corridor corridor;
    EXPECT_DOUBLE_EQ(free_way(vehicle, corridor, obstacles), 1.5);
    corridor.direction = -1;
    EXPECT_DOUBLE_EQ(free_way(vehicle, corridor, obstacles), 0.9);
    corridor.margin = 0.0;
    EXPECT_DOUBLE_EQ(free_way(vehicle, corridor, obstacles), corridor.most);
}

TEST(Corridor, NothingIsFreeAroundWhatIsInside) {
    for (const double steering : {0.0, 0.5, -1.2}) {
        for (const int direction : {1, -1}) {
            Corridor corridor;
            corridor.steering = steering;
            corridor.direction = direction;
            EXPECT_EQ(free_way(VehicleConfig(), corridor, {{0.3, 0.1}}), 0.0);
            EXPECT_EQ(free_way(VehicleConfig(), corridor, {}), corridor.most);
        }
    }
}

/// What stands beside the vehicle is met by its tail when it turns sharply.
TEST(Corridor, TheTailSwingsOut) {
    Corridor corridor;
    corridor.steering = radians(75.0);
    const Points beside = {{-1.0, -0.6}};
    EXPECT_LT(free_way(VehicleConfig(), corridor, beside), 0.6);
    corridor.steering = 0.0;
    EXPECT_EQ(free_way(VehicleConfig(), corridor, beside), corridor.most);
}

}  // namespace
}  // namespace hybrid_slam
