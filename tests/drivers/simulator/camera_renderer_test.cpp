// SPDX-License-Identifier: Apache-2.0
#include "camera_renderer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rendering.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

using testing::HasSubstr;

const Eigen::Vector3d kStill = Eigen::Vector3d::Zero();

/// Of the tiles' corners near the camera, from poses all over the room.
std::vector<Eigen::Vector2d> floor_errors(const CameraModel& model,
                                          const CameraMounting& mounting) {
    CameraRenderer renderer(room(15.3, 15.3), model, mounting, clean(), 3);
    std::vector<Eigen::Vector2d> errors;
    for (int i = 0; i < 20; ++i) {
        const Eye eye{model, mounting, {0.1 + 0.37 * i, 0.2 - 0.21 * i, 0.3 + 0.5 * i}};
        Image image = renderer.render(eye.world_from_robot, kStill, {}, 0);
        const auto found = corner_errors(gray(image), visible_tile_corners(eye, 0.6, 2.4));
        errors.insert(errors.end(), found.begin(), found.end());
    }
    return errors;
}

class Mountings : public testing::TestWithParam<CameraMounting> {};

TEST_P(Mountings, ShowTheFloorWhereTheCameraModelProjectsIt) {
    const auto errors = floor_errors(CameraModel(), GetParam());
    ASSERT_GE(errors.size(), 20U);
    // Sampling and the corner finder scatter; what remains on average would be the geometry's.
    EXPECT_LT(mean(errors).norm(), 0.08);
    EXPECT_LT(mean(lengths(errors)), 0.35);
}

CameraMounting askew() {
    CameraMounting mounting = pitched(35.0);
    mounting.x = 0.7;
    mounting.y = -0.3;
    mounting.z = 1.6;
    mounting.yaw = radians(140.0);
    mounting.roll = radians(-12.0);
    return mounting;
}

INSTANTIATE_TEST_SUITE_P(CameraRenderer, Mountings,
                         testing::Values(pitched(15.0), looking_down(2.0), askew()));

TEST(CameraRenderer, RendersAnySize) {
    for (const auto& [width, height] : {std::pair{321, 243}, std::pair{163, 121}}) {
        const CameraModel model = sized(width, height);
        CameraRenderer renderer(room(5.0, 5.0), model, pitched(20.0), clean(), 3);
        EXPECT_EQ(renderer.render({}, kStill, {}, 0).pixels.size(),
                  static_cast<std::size_t>(width * height * 3));
        const auto errors = floor_errors(model, pitched(30.0));
        ASSERT_GE(errors.size(), 20U);
        EXPECT_LT(mean(errors).norm(), 0.15);
        EXPECT_LT(mean(lengths(errors)), 0.6);
    }
}

/// In one column, from the top: the row where the floor begins below what stands there.
std::optional<double> foot_row(const World& world, const Eye& eye, int column) {
    const Eigen::Vector3d origin = eye.world_from_camera().translation();
    const auto beyond = [&](double row) {
        const auto floor = eye.floor_at(Pixel(column, row));
        const Eigen::Vector2d direction = eye.ray(Pixel(column, row)).head<2>().normalized();
        const double range = world.cast_ray(origin.head<2>(), direction);
        return !floor || (*floor - origin.head<2>()).norm() > range;
    };
    double above = 0.0;
    double below = eye.model.height - 1.0;
    if (!beyond(above) || beyond(below)) {
        return std::nullopt;
    }
    while (below - above > 1e-3) {
        (beyond(0.5 * (above + below)) ? above : below) = 0.5 * (above + below);
    }
    return 0.5 * (above + below);
}

/// Where the brightness crosses the middle between its values a little above and below.
std::optional<double> edge_row(const cv::Mat& image, int column, double expected) {
    const int reach = 4;
    const int row = static_cast<int>(std::lround(expected));
    if (row - reach - 1 < 0 || row + reach + 1 >= image.rows) {
        return std::nullopt;
    }
    const auto level = [&](int at) {
        return static_cast<double>(image.at<std::uint8_t>(at, column));
    };
    const double above = 0.5 * (level(row - reach) + level(row - reach - 1));
    const double below = 0.5 * (level(row + reach) + level(row + reach + 1));
    const bool flat = std::abs(level(row - reach) - level(row - reach - 1)) < 3.0 &&
                      std::abs(level(row + reach) - level(row + reach + 1)) < 3.0;
    if (below - above < 15.0 || !flat) {
        return std::nullopt;
    }
    const double middle = 0.5 * (above + below);
    for (int at = row - reach; at < row + reach; ++at) {
        if (level(at) <= middle && level(at + 1) > middle) {
            return at + (middle - level(at)) / (level(at + 1) - level(at));
        }
    }
    return std::nullopt;
}

std::vector<double> foot_errors(const World& world, const Eye& eye) {
    CameraRenderer renderer(world, eye.model, eye.mounting, clean(), 3);
    Image image = renderer.render(eye.world_from_robot, kStill, {}, 0);
    const cv::Mat levels = gray(image);
    std::vector<double> errors;
    for (int column = 0; column < eye.model.width; ++column) {
        const auto expected = foot_row(world, eye, column);
        const auto found = expected ? edge_row(levels, column, *expected) : std::nullopt;
        if (found) {
            errors.push_back(std::abs(*found - *expected));
        }
    }
    return errors;
}

TEST(CameraRenderer, WallsStandWhereTheRayCasterMeetsThem) {
    World world = room(4.3, 3.2);
    world.walls.push_back({{1.0, 0.6}, {2.5, -0.7}});
    for (const Pose2d& pose : {Pose2d(-1.0, 0.2, 0.1), Pose2d(0.3, 0.0, 1.9)}) {
        const auto errors = foot_errors(world, {CameraModel(), pitched(20.0), pose});
        ASSERT_GT(errors.size(), 150U);
        EXPECT_LT(quantile(errors, 0.5), 0.25);
        EXPECT_LT(quantile(errors, 0.95), 0.55);
    }
}

/// The box is brown, the wall behind it white: blue tells them apart.
TEST(CameraRenderer, CornersOfBoxesStandUprightWhereTheyProject) {
    World world = room(6.0, 6.0);
    add_box(world, {3.0, 0.2}, 0.4, 0.4);
    CameraMounting mounting = pitched(5.0);
    mounting.roll = radians(8.0);
    const Eye eye{CameraModel(), mounting, {0.0, 0.0, 0.0}};
    CameraRenderer renderer(world, eye.model, eye.mounting, clean(), 3);
    Image image = renderer.render(eye.world_from_robot, kStill, {}, 0);
    const auto is_brown = [&image](int column, int row) {
        const auto color = bgr(image).at<cv::Vec3b>(row, column);
        return color[2] > color[0] + 20;
    };
    for (const double height : {0.5, 0.65, 1.1}) {
        const Pixel left = eye.project({2.6, 0.6, height}).value();
        const auto row = static_cast<int>(std::lround(left.y()));
        const auto column = static_cast<int>(std::lround(left.x()));
        EXPECT_FALSE(is_brown(column - 3, row)) << height;
        EXPECT_TRUE(is_brown(column + 3, row)) << height;
    }
}

TEST(CameraRenderer, WhatIsHiddenChangesNoPixel) {
    World world = room(6.0, 6.0);
    add_box(world, {2.5, 0.0}, 0.2, 2.5);
    World with_hidden = world;
    add_box(with_hidden, {4.5, 0.3}, 0.5, 0.5);
    const RenderConfig config;
    CameraRenderer first(world, sized(320, 240), pitched(10.0), config, 3);
    CameraRenderer second(with_hidden, sized(320, 240), pitched(10.0), config, 3);
    const Pose2d pose(0.0, 0.0, 0.0);
    const Circle hidden{{3.5, 0.2}, 0.3};
    const Image expected = first.render(pose, kStill, {}, 0);
    EXPECT_EQ(second.render(pose, kStill, {hidden}, 0).pixels, expected.pixels);
    const Circle seen{{1.5, 0.2}, 0.3};
    EXPECT_NE(second.render(pose, kStill, {seen}, 0).pixels, expected.pixels);
}

TEST(CameraRenderer, PeopleCoverWhatTheyStandBefore) {
    const Eye eye{CameraModel(), pitched(0.0), {0.0, 0.0, 0.0}};
    CameraRenderer renderer(room(8.0, 8.0), eye.model, eye.mounting, clean(), 3);
    const Circle person{{5.0, 0.3}, 0.3};
    Image without = renderer.render(eye.world_from_robot, kStill, {}, 0);
    Image with = renderer.render(eye.world_from_robot, kStill, {person}, 0);
    cv::Mat changed;
    cv::absdiff(gray(without), gray(with), changed);
    const cv::Rect found = cv::boundingRect(changed > 8);
    const Pixel feet = eye.project({5.0, 0.3, 0.0}).value();
    const Pixel head = eye.project({5.0, 0.3, 1.75}).value();
    const Pixel left = eye.project({5.0, 0.6, 1.0}).value();
    EXPECT_NEAR(found.y, head.y(), 3.0);
    EXPECT_NEAR(found.y + found.height, feet.y(), 3.0);
    EXPECT_NEAR(found.x, left.x(), 4.0);
    EXPECT_NEAR(found.x + 0.5 * found.width, feet.x(), 2.0);
}

TEST(CameraRenderer, LampsHangFromTheCeilingWhereTheyProject) {
    RenderConfig config = clean();
    config.ceiling_height = 14.0;
    Eye eye{CameraModel(), pitched(-50.0), {0.4, 0.3, 0.0}};
    CameraRenderer renderer(room(20.0, 20.0), eye.model, eye.mounting, config, 3);
    constexpr double kSpacing = 4.8;  // of the lamps; the first hangs at (1.8, 1.8)
    constexpr int kReach = 45;        // pixels
    int lit = 0;
    for (int turn = 0; turn < 8; ++turn) {
        eye.world_from_robot.heading = turn * kPi / 4.0;
        Image image = renderer.render(eye.world_from_robot, kStill, {}, 0);
        for (int lamp = 0; lamp < 25; ++lamp) {
            const double x = 1.8 + kSpacing * (lamp % 5 - 2);
            const double y = 1.8 + kSpacing * (lamp / 5 - 2);
            const auto pixel = eye.project({x, y, config.ceiling_height});
            if (!pixel || !eye.sees(*pixel, kReach + 1)) {
                continue;
            }
            const cv::Rect window(static_cast<int>(pixel->x()) - kReach,
                                  static_cast<int>(pixel->y()) - kReach, 2 * kReach, 2 * kReach);
            const cv::Moments bright = cv::moments(gray(image)(window) > 200, true);
            if (bright.m00 > 100.0) {
                ++lit;
                EXPECT_NEAR(window.x + bright.m10 / bright.m00, pixel->x(), 1.5);
                EXPECT_NEAR(window.y + bright.m01 / bright.m00, pixel->y(), 1.5);
            }
        }
    }
    EXPECT_GE(lit, 4);
}

TEST(CameraRenderer, RefusesWhatItCannotRender) {
    const World world = room(5.0, 5.0);
    const CameraModel small = sized(64, 48);
    const auto message = [&](const CameraModel& model, const RenderConfig& config) {
        return error_of([&] { CameraRenderer(world, model, pitched(15.0), config, 1); });
    };
    RenderConfig config;
    config.wall_height = 0.9;
    EXPECT_THAT(message(small, config), HasSubstr("wall_height"));
    config = {};
    config.ceiling_height = 2.0;
    EXPECT_THAT(message(small, config), HasSubstr("ceiling_height"));
    config = {};
    config.noise_sigma = -1.0;
    EXPECT_THAT(message(small, config), HasSubstr("noise_sigma"));
    config = {};
    config.covered = {1.0, 2.0, 3.0};
    EXPECT_THAT(message(small, config), HasSubstr("render.covered: must hold pairs"));
    config.covered = {1.0, 2.0, 4.0, 4.0};
    EXPECT_THAT(message(small, config), HasSubstr("render.covered: must hold pairs"));
    config.covered = {4.0, 5.0, 1.0, 2.0};
    config.dimmed = {2.0, 1.0};
    EXPECT_THAT(message(small, config), HasSubstr("render.dimmed: must hold pairs"));
    config.dimmed = {-1.0, 1.0};
    EXPECT_THAT(message(small, config), HasSubstr("dimmed"));
    CameraModel folded = small;
    folded.k1 = -5.0;
    EXPECT_THAT(message(folded, {}), HasSubstr("distortion"));
}

}  // namespace
}  // namespace hybrid_slam::test
