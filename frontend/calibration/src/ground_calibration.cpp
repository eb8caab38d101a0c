// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/ground_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Moves the middle of the points to the origin and makes them sqrt(2) long on average (Hartley,
/// In defense of the eight-point algorithm), without which A mixes numbers of very different size.
Eigen::Matrix3d normalization(const std::vector<Vector2>& points) {
    Vector2 middle = Vector2::Zero();
    for (const Vector2& point : points) {
        middle += point / static_cast<double>(points.size());
    }
    double length = 0.0;
    for (const Vector2& point : points) {
        length += (point - middle).norm() / static_cast<double>(points.size());
    }
    if (!(length > 0.0) || !std::isfinite(length)) {
        throw Error("all points of the floor are one");
    }
    const double scale = std::sqrt(2.0) / length;
    Eigen::Matrix3d matrix;
    matrix << scale, 0.0, -scale * middle.x(),  //
        0.0, scale, -scale * middle.y(),        //
        0.0, 0.0, 1.0;
    return matrix;
}

Vector2 mapped(const Eigen::Matrix3d& matrix, const Vector2& point) {
    return (matrix * point.homogeneous()).hnormalized();
}

/// Equation 3.3, two rows for each point.
Eigen::MatrixXd equations(const std::vector<Vector2>& from, const std::vector<Vector2>& to) {
    Eigen::MatrixXd a(2 * from.size(), 9);
    for (std::size_t i = 0; i < from.size(); ++i) {
        const double x = from[i].x();
        const double y = from[i].y();
        const auto row = static_cast<Eigen::Index>(2 * i);
        a.row(row) << x, y, 1.0, 0.0, 0.0, 0.0, -to[i].x() * x, -to[i].x() * y, -to[i].x();
        a.row(row + 1) << 0.0, 0.0, 0.0, x, y, 1.0, -to[i].y() * x, -to[i].y() * y, -to[i].y();
    }
    return a;
}

/// The three angles of robot_from_camera = Rz(yaw) Ry(pitch) Rx(roll) level.
Vector3 yaw_pitch_roll(const Eigen::Matrix3d& robot_from_camera) {
    CameraMounting level;
    level.pitch = 0.0;
    const Eigen::Matrix3d turned =
        robot_from_camera * level.robot_from_camera().linear().transpose();
    return {std::atan2(turned(1, 0), turned(0, 0)), std::asin(std::clamp(-turned(2, 0), -1.0, 1.0)),
            std::atan2(turned(2, 1), turned(2, 2))};
}

/// The camera's pose by the columns of the inverse homography, which are r1, r2 and t up to scale.
Eigen::Isometry3d pose_of(const Eigen::Matrix3d& patch_from_image) {
    Eigen::Matrix3d columns = patch_from_image.inverse();
    const double length = 0.5 * (columns.col(0).norm() + columns.col(1).norm());
    columns /= columns(2, 2) < 0.0 ? -length : length;  // the patch is in front of the camera
    Eigen::Matrix3d rotation;
    rotation << columns.col(0), columns.col(1), columns.col(0).cross(columns.col(1));
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Isometry3d camera_from_patch = Eigen::Isometry3d::Identity();
    camera_from_patch.linear() = svd.matrixU() * svd.matrixV().transpose();
    camera_from_patch.translation() = columns.col(2);
    return camera_from_patch.inverse();
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& camera_from_patch, const Vector6& step) {
    const double angle = step.head<3>().norm();
    Eigen::Isometry3d pose = camera_from_patch;
    if (angle > 0.0) {
        const Eigen::AngleAxisd turn(angle, step.head<3>() / angle);
        pose.linear() = turn.toRotationMatrix() * pose.linear();
    }
    pose.translation() += step.tail<3>();
    return pose;
}

/// The reprojection error over the camera's pose, minimised by Levenberg and Marquardt.
class PoseFit {
  public:
    PoseFit(const CameraModel& model, const std::vector<FloorPoint>& points)
        : model_(model), points_(points) {}

    Eigen::Isometry3d refine(Eigen::Isometry3d camera_from_patch) const {
        constexpr int kMostIterations = 50;
        double cost = residuals(camera_from_patch).squaredNorm();
        double damping = 1e-6;
        for (int i = 0; i < kMostIterations && damping < 1e6; ++i) {
            const Eigen::MatrixXd jacobian = derivative(camera_from_patch);
            Eigen::Matrix<double, 6, 6> normal = jacobian.transpose() * jacobian;
            normal.diagonal() *= 1.0 + damping;
            const Vector6 step =
                -normal.ldlt().solve(jacobian.transpose() * residuals(camera_from_patch));
            const Eigen::Isometry3d candidate = moved(camera_from_patch, step);
            const double candidate_cost = residuals(candidate).squaredNorm();
            if (!(candidate_cost < cost)) {
                damping *= 10.0;
                continue;
            }
            camera_from_patch = candidate;
            cost = candidate_cost;
            damping /= 10.0;
            if (step.norm() < 1e-12) {
                break;
            }
        }
        return camera_from_patch;
    }

    /// Two for each point; huge where a point does not appear at all.
    Eigen::VectorXd residuals(const Eigen::Isometry3d& camera_from_patch) const {
        Eigen::VectorXd errors(2 * points_.size());
        for (std::size_t i = 0; i < points_.size(); ++i) {
            const auto pixel = seen(camera_from_patch, points_[i].floor);
            errors.segment<2>(static_cast<Eigen::Index>(2 * i)) =
                pixel ? Vector2(*pixel - points_[i].pixel) : Vector2(1e6, 1e6);
        }
        return errors;
    }

    std::optional<Pixel> seen(const Eigen::Isometry3d& camera_from_patch,
                              const Vector2& floor) const {
        return model_.project(camera_from_patch * Vector3(floor.x(), floor.y(), 0.0));
    }

    Eigen::MatrixXd derivative(const Eigen::Isometry3d& camera_from_patch) const {
        constexpr double kStep = 1e-6;
        Eigen::MatrixXd jacobian(2 * points_.size(), 6);
        for (Eigen::Index i = 0; i < 6; ++i) {
            const Vector6 step = kStep * Vector6::Unit(i);
            jacobian.col(i) = (residuals(moved(camera_from_patch, step)) -
                               residuals(moved(camera_from_patch, -step))) /
                              (2.0 * kStep);
        }
        return jacobian;
    }

  private:
    const CameraModel& model_;
    const std::vector<FloorPoint>& points_;
};

/// Deviations of height, pitch and roll when each coordinate of a pixel has one of a pixel.
Vector3 deviations_per_pixel(const PoseFit& fit, const Eigen::Isometry3d& camera_from_patch) {
    constexpr double kStep = 1e-6;
    const auto told = [](const Eigen::Isometry3d& pose) {
        const CameraMounting mounting = mounting_of(pose.inverse());
        return Vector3(mounting.z, mounting.pitch, mounting.roll);
    };
    const Eigen::MatrixXd jacobian = fit.derivative(camera_from_patch);
    const Eigen::MatrixXd covariance = (jacobian.transpose() * jacobian).inverse();
    Eigen::Matrix<double, 3, 6> slopes;
    for (Eigen::Index i = 0; i < 6; ++i) {
        const Vector6 step = kStep * Vector6::Unit(i);
        slopes.col(i) =
            (told(moved(camera_from_patch, step)) - told(moved(camera_from_patch, -step))) /
            (2.0 * kStep);
    }
    return (slopes * covariance * slopes.transpose()).diagonal().cwiseSqrt();
}

Vector2 undistorted(const CameraModel& model, const Pixel& pixel) {
    const auto ray = model.ray(pixel);
    if (!ray) {
        throw Error(fmt::format("the camera model has no direction for pixel {:.1f},{:.1f}",
                                pixel.x(), pixel.y()));
    }
    return ray->head<2>();
}

double rms_of(const Eigen::VectorXd& residuals) {
    return std::sqrt(residuals.squaredNorm() / (0.5 * static_cast<double>(residuals.size())));
}

/// In pixels, of the corners that the homography puts where the floor points are.
double homography_rms(const CameraModel& model, const Eigen::Matrix3d& patch_from_image,
                      const std::vector<FloorPoint>& points) {
    const Eigen::Matrix3d image_from_patch = patch_from_image.inverse();
    double sum = 0.0;
    for (const FloorPoint& point : points) {
        const Vector2 ray = mapped(image_from_patch, point.floor);
        const auto pixel = model.project(ray.homogeneous());
        sum += pixel ? (*pixel - point.pixel).squaredNorm() : 0.0;
    }
    return std::sqrt(sum / static_cast<double>(points.size()));
}

double cross(const Vector2& a, const Vector2& b) {
    return a.x() * b.y() - a.y() * b.x();
}

constexpr auto kNoTile =
    "the four corners do not look like a tile: three of them lie on one line, "
    "or one lies between the others";

/// Throws Error unless the corners, in this order, go around a figure without dents.
void check_convex(const std::array<Vector2, 4>& corners) {
    for (std::size_t i = 0; i < 4; ++i) {
        const Vector2 before = corners[(i + 1) % 4] - corners[i];
        const Vector2 behind = corners[(i + 2) % 4] - corners[(i + 1) % 4];
        if (!(cross(before, behind) < 0.0)) {
            throw Error(kNoTile);
        }
    }
}

/// Throws Error when any three corners lie on a line but for clicks that are a little off. Both in
/// the image and undistorted: each bends the lines of the other, which then pass for a tile.
void check_no_line(const std::array<Vector2, 4>& corners) {
    constexpr double kLeastHeight = 0.01;  // of the longest side of a triangle
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
        const Vector2& a = corners[(left_out + 1) % 4];
        const Vector2 ab = corners[(left_out + 2) % 4] - a;
        const Vector2 ac = corners[(left_out + 3) % 4] - a;
        const double square =
            std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
        if (!(std::abs(cross(ab, ac)) > kLeastHeight * square)) {
            throw Error(kNoTile);
        }
    }
}

}  // namespace

Eigen::Matrix3d fit_homography(const std::vector<Vector2>& from, const std::vector<Vector2>& to) {
    if (from.size() != to.size() || from.size() < 4) {
        throw Error(fmt::format("a homography needs four points on both sides, not {} and {}",
                                from.size(), to.size()));
    }
    const Eigen::Matrix3d from_normal = normalization(from);
    const Eigen::Matrix3d to_normal = normalization(to);
    std::vector<Vector2> tidy_from;
    std::vector<Vector2> tidy_to;
    for (std::size_t i = 0; i < from.size(); ++i) {
        tidy_from.push_back(mapped(from_normal, from[i]));
        tidy_to.push_back(mapped(to_normal, to[i]));
    }
    // Equations 3.4 and 3.5: A h = 0, so h is the last column of V in A = U D V'.
    const Eigen::MatrixXd a = equations(tidy_from, tidy_to);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a, Eigen::ComputeFullV);
    const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
    Eigen::Matrix3d tidy;
    tidy << h.head<3>().transpose(), h.segment<3>(3).transpose(), h.tail<3>().transpose();
    // Of points on one line there is a whole family of solutions, or a singular one.
    constexpr double kLeast = 1e-6;
    const bool unique = svd.singularValues()(7) > kLeast * svd.singularValues()(0);
    const Eigen::JacobiSVD<Eigen::Matrix3d> check(tidy);
    if (!unique || !(check.singularValues()(2) > kLeast * check.singularValues()(0))) {
        throw Error("the points determine no homography: too many of them lie on one line");
    }
    const Eigen::Matrix3d matrix = to_normal.inverse() * tidy * from_normal;
    return matrix / matrix.norm();
}

std::vector<FloorPoint> tile_points(const CameraModel& model, const std::vector<Pixel>& corners,
                                    double side) {
    if (corners.size() != 4) {
        throw Error(fmt::format("a tile has four corners, not {}", corners.size()));
    }
    if (!(side >= 0.01 && side <= 100.0)) {
        throw Error(fmt::format("a tile must be 0.01 to 100 m wide, not {}", side));
    }
    std::array<std::pair<double, std::size_t>, 4> around;
    std::array<Vector2, 4> rays;
    Vector2 middle = Vector2::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
        rays[i] = undistorted(model, corners[i]);
        middle += 0.25 * rays[i];
    }
    for (std::size_t i = 0; i < 4; ++i) {
        const Vector2 arm = rays[i] - middle;
        around[i] = {std::atan2(-arm.y(), arm.x()), i};  // y points down in the image
    }
    // Counter-clockwise as they are seen, which is also what they are from above.
    std::sort(around.begin(), around.end());
    std::array<Vector2, 4> ordered;
    std::array<Vector2, 4> seen;
    std::vector<FloorPoint> points;
    const std::array<Vector2, 4> floor{Vector2(0.5, -0.5), Vector2(0.5, 0.5), Vector2(-0.5, 0.5),
                                       Vector2(-0.5, -0.5)};
    for (std::size_t i = 0; i < 4; ++i) {
        ordered[i] = rays[around[i].second];
        seen[i] = corners[around[i].second];
        points.push_back({corners[around[i].second], side * floor[i]});
    }
    check_convex(ordered);
    check_no_line(ordered);
    check_no_line(seen);
    return points;
}

std::vector<FloorPoint> board_points(const std::vector<Pixel>& corners, const Chessboard& board) {
    check(board);
    const auto columns = static_cast<std::size_t>(board.columns);
    const auto rows = static_cast<std::size_t>(board.rows);
    if (corners.size() != columns * rows) {
        throw Error(fmt::format("a board of {} x {} inner corners has {} of them, not {}", columns,
                                rows, columns * rows, corners.size()));
    }
    // Down the rows must be to the right of along them, seen from above; else it is a mirror image.
    const Pixel along = corners[columns - 1] - corners[0];
    const Pixel down = corners[(rows - 1) * columns] - corners[0];
    const double side = cross(along, down) > 0.0 ? -1.0 : 1.0;
    std::vector<FloorPoint> points;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const std::size_t row = i / columns;
        const std::size_t column = i % columns;
        const double x = static_cast<double>(column) - 0.5 * static_cast<double>(columns - 1);
        const double y = static_cast<double>(row) - 0.5 * static_cast<double>(rows - 1);
        points.push_back({corners[i], board.square * Vector2(x, side * y)});
    }
    return points;
}

bool GroundCalibration::cornerwise() const {
    return std::abs(mounting.yaw) > radians(40.0);
}

GroundCalibration calibrate_ground(const CameraModel& model,
                                   const std::vector<FloorPoint>& points) {
    std::vector<Vector2> rays;
    std::vector<Vector2> floor;
    for (const FloorPoint& point : points) {
        rays.push_back(undistorted(model, point.pixel));
        floor.push_back(point.floor);
    }
    GroundCalibration result;
    result.patch_from_image = fit_homography(rays, floor);
    result.homography_rms = homography_rms(model, result.patch_from_image, points);
    const PoseFit fit(model, points);
    const Eigen::Isometry3d camera_from_patch =
        fit.refine(pose_of(result.patch_from_image).inverse());
    result.rms = rms_of(fit.residuals(camera_from_patch));
    for (const FloorPoint& point : points) {
        result.expected.push_back(
            fit.seen(camera_from_patch, point.floor).value_or(Pixel(0.0, 0.0)));
    }
    // Quarters of a turn that bring the x axis to where the camera looks.
    const Eigen::Isometry3d patch_from_camera = camera_from_patch.inverse();
    const double yaw = yaw_pitch_roll(patch_from_camera.linear())(0);
    const Eigen::Isometry3d turn(
        Eigen::AngleAxisd(-0.5 * kPi * std::round(yaw / (0.5 * kPi)), Vector3::UnitZ()));
    result.patch_from_camera = turn * patch_from_camera;
    Eigen::Matrix3d turn_floor = Eigen::Matrix3d::Identity();
    turn_floor.topLeftCorner<2, 2>() = turn.linear().topLeftCorner<2, 2>();
    result.patch_from_image = turn_floor * result.patch_from_image;
    result.mounting = mounting_of(result.patch_from_camera);
    if (!(result.mounting.z > 0.0) || !std::isfinite(result.rms)) {
        throw Error("the points are no floor that a camera could see from above");
    }
    const Vector3 deviations = deviations_per_pixel(fit, camera_from_patch);
    result.height_per_pixel = deviations(0);
    result.pitch_per_pixel = deviations(1);
    result.roll_per_pixel = deviations(2);
    return result;
}

CameraMounting mounting_on_robot(const GroundCalibration& ground, const CameraMounting& before,
                                 const std::optional<Pose2d>& robot_from_patch) {
    if (robot_from_patch) {
        Eigen::Isometry3d pose(Eigen::AngleAxisd(robot_from_patch->heading, Vector3::UnitZ()));
        pose.translation() = Vector3(robot_from_patch->x(), robot_from_patch->y(), 0.0);
        return mounting_of(pose * ground.patch_from_camera);
    }
    CameraMounting mounting = before;
    mounting.z = ground.mounting.z;
    mounting.pitch = ground.mounting.pitch;
    mounting.roll = ground.mounting.roll;
    return mounting;
}

CameraMounting mounting_of(const Eigen::Isometry3d& robot_from_camera) {
    const Vector3 angles = yaw_pitch_roll(robot_from_camera.linear());
    CameraMounting mounting;
    mounting.x = robot_from_camera.translation().x();
    mounting.y = robot_from_camera.translation().y();
    mounting.z = robot_from_camera.translation().z();
    mounting.yaw = angles(0);
    mounting.pitch = angles(1);
    mounting.roll = angles(2);
    return mounting;
}

}  // namespace hybrid_slam
