// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/chessboard.hpp"

#include <gmock/gmock.h>

#include "board_rendering.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

/// The largest distance between corners that belong together; the board may be seen from either
/// end.
double farthest(const std::vector<Pixel>& found, std::vector<Pixel> truth) {
    double least = 1e9;
    for (int end = 0; end < 2; ++end) {
        double most = 0.0;
        for (std::size_t i = 0; i < truth.size(); ++i) {
            most = std::max(most, (found[i] - truth[i]).norm());
        }
        least = std::min(least, most);
        std::reverse(truth.begin(), truth.end());
    }
    return least;
}

const Chessboard kBoard{7, 5, 0.03};

const BoardRenderer& renderer() {
    static const BoardRenderer kRenderer(small_camera(), kBoard);
    return kRenderer;
}

Image upright_view() {
    return renderer().render(board_at(kBoard, {0.0, 0.0, 0.55}, {0.0, 0.0, 0.0}));
}

TEST(FindBoard, FindsEachCornerToASmallPartOfAPixel) {
    for (const Eigen::Isometry3d& pose : board_views(kBoard)) {
        const auto sight = find_board(renderer().render(pose), kBoard);
        ASSERT_TRUE(sight);
        ASSERT_EQ(sight->corners.size(), 35U);
        EXPECT_LT(farthest(sight->corners, renderer().corners(pose)), 0.3);
        EXPECT_GT(sight->edge_width, 0.5);
        EXPECT_LT(sight->edge_width, 4.0);
    }
}

/// Squares of 12 pixels: a window of 11 would reach into the next ones.
TEST(FindBoard, FindsTheCornersOfABoardFarAway) {
    const Eigen::Isometry3d pose = board_at(kBoard, {0.05, 0.0, 0.95}, {0.4, 0.2, 0.1});
    const auto sight = find_board(renderer().render(pose), kBoard);
    ASSERT_TRUE(sight);
    EXPECT_LT(farthest(sight->corners, renderer().corners(pose)), 0.2);
}

TEST(FindBoard, FindsTheSameInColor) {
    const Image gray = upright_view();
    Image color = gray;
    color.channels = 3;
    color.pixels.clear();
    for (const std::uint8_t pixel : gray.pixels) {
        color.pixels.insert(color.pixels.end(), 3, pixel);
    }
    const auto expected = find_board(gray, kBoard);
    const auto found = find_board(color, kBoard);
    ASSERT_TRUE(expected && found);
    EXPECT_LT(farthest(found->corners, expected->corners), 1e-3);
}

/// Searched in a smaller copy, then refined in the photo itself.
TEST(FindBoard, FindsABoardInALargePhoto) {
    const Image small = upright_view();
    constexpr int kTimes = 4;
    Image large;
    large.width = kTimes * small.width;
    large.height = kTimes * small.height;
    for (int v = 0; v < large.height; ++v) {
        for (int u = 0; u < large.width; ++u) {
            large.pixels.push_back(small.pixels[(v / kTimes) * small.width + u / kTimes]);
        }
    }
    const auto expected = find_board(small, kBoard);
    const auto found = find_board(large, kBoard);
    ASSERT_TRUE(expected && found);
    std::vector<Pixel> enlarged;
    for (const Pixel& corner : expected->corners) {
        enlarged.push_back(kTimes * (corner + Pixel(0.5, 0.5)) - Pixel(0.5, 0.5));
    }
    EXPECT_LT(farthest(found->corners, enlarged), 1.0);
}

TEST(FindBoard, FindsNothingWhereThereIsNone) {
    Image gray;
    gray.width = 64;
    gray.height = 48;
    gray.pixels.assign(64 * 48, 128);
    EXPECT_FALSE(find_board(gray, kBoard));
    gray.width = gray.height = 1;
    gray.pixels.assign(1, 0);
    EXPECT_FALSE(find_board(gray, kBoard));
    EXPECT_FALSE(find_board(upright_view(), {9, 6, 0.03})) << "another board than asked for";
}

TEST(FindBoard, RefusesBoardsAndImagesThatCannotBe) {
    const Image image = upright_view();
    EXPECT_EQ(error_of([&] {
                  find_board(image, {2, 6, 0.03});
              }),
              "a board needs 3 to 100 inner corners each way, not 2 x 6");
    EXPECT_EQ(error_of([&] {
                  find_board(image, {9, 101, 0.03});
              }),
              "a board needs 3 to 100 inner corners each way, not 9 x 101");
    EXPECT_EQ(error_of([&] {
                  find_board(image, {9, 6, 0.0});
              }),
              "a square of the board must be 0.0001 to 10 m wide, not 0");
    Image torn = image;
    torn.pixels.pop_back();
    EXPECT_EQ(error_of([&] { find_board(torn, kBoard); }),
              "an image whose pixels do not fit its size");
}

TEST(BoardPhotos, RefusesByNameAndReason) {
    BoardPhotos photos(kBoard);
    Image empty;
    empty.width = 400;
    empty.height = 300;
    empty.pixels.assign(400 * 300, 90);
    EXPECT_EQ(photos.add("empty.png", empty).refusal, "no board of 7 x 5 inner corners");
    EXPECT_EQ(photos.usable(), 0U);
    EXPECT_EQ(photos.width(), 0) << "a photo that is not used says nothing of the others' size";
    const Image sharp = upright_view();
    EXPECT_TRUE(photos.add("sharp.png", sharp).usable());
    EXPECT_THAT(
        photos.add("soft.png", blurred(sharp, 4)).refusal,
        ::testing::MatchesRegex("blurred: edges are [5-9]\\.. pixels wide, 5.0 are allowed"));
    EXPECT_TRUE(photos.add("nearly.png", blurred(sharp, 1)).usable());
    Image cut = sharp;
    cut.height = 299;
    cut.pixels.resize(400 * 299);
    EXPECT_EQ(photos.add("cut.png", cut).refusal, "is 400 x 299, the others are 400 x 300");
    EXPECT_EQ(photos.refuse("torn.png", "no image").refusal, "no image");
    EXPECT_EQ(photos.usable(), 2U);
    EXPECT_EQ(photos.width(), 400);
    EXPECT_EQ(photos.height(), 300);
    ASSERT_EQ(photos.photos().size(), 6U);
    EXPECT_EQ(photos.photos()[2].name, "soft.png");
    EXPECT_FALSE(photos.photos()[2].usable());
}

/// Squares of 8 and of 14 pixels.
TEST(BoardPhotos, RefusesABoardTooSmallForItsSharpness) {
    const Chessboard board{3, 3, 0.03};
    const BoardRenderer small(small_camera(), board);
    BoardPhotos photos(board);
    testing::internal::CaptureStdout();
    const BoardPhoto far =
        photos.add("far.png", small.render(board_at(board, {0, 0, 1.4}, {0, 0, 0})));
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(
        far.refusal,
        "the board is too small: the sharpness of squares below 10 pixels cannot be measured");
    EXPECT_EQ(far.edge_width, 0.0);
    EXPECT_EQ(far.corners.size(), 9U);
    EXPECT_TRUE(
        photos.add("near.png", small.render(board_at(board, {0, 0, 0.8}, {0, 0, 0}))).usable());
}

TEST(BoardPhotos, TheLimitOfBlurCanBeSet) {
    const Image soft = blurred(upright_view(), 4);
    BoardPhotos lenient(kBoard, 20.0);
    EXPECT_TRUE(lenient.add("soft.png", soft).usable());
    BoardPhotos strict(kBoard, 0.5);
    EXPECT_FALSE(strict.add("sharp.png", upright_view()).usable());
}

}  // namespace
}  // namespace hybrid_slam::test
