// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "canvas.hpp"

/// What plots over time have in common: two, one above the other.
namespace hybrid_slam::tools::plot {

constexpr int kWidth = 1500;
constexpr int kTextHeight = 13;
constexpr Color kInk{45, 50, 58};
constexpr Color kFaintInk{105, 112, 122};
constexpr Color kRaster{225, 228, 232};

/// How high one plot is, and what lies below it.
struct Layout {
    int height = 0;
    int gap = 0;

    /// Of the upper plot (0) or the lower one (1).
    Rect rect(int index) const;
    /// Below both, times included.
    int bottom() const;
};

/// Seconds to the right; what goes up is the caller's.
class TimeAxis {
  public:
    TimeAxis(Canvas& canvas, const Rect& rect, double duration)
        : canvas_(canvas), rect_(rect), duration_(duration) {}

    /// `share` from the bottom (0) to the top (1).
    Pixel at(double time, double share) const {
        return {rect_.x + rect_.width * time / duration_, rect_.y + rect_.height * (1.0 - share)};
    }
    double duration() const { return duration_; }
    const Rect& rect() const { return rect_; }

    /// A line across, with its value beside it.
    void draw_level(double share, double value) const;
    void draw_level(double share, const Color& color) const;
    /// The lines of the times, and above all what is plotted.
    void draw_times(const std::string& label) const;

  private:
    Canvas& canvas_;
    Rect rect_;
    double duration_;
};

/// A round step that divides `range` into about `wanted` parts.
double round_step(double range, double wanted);

void draw_titles(Canvas& canvas, const std::string& title, const std::string& subtitle);
/// What the times are, centered below the plots on a baseline.
void draw_time_label(Canvas& canvas, double baseline);

}  // namespace hybrid_slam::tools::plot
