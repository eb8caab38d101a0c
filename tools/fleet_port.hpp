// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "hybrid_slam/pilot/pilot.hpp"
#ifdef HYBRID_SLAM_HAS_FLEET
#include "hybrid_slam/fleet/fleet_client.hpp"
#endif

namespace hybrid_slam::tools {

#ifndef HYBRID_SLAM_HAS_FLEET
/// Without the MQTT client: says so when a broker is asked for.
struct FleetConfig {
    std::string broker;
};
void describe(ConfigSchema& schema, FleetConfig& config);
#endif

/// The master control of a fleet as one more goal client of the pilot.
class FleetPort {
  public:
    /// No client of a LinkServer has this number.
    static constexpr std::uint64_t kClient = ~std::uint64_t{0};

    /// Throws Error for a bad config, and for a broker when this program knows no MQTT.
    FleetPort(const FleetConfig& config, const VehicleConfig& vehicle, const PilotConfig& pilot,
              const std::string& name);
    ~FleetPort();
    FleetPort(const FleetPort&) = delete;
    FleetPort& operator=(const FleetPort&) = delete;

    /// What it wants since the last call; says in messages when the broker comes or goes.
    std::vector<LinkEvent> events(double now);
    void refuse(const std::string& reason);

    struct Facts {
        const LinkStatus& drive;
        std::optional<LinkPose> pose;   ///< the newest
        std::optional<double> battery;  ///< share of full
    };
    void publish(const Facts& facts);

  private:
    struct State;
    std::unique_ptr<State> state_;
    std::optional<double> looked_at_;  ///< seconds, by the last call of events
};

}  // namespace hybrid_slam::tools
