// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>

#include "hybrid_slam/core/frame.hpp"
#include "input.hpp"

namespace hybrid_slam::tools {

/// What one measurement has brought.
struct DriveStep {
    std::optional<VisualMotion> motion;  ///< it was one
    std::optional<Frame> frame;          ///< it completed one
};

/// An input as frames, with the visual motions on the way to them.
class FrameStream {
  public:
    /// The input must outlive it. Scans of a live one never wait for an image.
    explicit FrameStream(Input& input);

    /// Empty at the end of the input.
    std::optional<DriveStep> next();

    std::size_t frames() const { return frames_; }
    /// Whether any scan so far had a return in it.
    bool saw_anything() const { return saw_anything_; }
    /// Seconds between the earliest and the latest scan so far.
    double recorded() const { return frames_ == 0 ? 0.0 : latest_ - earliest_; }

  private:
    void look_at(const Scan& scan);

    Input& input_;
    FrameAssembler assembler_;
    std::size_t frames_ = 0;
    bool saw_anything_ = false;
    double earliest_ = std::numeric_limits<double>::infinity();
    double latest_ = -std::numeric_limits<double>::infinity();
};

}  // namespace hybrid_slam::tools
