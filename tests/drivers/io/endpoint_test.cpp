// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/io/endpoint.hpp"

#include <gmock/gmock.h>

#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using ::testing::HasSubstr;

TEST(Endpoint, IsReadInEachForm) {
    struct Case {
        const char* text;
        const char* host;
        int port;
        const char* again;
    };
    const Case cases[] = {
        {"tcp://truck:5000", "truck", 5000, "truck:5000"},
        {"truck:5000", "truck", 5000, "truck:5000"},
        {":5000", "127.0.0.1", 5000, "127.0.0.1:5000"},
        {"tcp://:0", "127.0.0.1", 0, "127.0.0.1:0"},
        {"0.0.0.0:65535", "0.0.0.0", 65535, "0.0.0.0:65535"},
        {"[::1]:5000", "::1", 5000, "[::1]:5000"},
    };
    for (const Case& each : cases) {
        const Endpoint endpoint = parse_endpoint(each.text);
        EXPECT_EQ(endpoint.host, each.host) << each.text;
        EXPECT_EQ(endpoint.port, each.port) << each.text;
        EXPECT_EQ(endpoint.text(), each.again) << each.text;
    }
}

TEST(Endpoint, TellsWhatIsWrong) {
    const std::pair<const char*, const char*> cases[] = {
        {"truck", "no port"},
        {"", "no port"},
        {"[::1]", "no port"},
        {"truck:", "the port must be a number"},
        {"truck:65536", "the port must be a number"},
        {"truck:-1", "the port must be a number"},
        {"truck:50x", "the port must be a number"},
        {"udp://truck:5000", "only tcp://"},
        {"::1:5000", "in brackets"},
        {"tcp://truck/path:5000", "not a host"},
        {"two words:5000", "not a host"},
        {"[]:5000", "not a host"},
    };
    for (const auto& [text, reason] : cases) {
        const std::string error = error_of([text = text] { parse_endpoint(text); });
        EXPECT_THAT(error, HasSubstr(reason));
        EXPECT_EQ(error.rfind(text, 0), 0u) << "does not name it: " << error;
    }
}

}  // namespace
}  // namespace hybrid_slam
