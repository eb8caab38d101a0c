// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "camera_renderer.hpp"

/// Scenes for the camera, and what must be seen of them by the world's geometry and CameraModel
/// alone.
namespace hybrid_slam::test {

inline void add_box(World& world, const Point2& center, double half_x, double half_y) {
    const Points corners{center + Point2(-half_x, -half_y), center + Point2(half_x, -half_y),
                         center + Point2(half_x, half_y), center + Point2(-half_x, half_y)};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
}

inline World room(double half_x, double half_y) {
    World world;
    add_box(world, {0.0, 0.0}, half_x, half_y);
    return world;
}

/// One metre above the robot's origin.
inline CameraMounting pitched(double pitch_deg) {
    CameraMounting mounting;
    mounting.x = 0.0;
    mounting.z = 1.0;
    mounting.pitch = radians(pitch_deg);
    return mounting;
}

inline CameraMounting looking_down(double height) {
    CameraMounting mounting = pitched(90.0);
    mounting.z = height;
    return mounting;
}

/// Clean tiles and white walls everywhere, even light, no noise: only what is to be measured.
inline RenderConfig clean() {
    RenderConfig config;
    config.noise_sigma = 0.0;
    config.dirt = 0.0;
    config.bare_floor = 0.0;
    config.plain_walls = 1.0;
    config.shine = 0.0;
    config.vignetting = 0.0;
    return config;
}

/// The thesis's camera with another number of pixels.
inline CameraModel sized(int width, int height) {
    CameraModel model;
    const double scale = static_cast<double>(width) / model.width;
    model.width = width;
    model.height = height;
    model.fx *= scale;
    model.fy *= scale;
    model.cx *= scale;
    model.cy = 0.5 * height;
    return model;
}

/// The image's own pixels, not a copy.
inline cv::Mat bgr(Image& image) {
    return {image.height, image.width, CV_8UC3, image.pixels.data()};
}

inline cv::Mat gray(Image& image) {
    cv::Mat converted;
    cv::cvtColor(bgr(image), converted, cv::COLOR_BGR2GRAY);
    return converted;
}

struct Eye {
    CameraModel model;
    CameraMounting mounting;
    Pose2d world_from_robot;

    Eigen::Isometry3d world_from_camera() const {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.translation().head<2>() = world_from_robot.translation;
        pose.rotate(Eigen::AngleAxisd(world_from_robot.heading, Eigen::Vector3d::UnitZ()));
        return pose * mounting.robot_from_camera();
    }

    /// Empty behind the camera and far beside the image, where the distortion folds.
    std::optional<Pixel> project(const Eigen::Vector3d& point) const {
        const Eigen::Vector3d in_camera = world_from_camera().inverse() * point;
        if (in_camera.z() < 0.1 || in_camera.head<2>().norm() > 0.8 * in_camera.z()) {
            return std::nullopt;
        }
        return model.project(in_camera);
    }

    bool sees(const Pixel& pixel, double margin) const {
        return pixel.x() > margin && pixel.y() > margin && pixel.x() < model.width - 1 - margin &&
               pixel.y() < model.height - 1 - margin;
    }

    /// In the world, one metre along the optical axis.
    Eigen::Vector3d ray(const Pixel& pixel) const {
        return world_from_camera().linear() * model.ray(pixel).value();
    }

    /// Where the pixel's ray meets the floor, when it goes down.
    std::optional<Point2> floor_at(const Pixel& pixel) const {
        const Eigen::Vector3d direction = ray(pixel);
        const Eigen::Vector3d origin = world_from_camera().translation();
        if (direction.z() > -1e-3) {
            return std::nullopt;
        }
        return Point2((origin - origin.z() / direction.z() * direction).head<2>());
    }
};

/// Where the corners of the floor's tiles appear that are nearer than `farthest`.
inline std::vector<Pixel> visible_tile_corners(const Eye& eye, double tile, double farthest) {
    std::vector<Pixel> pixels;
    const Eigen::Vector3d camera = eye.world_from_camera().translation();
    const auto reach = static_cast<int>(farthest / tile) + 1;
    const Eigen::Vector2i middle = (camera.head<2>() / tile).array().round().cast<int>();
    for (int i = -reach; i <= reach; ++i) {
        for (int j = -reach; j <= reach; ++j) {
            const Eigen::Vector3d corner((middle.x() + i) * tile, (middle.y() + j) * tile, 0.0);
            const auto pixel = eye.project(corner);
            if (pixel && eye.sees(*pixel, 10.0) && (corner - camera).norm() < farthest) {
                pixels.push_back(*pixel);
            }
        }
    }
    return pixels;
}

/// From each given pixel to the corner that the image has next to it.
inline std::vector<Eigen::Vector2d> corner_errors(const cv::Mat& image,
                                                  const std::vector<Pixel>& expected) {
    std::vector<cv::Point2f> found;
    for (const Pixel& pixel : expected) {
        found.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    }
    if (!found.empty()) {
        cv::cornerSubPix(image, found, {5, 5}, {-1, -1}, {cv::TermCriteria::EPS, 50, 1e-4});
    }
    std::vector<Eigen::Vector2d> errors;
    for (std::size_t i = 0; i < found.size(); ++i) {
        errors.push_back(Pixel(found[i].x, found[i].y) - expected[i]);
    }
    return errors;
}

inline Eigen::Vector2d mean(const std::vector<Eigen::Vector2d>& vectors) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& vector : vectors) {
        sum += vector;
    }
    return sum / static_cast<double>(vectors.size());
}

inline std::vector<double> lengths(const std::vector<Eigen::Vector2d>& vectors) {
    std::vector<double> norms;
    for (const Eigen::Vector2d& vector : vectors) {
        norms.push_back(vector.norm());
    }
    return norms;
}

inline double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

inline double quantile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace hybrid_slam::test
