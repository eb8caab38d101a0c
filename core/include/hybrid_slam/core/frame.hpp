// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

/// One scan with what came along with it: the unit that SLAM processes.
struct Frame {
    Scan scan;
    std::optional<Pose2d> odom_from_robot;  ///< wheel odometry at the stamp of the scan
    std::vector<VisualMotion> visual;  ///< those since the frame before, the newest kMostVisual
};

/// Groups a stream of measurements into frames, one for each scan, in the order of the stream
/// (never sorted by stamp: the clocks of real logs run backwards). Images are for visual odometry,
/// which replaces them by VisualMotion before they come here; others are left out.
class FrameAssembler {
  public:
    /// A scan waits for the first visual motion at or after its stamp, so that its prior is inter-
    /// rather than extrapolated, if the newest one is at most `visual_wait` seconds older; until
    /// the next scan at the latest. Zero, for live vehicles, never waits.
    explicit FrameAssembler(double visual_wait = 0.0) : visual_wait_(visual_wait) {}

    /// Returns a frame when the measurement completes one. Wheel odometry at the stamp of the scan
    /// is the reading with that very stamp, else what the newest two give by inter- or
    /// extrapolation, when one of them is within kMaxExtrapolation (and ten times their interval),
    /// else none.
    std::optional<Frame> push(Measurement measurement);

    /// The scan that still waits at the end of the stream.
    std::optional<Frame> flush();

    static constexpr double kMaxExtrapolation = 0.5;  ///< seconds
    static constexpr double kVisualWait = 0.2;        ///< seconds; what suits recordings
    /// While no scan comes, the newest so many visual motions are kept.
    static constexpr std::size_t kMostVisual = 1000;

  private:
    std::optional<Pose2d> odometry_at(double stamp) const;
    bool waits() const;
    std::optional<Frame> complete();

    double visual_wait_;
    std::optional<WheelOdometry> newest_;
    std::optional<WheelOdometry> before_newest_;
    std::deque<VisualMotion> visual_;
    std::optional<Frame> waiting_;
    std::optional<double> newest_visual_;  ///< stamp, seconds
};

}  // namespace hybrid_slam
