// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid_slam/fleet/fleet_config.hpp"
#include "hybrid_slam/fleet/fleet_messages.hpp"

namespace hybrid_slam {

/// One MQTT message to be published.
struct FleetMessage {
    std::string topic;
    std::string payload;
    int qos = 0;
    bool is_retained = false;
};

struct FleetCounts {
    std::uint64_t orders = 0;  ///< new ones and updates that were taken
    std::uint64_t orders_refused = 0;
    std::uint64_t orders_repeated = 0;  ///< the one that is there already: ignored
    std::uint64_t actions = 0;          ///< instant actions that were understood
    std::uint64_t actions_refused = 0;  ///< and messages of them that could not be read
};

/// The vehicle's side of VDA 5050 2.1 without a network: texts in, texts and events out. What a
/// master control sends never makes it throw. Seconds `now` are of any one steady clock.
class FleetProtocol {
  public:
    /// Of the timestamps.
    using WallClock = std::function<std::chrono::system_clock::time_point()>;

    /// Throws Error for a bad config.
    FleetProtocol(const FleetConfig& config, const FleetVehicle& vehicle,
                  WallClock clock = std::chrono::system_clock::now);
    ~FleetProtocol();
    FleetProtocol(const FleetProtocol&) = delete;
    FleetProtocol& operator=(const FleetProtocol&) = delete;

    std::string topic(std::string_view name) const;

    void take_order(std::string_view text, double now);
    void take_instant_actions(std::string_view text, double now);

    /// What the drive does now: the order's progress and the running actions follow from it.
    void update(const FleetStatus& status, double now);

    /// The drive could not take the goals of the last event: the order is over.
    void refuse(const std::string& reason);

    /// What the drive is to do, in order, since the last call.
    std::vector<FleetEvent> events();

    /// The connection's messages; each call counts as one sent.
    FleetMessage will();
    FleetMessage online();
    FleetMessage offline();

    /// A connection is new: state and factsheet are due at once.
    void announce();

    /// What is to be published now.
    std::vector<FleetMessage> due(double now);

    const FleetCounts& counts() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
