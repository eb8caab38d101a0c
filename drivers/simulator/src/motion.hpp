// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// Where the robot truly is at each time: all that its sensors need to know of its drive.
class Motion {
  public:
    virtual Pose2d world_from_robot(double time) const = 0;
    virtual Eigen::Vector3d twist(double time) const = 0;  ///< (m/s, m/s, rad/s), robot's frame

  protected:
    Motion() = default;
    Motion(const Motion&) = default;
    Motion& operator=(const Motion&) = default;
    ~Motion() = default;  // nobody owns one by this name
};

}  // namespace hybrid_slam
