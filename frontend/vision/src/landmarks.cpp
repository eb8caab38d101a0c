// SPDX-License-Identifier: Apache-2.0
#include "landmarks.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kNoInformation = 1e-6;  ///< share of the information across an edge
constexpr double kFarFloor = 0.15;  ///< metres of floor in one pixel; what lies beyond says little
constexpr double kFloorSigma = 0.003;     ///< share of the distance: no floor is quite flat
constexpr double kNearWalls = 0.05;       ///< metres around the border, and
constexpr double kNearWallsShare = 0.02;  ///< of the distance: at the foot of what stands there
constexpr double kWallSigma = 0.03;       ///< metres, and
constexpr double kWallSigmaShare = 0.02;  ///< of the distance: what stands there is not all flat
constexpr double kNever = 1e6;            ///< metres to where a ray that rises meets the floor

bool says_floor(const FloorMask& mask, const cv::Point2f& pixel) {
    const int u = std::min(std::max(static_cast<int>(std::lround(pixel.x)), 0), mask.width - 1);
    const int v = std::min(std::max(static_cast<int>(std::lround(pixel.y)), 0), mask.height - 1);
    return mask.is_floor[static_cast<std::size_t>(v) * mask.width + u] != 0;
}

void place(Landmark& landmark, const CameraOnRobot& camera, const FloorHints& hints,
           double pixel_sigma) {
    const Eigen::Vector3d direction = camera.direction(landmark.ray);
    const double level = direction.head<2>().norm();  // metres along the floor for each of depth
    const double floor = camera.floor_inverse_depth(direction);
    const double distance = level > kNever * floor ? kNever : level / floor;
    // Metres of floor in one pixel are so many times the distance.
    const double grain = distance / (camera.focal_length() * camera.center().z());
    const auto wall = hints.border ? hints.border->distance(direction) : std::nullopt;
    const double margin = wall ? kNearWalls + kNearWallsShare * *wall : 0.0;
    const bool floor_by_mask = !hints.mask || says_floor(*hints.mask, landmark.pixel);
    if (floor_by_mask && grain * distance < kFarFloor && (!wall || distance < *wall - margin)) {
        landmark.floor = true;
        const double sigma = kFloorSigma + pixel_sigma * grain;
        landmark.belief = {floor, sigma * floor};
    } else if (wall && distance > *wall + margin) {
        const double sigma = kWallSigma + kWallSigmaShare * *wall;
        landmark.belief = {level / *wall, level * sigma / (*wall * *wall)};
    } else if (wall && distance > *wall - margin) {
        // At the foot of a wall both are in the same place.
        landmark.belief = {floor, level * margin / (*wall * *wall)};
    } else {
        landmark.belief = DepthBelief::anywhere();
    }
    landmark.inverse_depth = landmark.belief.inverse_depth;
}

}  // namespace

cv::Point2f Landmark::across(const cv::Point2f& from, const cv::Point2f& to) const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(texture);
    if (solver.eigenvalues()(0) > kNoInformation * solver.eigenvalues()(1)) {
        return to;
    }
    const Eigen::Vector2d normal = solver.eigenvectors().col(1);
    const Eigen::Vector2d moved(to.x - from.x, to.y - from.y);
    const Eigen::Vector2d crossed = normal.dot(moved) * normal;
    return from + cv::Point2f(static_cast<float>(crossed.x()), static_cast<float>(crossed.y()));
}

std::vector<Landmark> make_landmarks(const Pyramid& pyramid, const ImagePoints& points,
                                     const CameraOnRobot& camera, const FloorHints& hints,
                                     double pixel_sigma) {
    const std::vector<Eigen::Matrix2d> textures = textures_of(pyramid, points, pixel_sigma);
    std::vector<Landmark> landmarks;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto ray = camera.model().ray(pixel_of(points[i]));
        if (textures[i].isZero(0.0) || !ray) {
            continue;
        }
        Landmark landmark;
        landmark.pixel = points[i];
        landmark.now = points[i];
        landmark.ray = ray->head<2>();
        landmark.texture = textures[i];
        place(landmark, camera, hints, pixel_sigma);
        landmarks.push_back(landmark);
    }
    return landmarks;
}

}  // namespace hybrid_slam
