// SPDX-License-Identifier: Apache-2.0
#include "error_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace hybrid_slam::tools {
namespace {

constexpr double kStampTolerance = 0.001;  // seconds, as in relations_error
constexpr int kWidth = 1500;
constexpr int kPlotHeight = 340;
constexpr int kTop = 130;
constexpr int kBetween = 80;
constexpr int kLeft = 110;
constexpr int kRight = 40;
constexpr int kTextHeight = 13;
constexpr Color kInk{45, 50, 58};
constexpr Color kFaintInk{105, 112, 122};
constexpr Color kRaster{225, 228, 232};
constexpr Color kDots{40, 90, 190};
constexpr Color kMean{222, 60, 50};

PoseError error_between(double time, const Pose2d& expected, const Pose2d& found) {
    const Pose2d difference = between(expected, found);
    return {time, difference.translation.norm(), std::abs(difference.heading)};
}

/// One of the two errors as the axes need it.
struct Curve {
    std::string label;
    std::vector<Eigen::Vector2d> values;  ///< time in seconds, error
    double mean = 0.0;
    double highest = 0.0;
};

Curve curve_of(const std::string& label, const std::vector<PoseError>& errors,
               const std::function<double(const PoseError&)>& value) {
    Curve curve;
    curve.label = label;
    for (const PoseError& error : errors) {
        curve.values.emplace_back(error.time, value(error));
        curve.mean += value(error) / static_cast<double>(errors.size());
        curve.highest = std::max(curve.highest, value(error));
    }
    return curve;
}

/// Axes with a raster in a rectangle; from 0 to the largest value each way.
class Axes {
  public:
    Axes(Canvas& canvas, const Rect& rect, double x_max, double y_max)
        : canvas_(canvas), rect_(rect), x_max_(x_max), y_max_(y_max) {}

    Pixel at(double x, double y) const {
        return {rect_.x + rect_.width * x / x_max_, rect_.y + rect_.height * (1.0 - y / y_max_)};
    }

    void draw_raster(const std::string& label) const {
        const double y_step = round_step(y_max_, 5.0);
        for (double y = 0.0; y <= y_max_ * 1.0001; y += y_step) {
            canvas_.line(at(0.0, y), at(x_max_, y), {kRaster, 1});
            canvas_.text(at(0.0, y) + Pixel(-10.0, kTextHeight / 2.0), fmt::format("{:g}", y),
                         {kTextHeight, kFaintInk, Align::kRight, false});
        }
        const double x_step = round_step(x_max_, 8.0);
        for (double x = 0.0; x <= x_max_ * 1.0001; x += x_step) {
            canvas_.line(at(x, 0.0), at(x, y_max_), {kRaster, 1});
            canvas_.text(at(x, 0.0) + Pixel(0.0, 2.0 * kTextHeight), fmt::format("{:g}", x),
                         {kTextHeight, kFaintInk, Align::kCenter, false});
        }
        canvas_.text({static_cast<double>(rect_.x), rect_.y - 14.0}, label,
                     {kTextHeight, kInk, Align::kLeft, false});
    }

  private:
    Canvas& canvas_;
    Rect rect_;
    double x_max_;
    double y_max_;
};

void draw_curve(Canvas& canvas, const Rect& rect, const Curve& curve, double duration) {
    const double y_max = curve.highest > 0.0 ? 1.05 * curve.highest : 1.0;
    const Axes axes(canvas, rect, duration, y_max);
    axes.draw_raster(curve.label);
    for (const Eigen::Vector2d& value : curve.values) {
        canvas.disc(axes.at(value.x(), value.y()), 2.2, kDots);
    }
    canvas.line(axes.at(0.0, curve.mean), axes.at(duration, curve.mean), {kMean, 2});
    canvas.text(axes.at(duration, y_max) - Pixel(0.0, 14.0),
                fmt::format("mean {:.4g}, max {:.4g}", curve.mean, curve.highest),
                {kTextHeight, kMean, Align::kRight, false});
}

}  // namespace

double round_step(double range, double wanted) {
    const double rough = range / wanted;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double ratio = rough / power;
    return power * (ratio > 5.0 ? 10.0 : ratio > 2.0 ? 5.0 : ratio > 1.0 ? 2.0 : 1.0);
}

std::vector<PoseError> errors_over_time(const Trajectory& trajectory, const Yardstick& yardstick,
                                        const Evaluation& evaluation) {
    std::vector<PoseError> errors;
    double start = std::numeric_limits<double>::infinity();
    for (const StampedPose& stamped : trajectory) {
        start = std::min(start, stamped.stamp);
    }
    if (evaluation.truth) {
        const TrajectoryIndex truth(yardstick.truth());
        for (const StampedPose& stamped : trajectory) {
            if (const auto pose = truth.interpolated(stamped.stamp, TruthOptions{}.max_gap)) {
                errors.push_back(
                    error_between(stamped.stamp - start, *pose,
                                  evaluation.truth->truth_from_estimate * stamped.pose));
            }
        }
        return errors;
    }
    const TrajectoryIndex poses(trajectory);
    for (const Relation& relation : yardstick.relations()) {
        const auto from = poses.nearest(relation.from_stamp, kStampTolerance);
        const auto to = poses.nearest(relation.to_stamp, kStampTolerance);
        if (from && to) {
            const double time = std::min(relation.from_stamp, relation.to_stamp) - start;
            errors.push_back(error_between(time, relation.from_from_to, between(*from, *to)));
        }
    }
    return errors;
}

Canvas draw_errors(const std::string& title, const std::string& subtitle,
                   const std::vector<PoseError>& errors) {
    Canvas canvas(kWidth, kTop + 2 * (kPlotHeight + kBetween) + 20);
    canvas.text({32.0, 52.0}, title, {22, kInk, Align::kLeft, true});
    canvas.text({32.0, 52.0 + 2.4 * kTextHeight}, subtitle,
                {kTextHeight, kFaintInk, Align::kLeft, false});
    double duration = 1.0;
    for (const PoseError& error : errors) {
        duration = std::max(duration, error.time);
    }
    Rect rect{kLeft, kTop + 10, kWidth - kLeft - kRight, kPlotHeight};
    draw_curve(canvas, rect,
               curve_of("translation error, m", errors,
                        [](const PoseError& error) { return error.translation; }),
               duration);
    rect.y += kPlotHeight + kBetween;
    draw_curve(canvas, rect,
               curve_of("rotation error, deg", errors,
                        [](const PoseError& error) { return degrees(error.rotation); }),
               duration);
    canvas.text({kLeft + rect.width / 2.0, static_cast<double>(canvas.height() - 22)},
                "time since the first scan, s", {kTextHeight, kInk, Align::kCenter, false});
    return canvas;
}

}  // namespace hybrid_slam::tools
