// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/mjpeg_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "images.hpp"
#include "mjpeg_support.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::comes_true;
using test::error_of;
using test::kLongWait;
using test::number_of;
using test::numbered_image;
using test::numbers_to_the_end;
using test::open_url;
using test::RawSocket;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::uint16_t port_of(const MjpegServer& server) {
    const std::string url = server.url();
    return static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
}

MjpegServerOptions lossless() {
    MjpegServerOptions options;
    options.lossless = true;
    return options;
}

bool readers_are(const MjpegServer& server, std::uint64_t count) {
    return comes_true([&] { return server.counts().readers == count; });
}

TEST(MjpegServer, ARealImageGoesRound) {
    MjpegServer server;
    EXPECT_THAT(server.url(), HasSubstr("http://127.0.0.1:"));
    EXPECT_FALSE(server.has_reader());
    const EncodedImage jpeg = encode_jpeg(test::ramp_image(64, 48, 3), 90);
    server.publish(numbered_image(1));  // nobody is there: for nobody
    const auto capture = open_url(server.url());
    EXPECT_TRUE(server.has_reader());
    EncodedImage image;
    EXPECT_FALSE(capture->read(image, 0.01)) << "what was before is old";
    server.publish(jpeg);
    ASSERT_TRUE(capture->read(image, kLongWait));
    EXPECT_EQ(image, jpeg);
    EXPECT_TRUE(decode_image(image, ImageColor::kBgr));
    const MjpegServerCounts counts = server.counts();
    EXPECT_EQ(counts.images, 2u);
    EXPECT_EQ(counts.readers, 1u);
    EXPECT_EQ(counts.dropped, 0u);
    EXPECT_TRUE(comes_true([&] { return server.counts().sent == 1; }));
}

TEST(MjpegServer, EachImageReachesAReaderThatWaitsForIt) {
    MjpegServer server;
    const auto one = open_url(server.url());
    const auto two = open_url(server.url());
    EncodedImage image;
    for (std::uint32_t i = 0; i < 200; ++i) {
        server.publish(numbered_image(i, 50 + 300 * i));
        for (Capture* each : {one.get(), two.get()}) {
            ASSERT_TRUE(each->read(image, kLongWait));
            ASSERT_EQ(image, numbered_image(i, 50 + 300 * i));
        }
    }
    EXPECT_EQ(server.counts().dropped, 0u);
}

TEST(MjpegServer, AReaderThatLeavesIsNotCountedOn) {
    MjpegServer server;
    for (int i = 0; i < 40; ++i) {  // more than fit at once
        const auto capture = open_url(server.url());
        ASSERT_TRUE(server.has_reader());
    }
    EXPECT_TRUE(comes_true([&] { return !server.has_reader(); }));
    EXPECT_EQ(server.counts().readers, 40u);
}

TEST(MjpegServer, ReadersTooManyAreTurnedAway) {
    MjpegServer server;
    std::vector<std::unique_ptr<Capture>> readers;
    for (int i = 0; i < 16; ++i) {
        readers.push_back(open_url(server.url()));
    }
    error_of([&] { open_url(server.url()); });
    EXPECT_EQ(server.counts().refused, 1u);
    readers.pop_back();
    EXPECT_TRUE(comes_true([&] {
        try {
            open_url(server.url());
            return true;
        } catch (const Error&) {
            return false;
        }
    }));
}

/// A reader that takes nothing costs neither memory nor time, and no other reader its images.
TEST(MjpegServer, AReaderThatHangsMissesImages) {
    constexpr std::uint32_t kImages = 300;
    MjpegServer server;
    RawSocket hanging = RawSocket::connect(port_of(server), 4096);
    hanging.send("GET /stream HTTP/1.1\r\n\r\n");
    ASSERT_TRUE(readers_are(server, 1));
    const auto capture = open_url(server.url());
    EncodedImage image;
    for (std::uint32_t i = 0; i < kImages; ++i) {
        server.publish(numbered_image(i, 20000));
        ASSERT_TRUE(capture->read(image, kLongWait));
        ASSERT_EQ(number_of(image), i);
    }
    const MjpegServerCounts counts = server.counts();
    EXPECT_GE(counts.dropped, kImages / 2) << "the system's buffers hold some";
    EXPECT_EQ(counts.images, kImages);
}

TEST(MjpegServer, LosslessQueuesForAll) {
    constexpr std::uint32_t kImages = 500;
    std::vector<std::uint32_t> all(kImages);
    std::iota(all.begin(), all.end(), 0U);
    std::unique_ptr<Capture> one;
    std::unique_ptr<Capture> two;
    auto server = std::make_unique<MjpegServer>(lossless());
    one = open_url(server->url());
    two = open_url(server->url());
    for (std::uint32_t i = 0; i < kImages; ++i) {
        server->publish(numbered_image(i, 30000));
    }
    for (Capture* each : {one.get(), two.get()}) {
        std::vector<std::uint32_t> numbers;
        EncodedImage image;
        while (numbers.size() < kImages && each->read(image, kLongWait)) {
            numbers.push_back(number_of(image));
        }
        EXPECT_EQ(numbers, all);
    }
    EXPECT_EQ(server->counts().dropped, 0u);
}

TEST(MjpegServer, ItsEndIsTheReadersEnd) {
    auto server = std::make_unique<MjpegServer>();
    const std::uint16_t port = port_of(*server);
    const auto capture = open_url(server->url());
    const std::string url = server->url();
    server.reset();
    EncodedImage image;
    EXPECT_THAT(error_of([&] { capture->read(image, kLongWait); }), HasSubstr(url));
    error_of([&] { open_url(url); });
    // The same port again, at once.
    MjpegServerOptions options;
    options.port = port;
    MjpegServer again(options);
    EXPECT_EQ(again.url(), url);
    const auto other = open_url(url);
    again.publish(numbered_image(5));
    ASSERT_TRUE(other->read(image, kLongWait));
    EXPECT_EQ(number_of(image), 5u);
}

TEST(MjpegServer, AnswersWhoAsksForSomethingElse) {
    MjpegServer server;
    const struct {
        const char* request;
        const char* answer;
    } requests[] = {
        {"GET /favicon.ico HTTP/1.1\r\nHost: x\r\n\r\n", "HTTP/1.1 404 Not Found\r"},
        {"POST /stream HTTP/1.1\r\n\r\n", "HTTP/1.1 405 Method Not Allowed\r"},
        {"\r\n\r\n", "HTTP/1.1 405 Method Not Allowed\r"},
        {"GET\r\n\r\n", "HTTP/1.1 405 Method Not Allowed\r"},
        {"GET / HTTP/1.0\r\n\r\n", "HTTP/1.1 200 OK\r"},
        {"GET /stream?x=1 HTTP/1.1\r\n\r\n", "HTTP/1.1 200 OK\r"},
        {"GET /stream\r\n\r\n", "HTTP/1.1 200 OK\r"},
    };
    for (const auto& each : requests) {
        RawSocket browser = RawSocket::connect(port_of(server));
        ASSERT_TRUE(browser.send(each.request));
        EXPECT_EQ(browser.line(), each.answer) << each.request;
    }
    EXPECT_EQ(server.counts().refused, 4u);
    EXPECT_EQ(server.counts().readers, 3u);
}

TEST(MjpegServer, AnEndlessRequestIsCut) {
    MjpegServer server;
    RawSocket chatty = RawSocket::connect(port_of(server));
    chatty.send("GET /stream HTTP/1.1\r\nX: " + std::string(9000, 'x'));
    EXPECT_TRUE(chatty.is_closed());
    EXPECT_FALSE(server.has_reader());
}

TEST(MjpegServer, ToldWhereItCannotListen) {
    const MjpegServer server;
    MjpegServerOptions options;
    options.port = port_of(server);
    EXPECT_THAT(error_of([&] { MjpegServer{options}; }), HasSubstr("cannot listen"));
    options.host.clear();
    EXPECT_THAT(error_of([&] { MjpegServer{options}; }), HasSubstr("no host"));
    MjpegServerOptions all;
    all.host = "0.0.0.0";
    EXPECT_THAT(MjpegServer(all).url(), HasSubstr("http://127.0.0.1:"));
}

}  // namespace
}  // namespace hybrid_slam
