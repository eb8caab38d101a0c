// SPDX-License-Identifier: Apache-2.0
#include "motion_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {
namespace {

constexpr int kMostIterations = 25;
constexpr double kTranslationTolerance = 1e-5;  ///< metres
constexpr double kRotationTolerance = 1e-6;     ///< radians
constexpr double kKernel = 2.0;                 ///< sigmas, of the Cauchy kernel at the end
constexpr double kFirstKernel = 40.0;           ///< sigmas, at the start
constexpr double kKernelShrink = 0.5;           ///< for each iteration
constexpr double kInlier = 11.8;                ///< chi2 of 2 degrees of freedom at 3 sigma
/// chi2 that a feature must save by lying elsewhere: what is free to choose its depth fits
/// more easily.
constexpr double kElsewherePenalty = 6.0;
/// Neighbouring features err alike: so many of them say what one would.
constexpr double kCorrelated = 4.0;
constexpr double kBehind = 1e6;  ///< chi2 of what should be behind the camera

// What moves in a Gauss-Newton step: x, y, heading, tilt, aim.
using State = Eigen::Matrix<double, 7, 1>;
using Information = Eigen::Matrix<double, 7, 7>;

struct Residual {
    Eigen::Vector2d error = Eigen::Vector2d::Zero();
    Eigen::Matrix2d weight = Eigen::Matrix2d::Zero();
    Eigen::Matrix<double, 2, 7> jacobian = Eigen::Matrix<double, 2, 7>::Zero();
    double chi2 = 0.0;
    double inverse_depth = 0.0;  ///< the most likely one
};

/// The camera as it is believed to be mounted, and turned a little further to take derivatives.
struct Cameras {
    Cameras(const CameraOnRobot& mounted, const Eigen::Vector2d& aim)
        : middle(mounted.turned_by(aim)),
          pitched(mounted.turned_by(aim + Eigen::Vector2d(kAimStep, 0.0))),
          yawed(mounted.turned_by(aim + Eigen::Vector2d(0.0, kAimStep))) {}

    static constexpr double kAimStep = 1e-5;  ///< radians
    CameraOnRobot middle;
    CameraOnRobot pitched;
    CameraOnRobot yawed;
};

/// A feature at a depth, or on the floor wherever the camera then sees that.
Prediction predict_from(const CameraOnRobot& camera, const Sighting& sighting, bool floor,
                        double inverse_depth, const SolvedMotion& motion) {
    const Eigen::Vector3d before = camera.direction(sighting.before);
    return predict(camera, before, floor ? camera.floor_inverse_depth(before) : inverse_depth,
                   motion.before_from_now, motion.tilt);
}

/// How a prediction changes with the aim, by differences.
template <typename Predict>
Eigen::Matrix2d by_aim(const Cameras& cameras, const Prediction& middle, const Predict& predicted) {
    const Prediction pitched = predicted(cameras.pitched);
    const Prediction yawed = predicted(cameras.yawed);
    Eigen::Matrix2d derivative = Eigen::Matrix2d::Zero();
    if (pitched.ahead && yawed.ahead) {
        derivative.col(0) = (pitched.now - middle.now) / Cameras::kAimStep;
        derivative.col(1) = (yawed.now - middle.now) / Cameras::kAimStep;
    }
    return derivative;
}

/// The inverse depth is marginalised: what it could be is noise along the epipolar line. Linearised
/// at the depth found in the iteration before.
Residual residual_of(const Cameras& cameras, const Sighting& sighting, const DepthBelief& belief,
                     bool floor, const SolvedMotion& motion) {
    const double at = sighting.inverse_depth;
    const Prediction prediction = predict_from(cameras.middle, sighting, floor, at, motion);
    Residual residual;
    if (!prediction.ahead) {
        residual.chi2 = kBehind;
        residual.inverse_depth = belief.inverse_depth;
        return residual;
    }
    const Eigen::Vector2d& slide = prediction.by_inverse_depth;
    residual.error = prediction.now - sighting.now;
    if (!floor) {
        residual.error += slide * (belief.inverse_depth - at);
    }
    const double variance = belief.sigma * belief.sigma;
    // Sherman and Morrison: the information of a measurement with that noise added.
    const Eigen::Vector2d seen = sighting.information * slide;
    residual.weight = sighting.information -
                      variance / (1.0 + variance * slide.dot(seen)) * seen * seen.transpose();
    residual.jacobian.leftCols<5>() = prediction.by_motion;
    residual.jacobian.rightCols<2>() =
        by_aim(cameras, prediction, [&](const CameraOnRobot& camera) {
            return predict_from(camera, sighting, floor, at, motion);
        });
    residual.chi2 = residual.error.dot(residual.weight * residual.error);
    const double likely =
        belief.inverse_depth - variance * slide.dot(residual.weight * residual.error);
    residual.inverse_depth = std::max(likely, 0.0);
    return residual;
}

/// The better of what is believed of a sighting and of knowing nothing.
Residual judge(const Cameras& cameras, Sighting& sighting, const SolvedMotion& motion,
               double kernel) {
    // While the kernel is wide nobody is to leave what is believed of him for a first guess's sake.
    const double penalty = kElsewherePenalty * kernel * kernel / (kKernel * kKernel);
    Residual residual = residual_of(cameras, sighting, sighting.belief, sighting.floor, motion);
    sighting.on_floor = sighting.floor;
    if (residual.chi2 > penalty) {
        const Residual free =
            residual_of(cameras, sighting, DepthBelief::anywhere(), false, motion);
        if (free.chi2 + penalty < residual.chi2) {
            residual = free;
            residual.chi2 += penalty;
            sighting.on_floor = false;
        }
    }
    sighting.inverse_depth = residual.inverse_depth;
    sighting.chi2 = residual.chi2;
    return residual;
}

struct NormalEquations {
    Information hessian = Information::Zero();
    State gradient = State::Zero();
};

/// By the sightings and the stiffness of the mounting.
NormalEquations sum_up(const CameraOnRobot& camera, std::vector<Sighting>& sightings,
                       const SolvedMotion& motion, double kernel, double tilt_sigma) {
    const Cameras cameras(camera, motion.aim);
    NormalEquations sums;
    for (Sighting& sighting : sightings) {
        const Residual residual = judge(cameras, sighting, motion, kernel);
        const double weight = 1.0 / (kCorrelated * (1.0 + residual.chi2 / (kernel * kernel)));
        const Eigen::Matrix<double, 7, 2> weighted =
            weight * residual.jacobian.transpose() * residual.weight;
        sums.hessian += weighted * residual.jacobian;
        sums.gradient += weighted * residual.error;
    }
    const double stiffness = 1.0 / (tilt_sigma * tilt_sigma);
    sums.hessian.diagonal().segment<2>(3).array() += stiffness;
    sums.gradient.segment<2>(3) += stiffness * motion.tilt;
    return sums;
}

/// What is left to say of the motion when tilt and aim are known no better than believed.
Eigen::Matrix3d motion_information(Information hessian, const SightBelief& belief) {
    hessian.bottomRightCorner<2, 2>() += belief.aim_information;
    const Eigen::Matrix<double, 3, 4> mixed = hessian.topRightCorner<3, 4>();
    return hessian.topLeftCorner<3, 3>() -
           mixed * hessian.bottomRightCorner<4, 4>().inverse() * mixed.transpose();
}

/// And of the aim, when the motion is known no better than believed.
Eigen::Matrix2d aim_information(Information hessian, const SightBelief& belief) {
    hessian.topLeftCorner<3, 3>() += belief.information;
    const Eigen::Matrix<double, 2, 5> mixed = hessian.bottomLeftCorner<2, 5>();
    return hessian.bottomRightCorner<2, 2>() -
           mixed * hessian.topLeftCorner<5, 5>().inverse() * mixed.transpose();
}

void count(std::vector<Sighting>& sightings, SolvedMotion& motion) {
    for (Sighting& sighting : sightings) {
        sighting.inlier = sighting.chi2 < kInlier;
        motion.inliers += sighting.inlier ? 1 : 0;
        motion.floor_inliers += sighting.inlier && sighting.on_floor ? 1 : 0;
    }
}

}  // namespace

Prediction predict(const CameraOnRobot& camera, const Eigen::Vector3d& before, double inverse_depth,
                   const Pose2d& before_from_now, const Eigen::Vector2d& tilt) {
    // The point times its inverse depth, so that points at infinity need no care:
    // R_cr (Rz(-heading) (d + rho (c - t)) - rho c), turned by the tilt.
    const Eigen::Vector3d center = camera.center();
    const Eigen::Matrix3d untilted = camera.robot_from_camera().transpose();
    Eigen::Matrix3d small_turn;
    small_turn << 1.0, -tilt.y(), 0.0, tilt.y(), 1.0, -tilt.x(), 0.0, tilt.x(), 1.0;
    const Eigen::Matrix3d camera_from_robot = small_turn * untilted;
    Eigen::Matrix3d turn_back = Eigen::Matrix3d::Identity();
    turn_back.topLeftCorner<2, 2>() = before_from_now.rotation().transpose();
    Eigen::Vector3d from_now = center;
    from_now.head<2>() -= before_from_now.translation;
    const Eigen::Vector3d in_now = turn_back * (before + inverse_depth * from_now);
    const Eigen::Vector3d seen = in_now - inverse_depth * center;
    const Eigen::Vector3d point = camera_from_robot * seen;

    Prediction prediction;
    prediction.ahead = point.z() > 1e-3;
    if (!prediction.ahead) {
        return prediction;
    }
    prediction.now = point.head<2>() / point.z();
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << 1.0, 0.0, -prediction.now.x(), 0.0, 1.0, -prediction.now.y();
    by_point /= point.z();
    Eigen::Matrix<double, 3, 5> motion;
    motion.leftCols<2>() = -inverse_depth * (camera_from_robot * turn_back).leftCols<2>();
    motion.col(2) = camera_from_robot * Eigen::Vector3d(in_now.y(), -in_now.x(), 0.0);
    motion.col(3) = Eigen::Vector3d::UnitX().cross(untilted * seen);
    motion.col(4) = Eigen::Vector3d::UnitZ().cross(untilted * seen);
    prediction.by_motion = by_point * motion;
    prediction.by_inverse_depth = by_point * (camera_from_robot * (turn_back * from_now - center));
    return prediction;
}

SolvedMotion solve_motion(const CameraOnRobot& camera, std::vector<Sighting>& sightings,
                          const SightBelief& belief) {
    for (Sighting& sighting : sightings) {
        sighting.inverse_depth = sighting.belief.inverse_depth;
        sighting.on_floor = sighting.floor;
    }
    SolvedMotion motion;
    motion.before_from_now = belief.before_from_now;
    double kernel = kFirstKernel;
    bool converged = false;
    for (int i = 0; i < kMostIterations && !converged; ++i) {
        NormalEquations sums = sum_up(camera, sightings, motion, kernel, belief.tilt_sigma);
        sums.hessian.topLeftCorner<3, 3>() += belief.information;
        sums.gradient.head<3>() +=
            belief.information * difference(motion.before_from_now, belief.before_from_now);
        sums.hessian.bottomRightCorner<2, 2>() += belief.aim_information;
        sums.gradient.tail<2>() += belief.aim_information * motion.aim;
        const State step = -sums.hessian.ldlt().solve(sums.gradient);
        if (!step.allFinite()) {
            break;
        }
        motion.before_from_now.translation += step.head<2>();
        motion.before_from_now.heading = normalize_angle(motion.before_from_now.heading + step(2));
        motion.tilt += step.segment<2>(3);
        motion.aim += step.tail<2>();
        converged = kernel <= kKernel && step.head<2>().norm() < kTranslationTolerance &&
                    std::abs(step(2)) < kRotationTolerance;
        kernel = std::max(kKernel, kKernelShrink * kernel);
    }
    const Information hessian =
        sum_up(camera, sightings, motion, kKernel, belief.tilt_sigma).hessian;
    motion.information = motion_information(hessian, belief);
    motion.aim_information = aim_information(hessian, belief);
    count(sightings, motion);
    return motion;
}

}  // namespace hybrid_slam
