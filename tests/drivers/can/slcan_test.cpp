// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/slcan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frames.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::frame;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Kind = SlcanLine::Kind;

std::vector<CanFrame> frames_of(const std::vector<SlcanLine>& lines) {
    std::vector<CanFrame> frames;
    for (const SlcanLine& line : lines) {
        if (line.kind == Kind::kFrame) {
            frames.push_back(line.frame);
        }
    }
    return frames;
}

TEST(Slcan, SpellsFrames) {
    EXPECT_EQ(to_slcan(frame("203#03F4010A0A18FC00")), "t203803F4010A0A18FC00\r");
    EXPECT_EQ(to_slcan(frame("18FEF100#1122")), "T18FEF10021122\r");
    EXPECT_EQ(to_slcan(frame("601#R4")), "r6014\r");
    EXPECT_EQ(to_slcan(frame("00000601#R")), "R000006010\r");
    EXPECT_THAT(error_of([] { to_slcan(CanFrame::of(0x800, {})); }), HasSubstr("does not fit"));
}

TEST(Slcan, EveryFrameComesBackHoweverTheBytesAreCut) {
    std::mt19937 rng(3);
    std::vector<CanFrame> sent;
    std::string bytes;
    for (int i = 0; i < 500; ++i) {
        sent.push_back(test::random_frame(rng));
        bytes += to_slcan(sent.back());
    }
    for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, bytes.size()}) {
        SlcanParser parser;
        std::vector<CanFrame> got;
        for (std::size_t at = 0; at < bytes.size(); at += piece) {
            const auto part = frames_of(parser.push(std::string_view(bytes).substr(at, piece)));
            got.insert(got.end(), part.begin(), part.end());
        }
        EXPECT_EQ(got, sent);
        EXPECT_EQ(parser.dropped(), 0U);
    }
}

TEST(Slcan, TimeStampsAreTakenWithinTheirMinute) {
    SlcanParser parser;
    const auto lines = parser.push("T1111222281122334455667788EA5F\rt10011200a0\rt1001FFEA60\r");
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_EQ(lines[0].frame, frame("11112222#1122334455667788"));
    EXPECT_EQ(lines[0].milliseconds, 59999);
    EXPECT_EQ(lines[1].frame, frame("100#12"));
    EXPECT_EQ(lines[1].milliseconds, 160);
    EXPECT_EQ(parser.dropped(), 1U) << "a minute has no 60000 ms";
}

TEST(Slcan, AnswersOfAllKinds) {
    SlcanParser parser;
    const auto lines = parser.push("\rz\rZ\r\aV1013\rN4242\rF00\rS5\rO\rC\r");
    std::vector<Kind> kinds;
    for (const SlcanLine& line : lines) {
        kinds.push_back(line.kind);
    }
    EXPECT_THAT(kinds,
                ElementsAre(Kind::kDone, Kind::kDone, Kind::kDone, Kind::kRefused, Kind::kText,
                            Kind::kText, Kind::kText, Kind::kText, Kind::kText, Kind::kText));
    EXPECT_EQ(lines[4].text, "V1013");
    EXPECT_EQ(parser.dropped(), 0U);
}

TEST(Slcan, GarbageIsCountedAndTheNextLineRead) {
    for (const char* garbage :
         {"t", "t20", "t2039112233445566778899", "t2032112", "t80001", "T2000000011122", "r6019",
          "t2031xx", "hello", "t203112t2031FF", "V10 13", "\xFF\xFE", "z1"}) {
        SlcanParser parser;
        EXPECT_THAT(parser.push(std::string(garbage) + "\r"), IsEmpty()) << garbage;
        EXPECT_EQ(parser.dropped(), 1U) << garbage;
        EXPECT_THAT(frames_of(parser.push("t2031FF\r")), ElementsAre(frame("203#FF"))) << garbage;
    }
    SlcanParser parser;
    EXPECT_THAT(parser.push(std::string(100000, '7') + "\r"), IsEmpty());
    EXPECT_EQ(parser.push("t20\a").size(), 1U) << "the bell itself";
    EXPECT_EQ(parser.dropped(), 2U) << "too long; cut by a bell";
}

TEST(Slcan, DamageCostsTheLineItIsInAndItsNeighbourAtMost) {
    std::mt19937 rng(4);
    SlcanParser parser;
    for (int i = 0; i < 20000; ++i) {
        const std::string bad = test::mutated(to_slcan(test::random_frame(rng)), rng);
        for (const SlcanLine& line : parser.push(bad)) {
            EXPECT_TRUE(line.frame.valid()) << bad;
        }
        const CanFrame good = test::random_frame(rng);
        // The second one: the first may be the tail of a line that lost its end.
        const auto got = frames_of(parser.push(to_slcan(good) + to_slcan(good)));
        ASSERT_FALSE(got.empty()) << bad;
        EXPECT_EQ(got.back(), good) << bad;
    }
    EXPECT_GT(parser.dropped(), 5000U);
}

TEST(Slcan, BitRates) {
    EXPECT_EQ(slcan_bit_rate(10000), "S0");
    EXPECT_EQ(slcan_bit_rate(250000), "S5");
    EXPECT_EQ(slcan_bit_rate(1000000), "S8");
    EXPECT_THAT(error_of([] { slcan_bit_rate(83333); }), HasSubstr("bit_rate"));
}

TEST(SlcanAdapter, TalksAsTheManualSays) {
    SlcanAdapter adapter;
    EXPECT_EQ(adapter.push("V\rN\rF\rS5\r").answer, "V1013\rN4242\rF00\r\r");
    EXPECT_EQ(adapter.push("t2031FF\r").answer, "\a") << "not open";
    EXPECT_EQ(adapter.push("C\r").answer, "\a") << "closed already";
    EXPECT_EQ(adapter.push("O\r").answer, "\r");
    EXPECT_TRUE(adapter.is_open());
    EXPECT_EQ(adapter.push("O\rS5\rS9\rQ\rnonsense\r").answer, "\a\a\a\a\a");
    const auto result = adapter.push("t2031FF\rT000000010\r");
    EXPECT_EQ(result.answer, "z\rZ\r");
    EXPECT_THAT(result.frames, ElementsAre(frame("203#FF"), frame("00000001#")));
    EXPECT_EQ(adapter.push("C\r").answer, "\r");
    EXPECT_FALSE(adapter.is_open());
    EXPECT_EQ(adapter.dropped(), 1U);
}

TEST(SlcanAdapter, AnswersInTheOrderOfItsLines) {
    const std::string lines = "V\rnonsense\rS5\rO\rt203\rt2031FF\rC\r";
    SlcanAdapter adapter;
    const std::string together = adapter.push(lines).answer;
    EXPECT_EQ(together, "V1013\r\a\r\r\az\r\r");
    SlcanAdapter slow;
    std::string apart;
    for (const char byte : lines) {
        apart += slow.push(std::string(1, byte)).answer;
    }
    EXPECT_EQ(apart, together);
}

}  // namespace
}  // namespace hybrid_slam
