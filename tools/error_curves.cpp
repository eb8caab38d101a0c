// SPDX-License-Identifier: Apache-2.0
#include "error_curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "figure.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr int kWidth = 1500;
constexpr int kPlotHeight = 380;
constexpr int kTop = 130;
constexpr int kBetween = 90;
constexpr int kLeft = 110;
constexpr int kRight = 40;
constexpr int kTextHeight = 13;
constexpr int kMostDecades = 5;
constexpr Color kInk{45, 50, 58};
constexpr Color kFaintInk{105, 112, 122};
constexpr Color kRaster{225, 228, 232};
constexpr Color kFineRaster{241, 243, 245};
constexpr Color kBand{244, 236, 220};

using ValueOf = std::function<double(const PoseError&)>;

/// Powers of ten that hold what is to be seen.
struct Decades {
    int lowest = -2;
    int highest = 0;
};

/// From what the best are mostly above, up to the largest.
Decades decades_of(const ErrorCurves& picture, const ValueOf& value_of) {
    std::vector<double> values;
    for (const ErrorCurve& curve : picture.curves) {
        for (const PoseError& error : curve.errors) {
            const double value = value_of(error);
            if (std::isfinite(value) && value > 0.0) {
                values.push_back(value);
            }
        }
    }
    if (values.empty()) {
        return {};
    }
    std::sort(values.begin(), values.end());
    Decades decades;
    decades.highest = static_cast<int>(std::ceil(std::log10(values.back())));
    decades.lowest = static_cast<int>(std::floor(std::log10(values[values.size() / 50])));
    decades.lowest =
        std::clamp(decades.lowest, decades.highest - kMostDecades, decades.highest - 1);
    return decades;
}

/// Time to the right, powers of ten up; what lies beyond is put onto the edge.
class LogAxes {
  public:
    LogAxes(Canvas& canvas, const Rect& rect, double duration, const Decades& decades)
        : canvas_(canvas), rect_(rect), duration_(duration), decades_(decades) {}

    Pixel at(double time, double value) const {
        const double most = decades_.highest;
        const double least = decades_.lowest;
        const double power = value > 0.0 ? std::clamp(std::log10(value), least, most) : least;
        return {rect_.x + rect_.width * time / duration_,
                rect_.y + rect_.height * (most - power) / (most - least)};
    }

    void shade(const TimeBand& band) const {
        const Pixel left = at(std::clamp(band.from, 0.0, duration_), 0.0);
        const Pixel right = at(std::clamp(band.to, 0.0, duration_), 0.0);
        const int width = std::max(1, static_cast<int>(right.x() - left.x()));
        canvas_.fill({static_cast<int>(left.x()), rect_.y, width, rect_.height}, kBand);
    }

    void label(const TimeBand& band) const {
        const Pixel left = at(std::clamp(band.from, 0.0, duration_), 0.0);
        canvas_.text({left.x() + 4.0, rect_.y + kTextHeight + 6.0}, band.label,
                     {kTextHeight - 1, kInk, Align::kLeft, false});
    }

    void draw_raster(const std::string& label) const {
        for (int power = decades_.lowest; power <= decades_.highest; ++power) {
            const double value = std::pow(10.0, power);
            for (int digit = 2; digit < 10 && power < decades_.highest; ++digit) {
                canvas_.line(at(0.0, digit * value), at(duration_, digit * value),
                             {kFineRaster, 1});
            }
            canvas_.line(at(0.0, value), at(duration_, value), {kRaster, 1});
            canvas_.text(at(0.0, value) + Pixel(-10.0, kTextHeight / 2.0),
                         fmt::format("{:g}", value),
                         {kTextHeight, kFaintInk, Align::kRight, false});
        }
        const double step = round_step(duration_, 8.0);
        for (double time = 0.0; time <= duration_ * 1.0001; time += step) {
            const double bottom = std::pow(10.0, decades_.lowest);
            canvas_.line(at(time, bottom), at(time, std::pow(10.0, decades_.highest)),
                         {kRaster, 1});
            canvas_.text(at(time, bottom) + Pixel(0.0, 2.0 * kTextHeight),
                         fmt::format("{:g}", time),
                         {kTextHeight, kFaintInk, Align::kCenter, false});
        }
        canvas_.text({static_cast<double>(rect_.x), rect_.y - 14.0}, label,
                     {kTextHeight, kInk, Align::kLeft, false});
    }

  private:
    Canvas& canvas_;
    Rect rect_;
    double duration_;
    Decades decades_;
};

double duration_of(const ErrorCurves& picture) {
    double duration = 1.0;
    for (const ErrorCurve& curve : picture.curves) {
        for (const PoseError& error : curve.errors) {
            duration = std::max(duration, error.time);
        }
    }
    return duration;
}

void draw_plot(Canvas& canvas, const Rect& rect, const ErrorCurves& picture,
               const std::string& label, const ValueOf& value_of) {
    const LogAxes axes(canvas, rect, duration_of(picture), decades_of(picture, value_of));
    for (const TimeBand& band : picture.bands) {
        axes.shade(band);
    }
    axes.draw_raster(label);
    for (const ErrorCurve& curve : picture.curves) {
        std::vector<Pixel> pixels;
        for (const PoseError& error : curve.errors) {
            if (std::isfinite(value_of(error))) {
                pixels.push_back(axes.at(error.time, value_of(error)));
            }
        }
        if (picture.dots) {
            for (const Pixel& pixel : pixels) {
                canvas.disc(pixel, 2.0, curve.color);
            }
        } else {
            canvas.polyline(pixels, {curve.color, 2});
        }
    }
    for (const TimeBand& band : picture.bands) {
        axes.label(band);
    }
}

}  // namespace

Canvas draw(const ErrorCurves& picture) {
    std::vector<LegendEntry> legend;
    for (const ErrorCurve& curve : picture.curves) {
        legend.push_back({picture.dots ? Mark::kDot : Mark::kLine, curve.color, curve.name});
    }
    const int legend_top = kTop + 2 * (kPlotHeight + kBetween) - 10;
    Canvas canvas(kWidth, legend_top + legend_height(legend, kWidth) + 20);
    canvas.text({32.0, 52.0}, picture.title, {22, kInk, Align::kLeft, true});
    canvas.text({32.0, 52.0 + 2.4 * kTextHeight}, picture.subtitle,
                {kTextHeight, kFaintInk, Align::kLeft, false});
    Rect rect{kLeft, kTop + 10, kWidth - kLeft - kRight, kPlotHeight};
    draw_plot(canvas, rect, picture, "position " + picture.noun + ", m",
              [](const PoseError& error) { return error.translation; });
    rect.y += kPlotHeight + kBetween;
    draw_plot(canvas, rect, picture, "heading " + picture.noun + ", deg",
              [](const PoseError& error) { return degrees(error.rotation); });
    canvas.text({kLeft + rect.width / 2.0, rect.y + rect.height + 3.6 * kTextHeight},
                "time since the first scan, s", {kTextHeight, kInk, Align::kCenter, false});
    draw_legend(canvas, legend, legend_top);
    return canvas;
}

}  // namespace hybrid_slam::tools
