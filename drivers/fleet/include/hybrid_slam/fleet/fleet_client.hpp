// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hybrid_slam/fleet/fleet_config.hpp"
#include "hybrid_slam/fleet/fleet_messages.hpp"
#include "hybrid_slam/fleet/fleet_protocol.hpp"

namespace hybrid_slam {

struct FleetReport {
    bool is_connected = false;
    std::string trouble;            ///< why it is not connected; empty: it is, or not yet tried
    std::uint64_t attempts = 0;     ///< connections tried
    std::uint64_t connections = 0;  ///< that came about
    std::uint64_t published = 0;    ///< messages given to the network
    std::uint64_t received = 0;     ///< orders and instant actions
    std::uint64_t dropped = 0;      ///< received, but too many waited
    FleetCounts counts;
};

/// The vehicle at an MQTT broker, kept up by a thread of its own: a broker that is gone is tried
/// again for ever, and the order goes on without it. No method waits for the network but the
/// destructor, which says good-bye (OFFLINE) within some 2 s. Methods may be called from any
/// thread.
class FleetClient {
  public:
    /// Throws Error for a bad config; not for a broker that does not answer.
    FleetClient(const FleetConfig& config, const FleetVehicle& vehicle);
    ~FleetClient();
    FleetClient(const FleetClient&) = delete;
    FleetClient& operator=(const FleetClient&) = delete;

    /// What the master control wants since the last call, in order. None is ever dropped.
    std::vector<FleetEvent> events();

    /// What the drive does, once in each of its cycles; the latest counts.
    void publish(const FleetStatus& status);

    /// The drive could not take the goals of the last event: the order is over, with this reason.
    void refuse(const std::string& reason);

    FleetReport report() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
