// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/capture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <opencv2/videoio.hpp>
#include <string>

#include "images.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

CameraConfig camera(const std::filesystem::path& device, double rate = 1000.0) {
    CameraConfig config;
    config.device = device.string();
    config.rate = rate;
    return config;
}

std::string text_of(const EncodedImage& image) {
    return {image.begin(), image.end()};
}

/// Of a capture of files, to its end.
std::vector<EncodedImage> all_of(Capture& capture) {
    std::vector<EncodedImage> images;
    EncodedImage image;
    while (!capture.ended()) {
        if (capture.read(image, 0.1)) {
            images.push_back(image);
        }
    }
    return images;
}

TEST(ImageFolder, GivesFilesAsTheyAreInTheOrderOfTheirNames) {
    const TempFolder folder;
    folder.write("b_0002.PNG", "second");
    folder.write("b_0010.jpeg", "third");
    folder.write("a_9999.jpg", "first");
    folder.write("c.pgm", std::string("\0fourth", 7));
    folder.write("notes.txt", "no image");
    std::filesystem::create_directory(folder / "d.jpg");
    const auto capture = open_capture(camera(folder.path()));
    const auto images = all_of(*capture);
    ASSERT_EQ(images.size(), 4u);
    EXPECT_EQ(text_of(images[0]), "first");
    EXPECT_EQ(text_of(images[1]), "second");
    EXPECT_EQ(text_of(images[2]), "third");
    EXPECT_EQ(text_of(images[3]), std::string("\0fourth", 7));
    EncodedImage image;
    EXPECT_FALSE(capture->read(image, 0.1));
}

TEST(ImageFolder, KeepsThePace) {
    const TempFolder folder;
    for (const char* name : {"1.jpg", "2.jpg", "3.jpg"}) {
        folder.write(name, name);
    }
    const auto capture = open_capture(camera(folder.path(), 10.0));
    EncodedImage image;
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_TRUE(capture->read(image, 0.0)) << "the first one is there at once";
    EXPECT_FALSE(capture->read(image, 0.001)) << "the second one is 0.1 s away";
    EXPECT_FALSE(capture->ended());
    EXPECT_EQ(all_of(*capture).size(), 2u);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    EXPECT_GE(took.count(), 0.199);
}

TEST(ImageFolder, SaysWhatIsWrong) {
    const TempFolder folder;
    folder.write("notes.txt", "");
    EXPECT_THAT(error_of([&] { open_capture(camera(folder.path())); }),
                AllOf(HasSubstr(folder.path().string()), HasSubstr("holds no image")));
}

TEST(ImageFolder, AFileThatVanishesIsAnError) {
    const TempFolder folder;
    const auto file = folder.write("1.jpg", "x");
    const auto capture = open_capture(camera(folder.path()));
    std::filesystem::remove(file);
    EncodedImage image;
    EXPECT_THAT(error_of([&] { capture->read(image, 1.0); }), HasSubstr(file.string()));
}

TEST(VideoFile, GivesItsFramesInOrderAsPnm) {
    const TempFolder folder;
    const auto file = folder / "clip.avi";
    constexpr int kFrames = 8;
    {
        cv::VideoWriter writer(file.string(), cv::CAP_OPENCV_MJPEG,
                               cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30.0, {64, 48});
        if (!writer.isOpened()) {
            GTEST_SKIP() << "this OpenCV cannot write a video";
        }
        for (int i = 0; i < kFrames; ++i) {
            writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar(20 + 25 * i, 100, 200 - 20 * i)));
        }
    }
    const auto capture = open_capture(camera(file));
    const auto images = all_of(*capture);
    ASSERT_EQ(images.size(), static_cast<std::size_t>(kFrames));
    for (int i = 0; i < kFrames; ++i) {
        const auto image = decode_image(images[static_cast<std::size_t>(i)], ImageColor::kBgr);
        ASSERT_TRUE(image);
        EXPECT_EQ(image->width, 64);
        EXPECT_EQ(image->height, 48);
        const std::size_t middle = 3u * (24u * 64u + 32u);
        EXPECT_NEAR(image->pixels[middle], 20 + 25 * i, 6) << i;
        EXPECT_NEAR(image->pixels[middle + 1], 100, 6) << i;
        EXPECT_NEAR(image->pixels[middle + 2], 200 - 20 * i, 6) << i;
    }
}

TEST(VideoFile, BrokenOnesAreErrorsAndNothingIsPrinted) {
    const TempFolder folder;
    // The beginning of an MP4, about which FFmpeg has much to say.
    const std::string begun(
        "\0\0\0\x20"
        "ftypisom\0\0\2\0isomiso2avc1mp41\0\0\0\x8"
        "free",
        40);
    for (const std::string& bytes : {std::string(), std::string("no video"), begun}) {
        const auto file = folder.write("clip.mp4", bytes);
        ::testing::internal::CaptureStderr();
        const std::string error = error_of([&] { open_capture(camera(file)); });
        EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
        EXPECT_THAT(error, AllOf(HasSubstr(file.string()), HasSubstr("video")));
    }
}

TEST(VideoDevice, SaysWhatIsWrongInOneLineAndPrintsNothing) {
    const TempFolder folder;
    ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
    ::testing::internal::CaptureStderr();
    EXPECT_THAT(error_of([&] { open_capture(camera(folder / "video0")); }),
                AllOf(HasSubstr("video0: No such file"), HasSubstr("is it plugged in?")));
    EXPECT_THAT(error_of([&] { open_capture(camera("/dev/null")); }),
                HasSubstr("/dev/null: no camera"));
    EXPECT_THAT(error_of([&] { open_capture(camera(folder / "pipe")); }),
                HasSubstr("neither a camera nor a video"));
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(CameraConfig, ComesBackFromItsText) {
    CameraConfig config;
    ConfigSchema schema;
    describe(schema, config);
    for (const char* assignment :
         {"enabled=false", "device=/dev/v4l/by-id/front", "rate=15", "latency=0.05",
          "stall_after=2", "model.fx=500", "mounting.pitch_deg=30"}) {
        schema.override_with(assignment);
    }
    const TempFolder folder;
    const auto file = folder.write("camera.yaml", schema.to_yaml());
    CameraConfig back;
    ConfigSchema back_schema;
    describe(back_schema, back);
    back_schema.load(file);
    EXPECT_FALSE(back.enabled);
    EXPECT_EQ(back.device, "/dev/v4l/by-id/front");
    EXPECT_EQ(back.rate, 15.0);
    EXPECT_EQ(back.latency, 0.05);
    EXPECT_EQ(back.stall_after, 2.0);
    EXPECT_EQ(back.model.fx, 500.0);
    EXPECT_NEAR(back.mounting.pitch, 0.5235987756, 1e-9);
    EXPECT_THAT(error_of([&] { back_schema.override_with("rate=0"); }), HasSubstr("rate"));
}

}  // namespace
}  // namespace hybrid_slam
