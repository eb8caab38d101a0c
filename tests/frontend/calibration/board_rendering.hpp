// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "hybrid_slam/calibration/chessboard.hpp"
#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/measurements.hpp"

/// Photos of a chessboard by a camera that is known, made ray by ray.
namespace hybrid_slam::test {

/// A small camera with the distortion of a cheap lens.
inline CameraModel small_camera() {
    CameraModel model;
    model.width = 400;
    model.height = 300;
    model.fx = 380.0;
    model.fy = 372.0;
    model.cx = 204.0;
    model.cy = 147.0;
    model.k1 = -0.21;
    model.k2 = 0.06;
    model.p1 = 1e-3;
    model.p2 = -1.5e-3;
    return model;
}

/// The mean over a box of (2 reach + 1)^2 pixels, as a lens out of focus makes it.
inline Image blurred(const Image& image, int reach) {
    Image result = image;
    for (int v = 0; v < image.height; ++v) {
        for (int u = 0; u < image.width; ++u) {
            int sum = 0;
            int count = 0;
            for (int y = std::max(0, v - reach); y <= std::min(image.height - 1, v + reach); ++y) {
                for (int x = std::max(0, u - reach); x <= std::min(image.width - 1, u + reach);
                     ++x) {
                    sum += image.pixels[y * image.width + x];
                    ++count;
                }
            }
            result.pixels[v * image.width + u] = static_cast<std::uint8_t>(sum / count);
        }
    }
    return result;
}

class BoardRenderer {
  public:
    BoardRenderer(const CameraModel& model, const Chessboard& board)
        : model_(model), board_(board) {
        for (int v = 0; v < kSamples * model.height; ++v) {
            for (int u = 0; u < kSamples * model.width; ++u) {
                rays_.push_back(model.ray(place(u, v)).value_or(Eigen::Vector3d(0.0, 0.0, -1.0)));
            }
        }
    }

    /// `board_from_camera`: the board's x axis runs along its rows, y down its columns, from its
    /// first inner corner on.
    Image render(const Eigen::Isometry3d& camera_from_board) const {
        const Eigen::Isometry3d board_from_camera = camera_from_board.inverse();
        Image image;
        image.width = model_.width;
        image.height = model_.height;
        const int stride = kSamples * model_.width;
        for (int v = 0; v < model_.height; ++v) {
            for (int u = 0; u < model_.width; ++u) {
                double sum = 0.0;
                for (int sample = 0; sample < kSamples * kSamples; ++sample) {
                    const int row = kSamples * v + sample / kSamples;
                    const int column = kSamples * u + sample % kSamples;
                    sum += brightness(board_from_camera, rays_[row * stride + column]);
                }
                image.pixels.push_back(
                    static_cast<std::uint8_t>(std::lround(sum / (kSamples * kSamples))));
            }
        }
        return blurred(image, 1);  // no lens is as sharp as rays
    }

    /// Where the inner corners appear, in the order of BoardSight.
    std::vector<Pixel> corners(const Eigen::Isometry3d& camera_from_board) const {
        std::vector<Pixel> pixels;
        for (int row = 0; row < board_.rows; ++row) {
            for (int column = 0; column < board_.columns; ++column) {
                pixels.push_back(
                    *model_.project(camera_from_board * Eigen::Vector3d(column * board_.square,
                                                                        row * board_.square, 0.0)));
            }
        }
        return pixels;
    }

  private:
    static constexpr int kSamples = 3;  ///< each way in a pixel

    static Pixel place(int u, int v) {
        return {(u + 0.5) / kSamples - 0.5, (v + 0.5) / kSamples - 0.5};
    }

    double brightness(const Eigen::Isometry3d& board_from_camera,
                      const Eigen::Vector3d& ray) const {
        constexpr double kAround = 120.0;
        const Eigen::Vector3d along = board_from_camera.linear() * ray;
        const Eigen::Vector3d eye = board_from_camera.translation();
        const double range = -eye.z() / along.z();
        if (!(range > 0.0) || ray.z() < 0.0) {
            return kAround;
        }
        const Eigen::Vector2d at = (eye + range * along).head<2>() / board_.square;
        const Eigen::Vector2d most(board_.columns, board_.rows);
        if ((at.array() < -2.0).any() || (at.array() > most.array() + 1.0).any()) {
            return kAround;
        }
        const bool squares = (at.array() > -1.0).all() && (at.array() < most.array()).all();
        const auto sum = static_cast<int>(std::floor(at.x()) + std::floor(at.y()));
        return squares && sum % 2 == 0 ? 25.0 : 225.0;
    }

    CameraModel model_;
    Chessboard board_;
    std::vector<Eigen::Vector3d> rays_;
};

/// A board whose middle lies at `middle` in the camera's frame, turned by the angles (radians)
/// about its own x and y axes and about the camera's axis.
inline Eigen::Isometry3d board_at(const Chessboard& board, const Eigen::Vector3d& middle,
                                  const Eigen::Vector3d& angles) {
    const Eigen::Vector3d center(0.5 * board.square * (board.columns - 1),
                                 0.5 * board.square * (board.rows - 1), 0.0);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = (Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()) *
                     Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()))
                        .toRotationMatrix();
    pose.translation() = middle - pose.linear() * center;
    return pose;
}

/// Views from all sides, all over the image of small_camera().
inline std::vector<Eigen::Isometry3d> board_views(const Chessboard& board) {
    std::vector<Eigen::Isometry3d> views;
    const double near = 14.0 * board.square;
    const double far = 18.0 * board.square;
    views.push_back(board_at(board, {0.0, 0.0, near}, {0.5, 0.0, 0.1}));
    views.push_back(board_at(board, {0.0, 0.0, near}, {-0.5, 0.1, -0.1}));
    views.push_back(board_at(board, {0.1 * near, 0.0, near}, {0.0, 0.55, 0.0}));
    views.push_back(board_at(board, {-0.1 * near, 0.0, near}, {0.1, -0.55, 0.2}));
    views.push_back(board_at(board, {-0.28 * far, -0.18 * far, far}, {0.3, 0.3, 0.0}));
    views.push_back(board_at(board, {0.26 * far, -0.18 * far, far}, {0.3, -0.3, 0.0}));
    views.push_back(board_at(board, {-0.28 * far, 0.18 * far, far}, {-0.3, 0.3, 0.0}));
    views.push_back(board_at(board, {0.26 * far, 0.18 * far, far}, {-0.3, -0.3, 0.1}));
    return views;
}

}  // namespace hybrid_slam::test
