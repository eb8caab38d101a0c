// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam {

struct LinkClientConfig {
    std::string server;        ///< tcp://host:port
    std::string token;         ///< the server's; empty: none
    std::string name;          ///< shown at the server
    double retry_least = 0.2;  ///< s before the first new attempt, doubled from then on
    double retry_most = 5.0;   ///< s
    double patience = 3.0;     ///< s for the connection and the welcome
    double stale_after = 0.3;  ///< s; a pose that waited longer is not sent
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, LinkClientConfig& config);

enum class LinkState { kConnecting, kConnected, kWaiting };

struct LinkClientReport {
    LinkState state = LinkState::kConnecting;
    std::string trouble;  ///< why it is not connected, or what the server refused last; empty: none
    std::uint64_t connections = 0;       ///< welcomed
    std::uint64_t attempts = 0;          ///< connections tried
    std::uint64_t sent = 0;              ///< messages given to the network
    std::uint64_t poses_replaced = 0;    ///< by a newer one before they could be sent
    std::uint64_t poses_stale = 0;       ///< waited too long and were dropped
    std::uint64_t poses_invalid = 0;     ///< numbers not finite or out of range: not sent
    std::uint64_t refusals = 0;          ///< that the server told
    std::uint64_t received_dropped = 0;  ///< since received() was not called often enough
};

/// One connection to a LinkServer, kept up by a thread of its own. No method waits for the network
/// (the destructor may wait for a name that is being resolved). Methods may be called from any
/// thread.
class LinkClient {
  public:
    /// Throws Error for a bad config; not for a server that does not answer.
    LinkClient(const LinkClientConfig& config, LinkRole role);
    ~LinkClient();
    LinkClient(const LinkClient&) = delete;
    LinkClient& operator=(const LinkClient&) = delete;

    /// Replaces a pose that is not sent yet: the latest wins. Never throws for what is in it: an
    /// invalid pose is counted and takes back the waiting one, so that the vehicle stops.
    void send(const LinkPose& pose);

    /// False when there is no connection now: goals and commands never wait for one. Throws Error
    /// for goals out of range.
    bool send(const LinkGoals& goals);
    bool send(LinkCommand command);
    bool send(const LinkInitialPose& pose);

    /// Waits until connected, at most `timeout` seconds; whether it is.
    bool wait_connected(double timeout);

    /// What the server said since the last call; waits up to `timeout` seconds for a first one.
    std::vector<ServerMessage> received(double timeout = 0.0);

    LinkClientReport report() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
