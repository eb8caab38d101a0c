// SPDX-License-Identifier: Apache-2.0
#include "error_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "plot.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kStampTolerance = 0.001;  // seconds, as in relations_error
constexpr plot::Layout kLayout{340, 80};
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

void draw_curve(Canvas& canvas, const Rect& rect, const Curve& curve, double duration) {
    const plot::TimeAxis axis(canvas, rect, duration);
    const double y_max = curve.highest > 0.0 ? 1.05 * curve.highest : 1.0;
    const double step = plot::round_step(y_max, 5.0);
    for (double y = 0.0; y <= y_max * 1.0001; y += step) {
        axis.draw_level(y / y_max, y);
    }
    axis.draw_times(curve.label);
    for (const Eigen::Vector2d& value : curve.values) {
        canvas.disc(axis.at(value.x(), value.y() / y_max), 2.2, kDots);
    }
    const double mean = curve.mean / y_max;
    canvas.line(axis.at(0.0, mean), axis.at(duration, mean), {kMean, 2});
    canvas.text(axis.at(duration, 1.0) - Pixel(0.0, 14.0),
                fmt::format("mean {:.4g}, max {:.4g}", curve.mean, curve.highest),
                {plot::kTextHeight, kMean, Align::kRight, false});
}

}  // namespace

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
    Canvas canvas(plot::kWidth, kLayout.bottom() + 20);
    plot::draw_titles(canvas, title, subtitle);
    double duration = 1.0;
    for (const PoseError& error : errors) {
        duration = std::max(duration, error.time);
    }
    draw_curve(canvas, kLayout.rect(0),
               curve_of("translation error, m", errors,
                        [](const PoseError& error) { return error.translation; }),
               duration);
    draw_curve(canvas, kLayout.rect(1),
               curve_of("rotation error, deg", errors,
                        [](const PoseError& error) { return degrees(error.rotation); }),
               duration);
    plot::draw_time_label(canvas, canvas.height() - 22.0);
    return canvas;
}

}  // namespace hybrid_slam::tools
