// SPDX-License-Identifier: Apache-2.0
#include "feature_tracker.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace hybrid_slam {
namespace {

const cv::Size kWindow(17, 17);
constexpr int kMostLevels = 4;
constexpr int kBorder = 8;                 ///< pixels along the edges without corners
constexpr float kApart = 10.0F;            ///< pixels between corners
constexpr double kLeastQuality = 1e-5;     ///< smaller eigenvalue of a corner that is any good
constexpr double kLeastEigenvalue = 1e-6;  ///< edges are followed too
constexpr double kLeastSlope = 4.0;        ///< gray levels per pixel of an edge
constexpr double kFarthestMiss = 4.0;      ///< pixels, of the way back, along an edge too
constexpr int kNoiseBlocks = 12;           ///< a side, of the raster that tells the noise
constexpr double kNoiseQuantile = 0.1;
/// A window must have so many times the energy of noise alone in a direction to be followed in it.
constexpr double kAboveNoise = 3.0;
/// An edge whose pixels show as steps is no corner: those stay with the pixels.
constexpr double kLeastRoundness = 0.12;
/// Variance of Scharr's derivative over that of a pixel: 2 (3^2 + 10^2 + 3^2) / 32^2.
constexpr double kScharrNoise = 0.2305;
constexpr double kScharrScale = 1.0 / 32.0;
const cv::TermCriteria kStop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.01);

/// The strongest pixel of each cell of a raster.
std::vector<std::pair<float, cv::Point>> peaks_of(const cv::Mat& quality, int cell, double least) {
    std::vector<std::pair<float, cv::Point>> peaks;
    for (int top = kBorder; top + kBorder < quality.rows; top += cell) {
        for (int left = kBorder; left + kBorder < quality.cols; left += cell) {
            const cv::Rect rect(left, top, std::min(cell, quality.cols - kBorder - left),
                                std::min(cell, quality.rows - kBorder - top));
            double best = 0.0;
            cv::Point place;
            cv::minMaxLoc(quality(rect), nullptr, &best, nullptr, &place);
            if (best > least) {
                peaks.emplace_back(static_cast<float>(best), place + rect.tl());
            }
        }
    }
    return peaks;
}

bool is_near_any(const cv::Point2f& point, const ImagePoints& others) {
    return std::any_of(others.begin(), others.end(), [&](const cv::Point2f& other) {
        return std::abs(point.x - other.x) < kApart && std::abs(point.y - other.y) < kApart;
    });
}

bool is_inside(const cv::Point2f& point, const cv::Mat& image) {
    return point.x >= 0.0F && point.y >= 0.0F && point.x < static_cast<float>(image.cols) &&
           point.y < static_cast<float>(image.rows);
}

}  // namespace

cv::Mat gray_of(const Image& image) {
    cv::Mat pixels(image.height, image.width, image.channels == 1 ? CV_8UC1 : CV_8UC3);
    std::copy(image.pixels.begin(), image.pixels.end(), pixels.data);
    if (image.channels == 1) {
        return pixels;
    }
    cv::Mat gray;
    cv::cvtColor(pixels, gray, cv::COLOR_BGR2GRAY);
    return gray;
}

double mean_of(const cv::Mat& gray) {
    return cv::mean(gray)[0];
}

Pyramid make_pyramid(const cv::Mat& gray, double gain, double stamp) {
    Pyramid pyramid;
    pyramid.stamp = stamp;
    pyramid.gain = gain;
    cv::Mat scaled;  // never in place: the pixels are the caller's
    gray.convertTo(scaled, -1, gain);
    cv::buildOpticalFlowPyramid(scaled, pyramid.levels, kWindow, kMostLevels, true,
                                cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
    cv::Scalar mean;
    cv::Scalar deviation;
    // Two sizes down there is less noise to count as contrast.
    cv::meanStdDev(pyramid.image(2), mean, deviation);
    pyramid.mean = mean[0];
    pyramid.light = mean[0] / gain;
    pyramid.contrast = deviation[0] / gain;
    const cv::Mat& slopes = pyramid.slopes(1);
    pyramid.sharpness =
        cv::norm(slopes, cv::NORM_L1) / (64.0 * gain * static_cast<double>(slopes.total()));
    return pyramid;
}

namespace {

/// The strongest of each cell, the strongest first, until there are `most` with those taken.
ImagePoints pick(const cv::Mat& strength, double least, const ImagePoints& taken, std::size_t most,
                 double scale) {
    const double area = static_cast<double>(strength.total()) * scale * scale;
    const double cell = std::sqrt(area / static_cast<double>(std::max<std::size_t>(most, 1)));
    auto peaks = peaks_of(strength, std::max(8, static_cast<int>(cell / scale)), least);
    std::stable_sort(peaks.begin(), peaks.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    ImagePoints picked = taken;
    for (const auto& [peak, place] : peaks) {
        if (picked.size() >= most) {
            break;
        }
        const cv::Point2f point = cv::Point2f(place) * scale;
        if (!is_near_any(point, picked)) {
            picked.push_back(point);
        }
    }
    return {picked.begin() + static_cast<std::ptrdiff_t>(taken.size()), picked.end()};
}

/// Sums of products of the derivatives over a window: gray levels^2 / pixel^2.
Eigen::Matrix2d structure_at(const cv::Mat& slopes, const cv::Point2f& center) {
    const int half = kWindow.width / 2;
    const int left = static_cast<int>(std::lround(center.x)) - half;
    const int top = static_cast<int>(std::lround(center.y)) - half;
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    for (int v = std::max(top, 0); v < std::min(top + kWindow.height, slopes.rows); ++v) {
        const auto* row = slopes.ptr<cv::Vec2s>(v);
        for (int u = std::max(left, 0); u < std::min(left + kWindow.width, slopes.cols); ++u) {
            const double x = row[u][0];
            const double y = row[u][1];
            xx += x * x;
            xy += x * y;
            yy += y * y;
        }
    }
    Eigen::Matrix2d structure;
    structure << xx, xy, xy, yy;
    return kScharrScale * kScharrScale * structure;
}

/// The flattest windows show noise and nothing else.
double noise_energy(const cv::Mat& slopes) {
    std::vector<double> energies;
    for (int i = 0; i < kNoiseBlocks * kNoiseBlocks; ++i) {
        const int column = i % kNoiseBlocks;
        const int row = i / kNoiseBlocks;
        const auto x = static_cast<float>((column + 0.5) * slopes.cols / kNoiseBlocks);
        const auto y = static_cast<float>((row + 0.5) * slopes.rows / kNoiseBlocks);
        energies.push_back(0.5 * structure_at(slopes, {x, y}).trace());
    }
    const auto place =
        energies.begin() +
        static_cast<std::ptrdiff_t>(kNoiseQuantile * static_cast<double>(energies.size()));
    std::nth_element(energies.begin(), place, energies.end());
    return std::max(*place, 1.0);
}

}  // namespace

ImagePoints find_corners(const Pyramid& pyramid, const ImagePoints& taken, std::size_t most) {
    cv::Mat quality;
    cv::cornerMinEigenVal(pyramid.image(0), quality, 3, 3);
    return pick(quality, kLeastQuality, taken, most, 1.0);
}

ImagePoints find_edges(const Pyramid& pyramid, const ImagePoints& taken, std::size_t most) {
    cv::Mat parts[2];
    cv::split(pyramid.slopes(1), parts);
    const cv::Mat strength = cv::abs(parts[0]) + cv::abs(parts[1]);
    cv::Mat scaled;
    strength.convertTo(scaled, CV_32F, kScharrScale);
    return pick(scaled, kLeastSlope, taken, most, static_cast<double>(1 << pyramid.reachable(1)));
}

std::vector<Eigen::Matrix2d> textures_of(const Pyramid& pyramid, const ImagePoints& points,
                                         double sigma) {
    const cv::Mat& slopes = pyramid.slopes(0);
    const double energy = noise_energy(slopes);
    const double window = kWindow.area();
    const double noise = energy / (window * kScharrNoise);  // variance of a pixel
    std::vector<Eigen::Matrix2d> textures;
    for (const cv::Point2f& point : points) {
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(structure_at(slopes, point));
        Eigen::Vector2d information = Eigen::Vector2d::Zero();
        for (int i = 0; i < 2; ++i) {
            const double signal = solver.eigenvalues()(i) - energy;
            const double strongest = solver.eigenvalues()(1);
            if (signal > kAboveNoise * energy && signal > kLeastRoundness * strongest) {
                information(i) = 1.0 / (sigma * sigma + 2.0 * noise / signal);
            }
        }
        textures.emplace_back(solver.eigenvectors() * information.asDiagonal() *
                              solver.eigenvectors().transpose());
    }
    return textures;
}

Flow follow(const Pyramid& before, const Pyramid& now, const ImagePoints& points,
            const ImagePoints& guesses, int levels) {
    Flow flow;
    flow.now = guesses;
    flow.good.assign(points.size(), false);
    flow.miss.assign(points.size(), {});
    if (points.empty()) {
        return flow;
    }
    std::vector<std::uint8_t> there;
    std::vector<std::uint8_t> back;
    std::vector<float> errors;
    cv::calcOpticalFlowPyrLK(before.levels, now.levels, points, flow.now, there, errors, kWindow,
                             levels, kStop, cv::OPTFLOW_USE_INITIAL_FLOW, kLeastEigenvalue);
    ImagePoints returned = points;
    cv::calcOpticalFlowPyrLK(now.levels, before.levels, flow.now, returned, back, errors, kWindow,
                             std::min(levels, 1), kStop, cv::OPTFLOW_USE_INITIAL_FLOW,
                             kLeastEigenvalue);
    for (std::size_t i = 0; i < points.size(); ++i) {
        flow.miss[i] = returned[i] - points[i];
        flow.good[i] = there[i] != 0 && back[i] != 0 && is_inside(flow.now[i], now.image(0)) &&
                       flow.miss[i].dot(flow.miss[i]) < kFarthestMiss * kFarthestMiss;
    }
    return flow;
}

}  // namespace hybrid_slam
