// SPDX-License-Identifier: Apache-2.0
#include "plot.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hybrid_slam::tools::plot {
namespace {

constexpr int kTop = 130;
constexpr int kLeft = 110;
constexpr int kRight = 40;
constexpr double kEdge = 32.0;  // of the titles
constexpr double kTitleBaseline = 52.0;

}  // namespace

Rect Layout::rect(int index) const {
    return {kLeft, kTop + 10 + index * (height + gap), kWidth - kLeft - kRight, height};
}

int Layout::bottom() const {
    return kTop + 2 * (height + gap);
}

void TimeAxis::draw_level(double share, const Color& color) const {
    canvas_.line(at(0.0, share), at(duration_, share), {color, 1});
}

void TimeAxis::draw_level(double share, double value) const {
    draw_level(share, kRaster);
    canvas_.text(at(0.0, share) + Pixel(-10.0, kTextHeight / 2.0), fmt::format("{:g}", value),
                 {kTextHeight, kFaintInk, Align::kRight, false});
}

void TimeAxis::draw_times(const std::string& label) const {
    const double step = round_step(duration_, 8.0);
    for (double time = 0.0; time <= duration_ * 1.0001; time += step) {
        canvas_.line(at(time, 0.0), at(time, 1.0), {kRaster, 1});
        canvas_.text(at(time, 0.0) + Pixel(0.0, 2.0 * kTextHeight), fmt::format("{:g}", time),
                     {kTextHeight, kFaintInk, Align::kCenter, false});
    }
    canvas_.text({static_cast<double>(rect_.x), rect_.y - 14.0}, label,
                 {kTextHeight, kInk, Align::kLeft, false});
}

double round_step(double range, double wanted) {
    const double rough = range / wanted;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double ratio = rough / power;
    return power * (ratio > 5.0 ? 10.0 : ratio > 2.0 ? 5.0 : ratio > 1.0 ? 2.0 : 1.0);
}

void draw_titles(Canvas& canvas, const std::string& title, const std::string& subtitle) {
    canvas.text({kEdge, kTitleBaseline}, title, {22, kInk, Align::kLeft, true});
    canvas.text({kEdge, kTitleBaseline + 2.4 * kTextHeight}, subtitle,
                {kTextHeight, kFaintInk, Align::kLeft, false});
}

void draw_time_label(Canvas& canvas, double baseline) {
    canvas.text({kLeft + (kWidth - kLeft - kRight) / 2.0, baseline}, "time since the first scan, s",
                {kTextHeight, kInk, Align::kCenter, false});
}

}  // namespace hybrid_slam::tools::plot
