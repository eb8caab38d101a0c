// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "hybrid_slam/core/camera_model.hpp"

namespace hybrid_slam {

inline constexpr int kBlock = 8;  ///< pixels, the side of the blocks that are rendered at once
inline constexpr int kBlockPixels = kBlock * kBlock;
/// Of a block, in the order top left, top right, bottom left, bottom right.
inline constexpr std::array<int, 4> kCornerPixels = {0, kBlock - 1, kBlockPixels - kBlock,
                                                     kBlockPixels - 1};

/// Rays that run along a plane meet it at infinity; this keeps texels countable.
inline constexpr float kLeastDepthShare = 1e-4F;

/// Numbers the horizontal directions around the camera by entries: four faces of a square, each
/// divided evenly, so that the nearness of a wall (1 / depth before the face) is linear in the
/// entry. Face 1 lies ahead of the camera, face 2 to its left; the seam is behind.
struct HorizonFaces {
    static constexpr int kFaces = 4;
    int entries = 0;  ///< of one face

    /// Forward and to the left of the face, of a vector forward and to the left of the camera.
    static Eigen::Vector2d in_face(int face, const Eigen::Vector2d& vector);

    /// Of the four faces together.
    double entry(int face, double left_per_forward) const {
        return entries * (face + 0.5 * (left_per_forward + 1.0));
    }
};

/// What the pixels of one block have in common.
struct LensBlock {
    int least_entry = 0;
    int most_entry = 0;
    float least_slope = 0.0F;
    float most_slope = 0.0F;
    float entry_du = 0.0F;  ///< from one pixel to the next on the right
    float entry_dv = 0.0F;  ///< from one pixel to the next below
    float slope_du = 0.0F;
    float slope_dv = 0.0F;
    std::array<float, 4> vignette{};  ///< share of the light that is left, at the corners
};

/// What the optics and the mounting fix for each pixel once and for all. Pixels are stored block by
/// block, row by row within; the last blocks may reach out of the image.
struct LensMap {
    /// Samples are taken up to `reach` pixels from the middle of their pixel. Throws Error when the
    /// distortion cannot be inverted somewhere in the image.
    LensMap(const CameraModel& model, const CameraMounting& mounting, double vignetting,
            double reach);

    static std::size_t first_pixel(int block) {
        return static_cast<std::size_t>(block) * kBlockPixels;
    }

    int width = 0;
    int height = 0;
    int blocks_across = 0;
    int blocks_down = 0;
    HorizonFaces faces;
    std::vector<LensBlock> blocks;
    std::vector<float> ray_x;  ///< on the plane z = 1 of the camera
    std::vector<float> ray_y;
    std::vector<float> entry;
    std::vector<float> slope;  ///< rise per metre ahead of the face

  private:
    void aim(std::size_t pixel, const Eigen::Vector3d& ray,
             const Eigen::Matrix3d& level_from_camera);
    void summarize(int block, double reach);
};

}  // namespace hybrid_slam
