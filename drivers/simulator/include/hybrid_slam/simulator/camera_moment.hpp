// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "hybrid_slam/camera/camera_config.hpp"
#include "hybrid_slam/camera/image_codec.hpp"
#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam {

struct SimulatedDriveConfig;

/// All that an image depends on, to be rendered by whoever has the time.
struct CameraMoment {
    std::uint64_t number = 0;  ///< of the image, from 0
    double stamp = 0.0;        ///< seconds, the middle of the exposure
    double arrival = 0.0;      ///< seconds, when the computer gets it
    Pose2d world_from_robot;
    Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< (m/s, m/s, rad/s), robot's frame
    std::vector<Circle> people;
};

/// Makes the images of a simulated camera. For one thread.
class MomentRenderer {
  public:
    /// Throws Error as SimulatedVehicle does.
    MomentRenderer(const World& world, const CameraConfig& camera,
                   const SimulatedDriveConfig& config);
    ~MomentRenderer();
    MomentRenderer(const MomentRenderer&) = delete;
    MomentRenderer& operator=(const MomentRenderer&) = delete;

    EncodedImage render(const CameraMoment& moment);  ///< JPEG

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
