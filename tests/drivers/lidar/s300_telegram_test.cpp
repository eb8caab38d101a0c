// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/s300_telegram.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "hybrid_slam/core/measurements.hpp"
#include "support/error_of.hpp"
#include "support/shared_data.hpp"
#include "telegrams.hpp"

namespace hybrid_slam {
namespace {

using namespace test;  // NOLINT
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Bit by bit, as the definition says.
std::uint16_t checksum_oracle(const Bytes& bytes) {
    unsigned rest = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
        for (int bit = 7; bit >= 0; --bit) {
            const bool out = ((rest >> 15U) & 1U) != ((byte >> bit) & 1U);
            rest = ((rest << 1U) & 0xFFFFU) ^ (out ? 0x1021U : 0U);
        }
    }
    return static_cast<std::uint16_t>(rest);
}

void expect_same(const S300Telegram& a, const S300Telegram& b) {
    EXPECT_EQ(a.protocol, b.protocol);
    EXPECT_EQ(a.size_rule, b.size_rule);
    EXPECT_EQ(a.address, b.address);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.scan_number, b.scan_number);
    EXPECT_EQ(a.telegram_number, b.telegram_number);
    EXPECT_EQ(a.io, b.io);
    EXPECT_EQ(a.field, b.field);
    EXPECT_EQ(a.words, b.words);
    ASSERT_EQ(a.reflectors.size(), b.reflectors.size());
    for (std::size_t i = 0; i < a.reflectors.size(); ++i) {
        EXPECT_NEAR(a.reflectors[i].angle, b.reflectors[i].angle, 1e-12);
        EXPECT_NEAR(a.reflectors[i].distance, b.reflectors[i].distance, 1e-12);
        EXPECT_EQ(a.reflectors[i].flags, b.reflectors[i].flags);
    }
}

TEST(S300Checksum, GivesTheCheckValueOfItsFamily) {
    const Bytes nine{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    EXPECT_EQ(s300_checksum(nine.data(), nine.size()), 0x29B1);  // CRC-16/CCITT-FALSE
}

TEST(S300Checksum, FitsTheTokenRequestOfARealDevice) {
    const Bytes request = hex("19 00 00 05 FF 07 07 0F");
    EXPECT_EQ(s300_checksum(request.data(), request.size()), 0xD09F);
}

TEST(S300Checksum, AgreesWithTheDefinitionAtEveryLength) {
    std::mt19937 rng(3);
    Bytes bytes;
    for (int length = 0; length < 70; ++length) {
        EXPECT_EQ(s300_checksum(bytes.data(), bytes.size()), checksum_oracle(bytes)) << length;
        bytes.push_back(static_cast<std::uint8_t>(rng()));
    }
}

TEST(S300Telegram, TheFactsShortTelegramsAreReadWordForWord) {
    for (const Bytes& bytes : {short_0103(), short_0102()}) {
        const Decoded decoded = decode(bytes);
        ASSERT_EQ(decoded.telegrams.size(), 1U);
        const S300Telegram& telegram = decoded.telegrams[0];
        EXPECT_EQ(telegram.begin, 0U);
        EXPECT_EQ(telegram.end, 36U);
        EXPECT_EQ(telegram.scan_number, 0x00012345U);
        EXPECT_EQ(telegram.telegram_number, 0x0677);
        EXPECT_EQ(telegram.address, 7);
        EXPECT_EQ(telegram.status, 0);
        EXPECT_EQ(telegram.field, 1);
        EXPECT_THAT(telegram.words,
                    ElementsAre(150, 0x2000 | 151, 0x4000 | 152, 0x8000 | 153, 2996));
        EXPECT_THAT(telegram.io, IsEmpty());
        EXPECT_THAT(telegram.reflectors, IsEmpty());
    }
}

TEST(S300Telegram, EncodingGivesTheFactsBytes) {
    S300Telegram telegram =
        telegram_of(0x00012345, {150, 0x2000 | 151, 0x4000 | 152, 0x8000 | 153, 2996});
    telegram.telegram_number = 0x0677;
    EXPECT_EQ(encode(telegram), short_0103());
    telegram.protocol = 0x0102;
    telegram.size_rule = S300SizeRule::kFromByte4;
    EXPECT_EQ(encode(telegram), short_0102());
}

/// I/O words by bits 0 and 1 of `blocks`, distances by bit 2, reflectors by those above.
S300Telegram draw_telegram(std::mt19937& rng, int blocks, std::size_t count) {
    S300Telegram telegram;
    telegram.address = 8;
    telegram.status = 1;
    telegram.scan_number = static_cast<std::uint32_t>(rng());
    telegram.telegram_number = static_cast<std::uint16_t>(rng());
    for (int i = 0; i < (blocks & 3); ++i) {
        telegram.io.push_back(static_cast<std::uint16_t>(rng() % 0x1000));
    }
    if ((blocks & 4) != 0) {
        telegram.field = static_cast<std::uint8_t>(1 + rng() % 5);
        for (std::size_t i = 0; i < count; ++i) {
            telegram.words.push_back(static_cast<std::uint16_t>(rng()));
        }
    }
    for (int i = 0; i < (blocks >> 3); ++i) {
        S300Reflector reflector;
        reflector.angle = radians(0.01 * static_cast<double>(rng() % 27001));
        reflector.distance = 0.01 * static_cast<double>(rng() % 0x2000);
        reflector.flags = rng() % 2 == 0 ? kReflector : kProtectiveField;
        telegram.reflectors.push_back(reflector);
    }
    return telegram;
}

class S300Blocks : public ::testing::TestWithParam<S300SizeRule> {};

TEST_P(S300Blocks, SurviveEncodingAndDecoding) {
    std::mt19937 rng(5);
    for (int blocks = 1; blocks < 32; ++blocks) {
        for (const std::size_t count : {0U, 1U, 2U, 381U, 541U, 761U, 1980U}) {
            S300Telegram telegram = draw_telegram(rng, blocks, count);
            telegram.size_rule = GetParam();
            const Bytes bytes = encode(telegram);
            const Decoded decoded = decode(bytes);
            ASSERT_EQ(decoded.telegrams.size(), 1U) << blocks << ' ' << count;
            expect_same(decoded.telegrams[0], telegram);
            EXPECT_EQ(decoded.telegrams[0].end, bytes.size());
            EXPECT_EQ(decoded.counts.garbage_bytes, 0U);
            EXPECT_EQ(decoded.counts.bad_checksums, 0U);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Rules, S300Blocks,
                         ::testing::Values(S300SizeRule::kFromByte4, S300SizeRule::kFromByte8,
                                           S300SizeRule::kFromByte12));

TEST(S300Telegram, DistancesThatSpellABlockIdStayDistances) {
    // 0xCCCC counts 5 reflectors that are not there; there is no field 0x2223 or 0x6666.
    const std::vector<std::uint16_t> words{0xCCCC, 5, 1, 2, 0xBBBB, 0x2223, 0xAAAA, 0xBBBB, 0x6666};
    const Decoded decoded = decode(encode(telegram_of(2, words)));
    ASSERT_EQ(decoded.telegrams.size(), 1U);
    EXPECT_EQ(decoded.telegrams[0].words, words);
    EXPECT_THAT(decoded.telegrams[0].reflectors, IsEmpty());
}

TEST(S300Telegram, TheFirstOfSeveralFieldsIsKeptAndTheOthersAreCounted) {
    S300Telegram telegram = telegram_of(2, {7, 8, 9, 0xBBBB, 0x2222, 4, 5, 0xBBBB, 0x5555, 6});
    telegram.io = {3};
    telegram.reflectors.push_back({1.0, 2.0, kReflector});
    const Decoded decoded = decode(encode(telegram));
    ASSERT_EQ(decoded.telegrams.size(), 1U);
    EXPECT_EQ(decoded.telegrams[0].field, 1);
    EXPECT_THAT(decoded.telegrams[0].words, ElementsAre(7, 8, 9));
    EXPECT_EQ(decoded.telegrams[0].more_fields, 2U);
    EXPECT_THAT(decoded.telegrams[0].io, ElementsAre(3));
    EXPECT_EQ(decoded.telegrams[0].reflectors.size(), 1U);
    EXPECT_EQ(decode(encode(telegram_of(4))).telegrams.at(0).more_fields, 0U);
}

TEST(S300Telegram, AReflectorBlockOfNoneEndsTheDistances) {
    const Decoded decoded = decode(encode(telegram_of(2, {7, 8, 0xCCCC, 0})));
    ASSERT_EQ(decoded.telegrams.size(), 1U);
    EXPECT_THAT(decoded.telegrams[0].words, ElementsAre(7, 8));
}

TEST(S300Telegram, TheWarningFieldIsToldOnlyBeforeProtocol0103) {
    S300Telegram telegram;
    telegram.reflectors.push_back({1.0, 2.0, kWarningField | kReflector});
    EXPECT_EQ(decode(encode(telegram)).telegrams.at(0).reflectors.at(0).flags, kReflector);
    telegram.protocol = 0x0102;
    EXPECT_EQ(decode(encode(telegram)).telegrams.at(0).reflectors.at(0).flags,
              kWarningField | kReflector);
}

TEST(S300Telegram, AReflectorsWordIsReadAsTheFactsTellIt) {
    S300Telegram telegram;
    telegram.reflectors.push_back({radians(123.45), 6.78, kReflector});
    const Bytes bytes = encode(telegram);
    // Angle 12345 = 0x3039, distance 678 = 0x02A6 with bit 29 of the whole.
    EXPECT_EQ(Bytes(bytes.begin() + 20, bytes.end() - 2), hex("CC CC 01 00 39 30 A6 22"));
}

TEST(S300Telegram, WhatNoTelegramCanSayIsRefused) {
    const auto refusal = [](const S300Telegram& telegram) {
        return error_of([&] { encode(telegram); });
    };
    EXPECT_THAT(refusal({}), HasSubstr("22 bytes: must have 26 to 4096"));
    EXPECT_THAT(refusal(telegram_of(1, std::vector<std::uint16_t>(2036))),
                HasSubstr("4098 bytes: must have 26 to 4096"));
    S300Telegram telegram = telegram_of(1);
    telegram.field = 6;
    EXPECT_THAT(refusal(telegram), HasSubstr("field 6 must be 1 to 5"));
    telegram.field = 0;
    EXPECT_THAT(refusal(telegram), HasSubstr("field 0 must be 1 to 5"));
    for (const S300Reflector& reflector :
         {S300Reflector{-0.1, 1.0, 0}, S300Reflector{1.0, 82.0, 0}, S300Reflector{7.0, 1.0, 0},
          S300Reflector{std::nan(""), 1.0, 0}, S300Reflector{1.0, std::nan(""), 0}}) {
        telegram = {};
        telegram.reflectors = {reflector};
        EXPECT_THAT(refusal(telegram), HasSubstr("cannot be told"));
    }
}

Bytes read_file(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// What the facts say of the full telegrams.
std::vector<std::uint16_t> full_words() {
    std::vector<std::uint16_t> words;
    for (std::size_t i = 0; i < 541; ++i) {
        words.push_back(static_cast<std::uint16_t>(100 + 3 * i));
    }
    words[10] |= 0x2000U;
    words[20] |= 0x4000U;
    words[30] |= 0x8000U;
    words[540] = kS300NoReturn;
    return words;
}

struct GivenFile {
    const char* name;
    std::uint16_t protocol;
    S300SizeRule rule;
    std::uint8_t address;
    std::vector<std::uint16_t> io;
    std::vector<std::uint16_t> words;
};

TEST(S300Files, AreReadExactlyAndEncodedToTheSameBytes) {
    HYBRID_SLAM_SHARED_OR_SKIP(folder, "data/s300_telegrams");
    const std::vector<std::uint16_t> full = full_words();
    const std::vector<std::uint16_t> five{150, 0x2000 | 151, 0x4000 | 152, 0x8000 | 153, 2996};
    const std::vector<std::uint16_t> standby(541, kS300Standby);
    constexpr S300SizeRule kOld = S300SizeRule::kFromByte4;
    constexpr S300SizeRule kNew = S300SizeRule::kFromByte12;
    const std::vector<GivenFile> files{
        {"short5_v0102.bin", 0x0102, kOld, 7, {}, five},
        {"short5_v0103.bin", 0x0103, kNew, 7, {}, five},
        {"full541_v0102.bin", 0x0102, kOld, 7, {}, full},
        {"full541_v0103.bin", 0x0103, kNew, 7, {}, full},
        {"io_full541_v0102.bin", 0x0102, kOld, 7, {3}, full},
        {"io_full541_v0103.bin", 0x0103, kNew, 7, {3}, full},
        {"slave08_full541_v0103.bin", 0x0103, kNew, 8, {}, full},
        {"standby_full541_v0103.bin", 0x0103, kNew, 7, {}, standby},
    };
    for (const GivenFile& file : files) {
        SCOPED_TRACE(file.name);
        const Bytes bytes = read_file(folder / file.name);
        const Decoded decoded = decode(bytes, 64);
        ASSERT_EQ(decoded.telegrams.size(), 1U);
        const S300Telegram& telegram = decoded.telegrams[0];
        EXPECT_EQ(telegram.begin, 0U);
        EXPECT_EQ(telegram.end, bytes.size());
        EXPECT_EQ(telegram.protocol, file.protocol);
        EXPECT_EQ(telegram.size_rule, file.rule);
        EXPECT_EQ(telegram.address, file.address);
        EXPECT_EQ(telegram.status, 0);
        EXPECT_EQ(telegram.scan_number, 0x00012345U);
        EXPECT_EQ(telegram.telegram_number, 0x0677);
        EXPECT_EQ(telegram.io, file.io);
        EXPECT_EQ(telegram.words, file.words);
        EXPECT_EQ(decoded.counts.telegrams, 1U);
        EXPECT_EQ(decoded.counts.garbage_bytes, 0U);
        EXPECT_EQ(decoded.counts.bad_checksums, 0U);
        EXPECT_EQ(encode(telegram), bytes);
    }
}

TEST(S300Files, TheDamagedStreamHoldsItsTwoScans) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/s300_telegrams/stream_garbage_good_corrupt_good.bin");
    const Bytes bytes = read_file(file);
    for (const std::size_t most : {1, 7, 100, 5000}) {
        const Decoded decoded = decode(bytes, most);
        EXPECT_THAT(scan_numbers(decoded), ElementsAre(100, 104));
        EXPECT_EQ(decoded.counts.garbage_bytes, bytes.size() - 2 * 1108);
        EXPECT_EQ(decoded.counts.bad_checksums, 1U);  // the fake header's size is no telegram's
        EXPECT_EQ(decoded.counts.overlapping, 0U);
    }
}

}  // namespace
}  // namespace hybrid_slam
