// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <opencv2/video/tracking.hpp>

#include "camera_renderer.hpp"
#include "rendering.hpp"

namespace hybrid_slam::test {
namespace {

const Eigen::Vector3d kStill = Eigen::Vector3d::Zero();
const Pose2d kPose(0.1, 0.2, 0.3);

TEST(CameraImage, DependsOnTheSeedThePlaceAndTheNumberAlone) {
    const World world = room(5.0, 4.0);
    const CameraModel model = sized(160, 120);
    const Eigen::Vector3d twist(0.3, 0.0, 0.5);
    CameraRenderer first(world, model, pitched(15.0), RenderConfig(), 7);
    CameraRenderer second(world, model, pitched(15.0), RenderConfig(), 7);
    CameraRenderer other(world, model, pitched(15.0), RenderConfig(), 8);
    const auto pixels = first.render(kPose, twist, {}, 5).pixels;
    second.render({1.0, 1.0, -2.0}, {1.5, 0.0, 3.0}, {{{2.0, 1.0}, 0.3}}, 9);
    EXPECT_EQ(second.render(kPose, twist, {}, 5).pixels, pixels);
    EXPECT_NE(second.render(kPose, twist, {}, 6).pixels, pixels);
    EXPECT_NE(other.render(kPose, twist, {}, 5).pixels, pixels);
}

/// Mean and standard deviation of what two images of the same differ by, by channel.
cv::Matx<double, 2, 3> difference(Image& first, Image& second, const cv::Rect& where) {
    cv::Mat a;
    cv::Mat b;
    bgr(first)(where).convertTo(a, CV_64F);
    bgr(second)(where).convertTo(b, CV_64F);
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(a - b, mean, deviation);
    return {mean[0], mean[1], mean[2], deviation[0], deviation[1], deviation[2]};
}

TEST(CameraImage, NoiseHasTheConfiguredSizeAndGrowsWithTheLight) {
    RenderConfig config = clean();
    config.noise_sigma = 4.0;
    const World world = room(5.0, 4.0);
    const cv::Rect middle(40, 60, 240, 120);
    std::vector<double> sigmas;
    for (const double brightness : {0.3, 1.0, 1.5}) {
        config.brightness = brightness;
        CameraRenderer renderer(world, sized(320, 240), pitched(60.0), config, 7);
        Image first = renderer.render(kPose, kStill, {}, 1);
        Image second = renderer.render(kPose, kStill, {}, 2);
        const auto found = difference(first, second, middle);
        for (int channel = 0; channel < 3; ++channel) {
            EXPECT_NEAR(found(0, channel), 0.0, 0.15);
            EXPECT_NEAR(found(1, channel), found(1, 1), 0.08 * found(1, 1));
        }
        sigmas.push_back(found(1, 1) / std::sqrt(2.0));
    }
    EXPECT_NEAR(sigmas[1], 4.0, 0.6);
    EXPECT_LT(sigmas[0], 0.85 * sigmas[1]);
    EXPECT_GT(sigmas[2], 1.1 * sigmas[1]);
}

int corners_in(Image& image) {
    std::vector<cv::Point2f> corners;
    // A fixed threshold: goodFeaturesToTrack's own is relative to the best corner.
    cv::Mat strength;
    cv::cornerMinEigenVal(gray(image), strength, 5, 3);
    const cv::Mat strong = strength > 4e-4;
    cv::Mat grown;
    cv::dilate(strength, grown, cv::getStructuringElement(cv::MORPH_RECT, {13, 13}));
    return cv::countNonZero(strong & (strength == grown));
}

TEST(CameraImage, HasCornersWhereThereIsTextureAndHardlyAnyWhereItIsBare) {
    const World world = room(6.0, 5.0);
    const auto corners = [&world](double pitch_deg, double bare_floor, double plain_walls) {
        RenderConfig config;
        config.bare_floor = bare_floor;
        config.plain_walls = plain_walls;
        config.wall_height = 6.0;
        CameraRenderer renderer(world, CameraModel(), pitched(pitch_deg), config, 5);
        Image image = renderer.render(kPose, kStill, {}, 0);
        return corners_in(image);
    };
    const double kDown = 50.0;
    const int on_tiles = corners(kDown, 0.0, 0.0);
    const int on_bare_floor = corners(kDown, 1.0, 0.0);
    const int on_walls = corners(-12.0, 0.0, 0.0);
    const int on_plain_walls = corners(-12.0, 0.0, 1.0);
    EXPECT_GT(on_tiles, 200);
    EXPECT_LT(on_bare_floor, 20);
    EXPECT_GT(on_walls, 100);
    EXPECT_LT(on_plain_walls, 40);
}

/// Sum of the absolute differences between neighbours across and down, in the image's middle.
Eigen::Vector2d edges(Image& image) {
    cv::Mat levels;
    gray(image)(cv::Rect(220, 180, 200, 200)).convertTo(levels, CV_64F);
    const cv::Mat left = levels.colRange(0, levels.cols - 1);
    const cv::Mat upper = levels.rowRange(0, levels.rows - 1);
    return {cv::norm(left, levels.colRange(1, levels.cols), cv::NORM_L1),
            cv::norm(upper, levels.rowRange(1, levels.rows), cv::NORM_L1)};
}

TEST(CameraImage, IsSmearedAlongTheMotionOnly) {
    RenderConfig config;
    config.noise_sigma = 0.0;
    config.exposure = 0.02;
    config.bare_floor = 0.0;
    CameraRenderer renderer(room(5.0, 4.0), CameraModel(), pitched(30.0), config, 7);
    const auto rendered = [&](const Eigen::Vector3d& twist) {
        Image image = renderer.render(kPose, twist, {}, 0);
        return edges(image);
    };
    const Eigen::Vector2d still = rendered(kStill);
    const Eigen::Vector2d turning = rendered({0.0, 0.0, 0.5});
    const Eigen::Vector2d sideways = rendered({0.0, 1.0, 0.0});
    const Eigen::Vector2d ahead = rendered({1.0, 0.0, 0.0});
    // Averaging speckle along a line takes contrast from both directions, but more along it.
    const auto share_across = [&still](const Eigen::Vector2d& moving) {
        return moving.x() / still.x() / (moving.y() / still.y());
    };
    EXPECT_LT(turning.x(), 0.7 * still.x());
    EXPECT_LT(share_across(turning), 0.8);
    EXPECT_LT(sideways.x(), 0.7 * still.x());
    EXPECT_LT(share_across(sideways), 0.8);
    EXPECT_LT(ahead.y(), 0.7 * still.y());
    EXPECT_GT(share_across(ahead), 1.25);
}

/// Standard deviation of an edge's slope across, in pixels: the width of its smear.
double width_of_edge(Image& image, int row, int column) {
    double sum = 0.0;
    double first = 0.0;
    double second = 0.0;
    const cv::Mat levels = gray(image);
    for (int at = column - 14; at < column + 14; ++at) {
        double step = 0.0;
        for (int line = row - 10; line < row + 10; ++line) {
            step += levels.at<std::uint8_t>(line, at + 1) - levels.at<std::uint8_t>(line, at);
        }
        sum += step;
        first += step * (at - column);
        second += step * (at - column) * (at - column);
    }
    const double mean = first / sum;
    return std::sqrt(std::max(second / sum - mean * mean, 0.0));
}

/// An edge that moves by s in the exposure is smeared by a box of this width, whose standard
/// deviation is s / sqrt(12). It is that of a door's dark frame before a white wall.
TEST(CameraImage, IsSmearedByTheExposure) {
    World world = room(2.0, 6.0);
    world.walls.push_back({{1.6, 0.0}, {1.6, -1.2}});
    const RenderConfig config = clean();
    const Eye eye{CameraModel(), pitched(0.0), {0.0, 0.0, 0.0}};
    CameraRenderer renderer(world, eye.model, eye.mounting, config, 7);
    const Pixel edge = eye.project({1.6, 0.0, 0.5}).value();
    const auto width = [&](double turn_rate) {
        Image image = renderer.render({}, {0.0, 0.0, turn_rate}, {}, 0);
        return width_of_edge(image, static_cast<int>(edge.y()), static_cast<int>(edge.x()));
    };
    const double sharp = width(0.0);
    EXPECT_LT(sharp, 0.9);
    for (const double turn_rate : {0.2, -0.2, 0.5, -0.5, 1.0, 1.8}) {
        const double smear = turn_rate * config.exposure * eye.model.fx;
        const double expected = std::hypot(sharp, smear / std::sqrt(12.0));
        EXPECT_NEAR(width(turn_rate), expected, 0.15 + 0.1 * expected) << turn_rate;
    }
}

/// Tracks features of the first image into the second.
struct Tracks {
    Tracks(Image& first, Image& second) {
        const cv::Mat from = gray(first);
        const cv::Mat to = gray(second);
        std::vector<cv::Point2f> features;
        cv::goodFeaturesToTrack(from, features, 400, 0.01, 8.0);
        std::vector<cv::Point2f> tracked;
        std::vector<std::uint8_t> found;
        cv::calcOpticalFlowPyrLK(from, to, features, tracked, found, cv::noArray());
        for (std::size_t i = 0; i < features.size(); ++i) {
            if (found[i] != 0) {
                before.emplace_back(features[i].x, features[i].y);
                after.emplace_back(tracked[i].x, tracked[i].y);
            }
        }
    }
    std::vector<Pixel> before;
    std::vector<Pixel> after;
};

TEST(CameraImage, IsThatOfTheMiddleOfTheExposure) {
    CameraRenderer renderer(room(15.0, 15.0), CameraModel(), pitched(30.0), RenderConfig(), 3);
    Image still = renderer.render(kPose, kStill, {}, 0);
    for (const Eigen::Vector3d& twist :
         {Eigen::Vector3d(0.3, 0.0, 0.0), Eigen::Vector3d(0.3, 0.0, 0.5),
          Eigen::Vector3d(0.0, 0.0, -0.5), Eigen::Vector3d(1.5, 0.0, 0.0),
          Eigen::Vector3d(1.0, 0.0, 0.8)}) {
        Image moving = renderer.render(kPose, twist, {}, 1);
        const Tracks tracks(still, moving);
        ASSERT_GT(tracks.before.size(), 60U);
        std::vector<double> across;
        std::vector<double> down;
        for (std::size_t i = 0; i < tracks.before.size(); ++i) {
            across.push_back(tracks.after[i].x() - tracks.before[i].x());
            down.push_back(tracks.after[i].y() - tracks.before[i].y());
        }
        EXPECT_NEAR(quantile(across, 0.5), 0.0, 0.15) << twist.transpose();
        EXPECT_NEAR(quantile(down, 0.5), 0.0, 0.15) << twist.transpose();
    }
}

/// What cv::calcOpticalFlowPyrLK makes of two images, against the floor's true motion.
TEST(CameraImage, FlowsAsTheFloorMoves) {
    const World world = room(8.0, 8.0);
    const CameraMounting mounting = pitched(15.0);
    CameraRenderer renderer(world, CameraModel(), mounting, RenderConfig(), 11);
    constexpr double kPeriod = 1.0 / 30.0;
    for (const Eigen::Vector3d& twist :
         {Eigen::Vector3d(0.3, 0.0, 0.0), Eigen::Vector3d(0.3, 0.0, radians(30.0))}) {
        const Eye before{CameraModel(), mounting, kPose};
        const Eye after{CameraModel(), mounting, kPose * Pose2d::exp(kPeriod * twist)};
        Image first = renderer.render(before.world_from_robot, twist, {}, 0);
        Image second = renderer.render(after.world_from_robot, twist, {}, 1);
        const Tracks tracks(first, second);
        std::vector<double> errors;
        for (std::size_t i = 0; i < tracks.before.size(); ++i) {
            const auto place = before.floor_at(tracks.before[i]);
            if (!place || place->cwiseAbs().maxCoeff() > 8.0) {
                continue;
            }
            const auto expected = after.project({place->x(), place->y(), 0.0});
            if (expected && after.sees(*expected, 15.0)) {
                errors.push_back((tracks.after[i] - *expected).norm());
            }
        }
        ASSERT_GT(errors.size(), 80U);
        EXPECT_LT(mean(errors), 0.3);
        EXPECT_LT(quantile(errors, 0.5), 0.15);
    }
}

TEST(CameraImage, FaultsLastFromTheFirstMomentToBeforeTheLast) {
    RenderConfig config;
    config.covered = {8.0, 9.0, 2.0, 3.5};
    config.dimmed = {3.0, 5.0};
    for (const double time : {0.0, 1.999, 3.5, 7.9, 9.0, 1e5}) {
        EXPECT_FALSE(camera_light_at(config, time).covered) << time;
    }
    for (const double time : {2.0, 3.499, 8.0, 8.9}) {
        EXPECT_TRUE(camera_light_at(config, time).covered) << time;
    }
    EXPECT_EQ(camera_light_at(config, 2.999).lamps, 1.0);
    EXPECT_EQ(camera_light_at(config, 3.0).lamps, 0.5);
    EXPECT_EQ(camera_light_at(config, 4.999).lamps, 0.5);
    EXPECT_EQ(camera_light_at(config, 5.0).lamps, 1.0);
}

TEST(CameraImage, HalfTheLightHalvesAllLevelsAndTheNextImageIsAsBright) {
    RenderConfig config = clean();
    config.brightness = 0.7;  // nothing is overexposed
    config.shine = 0.3;
    CameraRenderer renderer(room(5.0, 4.0), sized(320, 240), pitched(15.0), config, 7);
    const std::vector<Circle> people{{{2.5, 0.5}, 0.3}};
    const Pose2d pose(-1.0, 0.2, 0.1);
    Image bright = renderer.render(pose, kStill, people, 0);
    Image dim = renderer.render(pose, kStill, people, 0, {0.5, false});
    cv::Mat expected;
    bgr(bright).convertTo(expected, CV_64F, 0.5);
    cv::Mat found;
    bgr(dim).convertTo(found, CV_64F);
    EXPECT_LE(cv::norm(found, expected, cv::NORM_INF), 0.76) << "rounded twice";
    EXPECT_GT(cv::mean(gray(bright))[0], 60.0);
    EXPECT_EQ(renderer.render(pose, kStill, people, 0).pixels, bright.pixels);
}

TEST(CameraImage, CoveredIsNearlyBlackWithNoiseAndShowsNothing) {
    const RenderConfig config;
    CameraRenderer renderer(room(5.0, 4.0), sized(320, 240), pitched(30.0), config, 7);
    const CameraLight covered{1.0, true};
    Image seen = renderer.render(kPose, {0.3, 0.0, 0.2}, {}, 4);
    Image first = renderer.render(kPose, {0.3, 0.0, 0.2}, {}, 4, covered);
    Image second = renderer.render({2.0, -1.0, 2.0}, kStill, {{{1.0, -1.0}, 0.3}}, 4, covered);
    EXPECT_EQ(first.pixels, second.pixels) << "of the noise alone";
    EXPECT_NE(renderer.render(kPose, kStill, {}, 5, covered).pixels, first.pixels);
    EXPECT_GT(cv::mean(gray(seen))[0], 50.0);
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(bgr(first), mean, deviation);
    for (int channel = 0; channel < 3; ++channel) {
        EXPECT_GT(mean[channel], 1.0);
        EXPECT_LT(mean[channel], 6.0);
        EXPECT_GT(deviation[channel], 0.5);
        EXPECT_LT(deviation[channel], 3.0);
    }
    EXPECT_EQ(corners_in(first), 0);
    EXPECT_EQ(renderer.render(kPose, {0.3, 0.0, 0.2}, {}, 4).pixels, seen.pixels);
}

}  // namespace
}  // namespace hybrid_slam::test
