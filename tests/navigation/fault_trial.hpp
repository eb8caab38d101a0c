// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "navigation/bus_log.hpp"
#include "navigation/closed_loop.hpp"

namespace hybrid_slam::test {

enum class Fault {
    kSlamKilled,     ///< SIGKILL
    kLidarPulled,    ///< its cable
    kLinkCut,        ///< silently, as by a cable
    kLinkClosed,     ///< both ends are told
    kCanPulled,      ///< the adapter: nobody can tell the truck to stand
    kPoseFrozen,     ///< the last line again and again
    kPoseRestamped,  ///< the same, with new stamps
    kCameraPulled,   ///< from here on the truck is to drive on
    kBrokerGone
};

inline constexpr Fault kFaults[] = {
    Fault::kSlamKilled,    Fault::kLidarPulled,  Fault::kLinkCut,
    Fault::kLinkClosed,    Fault::kCanPulled,    Fault::kPoseFrozen,
    Fault::kPoseRestamped, Fault::kCameraPulled, Fault::kBrokerGone};

const char* name_of(Fault fault);
/// Whether it drives on; else it has to stop.
bool drives_on(Fault fault);

struct FaultOutcome {
    bool drove = false;    ///< faster than 0.2 m/s when it happened; else the trial says nothing
    Stopping stopping;     ///< CAN: until the truck lets its commands go, by its own watchdog
    bool arrived = false;  ///< for one that drives on
    bool reported = false;
    std::string reason;  ///< why the drive says it stands; of one that drives on, who said what
};

/// A whole loop in real time, and the fault `after` seconds of driving. Throws Error when the loop
/// does not come up.
FaultOutcome try_fault(const LoopMap& map, Fault fault, int seed, double after);

/// A broker on this computer.
class Broker {
  public:
    /// Whether this computer has one to start.
    static bool is_there();
    /// Accepts connections when it returns.
    explicit Broker(const std::filesystem::path& folder);
    std::string url() const;
    void die() { process_.send(9); }

  private:
    std::uint16_t port_;
    Process process_;
};

}  // namespace hybrid_slam::test
