// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/camera_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <set>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr auto kTurnIt = "turn and tilt the board differently in each photo";
constexpr double kLeastTilt = radians(5.0);

/// What OpenCV takes and gives.
struct Solution {
    std::vector<std::vector<cv::Point2f>> seen;
    std::vector<std::vector<cv::Point3f>> board;
    cv::Mat camera = cv::Mat::eye(3, 3, CV_64F);
    cv::Mat distortion = cv::Mat::zeros(5, 1, CV_64F);
    std::vector<cv::Mat> rotations;
    std::vector<cv::Mat> translations;
    cv::Mat deviations;
    cv::Mat board_rms;
    double rms = 0.0;
};

std::vector<cv::Point3f> corners_of(const Chessboard& board) {
    std::vector<cv::Point3f> corners;
    for (int row = 0; row < board.rows; ++row) {
        for (int column = 0; column < board.columns; ++column) {
            corners.emplace_back(static_cast<float>(column * board.square),
                                 static_cast<float>(row * board.square), 0.0F);
        }
    }
    return corners;
}

Solution solve(const BoardPhotos& photos, const CameraCalibrationConfig& config) {
    Solution solution;
    for (const BoardPhoto& photo : photos.photos()) {
        if (photo.usable()) {
            solution.board.push_back(corners_of(photos.board()));
            solution.seen.emplace_back();
            for (const Pixel& corner : photo.corners) {
                solution.seen.back().emplace_back(static_cast<float>(corner.x()),
                                                  static_cast<float>(corner.y()));
            }
        }
    }
    const int flags = (config.same_focal_lengths ? cv::CALIB_FIX_ASPECT_RATIO : 0) |
                      (config.no_k3 ? cv::CALIB_FIX_K3 : 0) |
                      (config.no_tangential ? cv::CALIB_ZERO_TANGENT_DIST : 0);
    const cv::TermCriteria stop(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 200, 1e-12);
    cv::Mat pose_deviations;
    solution.rms = cv::calibrateCamera(
        solution.board, solution.seen, {photos.width(), photos.height()}, solution.camera,
        solution.distortion, solution.rotations, solution.translations, solution.deviations,
        pose_deviations, solution.board_rms, flags, stop);
    return solution;
}

CameraModel model_of(const Solution& solution, const BoardPhotos& photos) {
    CameraModel model;
    model.width = photos.width();
    model.height = photos.height();
    model.fx = solution.camera.at<double>(0, 0);
    model.fy = solution.camera.at<double>(1, 1);
    model.cx = solution.camera.at<double>(0, 2);
    model.cy = solution.camera.at<double>(1, 2);
    const auto* const coefficients = solution.distortion.ptr<double>();
    model.k1 = coefficients[0];
    model.k2 = coefficients[1];
    model.p1 = coefficients[2];
    model.p2 = coefficients[3];
    model.k3 = coefficients[4];
    return model;
}

IntrinsicDeviations deviations_of(const Solution& solution, const CameraCalibrationConfig& config) {
    const auto* const in_order = solution.deviations.ptr<double>();
    IntrinsicDeviations deviations{in_order[0], in_order[1], in_order[2], in_order[3], in_order[4],
                                   in_order[5], in_order[6], in_order[7], in_order[8]};
    if (config.same_focal_lengths) {
        deviations.fx = deviations.fy;  // OpenCV takes fx from fy then, and gives it none
    }
    return deviations;
}

/// Throws Error when the numbers are no camera.
void check_model(CameraModel model, const IntrinsicDeviations& deviations) {
    constexpr double kMostDeviation = 0.1;  // of the focal length
    const bool told = std::isfinite(deviations.fx) && std::isfinite(deviations.fy) &&
                      deviations.fx < kMostDeviation * model.fx &&
                      deviations.fy < kMostDeviation * model.fy;
    try {
        ConfigSchema schema;
        describe(schema, model);  // holds it to the ranges of a file
    } catch (const Error& error) {
        throw Error(fmt::format("the boards determine no camera ({}): {}", error.what(), kTurnIt));
    }
    if (!told) {
        throw Error(std::string("the boards do not determine the focal length: ") + kTurnIt);
    }
}

std::vector<BoardFit> fits_of(const Solution& solution, const BoardPhotos& photos,
                              const CameraModel& model) {
    std::vector<BoardFit> fits;
    for (std::size_t i = 0; i < photos.photos().size(); ++i) {
        if (!photos.photos()[i].usable()) {
            continue;
        }
        const std::size_t place = fits.size();
        BoardFit fit;
        fit.photo = i;
        fit.rms = solution.board_rms.at<double>(static_cast<int>(place));
        cv::Matx33d rotation;
        cv::Rodrigues(solution.rotations[place], rotation);
        const cv::Vec3d translation(solution.translations[place]);
        for (const cv::Point3f& corner : solution.board[place]) {
            const cv::Vec3d at = rotation * cv::Vec3d(corner.x, corner.y, corner.z) + translation;
            fit.expected.push_back(model.project({at[0], at[1], at[2]}).value_or(Pixel(0.0, 0.0)));
        }
        fits.push_back(std::move(fit));
    }
    return fits;
}

double tilt_spread_of(const Solution& solution) {
    std::vector<cv::Vec3d> normals;
    for (const cv::Mat& vector : solution.rotations) {
        cv::Matx33d rotation;
        cv::Rodrigues(vector, rotation);
        normals.emplace_back(rotation(0, 2), rotation(1, 2), rotation(2, 2));
    }
    double widest = 0.0;
    for (const cv::Vec3d& a : normals) {
        for (const cv::Vec3d& b : normals) {
            widest = std::max(widest, std::acos(std::clamp(a.dot(b), -1.0, 1.0)));
        }
    }
    return widest;
}

double coverage_of(const BoardPhotos& photos) {
    constexpr int kColumns = 8;
    constexpr int kRows = 6;
    std::set<int> seen;
    for (const BoardPhoto& photo : photos.photos()) {
        if (!photo.usable()) {
            continue;
        }
        for (const Pixel& corner : photo.corners) {
            const int column = static_cast<int>((corner.x() + 0.5) * kColumns / photos.width());
            const int row = static_cast<int>((corner.y() + 0.5) * kRows / photos.height());
            seen.insert(std::clamp(row, 0, kRows - 1) * kColumns +
                        std::clamp(column, 0, kColumns - 1));
        }
    }
    return static_cast<double>(seen.size()) / (kColumns * kRows);
}

bool sees_its_corners(const CameraModel& model) {
    for (const double u : {0.0, model.width - 1.0}) {
        for (const double v : {0.0, model.height - 1.0}) {
            if (!model.ray({u, v})) {
                return false;
            }
        }
    }
    return true;
}

void warn_of_photos(const BoardPhotos& photos, CameraCalibration& result) {
    constexpr std::size_t kEnoughBoards = 8;
    constexpr double kEnoughCoverage = 0.6;
    constexpr double kEnoughTilt = radians(25.0);
    if (result.fits.size() < kEnoughBoards) {
        result.warnings.push_back(fmt::format("only {} boards: {} to 20 make a good calibration",
                                              result.fits.size(), kEnoughBoards));
    }
    if (result.coverage < kEnoughCoverage) {
        result.warnings.push_back(
            fmt::format("the boards reach only {:.0f} % of the image: show the board near the "
                        "edges and in the corners too",
                        100.0 * result.coverage));
    }
    if (result.tilt_spread < kEnoughTilt) {
        result.warnings.push_back(
            fmt::format("the boards look nearly the same way ({:.0f} degrees apart at most): tilt "
                        "the board by 30 to 45 degrees, to all sides",
                        degrees(result.tilt_spread)));
    }
    std::vector<double> errors;
    for (const BoardFit& fit : result.fits) {
        errors.push_back(fit.rms);
    }
    std::nth_element(errors.begin(),
                     errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
    const double usual = errors[errors.size() / 2];
    for (const BoardFit& fit : result.fits) {
        if (fit.rms > 3.0 * usual && fit.rms > 0.1) {
            result.warnings.push_back(
                fmt::format("{}: {:.2f} pixels off, the others about {:.2f}; "
                            "better leave it out",
                            photos.photos()[fit.photo].name, fit.rms, usual));
        }
    }
}

void warn_of_model(CameraCalibration& result) {
    constexpr double kMostDeviation = 0.005;
    constexpr double kMostError = 1.0;  // pixels
    const CameraModel& model = result.model;
    const double deviation =
        std::max(result.deviations.fx / model.fx, result.deviations.fy / model.fy);
    if (deviation > kMostDeviation) {
        result.warnings.push_back(
            fmt::format("the focal length is uncertain by {:.1f} %", 100.0 * deviation));
    }
    if (result.rms > kMostError) {
        result.warnings.push_back(fmt::format(
            "{:.2f} pixels off: is the board flat, and the lens one of fixed focus?", result.rms));
    }
    if (!sees_its_corners(model)) {
        result.warnings.emplace_back(
            "the distortion is wrong in the corners of the image: show the board there, or fit "
            "fewer coefficients");
    }
}

}  // namespace

CameraCalibration calibrate_camera(const BoardPhotos& photos,
                                   const CameraCalibrationConfig& config) {
    if (photos.usable() < kLeastBoards) {
        throw Error(fmt::format("{} usable board{}, at least {} are needed", photos.usable(),
                                photos.usable() == 1 ? "" : "s", kLeastBoards));
    }
    Solution solution;
    try {
        solution = solve(photos, config);
    } catch (const cv::Exception& error) {
        throw Error("the boards determine no camera: " + error.err);
    }
    CameraCalibration result;
    result.tilt_spread = tilt_spread_of(solution);
    if (result.tilt_spread < kLeastTilt) {
        // Zhang's equations are singular then, and what came out is made of noise.
        throw Error(std::string("the boards all look the same way: ") + kTurnIt);
    }
    result.model = model_of(solution, photos);
    result.deviations = deviations_of(solution, config);
    check_model(result.model, result.deviations);
    result.rms = solution.rms;
    result.fits = fits_of(solution, photos, result.model);
    result.coverage = coverage_of(photos);
    warn_of_photos(photos, result);
    warn_of_model(result);
    return result;
}

}  // namespace hybrid_slam
