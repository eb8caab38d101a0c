// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/lidar/lidar_config.hpp"
#include "hybrid_slam/lidar/s300_telegram.hpp"

namespace hybrid_slam {

/// Bytes that came from the lidar's line together.
struct LidarBytes {
    double arrival = 0.0;  ///< seconds, when they were there
    std::vector<std::uint8_t> bytes;
};

/// What a reader met in the stream; all of it was survived.
struct LidarCounts {
    S300StreamCounts stream;
    std::uint64_t scans = 0;              ///< delivered
    std::uint64_t standby_scans = 0;      ///< whole scan 0x4004: not delivered
    std::uint64_t lockout_telegrams = 0;  ///< status not normal: the scan is not delivered
    std::uint64_t without_distances = 0;  ///< telegrams of I/O or reflectors alone
    std::uint64_t other_fields = 0;       ///< measuring fields other than the first one met
    std::uint64_t other_devices = 0;      ///< telegrams of another address than the one followed
    std::uint64_t missed_scans = 0;       ///< by the scan counter, at its usual step
    std::uint64_t repeated_scans = 0;     ///< the same scan number again: not delivered
    std::uint64_t counter_resets = 0;     ///< the scanner was switched off and on
    /// New fits of the scanner's clock: with each restart of the scanner, and when the host's clock
    /// was set. Stamps take a minute to be within 1 ms again.
    std::uint64_t clock_resets = 0;
    std::uint64_t beams = 0;             ///< of the scans delivered
    std::uint64_t no_returns = 0;        ///< of these
    std::uint64_t protective_scans = 0;  ///< with a beam inside of the protective field
    std::uint64_t warning_scans = 0;     ///< with a beam inside of the warning field
};

/// From bytes to scans: decodes, stamps by the clock fit, interprets. The same for the live line, a
/// recording and the simulator. The stamp of a scan is that of its first beam: the fitted arrival
/// of its telegram's last byte less wire time and latency.
class LidarReader {
  public:
    /// Throws Error for a config out of range (blind sectors not in pairs).
    explicit LidarReader(const LidarConfig& config);
    ~LidarReader();
    LidarReader(LidarReader&&) noexcept;
    LidarReader& operator=(LidarReader&&) noexcept;

    void push(const LidarBytes& bytes);
    /// The next scan found; empty when more bytes are needed. What is not fetched is kept, with its
    /// arrival.
    std::optional<Scan> next();

    const LidarCounts& counts() const;
    double count_period() const;  ///< seconds of one step of the scan counter, as fitted

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
