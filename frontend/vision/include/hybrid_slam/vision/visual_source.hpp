// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

#include "hybrid_slam/core/source.hpp"
#include "hybrid_slam/vision/visual_odometry.hpp"

namespace hybrid_slam {

struct VisualCounts {
    std::uint64_t images = 0;
    /// Images stamped no later than the one before: left out, but for one more than a second back,
    /// from which vision starts anew.
    std::uint64_t backward = 0;
    std::uint64_t wrong_size = 0;  ///< torn, or not as large as the camera model says: left out
    std::map<VisualStatus, std::uint64_t> statuses;
    double seconds = 0.0;  ///< of computing
};

/// A source whose images are replaced by the motion between them; all else passes.
class VisualSource : public Source {
  public:
    /// Both must outlive it.
    VisualSource(Source& source, VisualOdometry& odometry) : source_(source), odometry_(odometry) {}

    std::optional<Measurement> next() override;
    double progress() const override { return source_.progress(); }
    const VisualCounts& counts() const { return counts_; }

  private:
    Source& source_;
    VisualOdometry& odometry_;
    VisualCounts counts_;
    std::optional<double> newest_;
};

}  // namespace hybrid_slam
