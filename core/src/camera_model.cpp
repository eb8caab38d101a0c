// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/camera_model.hpp"

#include <cmath>

namespace hybrid_slam {
namespace {

using Point = Eigen::Vector2d;  ///< on the plane z = 1

Point distorted(const CameraModel& model, const Point& point) {
    const double x = point.x();
    const double y = point.y();
    const double r2 = point.squaredNorm();
    const double radial = 1.0 + r2 * (model.k1 + r2 * (model.k2 + r2 * model.k3));
    return {x * radial + 2.0 * model.p1 * x * y + model.p2 * (r2 + 2.0 * x * x),
            y * radial + model.p1 * (r2 + 2.0 * y * y) + 2.0 * model.p2 * x * y};
}

Eigen::Matrix2d derivative_of_distorted(const CameraModel& model, const Point& point) {
    const double x = point.x();
    const double y = point.y();
    const double r2 = point.squaredNorm();
    const double radial = 1.0 + r2 * (model.k1 + r2 * (model.k2 + r2 * model.k3));
    // Of the radial factor by r2, times the 2 of r2 = x^2 + y^2.
    const double slope = 2.0 * (model.k1 + r2 * (2.0 * model.k2 + r2 * 3.0 * model.k3));
    Eigen::Matrix2d derivative;
    derivative(0, 0) = radial + slope * x * x + 2.0 * model.p1 * y + 6.0 * model.p2 * x;
    derivative(0, 1) = slope * x * y + 2.0 * model.p1 * x + 2.0 * model.p2 * y;
    derivative(1, 0) = derivative(0, 1);
    derivative(1, 1) = radial + slope * y * y + 6.0 * model.p1 * y + 2.0 * model.p2 * x;
    return derivative;
}

}  // namespace

std::optional<Pixel> CameraModel::project(const Eigen::Vector3d& point_in_camera) const {
    if (!(point_in_camera.z() > 0.0)) {
        return std::nullopt;
    }
    const Point point = distorted(*this, point_in_camera.hnormalized());
    return Pixel(fx * point.x() + cx, fy * point.y() + cy);
}

std::optional<Eigen::Vector3d> CameraModel::ray(const Pixel& pixel) const {
    constexpr int kMostIterations = 20;
    constexpr double kTolerance = 1e-12;
    const Point wanted((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
    Point point = wanted;
    for (int i = 0; i < kMostIterations; ++i) {
        const Eigen::Matrix2d derivative = derivative_of_distorted(*this, point);
        // Beyond the fold the distortion maps two points onto one pixel.
        if (!(derivative.determinant() > 1e-3)) {
            return std::nullopt;
        }
        const Point step = derivative.inverse() * (wanted - distorted(*this, point));
        point += step;
        if (step.squaredNorm() < kTolerance * kTolerance) {
            return Eigen::Vector3d(point.x(), point.y(), 1.0);
        }
    }
    return std::nullopt;
}

void describe(ConfigSchema& schema, CameraModel& model) {
    schema.add("width", model.width, 16, 8192, "pixels");
    schema.add("height", model.height, 16, 8192, "pixels");
    schema.add("fx", model.fx, 1.0, 1e5, "pixels, focal length across");
    schema.add("fy", model.fy, 1.0, 1e5, "pixels, focal length down");
    schema.add("cx", model.cx, -1e4, 1e4, "pixels, of the optical axis from the left");
    schema.add("cy", model.cy, -1e4, 1e4, "pixels, of the optical axis from the top");
    schema.add("k1", model.k1, -10.0, 10.0, "radial distortion");
    schema.add("k2", model.k2, -100.0, 100.0, "radial distortion");
    schema.add("p1", model.p1, -1.0, 1.0, "tangential distortion");
    schema.add("p2", model.p2, -1.0, 1.0, "tangential distortion");
    schema.add("k3", model.k3, -1000.0, 1000.0, "radial distortion");
}

/// The axes of a level camera in the robot: right is -y, down is -z, forward is x.
Eigen::Isometry3d CameraMounting::robot_from_camera() const {
    Eigen::Matrix3d level;
    level << 0.0, 0.0, 1.0,  //
        -1.0, 0.0, 0.0,      //
        0.0, -1.0, 0.0;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(x, y, z);
    pose.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                        .toRotationMatrix() *
                    level;
    return pose;
}

void describe(ConfigSchema& schema, CameraMounting& mounting) {
    schema.add("x", mounting.x, -20.0, 20.0, "m, ahead of the robot's origin");
    schema.add("y", mounting.y, -20.0, 20.0, "m, to the left of it");
    schema.add("z", mounting.z, 0.01, 20.0, "m above the floor");
    schema.add_degrees("yaw_deg", mounting.yaw, -180.0, 180.0, "deg, turned to the left");
    schema.add_degrees("pitch_deg", mounting.pitch, -90.0, 90.0, "deg, looking down");
    schema.add_degrees("roll_deg", mounting.roll, -180.0, 180.0, "deg, tilted clockwise");
}

}  // namespace hybrid_slam
