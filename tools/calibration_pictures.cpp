// SPDX-License-Identifier: Apache-2.0
#include "calibration_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hybrid_slam::tools {
namespace {

constexpr int kHead = 40;  // pixels, of the line of text over the picture
constexpr Color kInk{45, 50, 58};
constexpr Color kFrame{190, 194, 200};
constexpr Color kGiven{214, 69, 65};
constexpr Color kExpected{30, 110, 220};
constexpr Color kFloor{40, 160, 90};
constexpr std::array<Color, 6> kColors{
    {{214, 69, 65}, {30, 110, 220}, {40, 160, 90}, {200, 130, 20}, {140, 70, 190}, {20, 150, 170}}};

void write_head(Canvas& canvas, const std::string& text) {
    canvas.text({8.0, 25.0}, text, {9, kInk, Align::kLeft, false});
}

/// From point to point of the floor, as far as it is seen.
void draw_floor_line(Canvas& canvas, const GroundPicture& picture, const Point2& from,
                     const Point2& to) {
    constexpr int kPieces = 60;
    const Eigen::Isometry3d camera_from_robot = picture.mounting.robot_from_camera().inverse();
    std::vector<Pixel> seen;
    const auto draw = [&] {
        canvas.polyline(seen, {kFloor, 1});
        seen.clear();
    };
    for (int i = 0; i <= kPieces; ++i) {
        const Point2 floor = from + (to - from) * i / kPieces;
        const auto pixel =
            picture.model.project(camera_from_robot * Eigen::Vector3d(floor.x(), floor.y(), 0.0));
        // Distortion folds what lies far outside of the image back into it.
        const auto back = pixel ? picture.model.ray(*pixel) : std::nullopt;
        const bool inside = back && pixel->x() > -0.5 * picture.model.width &&
                            pixel->x() < 1.5 * picture.model.width &&
                            pixel->y() > -0.5 * picture.model.height &&
                            pixel->y() < 1.5 * picture.model.height;
        if (inside) {
            seen.emplace_back(*pixel + Pixel(0.0, kHead));
        } else {
            draw();
        }
    }
    draw();
}

void draw_floor(Canvas& canvas, const GroundPicture& picture) {
    constexpr double kStep = 0.5;  // metres
    constexpr int kAhead = 12;     // steps
    constexpr int kAside = 6;
    const double start = std::floor(picture.mounting.x / kStep) * kStep;
    const double end = start + kAhead * kStep;
    for (int i = -kAside; i <= kAside; ++i) {
        draw_floor_line(canvas, picture, {start, i * kStep}, {end, i * kStep});
    }
    for (int i = 0; i <= kAhead; ++i) {
        const double x = start + i * kStep;
        draw_floor_line(canvas, picture, {x, -kAside * kStep}, {x, kAside * kStep});
    }
}

}  // namespace

Canvas draw_board_fits(const BoardPhotos& photos, const CameraCalibration& result) {
    constexpr double kTimes = 50.0;
    const CameraModel& model = result.model;
    const double scale = std::max(1.0, 960.0 / model.width);
    const Rect frame{0, kHead, static_cast<int>(scale * model.width),
                     static_cast<int>(scale * model.height)};
    Canvas canvas(frame.width, frame.height + kHead);
    write_head(canvas, fmt::format("{} boards, error {:.3f} pixels; lines: errors x {:.0f}",
                                   result.fits.size(), result.rms, kTimes));
    canvas.clip_to(frame);
    for (std::size_t i = 0; i < result.fits.size(); ++i) {
        const BoardFit& fit = result.fits[i];
        const std::vector<Pixel>& corners = photos.photos()[fit.photo].corners;
        for (std::size_t j = 0; j < corners.size(); ++j) {
            const Pixel at = scale * corners[j] + Pixel(0.0, kHead);
            const Pixel error = kTimes * scale * (fit.expected[j] - corners[j]);
            canvas.line(at, at + error, {kColors[i % kColors.size()], 1});
            canvas.disc(at, 2.0, kColors[i % kColors.size()]);
        }
    }
    canvas.clip_to_all();
    canvas.outline(frame, kFrame);
    return canvas;
}

Canvas draw_ground(const GroundPicture& picture) {
    const Rect frame{0, kHead, picture.image.width, picture.image.height};
    Canvas canvas(frame.width, frame.height + kHead);
    write_head(canvas,
               fmt::format("{:.3f} m high, {:.2f} deg down, {:.2f} deg clockwise; error {:.2f} px; "
                           "lines: 0.5 m",
                           picture.mounting.z, degrees(picture.mounting.pitch),
                           degrees(picture.mounting.roll), picture.ground.rms));
    canvas.image(picture.image, frame);
    canvas.clip_to(frame);
    draw_floor(canvas, picture);
    for (std::size_t i = 0; i < picture.points.size(); ++i) {
        canvas.disc(picture.points[i].pixel + Pixel(0.0, kHead), 3.0, kGiven);
        const Pixel at = picture.ground.expected[i] + Pixel(0.0, kHead);
        canvas.line(at - Pixel(6.0, 0.0), at + Pixel(6.0, 0.0), {kExpected, 1});
        canvas.line(at - Pixel(0.0, 6.0), at + Pixel(0.0, 6.0), {kExpected, 1});
    }
    canvas.clip_to_all();
    return canvas;
}

}  // namespace hybrid_slam::tools
