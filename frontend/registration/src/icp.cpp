// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/registration/icp.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {

namespace {

// A point without a known normal pulls in both directions, but a post or a corner is found less
// surely than a wall.
constexpr double kNoNormalWeight = 0.3;
// Below this ratio of eigenvalues the normal equations do not determine the pose.
constexpr double kDegenerateRatio = 1e-9;

struct Pair {
    std::size_t scan;
    std::size_t reference;
    double squared_distance;
};

// Pairs every point with its nearest neighbour and keeps those within the gate whose normals agree.
class Pairing {
  public:
    Pairing(const Surface& scan, const Reference& reference, const IcpConfig& config)
        : scan_(scan),
          reference_(reference),
          config_(config),
          min_cosine_(std::cos(config.max_normal_angle)),
          gate_(config.max_distance) {}

    const std::vector<Pair>& update(const Pose2d& reference_from_points) {
        const Eigen::Matrix2d rotation = reference_from_points.rotation();
        moved_.resize(scan_.size());
        for (std::size_t i = 0; i < scan_.size(); ++i) {
            moved_[i] = rotation * scan_.points[i] + reference_from_points.translation;
        }
        reference_.neighbors().find(moved_, answer_);
        pairs_.clear();
        const double squared_gate = gate_ * gate_;
        for (std::size_t i = 0; i < scan_.size(); ++i) {
            const std::size_t j = answer_.indices[i];
            const double squared_distance = answer_.squared_distances[i];
            if (squared_distance <= squared_gate && normals_agree(rotation, i, j)) {
                pairs_.push_back({i, j, squared_distance});
            }
        }
        trim();
        return pairs_;
    }

    // The next gate follows the fit: wide while the guess is poor, narrow once walls lie on walls.
    void narrow() {
        if (pairs_.empty()) {
            return;
        }
        const auto middle = pairs_.begin() + static_cast<std::ptrdiff_t>(pairs_.size() / 2);
        std::nth_element(pairs_.begin(), middle, pairs_.end(), closer);
        const double wanted = config_.gate_factor * std::sqrt(middle->squared_distance);
        gate_ = std::clamp(wanted, std::min(config_.min_distance, gate_), gate_);
    }

    double gate() const { return gate_; }

    // A fit found through a wide gate is a start, not an answer: halves the gate, false when it is
    // narrow.
    bool tighten() {
        if (gate_ <= config_.min_distance) {
            return false;
        }
        gate_ = std::max(0.5 * gate_, config_.min_distance);
        return true;
    }

    // Share of all points whose pair is at most `distance` apart.
    double share_within(double distance) const {
        const auto close = std::count_if(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
            return pair.squared_distance <= distance * distance;
        });
        return scan_.size() == 0 ? 0.0
                                 : static_cast<double>(close) / static_cast<double>(scan_.size());
    }

  private:
    static bool closer(const Pair& a, const Pair& b) {
        return a.squared_distance < b.squared_distance;
    }

    bool normals_agree(const Eigen::Matrix2d& rotation, std::size_t i, std::size_t j) const {
        const Point2& a = scan_.normals[i];
        const Point2& b = reference_.surface().normals[j];
        if (a.isZero(0.0) || b.isZero(0.0)) {
            return true;
        }
        return (rotation * a).dot(b) >= min_cosine_;
    }

    void trim() {
        if (config_.trim >= 1.0 || pairs_.empty()) {
            return;
        }
        const auto keep = static_cast<std::ptrdiff_t>(
            std::ceil(config_.trim * static_cast<double>(pairs_.size())));
        std::nth_element(pairs_.begin(), pairs_.begin() + keep - 1, pairs_.end(), closer);
        pairs_.resize(static_cast<std::size_t>(keep));
    }

    const Surface& scan_;
    const Reference& reference_;
    const IcpConfig& config_;
    double min_cosine_;
    double gate_;
    Points moved_;
    NearestNeighbors::Answer answer_;
    std::vector<Pair> pairs_;
};

// The robust kernel at the width of one iteration: it narrows together with the gate.
struct Kernel {
    IcpKernel kind;
    double scale;  // metres

    double weight(double residual) const {
        const double ratio = std::abs(residual) / scale;
        switch (kind) {
            case IcpKernel::kHuber:
                return ratio <= 1.0 ? 1.0 : 1.0 / ratio;
            case IcpKernel::kCauchy:
                return 1.0 / (1.0 + ratio * ratio);
            case IcpKernel::kNone:
                break;
        }
        return 1.0;
    }
};

// The pairs of one iteration with the surfaces that they index.
struct Matches {
    const Surface& scan;
    const Surface& reference;
    const std::vector<Pair>& pairs;
};

// Normal equations over (x, y, heading) of reference_from_points, unit noise.
struct NormalEquations {
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    double squared_residuals = 0.0;
    double weights = 0.0;

    void add(const Eigen::Vector3d& jacobian, double residual, double weight) {
        h.noalias() += weight * jacobian * jacobian.transpose();
        g.noalias() += weight * residual * jacobian;
        squared_residuals += weight * residual * residual;
        weights += weight;
    }
};

NormalEquations linearize(const Matches& matches, const Pose2d& pose, IcpMetric metric,
                          const Kernel& kernel) {
    NormalEquations equations;
    const Eigen::Matrix2d rotation = pose.rotation();
    const bool to_line = metric == IcpMetric::kPointToLine;
    for (const Pair& pair : matches.pairs) {
        const Eigen::Vector2d arm = rotation * matches.scan.points[pair.scan];
        const Eigen::Vector2d gap =
            arm + pose.translation - matches.reference.points[pair.reference];
        const Eigen::Vector2d swing(-arm.y(), arm.x());  // d(arm) / d(heading)
        Eigen::Vector2d normal = matches.reference.normals[pair.reference];
        if (normal.isZero(0.0)) {
            normal = rotation * matches.scan.normals[pair.scan];
        }
        if (to_line && !normal.isZero(0.0)) {
            const double residual = normal.dot(gap);
            equations.add({normal.x(), normal.y(), normal.dot(swing)}, residual,
                          kernel.weight(residual));
            continue;
        }
        const double weight = (to_line ? kNoNormalWeight : 1.0) * kernel.weight(gap.norm());
        equations.add({1.0, 0.0, swing.x()}, gap.x(), weight);
        equations.add({0.0, 1.0, swing.y()}, gap.y(), weight);
    }
    return equations;
}

Pose2d moved(const Pose2d& pose, const Eigen::Vector3d& step) {
    return {pose.x() + step.x(), pose.y() + step.y(), normalize_angle(pose.heading + step.z())};
}

double residual_variance(const NormalEquations& equations, const IcpConfig& config) {
    const double floor = config.noise_floor * config.noise_floor;
    return equations.weights > 0.0
               ? std::max(floor, equations.squared_residuals / equations.weights)
               : floor;
}

// One Gauss-Newton step with the guess as a prior; false when nothing determines it.
bool gauss_newton_step(const NormalEquations& equations, const IcpGuess& guess,
                       const IcpConfig& config, const Pose2d& pose, Eigen::Vector3d& step) {
    const double variance = residual_variance(equations, config);
    const Eigen::Matrix3d h = equations.h / variance + guess.information;
    const Eigen::Vector3d g =
        equations.g / variance + guess.information * difference(pose, guess.reference_from_points);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(h, Eigen::EigenvaluesOnly);
    const Eigen::Vector3d values = eigen.eigenvalues();
    if (!(values(0) > kDegenerateRatio * values(2))) {
        return false;
    }
    step = -h.ldlt().solve(g);
    return step.allFinite();
}

// The SVD's closed form, as a step of (x, y, heading).
Eigen::Vector3d closed_form_step(const Matches& matches, const Pose2d& pose, const Kernel& kernel) {
    Points from;
    Points to;
    std::vector<double> weights;
    for (const Pair& pair : matches.pairs) {
        from.push_back(matches.scan.points[pair.scan]);
        to.push_back(matches.reference.points[pair.reference]);
        weights.push_back(kernel.weight(std::sqrt(pair.squared_distance)));
    }
    return difference(align_points(to, from, weights), pose);
}

void describe_certainty(const NormalEquations& equations, const IcpConfig& config,
                        IcpResult& result) {
    result.rms =
        equations.weights > 0.0 ? std::sqrt(equations.squared_residuals / equations.weights) : 0.0;
    result.information = equations.h / residual_variance(equations, config);
    const Eigen::Matrix3d& h = result.information;
    if (h(2, 2) <= 0.0) {
        return;
    }
    // Marginal information of the translation: the Schur complement of the heading.
    const Eigen::Matrix2d translation =
        h.topLeftCorner<2, 2>() -
        h.topRightCorner<2, 1>() * h.topRightCorner<2, 1>().transpose() / h(2, 2);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(translation);
    const double small = std::max(eigen.eigenvalues()(0), 0.0);
    const double large = eigen.eigenvalues()(1);
    result.weakness_ratio = large > 0.0 ? std::sqrt(small / large) : 0.0;
    result.weak_direction = eigen.eigenvectors().col(0);
}

bool enough(const std::vector<Pair>& pairs, const Surface& scan, const IcpConfig& config) {
    return pairs.size() >= 3 && static_cast<double>(pairs.size()) >=
                                    config.min_overlap * static_cast<double>(scan.size());
}

}  // namespace

std::string_view to_string(IcpStatus status) {
    switch (status) {
        case IcpStatus::kConverged:
            return "converged";
        case IcpStatus::kMaxIterations:
            return "max_iterations";
        case IcpStatus::kTooFewPairs:
            return "too_few_pairs";
        case IcpStatus::kDegenerate:
            return "degenerate";
    }
    return "unknown";
}

IcpResult align(const Surface& scan, const Reference& reference, const IcpGuess& guess,
                const IcpConfig& config) {
    IcpResult result;
    result.reference_from_points = guess.reference_from_points;
    result.status = IcpStatus::kMaxIterations;
    Pairing pairing(scan, reference, config);
    Pose2d pose = guess.reference_from_points;
    for (; result.iterations < config.max_iterations; ++result.iterations) {
        const Matches matches{scan, reference.surface(), pairing.update(pose)};
        result.pairs = matches.pairs.size();
        if (!enough(matches.pairs, scan, config)) {
            result.status = IcpStatus::kTooFewPairs;
            break;
        }
        const Kernel kernel{config.kernel, std::max(config.kernel_scale,
                                                    config.kernel_gate_ratio * pairing.gate())};
        Eigen::Vector3d step;
        if (config.metric == IcpMetric::kPointToPoint) {
            step = closed_form_step(matches, pose, kernel);
        } else if (!gauss_newton_step(linearize(matches, pose, config.metric, kernel), guess,
                                      config, pose, step)) {
            result.status = IcpStatus::kDegenerate;
            break;
        }
        pose = moved(pose, step);
        pairing.narrow();
        if (step.head<2>().norm() < config.translation_tolerance &&
            std::abs(step.z()) < config.rotation_tolerance && !pairing.tighten()) {
            result.status = IcpStatus::kConverged;
            ++result.iterations;
            break;
        }
    }
    if (result.usable()) {
        result.reference_from_points = pose;
        const Matches matches{scan, reference.surface(), pairing.update(pose)};
        const Kernel kernel{config.kernel, config.kernel_scale};
        describe_certainty(linearize(matches, pose, config.metric, kernel), config, result);
        result.pairs = matches.pairs.size();
        result.overlap = pairing.share_within(config.min_distance);
    }
    return result;
}

void expect_consistent(const IcpConfig& config) {
    if (config.min_distance > config.max_distance) {
        throw Error("icp.min_distance: must not exceed icp.max_distance");
    }
    if (config.trim < config.min_overlap) {
        throw Error(
            "icp.trim: must not be less than icp.min_overlap, or no alignment ever succeeds");
    }
}

void describe(ConfigSchema& schema, IcpConfig& config) {
    schema.add(
        "metric", config.metric,
        {{"point_to_point", IcpMetric::kPointToPoint}, {"point_to_line", IcpMetric::kPointToLine}},
        "distance that is minimised");
    schema.add("max_iterations", config.max_iterations, 1, 1000, "iterations at most");
    schema.add("max_distance", config.max_distance, 0.01, 10.0,
               "m, pairs farther apart are no pairs, at first");
    schema.add("min_distance", config.min_distance, 0.01, 10.0,
               "m, to where that limit narrows as the fit improves");
    schema.add("gate_factor", config.gate_factor, 1.0, 1000.0,
               "the limit is this many times the median distance of the pairs");
    schema.add("max_normal_angle", config.max_normal_angle, 0.05, kPi,
               "rad, between the wall directions of a pair");
    schema.add("trim", config.trim, 0.1, 1.0, "share of the pairs kept, the closest first");
    schema.add(
        "kernel", config.kernel,
        {{"none", IcpKernel::kNone}, {"huber", IcpKernel::kHuber}, {"cauchy", IcpKernel::kCauchy}},
        "robust kernel on the distances");
    schema.add("kernel_scale", config.kernel_scale, 1e-3, 10.0, "m, width of the kernel");
    schema.add("kernel_gate_ratio", config.kernel_gate_ratio, 0.0, 10.0,
               "the kernel is at least this share of the distance limit wide");
    schema.add("translation_tolerance", config.translation_tolerance, 1e-9, 0.1,
               "m, converged when a step is smaller");
    schema.add("rotation_tolerance", config.rotation_tolerance, 1e-9, 0.1,
               "rad, converged when a step is smaller");
    schema.add("min_overlap", config.min_overlap, 0.0, 1.0,
               "share of the points that need a partner");
    schema.add("noise_floor", config.noise_floor, 1e-4, 1.0,
               "m, no distance counts as more certain than this");
}

}  // namespace hybrid_slam
