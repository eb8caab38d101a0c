// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam::tools {

/// A part of the plane, in metres.
struct Bounds {
    Point2 lower{0.0, 0.0};
    Point2 upper{0.0, 0.0};
    bool empty = true;

    void include(const Point2& point);
    void include(const Bounds& other);
    /// Wider by a share of its size, and at least a metre each way.
    Bounds with_margin(double share) const;
    Point2 size() const { return upper - lower; }
};

/// From metres (y up) to pixels (y down).
class View {
  public:
    /// Fits the bounds into the middle of the rectangle, not larger than `most` pixels per metre.
    View(const Bounds& bounds, const Rect& rect, double most);

    Pixel operator()(const Point2& point) const;
    std::vector<Pixel> operator()(const Points& points) const;
    double pixels_per_metre() const { return scale_; }

  private:
    double scale_ = 1.0;
    Point2 center_;
    Pixel middle_;
};

enum class Mark { kLine, kDashes, kDot, kRamp };

struct LegendEntry {
    Mark mark = Mark::kLine;
    Color color;
    std::string label;
};

/// Pixels that the entries take in a picture of this width.
int legend_height(const std::vector<LegendEntry>& legend, int width);
void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& legend, int top);

struct Panel {
    std::string caption;  ///< may be empty
    Bounds bounds;
    std::function<void(Canvas&, const View&)> draw;
};

/// A picture of one or several maps with title, scale bars and legend.
struct Figure {
    std::string title;
    std::string subtitle;
    std::vector<Panel> panels;
    std::vector<LegendEntry> legend;
};

Canvas draw(const Figure& figure);

/// The colour of something that happened at this share (0 to 1) of the drive.
Color ramp(double share);

}  // namespace hybrid_slam::tools
