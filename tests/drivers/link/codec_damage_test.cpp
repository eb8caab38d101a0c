// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "messages.hpp"

namespace hybrid_slam {
namespace {

using Random = std::mt19937;

std::size_t below(Random& random, std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

/// A few bytes changed, removed, repeated or put in.
std::string damaged(std::string line, Random& random) {
    const std::string spice = "{}[]\",:-+.eE0129nulltrue \t\\u\xff\x01";
    const std::size_t changes = 1 + below(random, 4);
    for (std::size_t i = 0; i < changes && !line.empty(); ++i) {
        const std::size_t place = below(random, line.size());
        switch (below(random, 4)) {
            case 0:
                line[place] = spice[below(random, spice.size())];
                break;
            case 1:
                line.erase(place, 1 + below(random, 8));
                break;
            case 2:
                line.insert(place, 1, spice[below(random, spice.size())]);
                break;
            default:
                line.insert(place, line.substr(place, 1 + below(random, 8)));
        }
    }
    return line;
}

struct Tally {
    int taken = 0;
    int refused = 0;
};

/// What was taken must be fit to be told on; what was not, refused with one short line.
template <typename Decode>
void try_line(const std::string& line, const Decode& decode, Tally& tally) {
    try {
        const auto message = decode(line);
        ++tally.taken;
        EXPECT_FALSE(encode_json(message).empty());
    } catch (const Error& error) {
        ++tally.refused;
        const std::string reason = error.what();
        EXPECT_FALSE(reason.empty());
        EXPECT_LT(reason.size(), 200u);
        EXPECT_EQ(reason.find('\n'), std::string::npos) << reason;
    }
}

constexpr int kRounds = 20000;

TEST(CodecDamage, ClientLinesAreTakenOrRefused) {
    const std::string lines[] = {
        encode_json(ClientMessage(test::some_pose())),
        encode_json(ClientMessage(test::some_goals())),
        encode_json(ClientMessage(LinkHello{LinkRole::kGoal, 1, "secret", "name"})),
        encode_json(ClientMessage(LinkCommand::kManual))};
    Random random(2);
    Tally tally;
    for (int i = 0; i < kRounds; ++i) {
        try_line(damaged(lines[below(random, 4)], random), decode_client_json, tally);
    }
    EXPECT_GT(tally.taken, kRounds / 100);
    EXPECT_GT(tally.refused, kRounds / 2);
}

TEST(CodecDamage, ServerLinesAreTakenOrRefused) {
    const std::string line = encode_json(ServerMessage(test::some_status()));
    Random random(3);
    Tally tally;
    for (int i = 0; i < kRounds; ++i) {
        try_line(damaged(line, random), decode_server_json, tally);
    }
    EXPECT_GT(tally.taken, kRounds / 100);
    EXPECT_GT(tally.refused, kRounds / 2);
}

TEST(CodecDamage, TextLinesAreTakenOrRefused) {
    const std::string lines[] = {"P 12.5 1.3 -0.15 0.02 0.03 0.01 degraded 0.9 2.5 - 1",
                                 "TEXT 1 goal secret plc_7", "G 1.25 -3.5 0.1", "M manual"};
    Random random(4);
    Tally tally;
    for (int i = 0; i < kRounds; ++i) {
        try_line(damaged(lines[below(random, 4)], random), decode_client_text, tally);
    }
    EXPECT_GT(tally.taken, kRounds / 100);
    EXPECT_GT(tally.refused, kRounds / 4);
}

TEST(CodecDamage, NoBytesAreTooStrange) {
    Random random(5);
    Tally tally;
    for (int i = 0; i < kRounds; ++i) {
        std::string line(below(random, 64), '\0');
        for (char& byte : line) {
            byte = static_cast<char>(below(random, 256));
        }
        try_line(line, decode_client_json, tally);
        try_line(line, decode_client_text, tally);
    }
    EXPECT_EQ(tally.taken + tally.refused, 2 * kRounds);
}

TEST(CodecDamage, DepthIsNoTrap) {
    Tally tally;
    const std::string open(60000, '[');
    try_line(open, decode_client_json, tally);
    try_line(open + std::string(60000, ']'), decode_client_json, tally);
    std::string deep = R"({"type":"cancel","x":)" + std::string(20000, '[');
    deep += std::string(20000, ']') + "}";
    try_line(deep, decode_client_json, tally);
    EXPECT_EQ(tally.refused, 2);
    EXPECT_EQ(tally.taken, 1);
}

}  // namespace
}  // namespace hybrid_slam
