// SPDX-License-Identifier: Apache-2.0
#include "figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hybrid_slam::tools {
namespace {

constexpr int kMargin = 32;       // pixels around everything
constexpr int kGap = 24;          // between panels
constexpr int kMostWidth = 1900;  // of all panels together
constexpr int kMostHeight = 1500;
constexpr int kLeastWidth = 1000;  // for title and legend
constexpr int kLeastPanelHeight = 260;
constexpr double kMostScale = 100.0;  // pixels per metre
constexpr int kTitleHeight = 22;
constexpr int kTextHeight = 13;
constexpr int kLegendRow = 32;
constexpr Color kInk{45, 50, 58};
constexpr Color kFaintInk{105, 112, 122};
constexpr Color kFrame{200, 204, 210};

/// Where everything lies.
struct Layout {
    int columns = 1;
    int panel_width = 0;
    int panel_height = 0;
    int caption = 0;  ///< height
    int top = 0;      ///< of the first row of panels, captions included

    Rect panel(std::size_t index) const {
        const int column = static_cast<int>(index) % columns;
        const int row = static_cast<int>(index) / columns;
        return {kMargin + column * (panel_width + kGap),
                top + caption + row * (panel_height + caption + kGap), panel_width, panel_height};
    }
};

Point2 largest_size(const std::vector<Panel>& panels) {
    // Each panel has a scale of its own: what they share is their shape, in the mean.
    double log_aspect = 0.0;
    double widest = 0.0;
    for (const Panel& panel : panels) {
        const Point2 size = panel.bounds.size();
        log_aspect += std::log(size.x() / size.y()) / static_cast<double>(panels.size());
        widest = std::max(widest, size.x());
    }
    const double aspect = std::clamp(std::exp(log_aspect), 0.2, 5.0);
    return {widest, widest / aspect};
}

/// The number of columns that shows the panels largest.
Layout lay_out(const Figure& figure) {
    Layout best;
    const Point2 size = largest_size(figure.panels);
    const int count = static_cast<int>(figure.panels.size());
    const bool captions = std::any_of(figure.panels.begin(), figure.panels.end(),
                                      [](const Panel& panel) { return !panel.caption.empty(); });
    double best_scale = 0.0;
    for (int columns = 1; columns <= count; ++columns) {
        if (count % columns != 0) {
            continue;  // would leave a hole
        }
        const int rows = count / columns;
        Layout layout;
        layout.columns = columns;
        layout.caption = captions ? 3 * kTextHeight : 0;
        layout.top = kMargin + kTitleHeight + 4 * kTextHeight;
        const double width = (kMostWidth - (columns - 1) * kGap) / static_cast<double>(columns);
        const double height =
            (kMostHeight - (rows - 1) * kGap) / static_cast<double>(rows) - layout.caption;
        const double scale = std::min({width / size.x(), height / size.y(), kMostScale});
        const int least_width = (kLeastWidth - (columns - 1) * kGap) / columns;
        layout.panel_width = std::max(static_cast<int>(scale * size.x()), least_width);
        layout.panel_height = std::max(static_cast<int>(scale * size.y()), kLeastPanelHeight);
        if (scale > best_scale) {
            best_scale = scale;
            best = layout;
        }
    }
    return best;
}

double mark_width(const LegendEntry& entry) {
    return entry.mark == Mark::kRamp ? 90.0 : entry.mark == Mark::kDot ? 14.0 : 34.0;
}

void draw_mark(Canvas& canvas, const Pixel& left, const LegendEntry& entry) {
    const double width = mark_width(entry);
    if (entry.mark == Mark::kDot) {
        canvas.disc(left + Pixel(7.0, 0.0), 6.0, entry.color);
        return;
    }
    constexpr int kPieces = 30;
    for (int i = 0; i < kPieces; ++i) {
        const Pixel start = left + Pixel(width * i / kPieces, 0.0);
        const Pixel end = left + Pixel(width * (i + 1) / kPieces, 0.0);
        const Color color = entry.mark == Mark::kRamp ? ramp((i + 0.5) / kPieces) : entry.color;
        if (entry.mark != Mark::kDashes) {
            canvas.line(start, end, {color, 4});
        } else if (i % 12 < 7) {
            canvas.line(start, end, {color, 2});
        }
    }
}

/// Places the entries in rows; draws them when there is a canvas. Returns the number of rows.
int lay_legend(const std::vector<LegendEntry>& legend, int width, Canvas* canvas, double top) {
    const TextStyle style{kTextHeight, kInk, Align::kLeft, false};
    int rows = legend.empty() ? 0 : 1;
    double x = kMargin;
    for (const LegendEntry& entry : legend) {
        const double taken = mark_width(entry) + 10.0 + text_width(entry.label, style);
        if (x > kMargin && x + taken > width - kMargin) {
            x = kMargin;
            ++rows;
        }
        if (canvas != nullptr) {
            const double y = top + (rows - 0.5) * kLegendRow;
            draw_mark(*canvas, {x, y}, entry);
            canvas->text({x + mark_width(entry) + 10.0, y + kTextHeight / 2.0}, entry.label, style);
        }
        x += taken + 34.0;
    }
    return rows;
}

/// A round number of metres that takes about a sixth of the panel.
void draw_scale_bar(Canvas& canvas, const Rect& rect, const View& view) {
    const double wanted = std::max(80.0, rect.width / 6.0) / view.pixels_per_metre();
    const double power = std::pow(10.0, std::floor(std::log10(wanted)));
    const double ratio = wanted / power;
    const double metres = power * (ratio >= 5.0 ? 5.0 : ratio >= 2.0 ? 2.0 : 1.0);
    const double length = metres * view.pixels_per_metre();
    const TextStyle style{kTextHeight, kInk, Align::kCenter, false};
    const Pixel left(rect.x + 22.0, rect.y + rect.height - 20.0);
    const Pixel right = left + Pixel(length, 0.0);
    const Rect box{rect.x + 8, rect.y + rect.height - 54, static_cast<int>(length) + 28, 46};
    canvas.fill(box, {255, 255, 255});
    canvas.outline(box, kFrame);
    canvas.line(left, right, {kInk, 2});
    for (const Pixel& end : {left, right}) {
        canvas.line(end - Pixel(0.0, 5.0), end + Pixel(0.0, 5.0), {kInk, 2});
    }
    canvas.text((left + right) / 2.0 - Pixel(0.0, 11.0), fmt::format("{:g} m", metres), style);
}

void draw_panel(Canvas& canvas, const Panel& panel, const Rect& rect) {
    if (!panel.caption.empty()) {
        canvas.text({static_cast<double>(rect.x), rect.y - kTextHeight + 2.0}, panel.caption,
                    {kTextHeight + 1, kInk, Align::kLeft, false});
    }
    const View view(panel.bounds, rect, kMostScale);
    canvas.clip_to(rect);
    panel.draw(canvas, view);
    draw_scale_bar(canvas, rect, view);
    canvas.outline(rect, kFrame);
    canvas.clip_to_all();
}

}  // namespace

void Bounds::include(const Point2& point) {
    lower = empty ? point : lower.cwiseMin(point);
    upper = empty ? point : upper.cwiseMax(point);
    empty = false;
}

void Bounds::include(const Bounds& other) {
    if (!other.empty) {
        include(other.lower);
        include(other.upper);
    }
}

Bounds Bounds::with_margin(double share) const {
    const Point2 margin = (share * size()).cwiseMax(1.0);
    Bounds wider;
    wider.include(Point2(lower - margin));
    wider.include(Point2(upper + margin));
    return wider;
}

View::View(const Bounds& bounds, const Rect& rect, double most)
    : scale_(std::min({rect.width / bounds.size().x(), rect.height / bounds.size().y(), most})),
      center_(0.5 * (bounds.lower + bounds.upper)),
      middle_(rect.x + rect.width / 2.0, rect.y + rect.height / 2.0) {}

Pixel View::operator()(const Point2& point) const {
    const Point2 offset = scale_ * (point - center_);
    return {middle_.x() + offset.x(), middle_.y() - offset.y()};
}

std::vector<Pixel> View::operator()(const Points& points) const {
    std::vector<Pixel> pixels;
    pixels.reserve(points.size());
    for (const Point2& point : points) {
        pixels.push_back((*this)(point));
    }
    return pixels;
}

int legend_height(const std::vector<LegendEntry>& legend, int width) {
    return kLegendRow * lay_legend(legend, width, nullptr, 0.0);
}

void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& legend, int top) {
    lay_legend(legend, canvas.width(), &canvas, top);
}

Canvas draw(const Figure& figure) {
    const Layout layout = lay_out(figure);
    const Rect last = layout.panel(figure.panels.size() - 1);
    const int width =
        2 * kMargin + layout.columns * layout.panel_width + (layout.columns - 1) * kGap;
    const int legend_top = last.y + last.height + kGap / 2;
    Canvas canvas(width, legend_top + legend_height(figure.legend, width) + kMargin / 2);
    const double baseline = kMargin + kTitleHeight;
    canvas.text({kMargin, baseline}, figure.title, {kTitleHeight, kInk, Align::kLeft, true});
    canvas.text({kMargin, baseline + 2.4 * kTextHeight}, figure.subtitle,
                {kTextHeight, kFaintInk, Align::kLeft, false});
    for (std::size_t i = 0; i < figure.panels.size(); ++i) {
        draw_panel(canvas, figure.panels[i], layout.panel(i));
    }
    draw_legend(canvas, figure.legend, legend_top);
    return canvas;
}

Color ramp(double share) {
    constexpr Color kStops[] = {{36, 72, 190}, {150, 40, 160}, {225, 60, 90}, {245, 150, 30}};
    constexpr int kPieces = 3;
    const double place = std::clamp(share, 0.0, 1.0) * kPieces;
    const int piece = std::min(static_cast<int>(place), kPieces - 1);
    return mix(kStops[piece], kStops[piece + 1], place - piece);
}

}  // namespace hybrid_slam::tools
