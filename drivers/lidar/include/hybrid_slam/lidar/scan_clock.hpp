// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

namespace hybrid_slam {

struct ScanClockConfig {
    double count_period = 0.040;     ///< seconds in one step of the counter, by the data sheet
    double period_tolerance = 0.01;  ///< share by which the true period may differ
    double window = 120.0;           ///< seconds of arrivals that the fit looks back on
    /// Seconds. An arrival this much too early, or all arrivals of 2 s this much too late (the
    /// host's clock was set, the scanner's counter restarted), start a new fit; so does a counter
    /// that went back. Less than an NTP client steps by, more than a bus varies by.
    double reset_after = 0.1;
};

/// Turns arrival times, which a bus delays by a varying amount but never hastens, into times on an
/// even grid: the line under all arrivals of a window, held by their lower convex hull (Zhang, Liu
/// and Xia, "Clock synchronization algorithms for network measurements", INFOCOM 2002, take the
/// hull's edge below the mean; here the lines that are likely are averaged, which halves the error
/// of the newest stamp). Causal and deterministic; a stamp takes microseconds.
class ScanClock {
  public:
    explicit ScanClock(const ScanClockConfig& config = {});
    ~ScanClock();
    ScanClock(ScanClock&&) noexcept;
    ScanClock& operator=(ScanClock&&) noexcept;

    /// The time on the host's clock at which the count would have arrived without delay. Seconds.
    /// Where the fit moves back, stamps still go on, at no less than half the period, until the fit
    /// has caught up; they go back only with a new fit. The same count again gives the same stamp.
    double stamp(std::uint32_t count, double arrival);

    double count_period() const;   ///< seconds, as fitted
    std::uint64_t resets() const;  ///< how often the fit had to start anew

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
