// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/simulator/camera_moment.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "motion.hpp"
#include "noise.hpp"

namespace hybrid_slam {

/// When the camera of a simulated drive takes its images and what it is before then.
class SimulatedCamera {
  public:
    SimulatedCamera(const World& world, const Motion& motion, const CameraConfig& camera,
                    const SimulatedDriveConfig& config);

    double next_stamp() const;  ///< seconds, the middle of the next image's exposure
    double arrival() const { return arrival_; }  ///< seconds, of the next image

    CameraMoment next();

  private:
    void draw_arrival();

    const World& world_;
    const Motion& motion_;
    CameraConfig camera_;
    double jitter_;
    Noise bus_noise_;
    std::uint64_t images_ = 0;
    double arrival_ = 0.0;
};

}  // namespace hybrid_slam
