// SPDX-License-Identifier: Apache-2.0
#include "feature_tracker.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr int kSquare = 40;  ///< pixels, of the checkerboard

cv::Mat checkerboard() {
    cv::Mat board(kHeight, kWidth, CV_8UC1);
    for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
            board.at<std::uint8_t>(v, u) = (u / kSquare + v / kSquare) % 2 == 0 ? 60 : 180;
        }
    }
    return board;
}

/// Waves in all directions: smooth, and known between the pixels too.
cv::Mat waves(double shift_x, double shift_y) {
    cv::Mat image(kHeight, kWidth, CV_8UC1);
    Rng rng(21);
    struct Wave {
        double x, y, phase;
    };
    std::vector<Wave> parts;
    for (int i = 0; i < 16; ++i) {
        const double angle = uniform(rng, 0.0, kPi);
        const double frequency = 2.0 * kPi / uniform(rng, 7.0, 60.0);
        parts.push_back({frequency * std::cos(angle), frequency * std::sin(angle),
                         uniform(rng, 0.0, 2.0 * kPi)});
    }
    for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
            const Eigen::Vector2d at(u - shift_x, v - shift_y);
            double level = 120.0;
            for (const Wave& wave : parts) {
                level += 14.0 * std::sin(wave.x * at.x() + wave.y * at.y() + wave.phase);
            }
            image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(level);
        }
    }
    return image;
}

Pyramid seen(const cv::Mat& image, double gain = 1.0) {
    return make_pyramid(image, gain, 0.0);
}

double away_from_multiple(float value) {
    const double at = (value + 0.5) / kSquare;  // squares begin at the edges of pixels
    return kSquare * std::abs(at - std::round(at));
}

void expect_spread(const ImagePoints& points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const cv::Point2f apart = points[i] - points[j];
            ASSERT_GE(std::max(std::abs(apart.x), std::abs(apart.y)), 8.0F);
        }
    }
}

TEST(FeatureTracker, FindsTheCornersOfACheckerboard) {
    const ImagePoints corners = find_corners(seen(checkerboard()), {}, 100);
    EXPECT_GE(corners.size(), 30U) << "there are 35";
    EXPECT_LE(corners.size(), 100U);
    for (const cv::Point2f& corner : corners) {
        EXPECT_LE(away_from_multiple(corner.x), 2.0) << corner;
        EXPECT_LE(away_from_multiple(corner.y), 2.0) << corner;
    }
    expect_spread(corners);
}

TEST(FeatureTracker, SpreadsCornersOverTheImage) {
    const ImagePoints corners = find_corners(seen(waves(0.0, 0.0)), {}, 60);
    ASSERT_GE(corners.size(), 40U);
    ASSERT_LE(corners.size(), 60U);
    expect_spread(corners);
    int counts[2][2] = {};
    for (const cv::Point2f& corner : corners) {
        ++counts[corner.y < kHeight / 2][corner.x < kWidth / 2];
    }
    for (const auto& half : counts) {
        EXPECT_GE(std::min(half[0], half[1]), 6);
    }
}

TEST(FeatureTracker, LeavesRoomAroundThoseTaken) {
    const Pyramid pyramid = seen(waves(0.0, 0.0));
    const ImagePoints taken = find_corners(pyramid, {}, 30);
    ImagePoints all = taken;
    const ImagePoints more = find_corners(pyramid, taken, 60);
    EXPECT_GT(more.size(), 5U);
    EXPECT_LE(more.size(), 30U);
    all.insert(all.end(), more.begin(), more.end());
    expect_spread(all);
    EXPECT_TRUE(find_corners(pyramid, taken, taken.size()).empty());
}

TEST(FeatureTracker, FindsNothingWhereThereIsNothing) {
    const cv::Mat gray(kHeight, kWidth, CV_8UC1, cv::Scalar(128));
    EXPECT_TRUE(find_corners(seen(gray), {}, 100).empty());
    EXPECT_TRUE(find_edges(seen(gray), {}, 100).empty());
}

cv::Mat step_at(int column) {
    cv::Mat image(kHeight, kWidth, CV_8UC1, cv::Scalar(60));
    image.colRange(column, kWidth).setTo(180);
    return image;
}

TEST(FeatureTracker, FindsPointsOnEdges) {
    const ImagePoints points = find_edges(seen(step_at(150)), {}, 100);
    ASSERT_GE(points.size(), 5U);
    for (const cv::Point2f& point : points) {
        EXPECT_NEAR(point.x, 149.5, 3.0);
    }
    expect_spread(points);
}

TEST(FeatureTracker, TellsCornersFromEdgesFromFlatParts) {
    cv::Mat image(kHeight, kWidth, CV_8UC1, cv::Scalar(60));
    cv::rectangle(image, {100, 80, 100, 100}, cv::Scalar(180), cv::FILLED);
    const ImagePoints points{{100, 80}, {100, 130}, {150, 80}, {150, 130}, {30, 30}};
    const auto textures = textures_of(seen(image), points, 0.25);
    ASSERT_EQ(textures.size(), points.size());
    const Eigen::FullPivLU<Eigen::Matrix2d> corner(textures[0]);
    EXPECT_EQ(corner.rank(), 2);
    EXPECT_LE(textures[0].trace(), 2.0 / (0.25 * 0.25) + 1e-9) << "no better than sigma";
    // The left edge can be followed across, the upper one down.
    EXPECT_GT(textures[1](0, 0), 1.0);
    EXPECT_NEAR(textures[1](1, 1), 0.0, 1e-6);
    EXPECT_NEAR(textures[1](0, 1), 0.0, 1e-6);
    EXPECT_GT(textures[2](1, 1), 1.0);
    EXPECT_NEAR(textures[2](0, 0), 0.0, 1e-6);
    EXPECT_TRUE(textures[3].isZero(0.0));
    EXPECT_TRUE(textures[4].isZero(0.0));
}

TEST(FeatureTracker, NoiseIsNoTexture) {
    cv::Mat image(kHeight, kWidth, CV_8UC1);
    Rng rng(22);
    for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
            image.at<std::uint8_t>(v, u) =
                cv::saturate_cast<std::uint8_t>((u < 160 ? 60.0 : 180.0) + gauss(rng, 4.0));
        }
    }
    ImagePoints flat;
    for (float u = 20.0F; u < 130.0F; u += 10.0F) {
        flat.emplace_back(u, 100.0F);
    }
    for (const Eigen::Matrix2d& texture : textures_of(seen(image), flat, 0.25)) {
        EXPECT_TRUE(texture.isZero(0.0));
    }
    const Eigen::Matrix2d edge = textures_of(seen(image), {{160, 100}}, 0.25)[0];
    EXPECT_GT(edge(0, 0), 4.0);
    EXPECT_LT(edge(1, 1), 0.02 * edge(0, 0));
}

ImagePoints well_inside(const ImagePoints& points) {
    ImagePoints inside;
    for (const cv::Point2f& point : points) {
        if (point.x > 30 && point.y > 30 && point.x < kWidth - 30 && point.y < kHeight - 30) {
            inside.push_back(point);
        }
    }
    return inside;
}

TEST(FeatureTracker, FollowsAShiftToAFractionOfAPixel) {
    const Pyramid before = seen(waves(0.0, 0.0));
    const ImagePoints points = well_inside(find_corners(before, {}, 80));
    ASSERT_GE(points.size(), 20U);
    for (const cv::Point2f shift : {cv::Point2f(0.37F, -0.61F), cv::Point2f(4.25F, 2.6F)}) {
        const Flow flow = follow(before, seen(waves(shift.x, shift.y)), points, points, 2);
        ASSERT_EQ(flow.now.size(), points.size());
        for (std::size_t i = 0; i < points.size(); ++i) {
            ASSERT_TRUE(flow.good[i]);
            const cv::Point2f error = flow.now[i] - points[i] - shift;
            ASSERT_LT(std::hypot(error.x, error.y), 0.05F) << i;
            ASSERT_LT(std::hypot(flow.miss[i].x, flow.miss[i].y), 0.05F);
        }
    }
}

TEST(FeatureTracker, AGuessBringsFarWaysWithinReach) {
    const Pyramid before = seen(waves(0.0, 0.0));
    const ImagePoints points = well_inside(find_corners(before, {}, 80));
    const cv::Point2f shift(23.4F, -17.2F);
    ImagePoints guesses;
    for (const cv::Point2f& point : points) {
        guesses.push_back(point + shift + cv::Point2f(1.0F, -1.0F));
    }
    const Flow flow = follow(before, seen(waves(shift.x, shift.y)), points, guesses, 0);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const cv::Point2f error = flow.now[i] - points[i] - shift;
        ASSERT_LT(std::hypot(error.x, error.y), 0.1F) << i;
    }
}

TEST(FeatureTracker, TheWayBackShowsWhatIsGone) {
    const Pyramid before = seen(waves(0.0, 0.0));
    const ImagePoints points = well_inside(find_corners(before, {}, 100));
    cv::Mat changed = waves(1.3, 0.8);
    Rng rng(23);
    for (int v = 0; v < kHeight; ++v) {
        for (int u = kWidth / 2; u < kWidth; ++u) {
            changed.at<std::uint8_t>(v, u) =
                cv::saturate_cast<std::uint8_t>(uniform(rng, 20.0, 220.0));
        }
    }
    const Flow flow = follow(before, seen(changed), points, points, 2);
    int gone = 0;
    int trusted = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const bool good = flow.good[i] && std::hypot(flow.miss[i].x, flow.miss[i].y) < 0.5F;
        if (points[i].x > kWidth / 2 + 12) {
            ++gone;
            trusted += good ? 1 : 0;
        } else if (points[i].x < kWidth / 2 - 30) {
            EXPECT_TRUE(good) << points[i];
        }
    }
    ASSERT_GE(gone, 8);
    EXPECT_LE(trusted, gone / 5);
}

TEST(FeatureTracker, WhatLeavesTheImageIsNotGood) {
    const Pyramid before = seen(waves(0.0, 0.0));
    const ImagePoints points{{300.0F, 100.0F}, {100.0F, 100.0F}};
    const ImagePoints guesses{{340.0F, 100.0F}, {140.0F, 100.0F}};
    const Flow flow = follow(before, seen(waves(40.0, 0.0)), points, guesses, 2);
    EXPECT_FALSE(flow.good[0]);
    EXPECT_TRUE(flow.good[1]);
    EXPECT_TRUE(follow(before, before, {}, {}, 2).now.empty());
}

TEST(FeatureTracker, GainMakesAnImageInHalfTheLightComparable) {
    const cv::Mat bright = waves(0.0, 0.0);
    const cv::Mat half = 0.5 * waves(0.6, 0.3);
    const Pyramid before = seen(bright);
    const Pyramid dim = seen(half);
    const Pyramid raised = seen(half, 2.0);
    EXPECT_NEAR(raised.mean, before.mean, 2.0);
    EXPECT_NEAR(raised.light, 0.5 * before.light, 1.0);
    EXPECT_NEAR(raised.contrast, 0.5 * before.contrast, 0.5);
    EXPECT_NEAR(raised.sharpness, dim.sharpness, 0.05 * dim.sharpness) << "of the image as it came";
    const ImagePoints points = well_inside(find_corners(before, {}, 60));
    const Flow flow = follow(before, raised, points, points, 2);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const cv::Point2f error = flow.now[i] - points[i] - cv::Point2f(0.6F, 0.3F);
        ASSERT_TRUE(flow.good[i]);
        ASSERT_LT(std::hypot(error.x, error.y), 0.15F);
    }
}

TEST(FeatureTracker, GainLeavesTheImageItselfAsItIs) {
    const cv::Mat image = waves(0.0, 0.0);
    const cv::Mat copy = image.clone();
    const Pyramid raised = seen(image, 1.5);
    EXPECT_EQ(cv::norm(image, copy, cv::NORM_INF), 0.0);
}

TEST(FeatureTracker, BlurTakesSharpness) {
    cv::Mat blurred;
    cv::GaussianBlur(waves(0.0, 0.0), blurred, {}, 6.0);
    EXPECT_LT(seen(blurred).sharpness, 0.5 * seen(waves(0.0, 0.0)).sharpness);
}

TEST(FeatureTracker, TakesGrayAndColor) {
    Image image;
    image.width = 2;
    image.height = 1;
    image.pixels = {10, 200};
    EXPECT_EQ(gray_of(image).at<std::uint8_t>(0, 1), 200);
    image.channels = 3;
    image.pixels = {90, 90, 90, 0, 0, 255};
    const cv::Mat gray = gray_of(image);
    EXPECT_EQ(gray.at<std::uint8_t>(0, 0), 90);
    EXPECT_EQ(gray.at<std::uint8_t>(0, 1), 76) << "red weighs 0.299";
}

}  // namespace
}  // namespace hybrid_slam::test
