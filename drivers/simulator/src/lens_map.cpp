// SPDX-License-Identifier: Apache-2.0
#include "lens_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kEntriesPerPixel = 4.0;
constexpr double kSteepest = 1e4;  ///< slopes are clipped: straight down there is no azimuth

/// The light that is left at a pixel: falls with the square of the distance from the axis.
float light_at(const CameraModel& model, int column, int row, double vignetting) {
    const double across = (column - 0.5 * (model.width - 1)) / (0.5 * model.width);
    const double down = (row - 0.5 * (model.height - 1)) / (0.5 * model.height);
    return static_cast<float>(1.0 - vignetting * 0.5 * (across * across + down * down));
}

}  // namespace

Eigen::Vector2d HorizonFaces::in_face(int face, const Eigen::Vector2d& vector) {
    switch (face) {
        case 0:
            return {-vector.y(), vector.x()};
        case 1:
            return vector;
        case 2:
            return {vector.y(), -vector.x()};
        default:
            return -vector;
    }
}

LensMap::LensMap(const CameraModel& model, const CameraMounting& mounting, double vignetting,
                 double reach)
    : width(model.width),
      height(model.height),
      blocks_across((model.width + kBlock - 1) / kBlock),
      blocks_down((model.height + kBlock - 1) / kBlock) {
    faces.entries = static_cast<int>(2.0 * kEntriesPerPixel * std::max(model.fx, model.fy));
    blocks.resize(static_cast<std::size_t>(blocks_across) * static_cast<std::size_t>(blocks_down));
    for (std::vector<float>* map : {&ray_x, &ray_y, &entry, &slope}) {
        map->resize(blocks.size() * kBlockPixels);
    }
    CameraMounting ahead = mounting;
    ahead.yaw = 0.0;
    const Eigen::Matrix3d level_from_camera = ahead.robot_from_camera().linear();
    for (std::size_t pixel = 0; pixel < ray_x.size(); ++pixel) {
        const auto block = static_cast<int>(pixel / kBlockPixels);
        const auto within = static_cast<int>(pixel % kBlockPixels);
        const int column =
            std::min(block % blocks_across * kBlock + within % kBlock, model.width - 1);
        const int row =
            std::min(block / blocks_across * kBlock + within / kBlock, model.height - 1);
        const auto ray = model.ray(Pixel(column, row));
        if (!ray) {
            throw Error(fmt::format(
                "camera model: the distortion cannot be inverted at pixel ({}, {})", column, row));
        }
        aim(pixel, *ray, level_from_camera);
    }
    for (int block = 0; block < blocks_across * blocks_down; ++block) {
        summarize(block, reach);
        LensBlock& made = blocks[static_cast<std::size_t>(block)];
        for (std::size_t i = 0; i < kCornerPixels.size(); ++i) {
            const int column = block % blocks_across * kBlock + kCornerPixels[i] % kBlock;
            const int row = block / blocks_across * kBlock + kCornerPixels[i] / kBlock;
            made.vignette[i] = std::max(light_at(model, column, row, vignetting), 0.0F);
        }
    }
}

void LensMap::aim(std::size_t pixel, const Eigen::Vector3d& ray,
                  const Eigen::Matrix3d& level_from_camera) {
    ray_x[pixel] = static_cast<float>(ray.x());
    ray_y[pixel] = static_cast<float>(ray.y());
    const Eigen::Vector3d level = level_from_camera * ray;
    for (int face = 0; face < HorizonFaces::kFaces; ++face) {
        const Eigen::Vector2d in_face = HorizonFaces::in_face(face, level.head<2>());
        if (in_face.x() > 0.0 && std::abs(in_face.y()) <= in_face.x()) {
            entry[pixel] = static_cast<float>(faces.entry(face, in_face.y() / in_face.x()));
            slope[pixel] =
                static_cast<float>(std::clamp(level.z() / in_face.x(), -kSteepest, kSteepest));
            return;
        }
    }
    entry[pixel] = static_cast<float>(faces.entry(1, 0.0));
    slope[pixel] = static_cast<float>(level.z() > 0.0 ? kSteepest : -kSteepest);
}

void LensMap::summarize(int block, double reach) {
    LensBlock& made = blocks[static_cast<std::size_t>(block)];
    const auto first = static_cast<std::ptrdiff_t>(first_pixel(block));
    const auto range_of = [first](const std::vector<float>& map) {
        return std::minmax_element(map.begin() + first, map.begin() + first + kBlockPixels);
    };
    const auto [least_entry, most_entry] = range_of(entry);
    const auto [least_slope, most_slope] = range_of(slope);
    const auto step = [first](const std::vector<float>& map, int next) {
        const auto begin = map.begin() + first;
        return (begin[next] - begin[0]) / static_cast<float>(kBlock - 1);
    };
    // Where faces meet behind the camera the entries leap; there samples stay in the middle.
    const bool smooth = *most_entry - *least_entry < 0.5F * static_cast<float>(faces.entries);
    if (smooth) {
        made.entry_du = step(entry, kCornerPixels[1]);
        made.entry_dv = step(entry, kCornerPixels[2]);
        made.slope_du = step(slope, kCornerPixels[1]);
        made.slope_dv = step(slope, kCornerPixels[2]);
    }
    const auto margin = static_cast<float>(1.25 * reach);
    const float entries = margin * (std::abs(made.entry_du) + std::abs(made.entry_dv)) + 1.0F;
    const float slopes = margin * (std::abs(made.slope_du) + std::abs(made.slope_dv));
    made.least_entry = static_cast<int>(std::floor(*least_entry - entries));
    made.most_entry = static_cast<int>(std::ceil(*most_entry + entries));
    made.least_slope = *least_slope - slopes;
    made.most_slope = *most_slope + slopes;
}

}  // namespace hybrid_slam
