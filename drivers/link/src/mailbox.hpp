// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/link/link_client.hpp"

namespace hybrid_slam {

/// Between a LinkClient's callers and its thread.
class Mailbox {
  public:
    /// Callers' side.
    void put_pose(std::string line, double now);
    void put_invalid_pose();
    bool put_order(std::string line);
    bool wait_connected(double timeout);
    std::vector<ServerMessage> take_received(double timeout);
    LinkClientReport report() const;

    /// The thread's side. The next line to send: orders before poses; a pose that is too old is
    /// dropped here.
    std::optional<std::string> next_order();
    std::optional<std::string> next_pose(double now, double stale_after);
    bool has_pose() const;
    void connecting();
    void connected();
    void disconnected(const std::string& trouble);
    void came(const ServerMessage& message);
    void sent();

  private:
    struct WaitingPose {
        std::string line;
        double since;
    };
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<WaitingPose> pose_;
    std::deque<std::string> orders_;
    std::deque<ServerMessage> received_;
    LinkClientReport report_;
};

}  // namespace hybrid_slam
