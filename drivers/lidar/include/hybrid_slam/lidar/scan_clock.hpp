// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

namespace hybrid_slam {

struct ScanClockConfig {
    double count_period = 0.040;     ///< seconds in one step of the counter, by the data sheet
    double period_tolerance = 0.01;  ///< share by which the true period may differ
    double window = 120.0;           ///< seconds of arrivals that the fit looks back on
    double reset_after = 0.5;  ///< seconds; an arrival this far off (early), or a counter that
                               ///< went back, starts a new fit
};

/// Turns arrival times, which a bus delays by a varying amount but never hastens, into times on an
/// even grid: fits the line under all arrivals of the window that is nearest to them (Zhang, Liu
/// and Xia, "Clock synchronization algorithms for network measurements", INFOCOM 2002: the edge of
/// the lower convex hull below the mean). Causal and deterministic.
class ScanClock {
  public:
    explicit ScanClock(const ScanClockConfig& config = {});
    ~ScanClock();
    ScanClock(ScanClock&&) noexcept;
    ScanClock& operator=(ScanClock&&) noexcept;

    /// The time on the host's clock at which the count would have arrived without delay. Seconds.
    double stamp(std::uint32_t count, double arrival);

    double count_period() const;   ///< seconds, as fitted
    double newest_delay() const;   ///< seconds by which the newest arrival was late
    std::uint64_t resets() const;  ///< how often the fit had to start anew

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
