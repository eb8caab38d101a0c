// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "camera_on_robot.hpp"
#include "sighting.hpp"
#include "support/room.hpp"

/// Features whose true places are known, as a camera without distortion sees them.
namespace hybrid_slam::test {

constexpr double kFocalLength = 500.0;  ///< pixels

inline CameraModel plain_camera() {
    CameraModel model;
    model.fx = model.fy = kFocalLength;
    model.cx = 320.0;
    model.cy = 240.0;
    model.k1 = model.k2 = model.k3 = model.p1 = model.p2 = 0.0;
    return model;
}

inline Eigen::Isometry3d in_space(const Pose2d& pose) {
    Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
    isometry.translation().head<2>() = pose.translation;
    isometry.rotate(Eigen::AngleAxisd(pose.heading, Eigen::Vector3d::UnitZ()));
    return isometry;
}

inline Eigen::Vector2d anywhere_in_image(Rng& rng) {
    return {uniform(rng, -320.0, 320.0) / kFocalLength, uniform(rng, -240.0, 240.0) / kFocalLength};
}

/// By the camera's pose in space alone: where what was seen at `before` shows after the motion.
inline Eigen::Vector3d in_camera_now(const CameraMounting& mounting, const Eigen::Vector2d& before,
                                     double inverse_depth, const Pose2d& before_from_now) {
    const Eigen::Isometry3d robot_from_camera = mounting.robot_from_camera();
    return (in_space(before_from_now) * robot_from_camera).inverse() * robot_from_camera *
           (before.homogeneous() / inverse_depth);
}

enum class Kind { kFloor, kWall, kUnknown };

/// Sightings of a scene by a camera that is truly mounted as `mounting` says.
class Scene {
  public:
    Scene(const CameraMounting& mounting, const Pose2d& motion, unsigned seed)
        : mounting_(mounting), camera_(plain_camera(), mounting), motion_(motion), rng_(seed) {}

    double noise = 0.0;  ///< pixels
    Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
    double pallet = 0.0;  ///< metres above the floor of what counts as floor

    void add(Kind kind, int count, double claimed_sigma = 0.25) {
        for (int added = 0; added < count;) {
            added += add_one(kind, kFocalLength / claimed_sigma) ? 1 : 0;
        }
    }

    std::vector<Sighting> sightings;

  private:
    bool add_one(Kind kind, double weight) {
        Sighting sighting;
        sighting.before = anywhere_in_image(rng_);
        const Eigen::Vector3d direction = camera_.direction(sighting.before);
        double inverse_depth = uniform(rng_, 0.05, 0.5);
        if (kind == Kind::kFloor) {
            inverse_depth = camera_.floor_inverse_depth(direction);
            sighting.floor = true;
            sighting.belief = {inverse_depth, 1e-3 * inverse_depth};
            inverse_depth *= mounting_.z / (mounting_.z - pallet);
        } else if (kind == Kind::kWall) {
            sighting.belief = {inverse_depth, 0.01 * inverse_depth};
        } else {
            sighting.belief = {0.1, 5.0};
        }
        if (noise > 0.0 && kind != Kind::kUnknown) {
            inverse_depth += gauss(rng_, sighting.belief.sigma);
        }
        if (inverse_depth < 0.05) {
            return false;
        }
        const Eigen::Vector3d now =
            Eigen::AngleAxisd(tilt.x(), Eigen::Vector3d::UnitX()) *
            (Eigen::AngleAxisd(tilt.y(), Eigen::Vector3d::UnitZ()) *
             in_camera_now(mounting_, sighting.before, inverse_depth, motion_));
        if (now.z() < 0.1) {
            return false;
        }
        sighting.now = now.hnormalized();
        if (noise > 0.0) {
            sighting.now += Eigen::Vector2d(gauss(rng_, noise), gauss(rng_, noise)) / kFocalLength;
        }
        sighting.information = weight * weight * Eigen::Matrix2d::Identity();
        sightings.push_back(sighting);
        return true;
    }

    CameraMounting mounting_;
    CameraOnRobot camera_;
    Pose2d motion_;
    Rng rng_;
};

}  // namespace hybrid_slam::test
