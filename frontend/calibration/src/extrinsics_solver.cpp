// SPDX-License-Identifier: Apache-2.0
#include "extrinsics_solver.hpp"

#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

using Jet = ceres::Jet<double, kExtrinsics>;
template <typename Scalar>
using Values = Eigen::Matrix<Scalar, kExtrinsics, 1>;

constexpr int kMostIterations = 60;
constexpr double kCauchy = 2.385;       // sigmas: 95 % efficient for Gaussian errors
constexpr double kHardlyCounts = 0.25;  // weight of an outlier

template <typename Scalar>
const Scalar& get(const Values<Scalar>& values, Extrinsic which) {
    return values[static_cast<Eigen::Index>(which)];
}

/// What one interval disagrees by, whitened, and how that changes with the unknowns.
struct Row {
    enum class Kind { kMotion, kSlip };
    double time = 0.0;  ///< seconds, its middle
    Kind kind = Kind::kMotion;
    int size() const { return kind == Kind::kMotion ? 3 : 1; }
    /// Metres, metres and radians; of a slip the first one alone.
    Eigen::Vector3d residual = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, 3, kExtrinsics> jacobian = Eigen::Matrix<double, 3, kExtrinsics>::Zero();
};

/// Of (x, y, heading) in the laser's axes: X = laser_from_camera on both ways around.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 1> motion_error(const LaserStep& laser, const CameraTrack::Motion& camera,
                                         double laser_y, const Values<Scalar>& v,
                                         const Scalar& more_time) {
    using Pose = Pose2<Scalar>;
    using Vector3 = typename Pose::Vector3;
    // The camera's clock later by more_time reads its track that much earlier, at both ends.
    const Vector3 begin = more_time * camera.twist_at_begin.template cast<Scalar>();
    const Vector3 end = -more_time * camera.twist_at_end.template cast<Scalar>();
    Pose moved = Pose::exp(begin) * camera.begin_from_end.template cast<Scalar>() * Pose::exp(end);
    moved.translation *= get(v, Extrinsic::kScale);
    const Pose robot_from_laser(get(v, Extrinsic::kLaserX), Scalar(laser_y),
                                get(v, Extrinsic::kLaserYaw));
    const Pose robot_from_camera(get(v, Extrinsic::kCameraX), get(v, Extrinsic::kCameraY),
                                 get(v, Extrinsic::kCameraYaw));
    const Pose laser_from_camera = robot_from_laser.inverse() * robot_from_camera;
    const Pose one_way = laser.begin_from_end.template cast<Scalar>() * laser_from_camera;
    const Pose other_way = laser_from_camera * moved;
    const typename Pose::Vector2 apart = one_way.translation - other_way.translation;
    return {apart.x(), apart.y(), normalize_angle(Scalar(one_way.heading - other_way.heading))};
}

/// Sideways part of the origin's motion: the laser's twist seen from the robot (adjoint), summed.
template <typename Scalar>
Scalar slip_error(const LaserStep& laser, const Values<Scalar>& v) {
    using std::cos;
    using std::sin;
    const Scalar& yaw = get(v, Extrinsic::kLaserYaw);
    return sin(yaw) * laser.integral.x() + cos(yaw) * laser.integral.y() -
           get(v, Extrinsic::kLaserX) * laser.integral.z();
}

double median_of(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Standard deviation by the median of absolute deviations from zero.
double spread_of(const std::vector<double>& errors, double least) {
    constexpr double kGaussian = 1.4826;
    return errors.empty() ? least : std::max(least, kGaussian * median_of(errors));
}

IntervalSigmas sigmas_of(const std::vector<Row>& rows) {
    std::vector<double> translation;
    std::vector<double> heading;
    std::vector<double> slip;
    for (const Row& row : rows) {
        if (row.kind == Row::Kind::kSlip) {
            slip.push_back(std::abs(row.residual.x()));
            continue;
        }
        translation.push_back(std::abs(row.residual.x()));
        translation.push_back(std::abs(row.residual.y()));
        heading.push_back(std::abs(row.residual.z()));
    }
    // No sensor is better than that, and exact data must not divide by zero.
    constexpr double kLeastTranslation = 1e-5;  // metres
    constexpr double kLeastHeading = 1e-5;      // radians
    return {spread_of(translation, kLeastTranslation), spread_of(heading, kLeastHeading),
            spread_of(slip, kLeastTranslation)};
}

void whiten(std::vector<Row>& rows, const IntervalSigmas& sigmas) {
    for (Row& row : rows) {
        const Eigen::Vector3d scale =
            row.kind == Row::Kind::kSlip
                ? Eigen::Vector3d(1.0 / sigmas.slip, 0.0, 0.0)
                : Eigen::Vector3d(1.0 / sigmas.translation, 1.0 / sigmas.translation,
                                  1.0 / sigmas.heading);
        row.residual = scale.cwiseProduct(row.residual);
        row.jacobian = scale.asDiagonal() * row.jacobian;
    }
}

/// Cauchy's weight of a whole interval, and the mean slope of weight * residual, by which it says
/// less than its weight.
struct Weight {
    double weight = 1.0;
    double slope = 1.0;
};
Weight weight_of(const Row& row) {
    const double most = kCauchy * kCauchy * row.size();
    const double squared = row.residual.squaredNorm();
    const double weight = 1.0 / (1.0 + squared / most);
    return {weight, weight - 2.0 * squared / (row.size() * most) * weight * weight};
}

/// What is known before the drive: next to nothing, so that what the drive does not tell comes out
/// with a large sigma.
ExtrinsicsVector prior_sigmas() {
    constexpr double kTime = 1.0;  // seconds
    constexpr double kScale = 1.0;
    constexpr double kArm = 10.0;  // metres
    ExtrinsicsVector sigmas;
    sigmas << kTime, kScale, kPi, kArm, kPi, kArm, kArm;
    return sigmas;
}

class Solver {
  public:
    Solver(const ExtrinsicsDrive& drive, const ExtrinsicsConfig& config)
        : config_(config),
          laser_y_(drive.robot_from_laser.y()),
          track_(drive.vision, drive.robot_from_camera, config.max_gap) {
        solution_.values << 0.0, 1.0, drive.robot_from_laser.heading, drive.robot_from_laser.x(),
            drive.robot_from_camera.heading, drive.robot_from_camera.x(),
            drive.robot_from_camera.y();
        start_ = solution_.values;
    }

    ExtrinsicsSolution solve(const std::vector<LaserStep>& compared,
                             const std::vector<LaserStep>& slipping) {
        while (!solution_.converged && solution_.iterations < kMostIterations) {
            linearize(compared, slipping);
            step();
        }
        linearize(compared, slipping);
        set_sigmas();
        return solution_;
    }

  private:
    void linearize(const std::vector<LaserStep>& compared, const std::vector<LaserStep>& slipping) {
        rows_.clear();
        solution_.blind = 0;
        for (const LaserStep& laser : compared) {
            const double time = get(solution_.values, Extrinsic::kTime);
            if (const auto camera = track_.motion(laser.begin - time, laser.end - time)) {
                add_motion(laser, *camera);
            } else {
                ++solution_.blind;
            }
        }
        solution_.intervals = rows_.size();
        for (const LaserStep& laser : slipping) {
            add_slip(laser);
        }
        solution_.residuals = sigmas_of(rows_);
        whiten(rows_, solution_.residuals);
        solution_.outliers =
            static_cast<std::size_t>(std::count_if(rows_.begin(), rows_.end(), [](const Row& row) {
                return row.kind != Row::Kind::kSlip && weight_of(row).weight < kHardlyCounts;
            }));
    }

    Values<Jet> jets() const {
        Values<Jet> values;
        for (int i = 0; i < static_cast<int>(kExtrinsics); ++i) {
            values[i] = Jet(solution_.values[i], i);
        }
        return values;
    }

    void add_motion(const LaserStep& laser, const CameraTrack::Motion& camera) {
        const Jet more_time(0.0, static_cast<int>(Extrinsic::kTime));
        const Eigen::Matrix<Jet, 3, 1> error =
            motion_error<Jet>(laser, camera, laser_y_, jets(), more_time);
        Row row;
        row.time = 0.5 * (laser.begin + laser.end);
        for (int i = 0; i < row.size(); ++i) {
            row.residual[i] = error[i].a;
            row.jacobian.row(i) = error[i].v.transpose();
        }
        rows_.push_back(row);
    }

    void add_slip(const LaserStep& laser) {
        const Jet error = slip_error<Jet>(laser, jets());
        Row row;
        row.time = 0.5 * (laser.begin + laser.end);
        row.kind = Row::Kind::kSlip;
        row.residual[0] = error.a;
        row.jacobian.row(0) = error.v.transpose();
        rows_.push_back(row);
    }

    /// With the slopes in place of the weights: how fast the pull of all rows really changes.
    ExtrinsicsMatrix normal_matrix(double Weight::*kind) const {
        ExtrinsicsMatrix normal =
            prior_sigmas().cwiseAbs2().cwiseInverse().asDiagonal().toDenseMatrix();
        for (const Row& row : rows_) {
            normal += weight_of(row).*kind * row.jacobian.transpose() * row.jacobian;
        }
        return normal;
    }

    static ExtrinsicsVector pull(const Row& row) {
        return weight_of(row).weight * row.jacobian.transpose() * row.residual;
    }

    void step() {
        ExtrinsicsVector gradient =
            (solution_.values - start_).cwiseQuotient(prior_sigmas().cwiseAbs2());
        for (const Row& row : rows_) {
            gradient += pull(row);
        }
        const ExtrinsicsMatrix normal = normal_matrix(&Weight::weight);
        const ExtrinsicsVector change = -normal.ldlt().solve(gradient);
        solution_.values += change;
        for (const Extrinsic yaw : {Extrinsic::kLaserYaw, Extrinsic::kCameraYaw}) {
            double& angle = solution_.values[static_cast<Eigen::Index>(yaw)];
            angle = normalize_angle(angle);
        }
        ++solution_.iterations;
        constexpr double kSmall = 1e-3;  // sigmas
        solution_.converged = change.dot(normal * change) < kSmall * kSmall;
    }

    /// Errors of drifting sensors last for longer than an interval: the covariance of the sum of
    /// all pulls counts those that are near in time as related (Newey and West 1987). Where the
    /// drive hardly tells that is too small, so never below what as many independent errors would
    /// give.
    void set_sigmas() {
        const ExtrinsicsMatrix inverse =
            normal_matrix(&Weight::slope).ldlt().solve(ExtrinsicsMatrix::Identity());
        const double related = 2.0 * config_.slip_interval;
        ExtrinsicsMatrix middle = ExtrinsicsMatrix::Zero();
        for (const Row& a : rows_) {
            for (const Row& b : rows_) {
                const double share = 1.0 - std::abs(a.time - b.time) / related;
                if (share > 0.0) {
                    middle += share * pull(a) * pull(b).transpose();
                }
            }
        }
        const ExtrinsicsVector sandwich = (inverse * middle * inverse).diagonal();
        solution_.sigmas = inverse.diagonal().cwiseMax(sandwich).cwiseSqrt();
    }

    const ExtrinsicsConfig& config_;
    double laser_y_;
    CameraTrack track_;
    ExtrinsicsVector start_;
    std::vector<Row> rows_;
    ExtrinsicsSolution solution_;
};

}  // namespace

ExtrinsicsSolution solve_extrinsics(const ExtrinsicsDrive& drive,
                                    const std::vector<LaserStep>& compared,
                                    const std::vector<LaserStep>& slipping,
                                    const ExtrinsicsConfig& config) {
    return Solver(drive, config).solve(compared, slipping);
}

}  // namespace hybrid_slam
