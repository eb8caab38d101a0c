// SPDX-License-Identifier: Apache-2.0
// What network cameras send, in all the ways in which they do, and damaged.
#include "mjpeg_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "http_head.hpp"
#include "mjpeg_support.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::kStreamHead;
using test::number_of;
using test::numbered_image;
using test::part;
using test::text_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<EncodedImage> images_of(MjpegStream& stream) {
    std::vector<EncodedImage> images;
    while (auto image = stream.next()) {
        images.push_back(std::move(*image));
    }
    return images;
}

std::vector<EncodedImage> read(const std::string& bytes, std::size_t piece) {
    MjpegStream stream;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
        stream.push(std::string_view(bytes).substr(at, piece));
    }
    return images_of(stream);
}

std::vector<std::uint32_t> numbers(const std::vector<EncodedImage>& images) {
    std::vector<std::uint32_t> result;
    for (const EncodedImage& image : images) {
        result.push_back(number_of(image));
    }
    return result;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    for (std::size_t at = text.find(what); at != std::string::npos;
         at = text.find(what, at + by.size())) {
        text.replace(at, what.size(), by);
    }
    return text;
}

std::string chunked(const std::string& body, std::size_t size) {
    std::string bytes;
    for (std::size_t at = 0; at < body.size(); at += size) {
        const std::string chunk = body.substr(at, size);
        char head[32];
        std::snprintf(head, sizeof head, at % 2 == 0 ? "%zX\r\n" : "%zx;note=1\r\n", chunk.size());
        bytes += head + chunk + "\r\n";
    }
    return bytes;
}

/// One camera's way to send images.
struct Dialect {
    const char* name;
    const char* head;
    const char* before;     ///< each image; %zu is its size
    const char* after;      ///< each image
    std::size_t chunk = 0;  ///< bytes; 0: not chunked
};

std::string spoken(const Dialect& dialect, const std::vector<EncodedImage>& images) {
    std::string body;
    for (const EncodedImage& image : images) {
        char before[256];
        std::snprintf(before, sizeof before, dialect.before, image.size());
        body += before + text_of(image) + dialect.after;
    }
    return dialect.head + (dialect.chunk > 0 ? chunked(body, dialect.chunk) : body);
}

const Dialect kDialects[] = {
    {"boundary ahead, lengths",
     "HTTP/1.0 200 OK\r\nServer: a\r\nContent-Type: multipart/x-mixed-replace;boundary=cam\r\n\r\n",
     "--cam\r\nContent-Type: image/jpeg\r\nContent-Length: %zu\r\nX-Timestamp: 1.5\r\n\r\n",
     "\r\n"},
    {"boundary behind, dashes announced",
     "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=--cam\r\n\r\n--cam\r\n",
     "Content-type: image/jpg\r\nContent-length:%zu\r\n\r\n", "\r\n--cam\r\n"},
    {"no lengths",
     "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=\"cam\"; x=1\r\n\r\n"
     "--cam\r\n",
     "Content-Type: image/jpeg\r\n\r\n", "\r\n--cam\r\n"},
    {"no lengths, no heads, dashes announced and doubled",
     "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=--cam\r\n\r\n----cam\r\n",
     "\r\n", "\r\n----cam\r\n"},
    {"line feeds alone",
     "HTTP/1.1 200 OK\ncontent-type: Multipart/X-Mixed-Replace;Boundary=cam\n\n--cam\n",
     "Content-Type: image/jpeg\nContent-Length: %zu\n\n", "\n--cam\n"},
    {"no line break behind an image with its length",
     "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=cam\r\n\r\n",
     "--cam  \r\nContent-Length: %zu\r\n\r\n", ""},
    {"words before the first boundary",
     "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=cam\r\n\r\nhello --cam "
     "you\r\n--camera\r\n\r\nwhat\r\n--cam\r\n",
     "Content-Length: %zu\r\n\r\n", "\r\n--cam\r\n"},
    {"small chunks",
     "HTTP/1.1 200 OK\r\nTransfer-Encoding: Chunked\r\n"
     "Content-Type: multipart/x-mixed-replace;boundary=cam\r\n\r\n",
     "--cam\r\nContent-Length: %zu\r\n\r\n", "\r\n", 7},
    {"large chunks, no lengths",
     "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n"
     "Content-Type: multipart/x-mixed-replace;boundary=cam\r\n\r\n",
     "--cam\r\n\r\n", "\r\n--cam\r\n\r\n--cam\r\n", 1001},
};

TEST(MjpegStream, UnderstandsTheWaysOfCameras) {
    std::vector<EncodedImage> images;
    for (std::uint32_t i = 0; i < 5; ++i) {
        images.push_back(numbered_image(i, 10 + 211 * i));
    }
    for (const Dialect& dialect : kDialects) {
        const std::string bytes = spoken(dialect, images);
        for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, bytes.size()}) {
            EXPECT_EQ(read(bytes, piece), images) << dialect.name << ", in pieces of " << piece;
        }
    }
}

TEST(MjpegStream, AnImageIsThereWithItsLastByte) {
    MjpegStream stream;
    stream.push(kStreamHead);
    EXPECT_TRUE(stream.begun());
    const EncodedImage image = numbered_image(1);
    const std::string bytes = part(image);
    const std::size_t end = bytes.size() - std::string("\r\n--frame\r\n").size();
    stream.push(bytes.substr(0, end - 1));
    EXPECT_FALSE(stream.next());
    stream.push(bytes.substr(end - 1, 1));
    EXPECT_EQ(stream.next(), image) << "without waiting for the boundary";
}

TEST(MjpegStream, WithoutALengthTheBoundaryBehindIsEnough) {
    MjpegStream stream;
    stream.push(kStreamHead);
    const EncodedImage image = numbered_image(1);
    stream.push("\r\n" + text_of(image) + "\r\n--frame\r");
    EXPECT_FALSE(stream.next());
    stream.push("\n");
    EXPECT_EQ(stream.next(), image);
}

TEST(MjpegStream, WhatIsNoImageIsSkipped) {
    MjpegStream stream;
    stream.push(kStreamHead);
    stream.push("Content-Type: text/xml\r\nContent-Length: 6\r\n\r\n<a>1</\r\n--frame\r\n");
    stream.push("Content-Length: 0\r\n\r\n\r\n--frame\r\n");
    stream.push(part({'G', 'I', 'F', '8', '9', 'a'}));
    stream.push(std::string("Content-Type: application/x\r\n\r\n") + text_of(numbered_image(1)) +
                "\r\n--frame\r\n");
    stream.push(part(numbered_image(2)));
    EXPECT_THAT(numbers(images_of(stream)), ElementsAre(2));
    EXPECT_EQ(stream.skipped(), 4u);
}

TEST(MjpegStream, ABoundaryWithinALineIsAnImagesOwn) {
    EncodedImage image = numbered_image(3, 40);
    const std::string text = "--frame\r\n \n--framed\r\n\n-frame\n";
    image.insert(image.begin() + 20, text.begin(), text.end());
    const std::string bytes =
        kStreamHead + ("\r\n" + text_of(image)) + "\r\n--frame\r\n" + part(numbered_image(4));
    for (const std::size_t piece : {std::size_t{1}, std::size_t{13}, bytes.size()}) {
        const auto images = read(bytes, piece);
        ASSERT_EQ(images.size(), 2u);
        EXPECT_EQ(images.front(), image);
    }
}

TEST(MjpegStream, HalfAnImageCostsOnlyItself) {
    const std::string whole = part(numbered_image(2));
    MjpegStream stream;
    stream.push(kStreamHead + part(numbered_image(1)));
    stream.push(whole.substr(0, 150) + "\r\n--frame\r\n");
    stream.push(part(numbered_image(3)));
    EXPECT_THAT(numbers(images_of(stream)), ElementsAre(1, 3));
    EXPECT_EQ(stream.skipped(), 1u);
}

TEST(MjpegStream, ALengthWithoutSenseIsNone) {
    for (const char* length : {"many", "-1", "99999999999999999999999", "", "0x20"}) {
        const EncodedImage image = numbered_image(5);
        const auto images = read(kStreamHead + ("Content-Length: " + std::string(length)) +
                                     "\r\n\r\n" + text_of(image) + "\r\n--frame\r\n",
                                 64);
        EXPECT_THAT(images, ElementsAre(image)) << length;
    }
}

TEST(MjpegStream, SaysWhetherEveryImageCounts) {
    for (const bool every : {false, true}) {
        MjpegStream stream;
        stream.push(replaced(kStreamHead, "\r\n\r\n",
                             every ? "\r\nx-every-image: Yes\r\n\r\n" : "\r\n\r\n"));
        EXPECT_EQ(stream.every_image(), every);
    }
}

TEST(MjpegStream, RefusesOtherAnswersInWords) {
    const struct {
        std::string answer;
        const char* words;
    } answers[] = {
        {"HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: Basic realm=\"cam\"\r\n\r\n",
         "wants a user and password"},
        {"HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: Digest realm=\"cam\"\r\n\r\n", "digest"},
        {"HTTP/1.1 404 Not Found\r\n\r\n", "answers: 404 Not Found"},
        {"HTTP/1.1 302 Found\r\nLocation: https://cam/x\r\n\r\n", "elsewhere: https://cam/x"},
        {"HTTP/1.1\r\n\r\n", "answers: "},
        {"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\n", "gives image/jpeg, not a stream"},
        {"HTTP/1.1 200 OK\r\n\r\n", "gives something unnamed"},
        {"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace\r\n\r\n", "no boundary"},
        {"HTTP/1.1 200 OK\r\nContent-Type: multipart/mixed;boundary=---\r\n\r\n", "no boundary"},
        {replaced(kStreamHead, "HTTP/1.1 200 OK", "HTTP/1.1 200 OK\r\nTransfer-Encoding: gzip"),
         "coding gzip"},
        {"SSH-2.0-OpenSSH_9.2\r\n\r\n", "does not speak HTTP"},
        {std::string(20000, 'x'), "does not speak HTTP"},
        {"HTTP/1.1 200 OK\r\n" + std::string(20000, 'x'), "header of its answer does not end"},
    };
    for (const auto& each : answers) {
        EXPECT_THAT(error_of([&] { read(each.answer, 100); }), HasSubstr(each.words));
    }
}

TEST(MjpegStream, ALengthMayCountTheLineBreak) {
    const EncodedImage image = numbered_image(5);
    const std::string bytes =
        replaced(part(image), std::to_string(image.size()), std::to_string(image.size() + 2));
    for (const std::size_t piece : {std::size_t{1}, bytes.size()}) {
        const auto images = read(kStreamHead + bytes + bytes, piece);
        EXPECT_THAT(numbers(images), ElementsAre(5, 5));
    }
}

TEST(MjpegStream, WhatCameBeforeABadChunkIsGood) {
    MjpegStream stream;
    const std::string head =
        replaced(kStreamHead, "\r\n\r\n--frame\r\n", "\r\nTransfer-Encoding: chunked\r\n\r\n");
    const std::string body = "--frame\r\n" + part(numbered_image(6));
    EXPECT_THAT(error_of([&] { stream.push(head + chunked(body, 100) + "no size\r\n"); }),
                HasSubstr("without a size"));
    EXPECT_THAT(numbers(images_of(stream)), ElementsAre(6));
}

TEST(MjpegStream, EndsInWords) {
    const std::string start = kStreamHead + part(numbered_image(1));
    EXPECT_EQ(error_of([&] { read(start + "\r\n--frame--", 50); }), "ended the stream");
    const std::string head =
        replaced(kStreamHead, "\r\n\r\n--frame\r\n", "\r\nTransfer-Encoding: chunked\r\n\r\n");
    EXPECT_EQ(error_of([&] { read(head + "0\r\n\r\n", 50); }), "ended the stream");
    EXPECT_THAT(error_of([&] { read(head + "4\r\n--fr!\r\n", 50); }), HasSubstr("longer than"));
    EXPECT_THAT(error_of([&] { read(head + "fast\r\n", 50); }), HasSubstr("without a size"));
    EXPECT_THAT(error_of([&] { read(head + "fffffffff\r\n", 50); }), HasSubstr("without a size"));
    EXPECT_THAT(error_of([&] { read(head + std::string(999, '1'), 50); }),
                HasSubstr("without a size"));
}

TEST(MjpegStream, DoesNotGrowWithoutEnd) {
    const std::string noise(1 << 20, 'n');
    MjpegStream stream;
    stream.push(kStreamHead);
    const std::string error = error_of([&] {
        for (int i = 0; i < 32; ++i) {
            stream.push(noise);
        }
    });
    EXPECT_THAT(error, HasSubstr("no boundary"));
}

/// Some bytes changed, lost or put in.
std::string damaged(std::string bytes, int places, std::mt19937& random) {
    const auto below = [&random](std::size_t count) {
        return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
    };
    for (int i = 0; i < places; ++i) {
        const std::size_t at = below(bytes.size());
        switch (below(3)) {
            case 0:
                bytes[at] = static_cast<char>(below(256));
                break;
            case 1:
                bytes.erase(at, 1 + below(20));
                break;
            default:
                bytes.insert(at, std::string(1 + below(20), static_cast<char>(below(256))));
        }
    }
    return bytes;
}

TEST(MjpegStream, DamageCostsTheImagesThatItHits) {
    constexpr int kImages = 40;
    constexpr int kPlaces = 4;
    std::string sound;
    std::vector<EncodedImage> sent;
    for (std::uint32_t i = 0; i < kImages; ++i) {
        sent.push_back(numbered_image(i, 80));
        sound += part(sent.back());
    }
    std::mt19937 random(11);
    int hurt = 0;
    for (int round = 0; round < 2000; ++round) {
        const auto images = read(kStreamHead + damaged(sound, kPlaces, random), 97);
        int whole = 0;
        auto from = sent.begin();
        for (const EncodedImage& image : images) {
            const auto found = std::find(from, sent.end(), image);
            if (found != sent.end()) {
                from = found + 1;
                ++whole;
            }
        }
        // A boundary that was hit hides the image behind it too.
        ASSERT_GE(whole, kImages - 2 * kPlaces) << "round " << round;
        hurt += kImages - whole;
    }
    EXPECT_GT(hurt, 2000);
}

TEST(HttpHead, FieldsAndCounts) {
    const HttpHead head("HTTP/1.1 200 OK\r\nA: 1\r\nb :  two words \r\nA: 3\r\nno field\r\n\r\n");
    EXPECT_EQ(head.first, "HTTP/1.1 200 OK");
    EXPECT_EQ(head["a"], "3");
    EXPECT_EQ(head["b"], "two words");
    EXPECT_EQ(head["c"], "");
    EXPECT_EQ(trimmed(" \t "), "");
    EXPECT_EQ(parse_count("1f", 16, 31), 31u);
    EXPECT_EQ(parse_count("1F", 16, 30), std::nullopt);
    EXPECT_EQ(parse_count("1f", 10, 99), std::nullopt);
    EXPECT_EQ(parse_count("", 10, 99), std::nullopt);
}

}  // namespace
}  // namespace hybrid_slam
