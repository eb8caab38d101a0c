// SPDX-License-Identifier: Apache-2.0
#include "canvas.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
constexpr double kFontCapital = 21.0;  // pixels, of a capital letter at scale 1
constexpr int kShift = 4;              // bits of a pixel's fraction
constexpr double kFarAway = 1e5;       // pixels; beyond it OpenCV's integers overflow

cv::Scalar bgr(const Color& color) {
    return {static_cast<double>(color.blue), static_cast<double>(color.green),
            static_cast<double>(color.red)};
}

cv::Vec3b bgr_bytes(const Color& color) {
    return {color.blue, color.green, color.red};
}

cv::Rect cv_rect(const Rect& rect) {
    return {rect.x, rect.y, rect.width, rect.height};
}

cv::Point fixed_point(const Pixel& pixel) {
    const Pixel near = pixel.cwiseMax(-kFarAway).cwiseMin(kFarAway) * (1 << kShift);
    return {static_cast<int>(std::lround(near.x())), static_cast<int>(std::lround(near.y()))};
}

double font_scale(const TextStyle& style) {
    return style.height / kFontCapital;
}

int font_thickness(const TextStyle& style) {
    return style.bold ? std::max(2, style.height / 8) : std::max(1, style.height / 16);
}

/// Two pictures of the grid, the top row first: what of each cell is known free, and what is wall.
struct Masks {
    cv::Mat free;
    cv::Mat wall;
};

Masks masks_of(const StateGrid& grid) {
    const GridGeometry& geometry = grid.geometry;
    Masks masks{cv::Mat(geometry.height, geometry.width, CV_8UC1),
                cv::Mat(geometry.height, geometry.width, CV_8UC1)};
    for (int row = 0; row < geometry.height; ++row) {
        for (int x = 0; x < geometry.width; ++x) {
            const CellState state = grid.at({x, geometry.height - 1 - row});
            masks.free.at<std::uint8_t>(row, x) = state == CellState::kFree ? 255 : 0;
            masks.wall.at<std::uint8_t>(row, x) = state == CellState::kOccupied ? 255 : 0;
        }
    }
    return masks;
}

}  // namespace

struct Canvas::State {
    cv::Mat picture;
    cv::Mat view;      ///< the part of the picture inside of the clip
    cv::Point offset;  ///< of the view

    Pixel local(const Pixel& pixel) const { return pixel - Pixel(offset.x, offset.y); }
};

Color mix(const Color& from, const Color& to, double ratio) {
    const auto blend = [ratio](std::uint8_t a, std::uint8_t b) {
        return static_cast<std::uint8_t>(std::lround(a + ratio * (b - a)));
    };
    return {blend(from.red, to.red), blend(from.green, to.green), blend(from.blue, to.blue)};
}

Canvas::Canvas(int width, int height) : state_(std::make_unique<State>()) {
    cv::setNumThreads(1);  // the same bytes on any machine, in tests too
    state_->picture = cv::Mat(height, width, CV_8UC3, cv::Scalar::all(255.0));
    clip_to_all();
}
Canvas::~Canvas() = default;
Canvas::Canvas(Canvas&&) noexcept = default;
Canvas& Canvas::operator=(Canvas&&) noexcept = default;

int Canvas::width() const {
    return state_->picture.cols;
}

int Canvas::height() const {
    return state_->picture.rows;
}

void Canvas::clip_to(const Rect& rect) {
    const cv::Rect inside = cv_rect(rect) & cv::Rect(0, 0, width(), height());
    state_->view = state_->picture(inside);
    state_->offset = inside.tl();
}

void Canvas::clip_to_all() {
    clip_to({0, 0, width(), height()});
}

void Canvas::fill(const Rect& rect, const Color& color) {
    cv::rectangle(state_->view, cv_rect(rect) - state_->offset, bgr(color), cv::FILLED);
}

void Canvas::outline(const Rect& rect, const Color& color) {
    cv::rectangle(state_->view, cv_rect(rect) - state_->offset, bgr(color), 1);
}

void Canvas::line(const Pixel& from, const Pixel& to, const Stroke& stroke) {
    polyline({from, to}, stroke);
}

void Canvas::polyline(const std::vector<Pixel>& pixels, const Stroke& stroke) {
    std::vector<cv::Point> points;
    points.reserve(pixels.size());
    for (const Pixel& pixel : pixels) {
        points.push_back(fixed_point(state_->local(pixel)));
    }
    cv::polylines(state_->view, points, false, bgr(stroke.color), stroke.width, cv::LINE_AA,
                  kShift);
}

void Canvas::disc(const Pixel& center, double radius, const Color& color) {
    const int fixed_radius = static_cast<int>(std::lround(radius * (1 << kShift)));
    cv::circle(state_->view, fixed_point(state_->local(center)), fixed_radius, bgr(color),
               cv::FILLED, cv::LINE_AA, kShift);
}

void Canvas::speckle(const std::vector<Pixel>& pixels, const Color& color) {
    constexpr double kStrength = 0.75;
    const cv::Rect inside(0, 0, state_->view.cols, state_->view.rows);
    for (const Pixel& pixel : pixels) {
        const Pixel at = state_->local(pixel).cwiseMax(-1.0).cwiseMin(kFarAway);
        const cv::Point point(static_cast<int>(std::floor(at.x())),
                              static_cast<int>(std::floor(at.y())));
        if (inside.contains(point)) {
            cv::Vec3b& under = state_->view.at<cv::Vec3b>(point);
            under = bgr_bytes(mix({under[2], under[1], under[0]}, color, kStrength));
        }
    }
}

void Canvas::text(const Pixel& baseline, const std::string& letters, const TextStyle& style) {
    const double width = text_width(letters, style);
    const double shift = style.align == Align::kLeft     ? 0.0
                         : style.align == Align::kCenter ? width / 2.0
                                                         : width;
    const Pixel start = state_->local(baseline) - Pixel(shift, 0.0);
    cv::putText(
        state_->view, letters,
        {static_cast<int>(std::lround(start.x())), static_cast<int>(std::lround(start.y()))}, kFont,
        font_scale(style), bgr(style.color), font_thickness(style), cv::LINE_AA);
}

double text_width(const std::string& letters, const TextStyle& style) {
    int below_baseline = 0;
    return cv::getTextSize(letters, kFont, font_scale(style), font_thickness(style),
                           &below_baseline)
        .width;
}

void Canvas::grid(const StateGrid& grid, const Pixel& corner, double pixels_per_cell,
                  const GridShades& shades) {
    // A wall of one cell would fade between pixels, the more the fewer there are.
    const double emphasis = std::max(1.2, 2.4 / pixels_per_cell);
    const int interpolation = pixels_per_cell < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR;
    const cv::Size size(
        std::max(1, static_cast<int>(std::lround(grid.geometry.width * pixels_per_cell))),
        std::max(1, static_cast<int>(std::lround(grid.geometry.height * pixels_per_cell))));
    Masks masks = masks_of(grid);
    cv::resize(masks.free, masks.free, size, 0.0, 0.0, interpolation);
    cv::resize(masks.wall, masks.wall, size, 0.0, 0.0, interpolation);
    const Pixel start = state_->local(corner);
    const cv::Point origin(static_cast<int>(std::lround(start.x())),
                           static_cast<int>(std::lround(start.y())));
    const cv::Rect target =
        cv::Rect(origin, size) & cv::Rect(0, 0, state_->view.cols, state_->view.rows);
    for (int y = target.y; y < target.y + target.height; ++y) {
        for (int x = target.x; x < target.x + target.width; ++x) {
            const cv::Point source(x - origin.x, y - origin.y);
            const double free = masks.free.at<std::uint8_t>(source) / 255.0;
            const double wall =
                std::min(1.0, emphasis * masks.wall.at<std::uint8_t>(source) / 255.0);
            const Color floor = mix(shades.unknown, shades.free, std::min(1.0, free + wall));
            state_->view.at<cv::Vec3b>(y, x) = bgr_bytes(mix(floor, shades.wall, wall));
        }
    }
}

void Canvas::image(const Image& image, const Rect& rect) {
    // OpenCV takes bytes to read from and to write to alike; these are only read.
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
    auto* const pixels = const_cast<std::uint8_t*>(image.pixels.data());
    const cv::Mat whole(image.height, image.width, image.channels == 1 ? CV_8UC1 : CV_8UC3, pixels);
    const double scale = std::min(static_cast<double>(rect.width) / image.width,
                                  static_cast<double>(rect.height) / image.height);
    cv::Rect place(0, 0, std::max(1, static_cast<int>(scale * image.width)),
                   std::max(1, static_cast<int>(scale * image.height)));
    cv::Mat small;
    cv::resize(whole, small, place.size(), 0.0, 0.0, cv::INTER_AREA);
    if (small.channels() == 1) {
        cv::cvtColor(small, small, cv::COLOR_GRAY2BGR);
    }
    place += cv::Point(rect.x + (rect.width - place.width) / 2,
                       rect.y + (rect.height - place.height) / 2);
    const cv::Rect seen = place & cv::Rect(0, 0, width(), height());
    small(seen - place.tl()).copyTo(state_->picture(seen));
}

void Canvas::write_png(const std::filesystem::path& file) const {
    const std::filesystem::path place =
        replaceable_file(file);  // libpng removes what it cannot write
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width());
    image.height = static_cast<png_uint_32>(height());
    image.format = PNG_FORMAT_BGR;
    const auto row_stride = static_cast<png_int_32>(state_->picture.step[0]);
    if (png_image_write_to_file(&image, place.c_str(), 0, state_->picture.data, row_stride,
                                nullptr) == 0) {
        throw Error(file.string() + ": " + image.message);
    }
}

}  // namespace hybrid_slam::tools
