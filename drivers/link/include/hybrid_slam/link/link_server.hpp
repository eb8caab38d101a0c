// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/io/endpoint.hpp"
#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam {

struct LinkServerConfig {
    std::string listen = ":5000";  ///< without a host only this computer can connect; 0.0.0.0: all
    std::string token;             ///< that clients must show; empty: none
    int most_clients = 16;         ///< a watcher goes when one that does more comes
    int line_bytes = 32768;        ///< of the longest line
    int lines_per_second = 200;    ///< of one client; as many may come at once
    int refusals = 10;  ///< lines refused before a client is closed; a good line takes one back
    double hello_timeout = 5.0;  ///< s that a connection may be silent at first
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, LinkServerConfig& config);

struct LinkConnected {
    std::string name;
};
struct LinkDisconnected {
    std::string reason;
};

struct LinkEvent {
    std::uint64_t client = 0;  ///< counts from 1, never used again
    LinkRole role = LinkRole::kWatch;
    double arrival = 0.0;  ///< s of steady_seconds()
    /// Of a pose: s by which it came later, against its stamp, than the promptest of the last half
    /// to whole minute from this client. Two computers' clocks cannot be compared, this can: it
    /// tells a pose that was held up on the way, although it came just now.
    double lateness = 0.0;
    std::variant<LinkConnected, LinkDisconnected, LinkPose, LinkGoals, LinkCommand, LinkInitialPose>
        what;
};

struct LinkServerCounts {
    std::uint64_t connections = 0;       ///< greeted and let in
    std::uint64_t turned_away = 0;       ///< not let in: full, no or a bad first line, wrong token
    std::uint64_t lines = 0;             ///< good ones, of clients let in
    std::uint64_t refused = 0;           ///< lines of clients let in
    std::uint64_t poses_dropped = 0;     ///< since events() was not called often enough
    std::uint64_t statuses_dropped = 0;  ///< since readers were too slow
};

/// The vehicle's end: takes poses and goals from TCP clients, tells them its status. One thread of
/// its own; nothing that clients do makes it throw, block or grow. Its methods may be called from
/// any thread.
class LinkServer {
  public:
    /// Listens when it returns. Throws Error for a bad config and an address that cannot be had.
    explicit LinkServer(const LinkServerConfig& config);
    ~LinkServer();
    LinkServer(const LinkServer&) = delete;
    LinkServer& operator=(const LinkServer&) = delete;

    /// Where it really listens: port 0 asks for any.
    Endpoint endpoint() const;

    /// What came since the last call, in order; waits up to `timeout` seconds for a first one. A
    /// client's first event is LinkConnected and its last LinkDisconnected; these and commands are
    /// never dropped: when the queue is full, old poses go first, then clients are refused.
    std::vector<LinkEvent> events(double timeout = 0.0);

    /// To all clients; a later one gets the last one at once. Of what a slow reader did not take,
    /// the oldest is dropped. Throws Error for numbers that are not finite.
    void publish(const LinkStatus& status);
    /// To all pose sources. Throws Error for numbers that are not finite.
    void publish(const LinkInitialPose& pose);
    /// Tells one client that what it asked for is not done; nothing when it is gone.
    void refuse(std::uint64_t client, const std::string& reason);

    LinkServerCounts counts() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
