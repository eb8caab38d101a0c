// SPDX-License-Identifier: Apache-2.0
#include "corner_picker.hpp"

#include <gmock/gmock.h>

#include "corner_window.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::tools {
namespace {

using hybrid_slam::test::bytes_of;
using hybrid_slam::test::error_of;
using hybrid_slam::test::TempFolder;
using ::testing::HasSubstr;
using State = CornerPicker::State;

constexpr int kEnter = 13;
constexpr int kBackspace = 8;
constexpr int kEscape = 27;

CornerPicker picker_with(int clicks) {
    CornerPicker picker({640, 480}, {640, 480});
    for (int i = 0; i < clicks; ++i) {
        picker.click({100 + i, 200});
    }
    return picker;
}

TEST(CornerPicker, FourClicksAndEnterEndIt) {
    CornerPicker picker = picker_with(3);
    picker.press(kEnter);
    EXPECT_EQ(picker.state(), State::kPicking) << "three are too few";
    picker.click({50, 60});
    EXPECT_EQ(picker.state(), State::kPicking) << "the last one may still be taken back";
    picker.press(-1);
    EXPECT_EQ(picker.state(), State::kPicking);
    picker.press(kEnter);
    EXPECT_EQ(picker.state(), State::kAccepted);
    ASSERT_EQ(picker.corners().size(), 4U);
    EXPECT_EQ(picker.corners()[0], Eigen::Vector2d(100, 200));
    EXPECT_EQ(picker.corners()[3], Eigen::Vector2d(50, 60));
}

TEST(CornerPicker, AFifthClickDoesNothing) {
    CornerPicker picker = picker_with(5);
    ASSERT_EQ(picker.corners().size(), 4U);
    EXPECT_EQ(picker.corners()[3], Eigen::Vector2d(103, 200));
}

TEST(CornerPicker, TakesTheLastOneBack) {
    CornerPicker picker = picker_with(4);
    picker.undo();
    picker.press(kBackspace);
    picker.press(0x100000 | 0xFF);  // Delete, with a modifier's bit in the upper bytes
    ASSERT_EQ(picker.corners().size(), 1U);
    picker.press(127);
    picker.undo();
    EXPECT_TRUE(picker.corners().empty());
    picker.click({7, 8});
    ASSERT_EQ(picker.corners().size(), 1U);
    EXPECT_EQ(picker.corners()[0], Eigen::Vector2d(7, 8));
}

TEST(CornerPicker, ClicksOutsideOfTheImageDoNothing) {
    CornerPicker picker({640, 480}, {640, 480});
    for (const Eigen::Vector2i& outside :
         {Eigen::Vector2i(-1, 5), Eigen::Vector2i(640, 5), Eigen::Vector2i(5, 480)}) {
        picker.click(outside);
    }
    EXPECT_TRUE(picker.corners().empty());
    picker.click({639, 479});
    EXPECT_EQ(picker.corners().size(), 1U);
}

TEST(CornerPicker, CanBeGivenUp) {
    for (const int key : {kEscape, static_cast<int>('q')}) {
        CornerPicker picker = picker_with(4);
        picker.press(key);
        EXPECT_EQ(picker.state(), State::kCancelled);
        picker.press(kEnter);
        EXPECT_EQ(picker.state(), State::kCancelled) << "an end is an end";
        picker.undo();
        EXPECT_EQ(picker.corners().size(), 4U);
    }
    CornerPicker closed = picker_with(4);
    closed.close();
    EXPECT_EQ(closed.state(), State::kCancelled);
}

TEST(CornerPicker, ALargeImageIsShownSmaller) {
    CornerPicker picker({2560, 1440}, {1280, 800});
    EXPECT_EQ(picker.scale(), 0.5);
    EXPECT_EQ(picker.window_size(), Eigen::Vector2i(1280, 720));
    picker.click({0, 0});
    picker.click({1279, 719});
    // The middle of two pixels each way.
    EXPECT_EQ(picker.corners()[0], Eigen::Vector2d(0.5, 0.5));
    EXPECT_EQ(picker.corners()[1], Eigen::Vector2d(2558.5, 1438.5));
}

TEST(CornerPicker, ASmallImageIsEnlargedByThreeAtMost) {
    CornerPicker picker({100, 80}, {1280, 800});
    EXPECT_EQ(picker.scale(), 3.0);
    picker.click({4, 7});
    EXPECT_EQ(picker.corners()[0], Eigen::Vector2d(1, 2));
    picker.move({5, 7});
    EXPECT_NEAR(picker.mouse().x(), 4.0 / 3.0, 1e-12);
    const Eigen::Vector2d back = picker.to_window(picker.mouse());
    EXPECT_NEAR(back.x(), 5.0, 1e-12);
    EXPECT_NEAR(back.y(), 7.0, 1e-12);
}

TEST(CornerPicker, SaysWhatToDo) {
    EXPECT_THAT(picker_with(0).prompt(), HasSubstr("corner 1 of 4"));
    EXPECT_THAT(picker_with(3).prompt(), HasSubstr("corner 4 of 4"));
    EXPECT_THAT(picker_with(4).prompt(), HasSubstr("Enter"));
}

/// A window program of a few lines of shell.
std::filesystem::path script(const TempFolder& folder, const std::string& lines) {
    const std::filesystem::path file = folder.write("window", "#!/bin/sh\n" + lines);
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
    return file;
}

Image small_image() {
    Image image;
    image.width = 3;
    image.height = 2;
    image.pixels = {'a', 'b', 'c', 'd', 'e', 'f'};
    return image;
}

TEST(PickCornersBy, GivesTheImageAndTakesTheCorners) {
    const TempFolder folder;
    const std::filesystem::path got = folder / "got";
    const auto corners = pick_corners_by(
        script(folder, "cat > '" + got.string() + "'\nprintf '1 2\\n3.5 4\\n5 6\\n7 8e1\\n'\n"),
        small_image());
    EXPECT_EQ(bytes_of(got), "3 2 1\nabcdef");
    ASSERT_EQ(corners.size(), 4U);
    EXPECT_EQ(corners[1], Pixel(3.5, 4));
    EXPECT_EQ(corners[3], Pixel(7, 80));
}

TEST(PickCornersBy, TellsWhyThereAreNone) {
    const TempFolder folder;
    const auto refusal = [&](const std::string& lines) {
        return error_of([&] { pick_corners_by(script(folder, lines), small_image()); });
    };
    const std::string instead = "): give them as --corners u,v u,v u,v u,v";
    EXPECT_EQ(refusal("exit 3"), "no corners: the window was closed");
    EXPECT_EQ(refusal("echo trouble >&2; exit 1"),
              "no window to click corners in (it could not be opened" + instead);
    EXPECT_EQ(refusal("kill -ABRT $$"),
              "no window to click corners in (it could not be opened" + instead);
    EXPECT_EQ(refusal("echo 1 2 3"),
              "no window to click corners in (it answered with something else than four corners" +
                  instead);
    const std::filesystem::path nowhere = folder / "nowhere";
    EXPECT_EQ(
        error_of([&] { pick_corners_by(nowhere, small_image()); }),
        "no window to click corners in (" + nowhere.string() + " cannot be started" + instead);
}

}  // namespace
}  // namespace hybrid_slam::tools
