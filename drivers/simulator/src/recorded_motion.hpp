// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "hybrid_slam/vehicle/forklift.hpp"
#include "motion.hpp"

namespace hybrid_slam {

/// The last seconds of a vehicle that nobody knows the future of.
class RecordedMotion final : public Motion {
  public:
    static constexpr double kKept = 2.0;  ///< seconds

    explicit RecordedMotion(const VehicleConfig& vehicle) : vehicle_(vehicle) {}

    /// Times must increase.
    void record(double time, const VehicleState& state);
    double newest() const { return states_.back().time; }

    /// Between two records along an arc: exact for constant speed and steering. Clamped to what is
    /// kept, of which there must be something.
    Pose2d world_from_robot(double time) const override;
    Eigen::Vector3d twist(double time) const override;

  private:
    struct Record {
        double time = 0.0;
        VehicleState state;
    };
    std::size_t leg_at(double time) const;
    double share(std::size_t leg, double time) const;

    VehicleConfig vehicle_;
    std::deque<Record> states_;
};

}  // namespace hybrid_slam
