// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "hybrid_slam/core/source.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "hybrid_slam/sensors/sensor_event.hpp"

namespace hybrid_slam {

struct SensorCounts {
    LidarCounts lidar;
    std::uint64_t images = 0;      ///< delivered
    std::uint64_t bad_images = 0;  ///< that could not be decoded
};

/// Measurements from sensor events: the one way from bytes to scans and images, live and on replay.
class SensorSource : public Source {
  public:
    enum class Images { kSkip, kGray, kColor };

    /// `stream` must outlive the source.
    SensorSource(SensorStream& stream, const RobotConfig& robot, Images images = Images::kSkip);
    ~SensorSource() override;

    std::optional<Measurement> next() override;
    double progress() const override;
    const SensorCounts& counts() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
