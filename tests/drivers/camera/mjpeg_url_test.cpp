// SPDX-License-Identifier: Apache-2.0
#include "mjpeg_url.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(MjpegUrl, Parts) {
    const struct {
        const char* text;
        const char* host;
        int port;
        const char* path;
    } urls[] = {
        {"http://cam", "cam", 80, "/"},
        {"http://cam/", "cam", 80, "/"},
        {"http://10.0.0.7:8080/stream", "10.0.0.7", 8080, "/stream"},
        {"http://cam:81?action=stream", "cam", 81, "/?action=stream"},
        {"http://cam/a/b?c=http://d@e:7#top", "cam", 80, "/a/b?c=http://d@e:7"},
        {"http://[::1]:8080/x", "::1", 8080, "/x"},
        {"http://[fe80::1]", "fe80::1", 80, "/"},
    };
    for (const auto& each : urls) {
        const MjpegUrl url = parse_mjpeg_url(each.text);
        EXPECT_EQ(url.host, each.host);
        EXPECT_EQ(url.port, each.port);
        EXPECT_EQ(url.path, each.path);
        EXPECT_EQ(url.authorization, "");
    }
}

TEST(MjpegUrl, TellsThePasswordToTheCameraOnly) {
    const struct {
        const char* secret;
        const char* code;
    } secrets[] = {
        {"Aladdin:open%20sesame", "QWxhZGRpbjpvcGVuIHNlc2FtZQ=="},  // RFC 7617
        {"test:123%C2%A3", "dGVzdDoxMjPCow=="},                     // RFC 7617
        {"foobar", "Zm9vYmFy"},                                     // RFC 4648
        {"fooba", "Zm9vYmE="},
        {"a:b@c", "YTpiQGM="},
        {"a%4", "YSU0"},
    };
    for (const auto& each : secrets) {
        const MjpegUrl url = parse_mjpeg_url("http://" + std::string(each.secret) + "@cam:81/x");
        EXPECT_EQ(url.authorization, each.code);
        EXPECT_EQ(url.host, "cam");
        EXPECT_EQ(url.name, "http://cam:81/x");
        EXPECT_THAT(url.request(),
                    HasSubstr("\r\nAuthorization: Basic " + std::string(each.code) + "\r\n"));
    }
}

TEST(MjpegUrl, Request) {
    EXPECT_EQ(parse_mjpeg_url("http://[::1]:8080/x?y").request(),
              "GET /x?y HTTP/1.1\r\nHost: [::1]:8080\r\nUser-Agent: hybrid-slam\r\n"
              "Accept: multipart/x-mixed-replace\r\nConnection: close\r\n\r\n");
}

TEST(MjpegUrl, RefusesTheRest) {
    for (const char* text : {"http://", "http:///x", "http://:80/", "http://cam:/x",
                             "http://cam:0/", "http://cam:65536", "http://cam:8o", "http://[::1/x",
                             "http://[::1]80", "http://[]:80/", "http://a:b@"}) {
        EXPECT_THAT(error_of([&] { parse_mjpeg_url(text); }), HasSubstr("http://[user:password@]"))
            << text;
    }
    for (const char* text :
         {"http://cam/a\r\nX: y", "http://ca\r\nm/", "http://cam/a b", "http://c\xC3\xA4m/"}) {
        EXPECT_THAT(error_of([&] { parse_mjpeg_url(text); }),
                    AllOf(HasSubstr("blanks"), Not(HasSubstr("\n"))));
    }
    EXPECT_THAT(error_of([] { parse_mjpeg_url("https://me:geheim@cam/x"); }),
                AllOf(HasSubstr("https://cam/x"), HasSubstr("https is not spoken"),
                      Not(HasSubstr("geheim"))));
    EXPECT_THAT(error_of([] { parse_mjpeg_url("http://me:geheim@cam:x/x"); }),
                Not(HasSubstr("geheim")));
}

}  // namespace
}  // namespace hybrid_slam
