// SPDX-License-Identifier: Apache-2.0
#include "comparison_pictures.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "drawings.hpp"
#include "error_curves.hpp"

namespace hybrid_slam::tools {
namespace {

/// Told apart by people who see colours differently too (Okabe and Ito, 2008).
constexpr Color kColors[] = {{213, 94, 0},   {204, 121, 167}, {230, 159, 0},
                             {86, 180, 233}, {0, 158, 115},   {0, 96, 190}};
constexpr Color kWheelColor{150, 100, 60};

Trajectory moved(const Pose2d& to_from_frame, Trajectory trajectory) {
    for (StampedPose& stamped : trajectory) {
        stamped.pose = to_from_frame * stamped.pose;
    }
    return trajectory;
}

std::string caption_of(const std::string& name, const std::optional<Evaluation>& evaluation) {
    return name + (evaluation ? ": " + evaluation->brief() : "");
}

double start_of(const Trajectory& trajectory) {
    double start = std::numeric_limits<double>::infinity();
    for (const StampedPose& stamped : trajectory) {
        start = std::min(start, stamped.stamp);
    }
    return start;
}

/// When the images told little, by the last variant that looked at them.
std::vector<TimeBand> bad_vision(const Comparison& comparison) {
    const VariantRun& last = comparison.runs.back();
    const double start = start_of(last.session.map.trajectory);
    std::vector<TimeBand> bands;
    for (const BadSpell& spell : last.session.vision.spells) {
        bands.push_back({spell.from - start, spell.to - start, words_for(spell.status)});
    }
    return bands;
}

}  // namespace

Color variant_color(const Comparison& comparison, std::size_t run) {
    constexpr std::size_t kCount = std::size(kColors);
    // The last, which is the one that counts, has the same in all comparisons.
    const bool last = run + 1 == comparison.runs.size();
    return kColors[last ? kCount - 1 : run % (kCount - 1)];
}

Canvas draw_paths(const Comparison& comparison) {
    const VariantRun& best = comparison.best();
    PathsPicture picture;
    picture.title = comparison.title();
    picture.subtitle = "gray: the scans, drawn from the poses of " + best.variant.name;
    picture.points = transform(best.truth_from_map(), best.points);
    if (comparison.has_truth()) {
        picture.truth = comparison.yardstick->truth();
    }
    if (!comparison.wheels.empty()) {
        const std::optional<Evaluation>& odometry = comparison.odometry;
        // Raw odometry has a frame of its own.
        const Pose2d truth_from_wheels = odometry && odometry->truth
                                             ? odometry->truth->truth_from_estimate
                                             : best.truth_from_map() *
                                                   best.session.map.trajectory.front().pose *
                                                   comparison.wheels.front().pose.inverse();
        picture.paths.push_back({caption_of("raw odometry", odometry), kWheelColor,
                                 moved(truth_from_wheels, comparison.wheels)});
    }
    for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
        const VariantRun& run = comparison.runs[i];
        picture.paths.push_back({caption_of(run.variant.name, run.evaluation),
                                 variant_color(comparison, i),
                                 moved(run.truth_from_map(), run.session.map.trajectory)});
    }
    return draw(picture);
}

Canvas draw_maps(const Comparison& comparison) {
    std::vector<VariantPicture> variants;
    for (const VariantRun& run : comparison.runs) {
        variants.push_back({caption_of(run.variant.name, run.evaluation),
                            transform(run.truth_from_map(), run.points),
                            moved(run.truth_from_map(), run.session.map.trajectory)});
    }
    const std::string subtitle =
        comparison.odometry ? caption_of("raw odometry", comparison.odometry) : "";
    return draw_comparison(comparison.title(), subtitle, variants);
}

Canvas draw_errors(const Comparison& comparison) {
    ErrorCurves picture;
    picture.title = comparison.title();
    picture.subtitle = "root mean square of each in the legend";
    picture.noun = comparison.has_truth() ? "error" : "difference";
    picture.bands = bad_vision(comparison);
    const Yardstick& yardstick = *comparison.yardstick;
    const auto add = [&](const std::string& name, const Color& color, const Trajectory& trajectory,
                         const std::optional<Evaluation>& evaluation) {
        if (evaluation) {
            picture.dots = evaluation->relations.has_value();
            picture.curves.push_back({caption_of(name, evaluation), color,
                                      errors_over_time(trajectory, yardstick, *evaluation)});
        }
    };
    add("raw odometry", kWheelColor, comparison.wheels, comparison.odometry);
    for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
        const VariantRun& run = comparison.runs[i];
        add(run.variant.name, variant_color(comparison, i), run.session.map.trajectory,
            run.evaluation);
    }
    if (picture.dots) {
        picture.subtitle = "mean of each in the legend; a dot is a relation";
    }
    return draw(picture);
}

}  // namespace hybrid_slam::tools
