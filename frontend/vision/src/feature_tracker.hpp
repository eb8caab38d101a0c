// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

using ImagePoints = std::vector<cv::Point2f>;

inline Pixel pixel_of(const cv::Point2f& point) {
    return {point.x, point.y};
}

/// An image at several sizes, ready for optical flow.
struct Pyramid {
    std::vector<cv::Mat> levels;  ///< each image, followed by its derivatives
    double gain = 1.0;            ///< of the gray levels against those of the image as it came
    double mean = 0.0;            ///< gray level of the pixels
    double light = 0.0;           ///< the same of the image as it came
    double contrast = 0.0;        ///< standard deviation of the gray levels as they came
    double sharpness = 0.0;       ///< mean slope of a smaller level: gray levels per pixel
    double stamp = 0.0;           ///< seconds

    bool empty() const { return levels.empty(); }
    /// The image halved `level` times, or as often as it could be.
    const cv::Mat& image(std::size_t level) const { return levels[2 * reachable(level)]; }
    /// Its derivatives by Scharr, times 32.
    const cv::Mat& slopes(std::size_t level) const { return levels[2 * reachable(level) + 1]; }
    std::size_t reachable(std::size_t level) const {
        return std::min(level, levels.size() / 2 - 1);
    }
};

/// The image in gray.
cv::Mat gray_of(const Image& image);

/// `gain` scales the gray levels: what follows features between two images takes them to be
/// equally bright.
Pyramid make_pyramid(const cv::Mat& gray, double gain, double stamp);

double mean_of(const cv::Mat& gray);

/// Corners by Shi and Tomasi, "Good features to track" (1994), the best of each cell of a raster,
/// so that they spread over the image; none near `taken`, and at most `most` with those together.
ImagePoints find_corners(const Pyramid& pyramid, const ImagePoints& taken, std::size_t most);

/// Points on edges, likewise: they are followed across the edge only.
ImagePoints find_edges(const Pyramid& pyramid, const ImagePoints& taken, std::size_t most);

/// How well the surroundings of points can be followed, as information matrices (1 / pixel^2): by
/// the structure tensor of the window, of which the noise is taken off; `sigma` (pixels) is what
/// even the best corner errs by. Zero where nothing stands out of the noise.
std::vector<Eigen::Matrix2d> textures_of(const Pyramid& pyramid, const ImagePoints& points,
                                         double sigma);

struct Flow {
    ImagePoints now;
    std::vector<bool> good;         ///< followed there and back
    std::vector<cv::Point2f> miss;  ///< pixels from the start to where the way back ended
};

/// Pyramidal optical flow of Lucas and Kanade (1981) by Bouguet, from guesses; `levels` sizes above
/// the image itself.
Flow follow(const Pyramid& before, const Pyramid& now, const ImagePoints& points,
            const ImagePoints& guesses, int levels);

}  // namespace hybrid_slam
