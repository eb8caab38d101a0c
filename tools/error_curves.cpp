// SPDX-License-Identifier: Apache-2.0
#include "error_curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "figure.hpp"
#include "plot.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr plot::Layout kLayout{380, 90};
constexpr int kMostDecades = 5;
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
    LogAxes(Canvas& canvas, const plot::TimeAxis& axis, const Decades& decades)
        : canvas_(canvas), axis_(axis), decades_(decades) {}

    Pixel at(double time, double value) const { return axis_.at(time, share_of(value)); }

    void shade(const TimeBand& band) const {
        const double left = x_at(band.from);
        const int width = std::max(1, static_cast<int>(x_at(band.to) - left));
        const Rect& rect = axis_.rect();
        canvas_.fill({static_cast<int>(left), rect.y, width, rect.height}, kBand);
    }

    void label(const TimeBand& band) const {
        canvas_.text({x_at(band.from) + 4.0, axis_.rect().y + plot::kTextHeight + 6.0}, band.label,
                     {plot::kTextHeight - 1, plot::kInk, Align::kLeft, false});
    }

    void draw_raster(const std::string& label) const {
        for (int power = decades_.lowest; power <= decades_.highest; ++power) {
            const double value = std::pow(10.0, power);
            for (int digit = 2; digit < 10 && power < decades_.highest; ++digit) {
                axis_.draw_level(share_of(digit * value), kFineRaster);
            }
            axis_.draw_level(share_of(value), value);
        }
        axis_.draw_times(label);
    }

  private:
    double share_of(double value) const {
        const double most = decades_.highest;
        const double least = decades_.lowest;
        const double power = value > 0.0 ? std::clamp(std::log10(value), least, most) : least;
        return (power - least) / (most - least);
    }
    double x_at(double time) const {
        return axis_.at(std::clamp(time, 0.0, axis_.duration()), 0.0).x();
    }

    Canvas& canvas_;
    plot::TimeAxis axis_;
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
    const LogAxes axes(canvas, {canvas, rect, duration_of(picture)}, decades_of(picture, value_of));
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
    const int legend_top = kLayout.bottom() - 10;
    Canvas canvas(plot::kWidth, legend_top + legend_height(legend, plot::kWidth) + 20);
    plot::draw_titles(canvas, picture.title, picture.subtitle);
    draw_plot(canvas, kLayout.rect(0), picture, "position " + picture.noun + ", m",
              [](const PoseError& error) { return error.translation; });
    const Rect lower = kLayout.rect(1);
    draw_plot(canvas, lower, picture, "heading " + picture.noun + ", deg",
              [](const PoseError& error) { return degrees(error.rotation); });
    plot::draw_time_label(canvas, lower.y + lower.height + 3.6 * plot::kTextHeight);
    draw_legend(canvas, legend, legend_top);
    return canvas;
}

}  // namespace hybrid_slam::tools
