// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/camera_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hybrid_slam::test {
namespace {

TEST(CameraModel, WithoutDistortionIsAPinhole) {
    CameraModel model;
    model.k1 = model.k2 = model.p1 = model.p2 = model.k3 = 0.0;
    const auto pixel = model.project({0.2, -0.1, 2.0});
    ASSERT_TRUE(pixel);
    EXPECT_DOUBLE_EQ(pixel->x(), model.fx * 0.1 + model.cx);
    EXPECT_DOUBLE_EQ(pixel->y(), model.fy * -0.05 + model.cy);
}

TEST(CameraModel, SeesNothingBehindItself) {
    const CameraModel model;
    EXPECT_FALSE(model.project({0.0, 0.0, 0.0}));
    EXPECT_FALSE(model.project({0.1, 0.1, -1.0}));
}

/// Values of Brown's formula, worked out by hand: x = 0.3, y = -0.2, r2 = 0.13.
TEST(CameraModel, DistortsByBrownsFormula) {
    CameraModel model;
    model.fx = model.fy = 1.0;
    model.cx = model.cy = 0.0;
    model.k1 = 0.1;
    model.k2 = 0.2;
    model.k3 = 0.3;
    model.p1 = 0.01;
    model.p2 = 0.02;
    const double radial = 1.0 + 0.1 * 0.13 + 0.2 * 0.0169 + 0.3 * 0.002197;
    const auto pixel = model.project({0.3, -0.2, 1.0});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), 0.3 * radial + 2 * 0.01 * -0.06 + 0.02 * (0.13 + 0.18), 1e-15);
    EXPECT_NEAR(pixel->y(), -0.2 * radial + 0.01 * (0.13 + 0.08) + 2 * 0.02 * -0.06, 1e-15);
}

TEST(CameraModel, RayInvertsProjectOverTheWholeImage) {
    CameraModel wide;
    wide.fx = wide.fy = 420.0;
    wide.k1 = -0.28;
    wide.k2 = 0.07;
    for (const CameraModel& model : {CameraModel(), wide}) {
        for (double v = 0.0; v < model.height; v += 15.5) {
            for (double u = 0.0; u < model.width; u += 15.5) {
                const auto ray = model.ray({u, v});
                ASSERT_TRUE(ray) << u << " " << v;
                EXPECT_EQ(ray->z(), 1.0);
                const auto pixel = model.project(3.7 * *ray);
                ASSERT_TRUE(pixel);
                EXPECT_LT((*pixel - Pixel(u, v)).norm(), 1e-8);
            }
        }
    }
}

TEST(CameraModel, HasNoRayBeyondTheFoldOfItsDistortion) {
    CameraModel barrel;
    barrel.k1 = -0.5;
    barrel.k2 = 0.0;
    EXPECT_FALSE(barrel.ray({20000.0, 0.0}));
}

TEST(CameraMounting, LevelCameraLooksAhead) {
    CameraMounting mounting;
    mounting.x = 1.0;
    mounting.y = 0.5;
    mounting.z = 2.0;
    mounting.pitch = 0.0;
    const Eigen::Isometry3d pose = mounting.robot_from_camera();
    EXPECT_LT((pose * Eigen::Vector3d(0, 0, 3) - Eigen::Vector3d(4, 0.5, 2)).norm(), 1e-12);
    EXPECT_LT((pose * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, -0.5, 2)).norm(), 1e-12);
    EXPECT_LT((pose * Eigen::Vector3d(0, 1, 0) - Eigen::Vector3d(1, 0.5, 1)).norm(), 1e-12);
}

TEST(CameraMounting, AnglesTurnAsTheyAreNamed) {
    CameraMounting mounting;
    mounting.pitch = 0.0;
    const auto axis = [&mounting](const Eigen::Vector3d& in_camera) {
        return Eigen::Vector3d(mounting.robot_from_camera().linear() * in_camera);
    };
    mounting.yaw = 0.1;
    EXPECT_GT(axis({0, 0, 1}).y(), 0.0) << "to the left";
    mounting.yaw = 0.0;
    mounting.pitch = 0.1;
    EXPECT_LT(axis({0, 0, 1}).z(), 0.0) << "looking down";
    mounting.pitch = 0.0;
    mounting.roll = 0.1;
    EXPECT_LT(axis({1, 0, 0}).z(), 0.0) << "clockwise: its right side sinks";
}

/// A pitched camera at height h sees the floor under its axis at h / tan(pitch).
TEST(CameraMounting, OpticalAxisMeetsTheFloorWhereItShould) {
    CameraMounting mounting;
    mounting.x = 0.0;
    mounting.z = 1.2;
    mounting.pitch = radians(20.0);
    const CameraModel model;
    const Eigen::Isometry3d camera_from_robot = mounting.robot_from_camera().inverse();
    const auto pixel =
        model.project(camera_from_robot * Eigen::Vector3d(1.2 / std::tan(radians(20.0)), 0, 0));
    ASSERT_TRUE(pixel);
    EXPECT_LT((*pixel - Pixel(model.cx, model.cy)).norm(), 1e-9);
}

}  // namespace
}  // namespace hybrid_slam::test
