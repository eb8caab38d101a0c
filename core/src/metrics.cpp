// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/metrics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/points.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// Mean and deviation of the values; NaN of none, so that no comparison with a limit succeeds.
std::pair<double, double> mean_and_deviation(const std::vector<double>& values) {
    if (values.empty()) {
        return {kNothing, kNothing};
    }
    const auto count = static_cast<double>(values.size());
    double sum = 0.0;
    for (const double value : values) {
        sum += value;
    }
    const double mean = sum / count;
    double squares = 0.0;
    for (const double value : values) {
        squares += (value - mean) * (value - mean);
    }
    return {mean, std::sqrt(squares / count)};
}

ErrorStatistics statistics_of(const std::vector<double>& errors) {
    std::vector<double> squared;
    squared.reserve(errors.size());
    for (const double error : errors) {
        squared.push_back(error * error);
    }
    ErrorStatistics statistics;
    std::tie(statistics.mean, statistics.deviation) = mean_and_deviation(errors);
    std::tie(statistics.mean_squared, statistics.deviation_squared) = mean_and_deviation(squared);
    statistics.maximum =
        errors.empty() ? kNothing : *std::max_element(errors.begin(), errors.end());
    return statistics;
}

class RootMeanSquare {
  public:
    void add(double value) {
        sum_ += value * value;
        ++count_;
    }
    double value() const {
        return count_ == 0 ? kNothing : std::sqrt(sum_ / static_cast<double>(count_));
    }

  private:
    double sum_ = 0.0;
    std::size_t count_ = 0;
};

/// Estimated poses with the truth at their stamps, in the order of driving.
struct Pairs {
    std::vector<Pose2d> estimate;
    std::vector<Pose2d> truth;
};

Pairs pair_up(const Trajectory& estimate, const Trajectory& truth, double max_gap) {
    const TrajectoryIndex index(truth);
    Pairs pairs;
    for (const StampedPose& pose : estimate) {
        if (const auto true_pose = index.interpolated(pose.stamp, max_gap)) {
            pairs.estimate.push_back(pose.pose);
            pairs.truth.push_back(*true_pose);
        }
    }
    return pairs;
}

Points positions(const std::vector<Pose2d>& poses) {
    Points points;
    points.reserve(poses.size());
    for (const Pose2d& pose : poses) {
        points.push_back(pose.translation);
    }
    return points;
}

/// Thesis equations 4.1 to 4.3, and the distances that they make up.
void add_absolute_errors(const Pairs& pairs, TruthError& result) {
    RootMeanSquare distance;
    RootMeanSquare x;
    RootMeanSquare y;
    RootMeanSquare heading;
    for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
        const Pose2d estimate = result.truth_from_estimate * pairs.estimate[i];
        const Point2 offset = estimate.translation - pairs.truth[i].translation;
        distance.add(offset.norm());
        x.add(offset.x());
        y.add(offset.y());
        heading.add(normalize_angle(estimate.heading - pairs.truth[i].heading));
        result.ate_max = std::max(result.ate_max, offset.norm());
    }
    result.ate_rmse = distance.value();
    result.x_rmse = x.value();
    result.y_rmse = y.value();
    result.heading_rmse = heading.value();
}

/// From each pose to the first one that is rpe_distance further along the true path.
void add_relative_errors(const Pairs& pairs, TruthError& result) {
    std::vector<double> path(pairs.truth.size(), 0.0);
    for (std::size_t i = 1; i < path.size(); ++i) {
        path[i] =
            path[i - 1] + (pairs.truth[i].translation - pairs.truth[i - 1].translation).norm();
    }
    // Summed lengths round: ten steps of 0.1 m count as a metre.
    const double distance = result.rpe_distance * (1.0 - 1e-9);
    RootMeanSquare translation;
    RootMeanSquare rotation;
    std::size_t to = 0;
    for (std::size_t from = 0; from < path.size(); ++from) {
        while (to < path.size() && path[to] - path[from] < distance) {
            ++to;
        }
        if (to == path.size()) {
            break;
        }
        const Pose2d error = between(between(pairs.truth[from], pairs.truth[to]),
                                     between(pairs.estimate[from], pairs.estimate[to]));
        translation.add(error.translation.norm());
        rotation.add(error.heading);
        ++result.rpe_pairs;
    }
    result.rpe_translation_rmse = translation.value();
    result.rpe_rotation_rmse = rotation.value();
}

}  // namespace

std::vector<Relation> read_relations(const std::filesystem::path& file) {
    TextFileReader reader(file);
    std::vector<Relation> relations;
    std::string line;
    while (reader.next(line)) {
        const std::string_view first = Tokens(line).next();
        if (first.empty() || first[0] == '#') {
            continue;
        }
        std::array<double, 8> values{};
        Tokens tokens(line);
        bool good = true;
        for (double& value : values) {
            good = good && parse_double(tokens.next(), value) && std::isfinite(value);
        }
        if (!good || !tokens.next().empty()) {
            throw Error(reader.where() + ": must be eight numbers: t1 t2 x y z roll pitch yaw");
        }
        const auto [from, to, x, y, z, roll, pitch, yaw] = values;
        relations.push_back({from, to, Pose2d(x, y, normalize_angle(yaw))});
    }
    if (reader.corrupt()) {
        throw Error(reader.where() + ": the file is truncated or corrupt after this line");
    }
    if (relations.empty()) {
        throw Error(file.string() + ": holds no relation");
    }
    return relations;
}

RelationsError relations_error(const Trajectory& trajectory, const std::vector<Relation>& relations,
                               double tolerance) {
    const TrajectoryIndex index(trajectory);
    RelationsError result;
    std::vector<double> translations;
    std::vector<double> rotations;
    for (const Relation& relation : relations) {
        const auto from = index.nearest(relation.from_stamp, tolerance);
        const auto to = index.nearest(relation.to_stamp, tolerance);
        if (!from || !to) {
            ++result.unmatched;
            continue;
        }
        const Pose2d error = between(relation.from_from_to, between(*from, *to));
        translations.push_back(error.translation.norm());
        rotations.push_back(std::abs(error.heading));
    }
    result.used = translations.size();
    result.translation = statistics_of(translations);
    result.rotation = statistics_of(rotations);
    return result;
}

TruthError truth_error(const Trajectory& estimate, const Trajectory& truth,
                       const TruthOptions& options) {
    if (!(options.rpe_distance > 0.0)) {
        throw Error("truth_error: rpe_distance must be above 0");
    }
    const Pairs pairs = pair_up(estimate, truth, options.max_gap);
    TruthError result;
    result.rpe_distance = options.rpe_distance;
    result.used = pairs.truth.size();
    result.unmatched = estimate.size() - result.used;
    if (result.used < 2) {
        throw Error("truth_error: only " + std::to_string(result.used) + " of " +
                    std::to_string(estimate.size()) + " estimated poses have truth at their stamp");
    }
    if (options.alignment == TruthAlignment::kBestFit) {
        result.truth_from_estimate =
            align_points(positions(pairs.truth), positions(pairs.estimate));
    } else if (options.alignment == TruthAlignment::kFirstPose) {
        result.truth_from_estimate = pairs.truth.front() * pairs.estimate.front().inverse();
    }
    add_absolute_errors(pairs, result);
    add_relative_errors(pairs, result);
    return result;
}

}  // namespace hybrid_slam
