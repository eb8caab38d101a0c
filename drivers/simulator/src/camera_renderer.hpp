// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/simulator/render_config.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam {

/// What the faults of a moment leave of the light.
struct CameraLight {
    double lamps = 1.0;    ///< share of what the lamps give
    bool covered = false;  ///< the lens: nearly black then, whatever is before it
};

/// By the faults of the config, `time` seconds after the start of the drive.
CameraLight camera_light_at(const RenderConfig& config, double time);

/// A webcam in a world: a textured floor at z = 0, walls and posts from there to wall_height, a
/// roof with lamps above. Not for use from several threads at once.
class CameraRenderer {
  public:
    /// Everything random follows from the seed. Throws Error for a camera that is not below the
    /// walls' upper edge or whose distortion cannot be inverted, and for a config out of range.
    CameraRenderer(const World& world, const CameraModel& model, const CameraMounting& mounting,
                   const RenderConfig& config, std::uint64_t seed);
    ~CameraRenderer();
    CameraRenderer(CameraRenderer&&) noexcept;
    CameraRenderer& operator=(CameraRenderer&&) noexcept;

    /// One image (BGR, stamp 0) from the robot's pose at the middle of the exposure, smeared by
    /// its motion (twist: m/s, m/s, rad/s in the robot's frame). `people` are circles that stand
    /// there at that moment. `frame` is the image's number: its noise depends on it and the seed
    /// alone.
    Image render(const Pose2d& world_from_robot, const Eigen::Vector3d& twist,
                 const std::vector<Circle>& people, std::uint64_t frame,
                 const CameraLight& camera_light = {});

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
