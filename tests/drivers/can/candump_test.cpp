// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/candump.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frames.hpp"
#include "support/error_of.hpp"
#include "support/shared_data.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::TempFolder;
using ::testing::HasSubstr;

std::string refusal(const std::string& line) {
    return error_of([&line] { parse_candump(line); });
}

TEST(Candump, ReadsAndWritesALine) {
    const std::string text = "(1700000000.020000) can0 203#03F4010A0A18FC00";
    const CandumpLine line = parse_candump(text);
    EXPECT_EQ(line.microseconds, 1700000000020000);
    EXPECT_EQ(line.bus, "can0");
    EXPECT_EQ(line.frame, CanFrame::of(0x203, {0x03, 0xF4, 0x01, 0x0A, 0x0A, 0x18, 0xFC, 0x00}));
    EXPECT_EQ(to_candump(line), text);
    EXPECT_EQ(to_candump({7, "vcan12", CanFrame::of(0x7, {})}), "(0000000000.000007) vcan12 007#");
}

TEST(Candump, ReadsWhatOtherToolsWrite) {
    EXPECT_EQ(parse_candump("(0.000001) can0 123#DEad").frame, CanFrame::of(0x123, {0xDE, 0xAD}));
    EXPECT_EQ(parse_candump("(0.000001) can0 123#00 R").frame, CanFrame::of(0x123, {0}));
    EXPECT_EQ(parse_candump("(0.000001)\tcan0  123#00 T").frame, CanFrame::of(0x123, {0}));
    const CanFrame asked = parse_candump("(0.000001) can0 00000601#R4").frame;
    EXPECT_TRUE(asked.remote);
    EXPECT_TRUE(asked.extended);
    EXPECT_EQ(asked.size, 4);
    EXPECT_EQ(parse_candump("(0.000001) can0 601#R").frame.size, 0);
}

TEST(Candump, EveryFrameComesBack) {
    std::mt19937 rng(1);
    for (int i = 0; i < 2000; ++i) {
        CandumpLine line;
        line.microseconds = static_cast<std::int64_t>(rng()) * 1000003;
        line.frame = test::random_frame(rng);
        const CandumpLine again = parse_candump(to_candump(line));
        EXPECT_EQ(again.frame, line.frame);
        EXPECT_EQ(again.microseconds, line.microseconds);
    }
}

TEST(Candump, SaysWhatItRefuses) {
    EXPECT_THAT(refusal("(0.000001) can0 123##1AA"), HasSubstr("CAN FD"));
    EXPECT_THAT(refusal("(0.000001) can0 20000004#0000"), HasSubstr("an error frame"));
    EXPECT_THAT(refusal("(0.000001) can0 123#ABC"), HasSubstr("8 bytes"));
    EXPECT_THAT(refusal("(0.000001) can0 123#112233445566778899"), HasSubstr("8 bytes"));
    EXPECT_THAT(refusal("(0.000001) can0 123#R9"), HasSubstr("R0 to R8"));
    EXPECT_THAT(refusal("(0.000001) can0 123#R12"), HasSubstr("R0 to R8"));
    EXPECT_THAT(refusal("(0.000001) can0 800#00"), HasSubstr("id"));
    EXPECT_THAT(refusal("(0.000001) can0 0123#00"), HasSubstr("id"));
    EXPECT_THAT(refusal("(0.000001) can0 40000000#00"), HasSubstr("id"));
    EXPECT_THAT(refusal("(0.000001) can0 12300"), HasSubstr("not a frame"));
    EXPECT_THAT(refusal("(0.000001) can0"), HasSubstr("not a frame"));
    EXPECT_THAT(refusal("(0.000001) can0 123#00 X"), HasSubstr("behind the frame"));
    EXPECT_THAT(refusal("(0.000001) can0 123#00 R R"), HasSubstr("behind the frame"));
    EXPECT_THAT(refusal("(0.000001) ca\rn0 123#00"), HasSubstr("name of a bus"));
    for (const char* stamp : {"0.000001", "(0)", "(.000001)", "(0.1)", "(-1.000000)", "()", "(",
                              "(99999999999999999999.000000)"}) {
        EXPECT_THAT(refusal(std::string(stamp) + " can0 123#00"), HasSubstr("not a time")) << stamp;
    }
}

TEST(Candump, WritesOnlyWhatCanBeRead) {
    CanFrame wide = CanFrame::of(0x800, {});
    EXPECT_THAT(error_of([&] { to_candump({0, "can0", wide}); }), HasSubstr("does not fit"));
    const CanFrame good = CanFrame::of(0x100, {});
    EXPECT_THAT(error_of([&] { to_candump({0, "can 0", good}); }), HasSubstr("name of a bus"));
    EXPECT_THAT(error_of([&] { to_candump({0, "", good}); }), HasSubstr("name of a bus"));
    EXPECT_THAT(error_of([&] { to_candump({-1, "can0", good}); }), HasSubstr("1970"));
}

TEST(Candump, DamagedLinesAreRefusedOrAreLines) {
    std::mt19937 rng(2);
    int refused = 0;
    for (int i = 0; i < 20000; ++i) {
        const std::string text =
            test::mutated(to_candump({1700000000123456, "can0", test::random_frame(rng)}), rng);
        try {
            const CandumpLine line = parse_candump(text);
            EXPECT_EQ(parse_candump(to_candump(line)).frame, line.frame) << text;
        } catch (const Error&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, 5000);
    EXPECT_LT(refused, 19000);
}

TEST(Candump, FilesTellTheLine) {
    const TempFolder folder;
    const auto good = folder.write("good.log", "(1.000000) can0 1AB#01\n\n(2.000000) b 1AB#R\r\n");
    const std::vector<CandumpLine> lines = read_candump(good);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_EQ(lines[1].bus, "b");
    const auto bad = folder.write("bad.log", "(1.000000) can0 1AB#01\n(1.000000) can0 1AB\n");
    EXPECT_THAT(error_of([&] { read_candump(bad); }), HasSubstr("bad.log:2: '1AB'"));
}

TEST(Candump, TheSampleOfCanUtils) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/sample_candump.log");
    const std::vector<CandumpLine> lines = read_candump(file);
    std::string again;
    for (const CandumpLine& line : lines) {
        again += to_candump(line) + "\n";
    }
    EXPECT_EQ(lines.size(), 6U);
    EXPECT_EQ(again, test::bytes_of(file));
}

}  // namespace
}  // namespace hybrid_slam
