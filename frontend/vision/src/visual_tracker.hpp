// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/vision/visual_odometry.hpp"

namespace hybrid_slam {

/// A way to get motion from images.
class VisualTracker {
  public:
    using Features = std::vector<VisualOdometry::Feature>;

    VisualTracker() = default;
    VisualTracker(const VisualTracker&) = delete;
    VisualTracker& operator=(const VisualTracker&) = delete;
    virtual ~VisualTracker() = default;

    virtual void see(const Scan& scan) = 0;
    /// Since the image before.
    virtual VisualMotion track(const Image& image) = 0;
    /// The next image is the first.
    virtual void restart() = 0;
    /// Of the last image.
    virtual const Features& features() const = 0;
};

}  // namespace hybrid_slam
