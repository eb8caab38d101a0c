// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "hybrid_slam/fleet/fleet_config.hpp"
#include "hybrid_slam/fleet/fleet_protocol.hpp"

namespace hybrid_slam {

/// One MQTT client that is connected again and again. None of its methods waits for the network but
/// `close`, none throws. Of one thread, but for `received`, which is called by paho's.
class MqttConnection {
  public:
    using Received = std::function<void(const std::string& topic, std::string_view payload)>;

    /// Throws Error for a broker's name that paho does not take.
    MqttConnection(const FleetConfig& config, Received received);
    ~MqttConnection();
    MqttConnection(const MqttConnection&) = delete;
    MqttConnection& operator=(const MqttConnection&) = delete;

    enum class State { kIdle, kConnecting, kConnected };

    /// Begins an attempt; the broker publishes `will` when it misses us.
    void connect(const FleetMessage& will);
    State state();
    void subscribe(const std::string& topic);
    /// False when it could not be given to the network.
    bool publish(const FleetMessage& message);
    /// Gives the last message and the good-bye a second each.
    void close(const FleetMessage& last);

    const std::string& trouble() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
