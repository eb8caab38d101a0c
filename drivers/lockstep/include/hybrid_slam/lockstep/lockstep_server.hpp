// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/lockstep/lockstep_client.hpp"

namespace hybrid_slam {

/// The drive's end of a lockstep clock is gone: the run is over.
class LockstepClosed : public Error {
  public:
    using Error::Error;
};

struct LockstepCounts {
    std::uint64_t ticks = 0;
    std::uint64_t lidar = 0;   ///< pieces of bytes announced
    std::uint64_t images = 0;  ///< announced
    bool sensors_gone = false;
};

/// A clock for several processes that run as fast as they can, yet always the same: the simulator
/// holds it, tells what it has put on the sensors' lines and when that arrived, and lets the drive
/// compute one tick after the other. Lines of text over TCP; one client of each kind, who stays
/// from the beginning to the end.
///
/// The sensors' end may go before the drive's, as a SLAM that is killed does: the run goes on
/// without it. For one thread.
class LockstepServer {
  public:
    /// `listen` as of parse_endpoint; port 0 takes any. `patience`: seconds of the wall clock after
    /// which a client that does not answer ends the run. Throws Error when it cannot listen.
    explicit LockstepServer(const std::string& listen = ":0", double patience = 60.0);
    /// Says `end` to those who are there.
    ~LockstepServer();
    LockstepServer(const LockstepServer&) = delete;
    LockstepServer& operator=(const LockstepServer&) = delete;

    std::string url() const;  ///< tcp://127.0.0.1:PORT: what the clients connect to

    /// Whether both clients are there, after `timeout` seconds at most. Who says something else
    /// than hello, or is there already, is turned away.
    bool wait_for_clients(double timeout);

    /// Waits until the sensors' end has read all that was announced, so that no buffer overflows.
    /// Before bytes are put on a line.
    void wait_until_read();

    /// So many bytes, which came at `arrival`, are on the lidar's line now.
    void lidar(double arrival, std::size_t bytes);
    /// The next image of the camera's stream came at `arrival`.
    void image(double arrival);

    /// The drive computes what it does at `tick.now`; the result is how many CAN frames it has
    /// written in this tick. Calls `meanwhile` every few milliseconds until it has answered: the
    /// adapter that it opens answers there. Throws LockstepClosed when it is gone; Error when it
    /// does not answer in time.
    std::size_t tick(const LockstepTick& tick, const std::function<void()>& meanwhile = {});

    LockstepCounts counts() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
