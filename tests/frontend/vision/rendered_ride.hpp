// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "camera_renderer.hpp"
#include "hybrid_slam/vision/visual_odometry.hpp"
#include "support/room.hpp"

/// Images that a camera takes on its way through a room.
namespace hybrid_slam::test {

constexpr double kImageInterval = 1.0 / 30.0;  ///< seconds

struct Ride {
    Trajectory truth;
    std::vector<Image> images;

    Pose2d moved() const { return between(truth.front().pose, truth.back().pose); }
    Pose2d step(std::size_t i) const { return between(truth[i - 1].pose, truth[i].pose); }
};

/// Along one arc: `twist` in m/s, m/s, rad/s.
inline Ride ride(const World& world, const CameraMounting& mounting, const Pose2d& start,
                 const Eigen::Vector3d& twist, int images) {
    CameraRenderer renderer(world, CameraModel(), mounting, {}, 5);
    Ride ride;
    for (int i = 0; i < images; ++i) {
        const double stamp = kImageInterval * i;
        const Pose2d pose = start * Pose2d::exp(stamp * twist);
        ride.truth.push_back({stamp, pose});
        ride.images.push_back(renderer.render(pose, twist, {}, static_cast<std::uint64_t>(i)));
        ride.images.back().stamp = stamp;
    }
    return ride;
}

inline std::vector<VisualMotion> track_all(VisualOdometry& odometry, const Ride& ride) {
    std::vector<VisualMotion> motions;
    for (const Image& image : ride.images) {
        motions.push_back(odometry.track(image));
    }
    return motions;
}

/// The way of all motions together.
inline Pose2d sum_of(const std::vector<VisualMotion>& motions) {
    Pose2d first_from_now;
    for (const VisualMotion& motion : motions) {
        first_from_now = first_from_now * motion.before_from_now;
    }
    return first_from_now;
}

}  // namespace hybrid_slam::test
