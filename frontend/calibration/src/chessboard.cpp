// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/chessboard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

using CvCorners = std::vector<cv::Point2f>;

cv::Mat gray_of(const Image& image) {
    cv::Mat whole(image.height, image.width, CV_8UC(image.channels));
    std::copy(image.pixels.begin(), image.pixels.end(), whole.data);
    if (image.channels == 1) {
        return whole;
    }
    cv::Mat gray;
    cv::cvtColor(whole, gray, cv::COLOR_BGR2GRAY);
    return gray;
}

/// Large photos are searched in a smaller copy: a search without success takes seconds there.
CvCorners search(const cv::Mat& gray, const cv::Size& pattern) {
    constexpr double kMostSide = 1280.0;
    const double scale = std::min(1.0, kMostSide / std::max(gray.cols, gray.rows));
    cv::Mat small = gray;
    if (scale < 1.0) {
        cv::resize(gray, small, {}, scale, scale, cv::INTER_AREA);
    }
    CvCorners corners;
    constexpr int kFlags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
    if (!cv::findChessboardCorners(small, pattern, corners, kFlags)) {
        return {};
    }
    const cv::Point2f half(0.5F, 0.5F);  // pixels have their centres at whole numbers
    for (cv::Point2f& corner : corners) {
        corner = (corner + half) / scale - half;
    }
    return corners;
}

/// Pixels to the nearest neighbour of a corner.
double spacing_at(const CvCorners& corners, const cv::Size& pattern, int index) {
    const int column = index % pattern.width;
    const int row = index / pattern.width;
    double least = 1e9;
    const auto consider = [&](bool exists, int neighbour) {
        if (exists) {
            least = std::min(least, cv::norm(corners[index] - corners[neighbour]));
        }
    };
    consider(column > 0, index - 1);
    consider(column + 1 < pattern.width, index + 1);
    consider(row > 0, index - pattern.width);
    consider(row + 1 < pattern.height, index + pattern.width);
    return least;
}

/// Each corner by the gradients around it. The window stays within the squares of its corner, of
/// which the outer ones are often printed by half only: a wider one, as the customary 11 pixels in
/// a board far away, is drawn to the edges beyond them.
CvCorners refined(const cv::Mat& gray, const CvCorners& rough, const cv::Size& pattern) {
    constexpr double kReach = 0.4;  // of the way to the next corner
    const double widest = 11.0 * std::max(1.0, std::max(gray.cols, gray.rows) / 640.0);
    const cv::TermCriteria stop(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-4);
    CvCorners corners = rough;
    for (int i = 0; i < static_cast<int>(rough.size()); ++i) {
        const double reach = std::clamp(kReach * spacing_at(rough, pattern, i), 2.0, widest);
        const int window = static_cast<int>(reach);
        CvCorners one{rough[i]};
        cv::cornerSubPix(gray, one, {window, window}, {-1, -1}, stop);
        corners[i] = one[0];
    }
    return corners;
}

/// Pixels from corner to corner on average, of the narrower of the two directions.
double mean_spacing(const CvCorners& corners, const cv::Size& pattern) {
    double along = 0.0;
    double down = 0.0;
    for (int i = 0; i < static_cast<int>(corners.size()); ++i) {
        along += i % pattern.width > 0 ? cv::norm(corners[i] - corners[i - 1]) : 0.0;
        down += i >= pattern.width ? cv::norm(corners[i] - corners[i - pattern.width]) : 0.0;
    }
    return std::min(along / ((pattern.width - 1) * pattern.height),
                    down / ((pattern.height - 1) * pattern.width));
}

/// Zero when it cannot be measured.
double edge_width_of(const cv::Mat& gray, const CvCorners& corners, const cv::Size& pattern) {
    constexpr double kLeastSpacing = 10.0;
    constexpr double kNotMeasured = 9999.0;  // of OpenCV
    if (mean_spacing(corners, pattern) < kLeastSpacing) {
        return 0.0;  // not even tried: OpenCV would complain on standard output
    }
    double widest = 0.0;
    for (const bool vertical : {false, true}) {
        const cv::Scalar sharpness =
            cv::estimateChessboardSharpness(gray, pattern, corners, 0.8F, vertical);
        widest = std::max(widest, sharpness[0]);
    }
    return widest < kNotMeasured ? widest : 0.0;
}

}  // namespace

void check(const Chessboard& board) {
    const auto fits = [](int count) { return count >= 3 && count <= 100; };
    if (!fits(board.columns) || !fits(board.rows)) {
        throw Error(fmt::format("a board needs 3 to 100 inner corners each way, not {} x {}",
                                board.columns, board.rows));
    }
    if (!(board.square >= 1e-4 && board.square <= 10.0)) {
        throw Error(
            fmt::format("a square of the board must be 0.0001 to 10 m wide, not {}", board.square));
    }
}

std::optional<BoardSight> find_board(const Image& image, const Chessboard& board) {
    check(board);
    if (!is_consistent(image)) {
        throw Error("an image whose pixels do not fit its size");
    }
    const cv::Mat gray = gray_of(image);
    const cv::Size pattern(board.columns, board.rows);
    try {
        const CvCorners rough = search(gray, pattern);
        if (rough.empty()) {
            return std::nullopt;
        }
        const CvCorners corners = refined(gray, rough, pattern);
        BoardSight sight;
        sight.edge_width = edge_width_of(gray, corners, pattern);
        for (const cv::Point2f& corner : corners) {
            sight.corners.emplace_back(corner.x, corner.y);
        }
        return sight;
    } catch (const cv::Exception&) {
        return std::nullopt;  // an image too small for any of it
    }
}

BoardPhotos::BoardPhotos(const Chessboard& board, double most_edge_width)
    : board_(board), most_edge_width_(most_edge_width) {
    check(board);
}

std::string BoardPhotos::refusal_of(const Image& image,
                                    const std::optional<BoardSight>& sight) const {
    if (!sight) {
        return fmt::format("no board of {} x {} inner corners", board_.columns, board_.rows);
    }
    if (!(sight->edge_width > 0.0)) {
        return "the board is too small: the sharpness of squares below 10 pixels cannot be "
               "measured";
    }
    const double most =
        most_edge_width_ * std::max(1.0, std::max(image.width, image.height) / 640.0);
    if (sight->edge_width > most) {
        return fmt::format("blurred: edges are {:.1f} pixels wide, {:.1f} are allowed",
                           sight->edge_width, most);
    }
    return {};
}

const BoardPhoto& BoardPhotos::add(std::string name, const Image& image) {
    if (width_ > 0 && (image.width != width_ || image.height != height_)) {
        return refuse(std::move(name), fmt::format("is {} x {}, the others are {} x {}",
                                                   image.width, image.height, width_, height_));
    }
    std::optional<BoardSight> sight = find_board(image, board_);
    BoardPhoto photo;
    photo.name = std::move(name);
    photo.refusal = refusal_of(image, sight);
    if (sight) {
        photo.corners = std::move(sight->corners);
        photo.edge_width = sight->edge_width;
    }
    if (photo.usable()) {
        width_ = image.width;
        height_ = image.height;
    }
    photos_.push_back(std::move(photo));
    return photos_.back();
}

const BoardPhoto& BoardPhotos::refuse(std::string name, std::string reason) {
    photos_.push_back({std::move(name), {}, 0.0, std::move(reason)});
    return photos_.back();
}

std::size_t BoardPhotos::usable() const {
    return static_cast<std::size_t>(std::count_if(
        photos_.begin(), photos_.end(), [](const BoardPhoto& photo) { return photo.usable(); }));
}

}  // namespace hybrid_slam
