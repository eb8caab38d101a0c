// SPDX-License-Identifier: Apache-2.0
// open_capture on a network camera, with fake ones at the other end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "mjpeg_support.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::FakeCamera;
using test::kLongWait;
using test::kStreamHead;
using test::number_of;
using test::numbered_image;
using test::numbers_to_the_end;
using test::open_url;
using test::part;
using test::RawSocket;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// Until the reader goes.
void wait_for_end(RawSocket& customer) {
    customer.is_closed();
}

TEST(MjpegCapture, GivesImagesAndWaitsForThem) {
    FakeCamera camera([](RawSocket& customer) {
        customer.send(kStreamHead + part(numbered_image(1)));
        wait_for_end(customer);
    });
    {
        const auto capture = open_url(camera.url());
        EncodedImage image;
        ASSERT_TRUE(capture->read(image, kLongWait));
        EXPECT_EQ(image, numbered_image(1));
        EXPECT_FALSE(capture->read(image, 0.01)) << "quiet, but there";
        EXPECT_FALSE(capture->read(image, 0.0));
        EXPECT_FALSE(capture->ended());
    }
    camera.join();
    EXPECT_THAT(camera.request(), StartsWith("GET /cam HTTP/1.1\r\n"));
    EXPECT_THAT(camera.request(), HasSubstr("Host: " + camera.address()));
    EXPECT_THAT(camera.request(), Not(HasSubstr("Authorization")));
}

TEST(MjpegCapture, ShowsItsPassword) {
    FakeCamera camera([](RawSocket& customer) { customer.send(kStreamHead); });
    open_url("http://Aladdin:open%20sesame@" + camera.address() + "/x?y=1");
    camera.join();
    EXPECT_THAT(camera.request(), StartsWith("GET /x?y=1 HTTP/1.1\r\n"));
    EXPECT_THAT(camera.request(), HasSubstr("Authorization: Basic QWxhZGRpbjpvcGVuIHNlc2FtZQ=="));
}

TEST(MjpegCapture, AClosedConnectionIsAnErrorAfterTheLastImage) {
    FakeCamera camera([](RawSocket& customer) {
        const std::string half = part(numbered_image(8)).substr(0, 99);
        customer.send(kStreamHead + part(numbered_image(7)) + half);
    });
    const auto capture = open_url(camera.url());
    camera.join();
    EncodedImage image;
    ASSERT_TRUE(capture->read(image, kLongWait));
    EXPECT_EQ(image, numbered_image(7)) << "half an image is none";
    const std::string closed = camera.url() + ": closed by the other end";
    EXPECT_EQ(error_of([&] { capture->read(image, kLongWait); }), closed);
    EXPECT_EQ(error_of([&] { capture->read(image, kLongWait); }), closed) << "and stays so";
}

TEST(MjpegCapture, GarbageIsAnErrorAfterTheLastImage) {
    FakeCamera camera([](RawSocket& customer) {
        customer.send(kStreamHead + part(numbered_image(7)));
        const std::string noise(1 << 20, 'n');
        for (int i = 0; i < 40 && customer.send(noise); ++i) {
        }
        wait_for_end(customer);
    });
    const auto capture = open_url(camera.url());
    EncodedImage image;
    ASSERT_TRUE(capture->read(image, kLongWait));
    EXPECT_EQ(error_of([&] { capture->read(image, kLongWait); }),
              camera.url() + ": sends no boundary between images");
}

TEST(MjpegCapture, WhatIsNoCameraIsToldAtOnce) {
    const struct {
        std::string answer;
        const char* words;
    } answers[] = {
        {"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", "answers: 404 Not Found"},
        {"HTTP/1.1 401 No\r\nWWW-Authenticate: Basic realm=x\r\n\r\n", "user and password"},
        {"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<html>", "gives text/html"},
        {"220 mail ready\r\n\r\n", "does not speak HTTP"},
        {"", "closed by the other end"},
    };
    for (const auto& each : answers) {
        FakeCamera camera([&each](RawSocket& customer) { customer.send(each.answer); });
        EXPECT_THAT(error_of([&] { open_url(camera.url()); }),
                    AllOf(StartsWith(camera.url() + ": "), HasSubstr(each.words)));
    }
}

TEST(MjpegCapture, NobodyThereIsToldAtOnce) {
    const std::uint16_t port = RawSocket::listen().port();  // closed again
    const std::string url = "http://me:geheim@127.0.0.1:" + std::to_string(port) + "/";
    EXPECT_THAT(
        error_of([&] { open_url(url); }),
        AllOf(StartsWith("http://127.0.0.1:"), HasSubstr("refused"), Not(HasSubstr("geheim"))));
    EXPECT_THAT(error_of([] { open_url("https://cam/x"); }), HasSubstr("https is not spoken"));
    EXPECT_THAT(error_of([] { open_url("http://:80/"); }), HasSubstr("not of the form"));
}

/// While the reader is busy with something else, the images before the newest go.
TEST(MjpegCapture, ASlowReaderGetsTheNewest) {
    constexpr std::uint32_t kImages = 50;
    constexpr int kAttempts = 10;  // the machine may be slow too, and not have it all by then
    FakeCamera camera(
        [](RawSocket& customer) {
            std::string bytes = kStreamHead;
            for (std::uint32_t i = 0; i < kImages; ++i) {
                bytes += part(numbered_image(i, 20000));
            }
            customer.send(bytes);
            wait_for_end(customer);
        },
        kAttempts);
    bool newest = false;
    for (int attempt = 1; attempt <= kAttempts; ++attempt) {
        const auto capture = open_url(camera.url());
        if (newest) {
            continue;  // the camera waits for so many
        }
        test::sleep_ms(20 * attempt);
        EncodedImage image;
        ASSERT_TRUE(capture->read(image, kLongWait));
        newest = number_of(image) == kImages - 1;
        std::uint32_t last = number_of(image);
        while (last < kImages - 1) {
            ASSERT_TRUE(capture->read(image, kLongWait));
            ASSERT_GT(number_of(image), last) << "never an older one";
            last = number_of(image);
        }
    }
    EXPECT_TRUE(newest);
}

TEST(MjpegCapture, LeavesNoneOutWhereTheServerSaysSo) {
    constexpr std::uint32_t kImages = 300;
    FakeCamera camera([](RawSocket& customer) {
        std::string bytes = kStreamHead;
        bytes.insert(bytes.find("\r\n") + 2, "X-Every-Image: yes\r\n");
        for (std::uint32_t i = 0; i < kImages; ++i) {
            bytes += part(numbered_image(i, 20000));
        }
        customer.send(bytes);
    });
    const auto capture = open_url(camera.url());
    test::sleep_ms(20);  // so that more wait than are kept in memory
    const auto numbers = numbers_to_the_end(*capture);
    std::vector<std::uint32_t> all(kImages);
    std::iota(all.begin(), all.end(), 0U);
    EXPECT_EQ(numbers, all);
}

TEST(MjpegCapture, LetsGoWhileImagesWait) {
    FakeCamera camera([](RawSocket& customer) {
        std::string bytes = kStreamHead;
        bytes.insert(bytes.find("\r\n") + 2, "X-Every-Image: yes\r\n");
        for (std::uint32_t i = 0; i < 100; ++i) {
            bytes += part(numbered_image(i));
        }
        customer.send(bytes);
        wait_for_end(customer);
    });
    const auto capture = open_url(camera.url());
    EncodedImage image;
    ASSERT_TRUE(capture->read(image, kLongWait));
    EXPECT_EQ(number_of(image), 0u);
}

TEST(MjpegCapture, DripsAndChunks) {
    FakeCamera camera([](RawSocket& customer) {
        customer.send("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n");
        test::sleep_ms(5);
        customer.send("Content-Type: multipart/x-mixed-replace;boundary=frame\r\n\r");
        test::sleep_ms(5);
        customer.send("\n");
        const std::string image = part(numbered_image(3));
        customer.send("9\r\n--frame\r\n\r\n");
        for (const char byte : image) {
            customer.send("1\r\n" + std::string(1, byte) + "\r\n");
        }
        customer.send("0\r\n\r\n");
        wait_for_end(customer);
    });
    const auto capture = open_url(camera.url());
    EncodedImage image;
    ASSERT_TRUE(capture->read(image, kLongWait));
    EXPECT_EQ(image, numbered_image(3));
    EXPECT_THAT(error_of([&] { capture->read(image, kLongWait); }), HasSubstr("ended the stream"));
}

}  // namespace
}  // namespace hybrid_slam
