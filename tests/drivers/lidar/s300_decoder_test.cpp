// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "telegrams.hpp"

namespace hybrid_slam {
namespace {

using namespace test;  // NOLINT
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr S300SizeRule kRules[] = {S300SizeRule::kFromByte4, S300SizeRule::kFromByte8,
                                   S300SizeRule::kFromByte12};

Bytes encoded(std::uint32_t scan_number, S300SizeRule rule, std::uint16_t protocol = 0x0103) {
    S300Telegram telegram = telegram_of(scan_number);
    telegram.size_rule = rule;
    telegram.protocol = protocol;
    return encode(telegram);
}

/// Intact telegrams among all kinds of damage, of one size rule; `zeros` makes headers likely.
Bytes damaged_stream(std::mt19937& rng, S300SizeRule rule, int parts) {
    Bytes stream;
    for (int part = 0; part < parts; ++part) {
        S300Telegram telegram = telegram_of(static_cast<std::uint32_t>(part));
        telegram.size_rule = rule;
        telegram.words.resize(1 + rng() % 60);
        for (std::uint16_t& word : telegram.words) {
            word = static_cast<std::uint16_t>(rng() % 3 == 0 ? 0 : rng() % 3000);
        }
        Bytes bytes = encode(telegram);
        const std::size_t place = rng() % bytes.size();
        switch (rng() % 6) {
            case 0:
                bytes.resize(place);
                break;
            case 1:
                bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(place));
                break;
            case 2:
                bytes[place] ^= static_cast<std::uint8_t>(1U << (rng() % 8));
                break;
            case 3:
                std::generate(bytes.begin(), bytes.end(), [&] {
                    return static_cast<std::uint8_t>(rng() % 2 == 0 ? 0 : rng() % 2 * 0xFF);
                });
                break;
            default:
                break;
        }
        append(stream, bytes);
    }
    return stream;
}

using Place = std::tuple<std::uint64_t, std::uint64_t>;

std::set<Place> places(const Decoded& decoded) {
    std::set<Place> found;
    for (const S300Telegram& telegram : decoded.telegrams) {
        found.insert({telegram.begin, telegram.end});
    }
    return found;
}

/// Tries every place.
std::set<Place> places_by_oracle(const Bytes& stream, std::size_t uncounted) {
    std::set<Place> found;
    for (std::size_t begin = 0; begin + 26 <= stream.size(); ++begin) {
        const std::uint8_t* const bytes = &stream[begin];
        const std::size_t total = uncounted + 2 * (256U * bytes[6] + bytes[7]);
        if (std::all_of(bytes, bytes + 6, [](std::uint8_t byte) { return byte == 0; }) &&
            bytes[8] == 0xFF && bytes[11] == 1 && total >= 26 && total <= 4096 &&
            begin + total <= stream.size() &&
            s300_checksum(bytes + 4, total - 6) == bytes[total - 2] + 256 * bytes[total - 1]) {
            found.insert({begin, begin + total});
        }
    }
    return found;
}

TEST(S300Decoder, FindsWhatASearchAtEveryPlaceFinds) {
    for (unsigned seed = 0; seed < 30; ++seed) {
        std::mt19937 rng(seed);
        const S300SizeRule rule = kRules[seed % 3];
        const Bytes stream = joined({encoded(9, rule), damaged_stream(rng, rule, 60)});
        const std::set<Place> expected =
            places_by_oracle(stream, std::size_t{rule == S300SizeRule::kFromByte4   ? 4U
                                                 : rule == S300SizeRule::kFromByte8 ? 8U
                                                                                    : 14U});
        ASSERT_GT(expected.size(), 10U);
        EXPECT_EQ(places(decode(stream)), expected) << seed;
    }
}

void expect_same_counts(const S300StreamCounts& a, const S300StreamCounts& b) {
    EXPECT_EQ(a.bytes, b.bytes);
    EXPECT_EQ(a.telegrams, b.telegrams);
    EXPECT_EQ(a.candidates, b.candidates);
    EXPECT_EQ(a.garbage_bytes, b.garbage_bytes);
    EXPECT_EQ(a.bad_checksums, b.bad_checksums);
    EXPECT_EQ(a.bad_contents, b.bad_contents);
    EXPECT_EQ(a.overlapping, b.overlapping);
}

TEST(S300Decoder, PiecesMakeNoDifference) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 rng(seed);
        Bytes stream;
        for (int i = 0; i < 12; ++i) {  // size rules change, so that telegrams are held back too
            append(stream, damaged_stream(rng, kRules[rng() % 3], 1 + static_cast<int>(rng() % 9)));
        }
        const Decoded whole = decode(stream);
        ASSERT_FALSE(whole.telegrams.empty());
        for (const std::size_t most : {1U, 3U, 50U, 3000U}) {
            const Decoded pieces = decode(stream, most, seed);
            EXPECT_EQ(scan_numbers(pieces), scan_numbers(whole));
            EXPECT_EQ(places(pieces), places(whole));
            expect_same_counts(pieces.counts, whole.counts);
        }
    }
}

TEST(S300Decoder, EveryByteIsOfATelegramOrGarbageOrPending) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 rng(seed);
        const Bytes stream = damaged_stream(rng, S300SizeRule::kFromByte12, 100);
        for (std::size_t cut = 0; cut < stream.size(); cut += 97) {
            const Decoded decoded =
                decode(Bytes(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(cut)));
            ASSERT_LE(decoded.counts.garbage_bytes + covered_bytes(decoded), cut);
        }
        // A last telegram can still begin in the last 11 bytes, and nowhere else once the longest
        // one cannot be waited for any more.
        const Bytes tail(S300Decoder::kWitnessBytes + 2 * S300Decoder::kMostBytes, 0x55);
        EXPECT_EQ(pending_bytes(decode(joined({stream, tail}))), 11U);
    }
}

TEST(S300Decoder, AFalseHeaderDoesNotDelayWhatComesBehindIt) {
    const Bytes fake = hex("00 00 00 00 00 00 07 00 FF 07 03 01");  // claims 3598 bytes
    const Bytes good = encode(telegram_of(5));
    S300Decoder decoder;
    decoder.push(fake.data(), fake.size());
    decoder.push(good.data(), good.size() - 1);
    EXPECT_THAT(fetch_all(decoder), IsEmpty());
    decoder.push(&good.back(), 1);
    ASSERT_EQ(fetch_all(decoder).size(), 1U);
    EXPECT_EQ(decoder.counts().bad_checksums, 0U);  // it may still become one
    EXPECT_EQ(decoder.counts().garbage_bytes, 0U);
    const Bytes rest(3600, 0x11);
    decoder.push(rest.data(), rest.size());
    EXPECT_EQ(decoder.counts().bad_checksums, 1U);
    EXPECT_EQ(decoder.counts().garbage_bytes,
              decoder.counts().bytes - good.size() - 11);  // 11 may begin a header
}

TEST(S300Decoder, ATelegramThatFitsHidesNoneInsideOfIt) {
    const Bytes inner = encode(telegram_of(4));
    std::vector<std::uint16_t> words{1, 2, 3};
    for (std::size_t i = 0; i < inner.size(); i += 2) {
        words.push_back(static_cast<std::uint16_t>(inner[i] | (inner[i + 1] << 8U)));
    }
    words.resize(60, 9);
    const Bytes outer = encode(telegram_of(2, words));
    const Decoded decoded = decode(joined({outer, encode(telegram_of(6))}), 10);
    EXPECT_THAT(scan_numbers(decoded), ElementsAre(4, 2, 6));  // by their ends
    EXPECT_EQ(decoded.counts.overlapping, 1U);
    EXPECT_EQ(pending_bytes(decoded), 0U);
}

TEST(S300Decoder, ACutTelegramDoesNotSwallowTheNext) {
    const Bytes good = encode(telegram_of(2, std::vector<std::uint16_t>(50, 0)));
    for (std::size_t cut = 0; cut < good.size(); ++cut) {
        const Bytes head(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(cut));
        const Bytes tail(good.begin() + static_cast<std::ptrdiff_t>(cut), good.end());
        const Bytes next = encode(telegram_of(4));
        EXPECT_THAT(scan_numbers(decode(joined({head, next}))), ElementsAre(4)) << cut;
        const std::vector<std::uint32_t> behind = scan_numbers(decode(joined({tail, next})));
        EXPECT_EQ(behind.back(), 4U) << cut;
        EXPECT_EQ(behind.size(), cut == 0 ? 2U : 1U) << cut;
    }
}

TEST(S300Decoder, ZerosBeforeATelegramAreNotPartOfIt) {
    for (std::size_t zeros = 0; zeros < 20; ++zeros) {
        const Decoded decoded = decode(joined({Bytes(zeros, 0), short_0103()}));
        ASSERT_EQ(decoded.telegrams.size(), 1U);
        EXPECT_EQ(decoded.telegrams[0].begin, zeros);
        EXPECT_EQ(decoded.counts.garbage_bytes, zeros);
    }
}

TEST(S300Decoder, TheFirstTelegramMayFollowAnyRule) {
    for (const S300SizeRule rule : kRules) {
        for (const int protocol : {0x0100, 0x0102, 0x0103, 0x0107}) {
            const Decoded decoded = decode(encoded(1, rule, static_cast<std::uint16_t>(protocol)));
            ASSERT_EQ(decoded.telegrams.size(), 1U);
            EXPECT_EQ(decoded.telegrams[0].size_rule, rule);
        }
    }
}

TEST(S300Decoder, ProtocolsMayAlternate) {
    const Decoded decoded =
        decode(joined({short_0103(), short_0102(), short_0103(), short_0102()}));
    EXPECT_EQ(decoded.telegrams.size(), 4U);
}

TEST(S300Decoder, AnotherRuleIsBelievedOnTheSecondTelegram) {
    const S300SizeRule from = S300SizeRule::kFromByte12;
    for (const S300SizeRule to : {S300SizeRule::kFromByte4, S300SizeRule::kFromByte8}) {
        const Bytes first = joined({encoded(2, from), encoded(4, from), encoded(6, to)});
        EXPECT_THAT(scan_numbers(decode(first)), ElementsAre(2, 4));
        EXPECT_EQ(pending_bytes(decode(first)), encoded(6, to).size());
        const Bytes second = joined({first, encoded(8, to)});
        EXPECT_THAT(scan_numbers(decode(second)), ElementsAre(2, 4, 6, 8));
        EXPECT_EQ(pending_bytes(decode(second)), 0U);
        EXPECT_THAT(scan_numbers(decode(joined({second, encoded(10, to), encoded(12, from)}))),
                    ElementsAre(2, 4, 6, 8, 10, 12));
    }
}

TEST(S300Decoder, AnUndocumentedProtocolIsBelievedOnTheSecondTelegram) {
    const S300SizeRule rule = S300SizeRule::kFromByte12;
    const Bytes first = joined({encoded(2, rule), encoded(4, rule, 0x0107)});
    EXPECT_THAT(scan_numbers(decode(first)), ElementsAre(2));
    EXPECT_THAT(scan_numbers(decode(joined({first, encoded(6, rule, 0x0107)}))),
                ElementsAre(2, 4, 6));
}

TEST(S300Decoder, ATelegramHeldBackIsGarbageWhenItsWitnessComesTooLate) {
    const Bytes held = encoded(4, S300SizeRule::kFromByte8);
    const Bytes gap(S300Decoder::kWitnessBytes, 0x33);
    const Bytes near = joined({encoded(2, S300SizeRule::kFromByte12), held, gap});
    EXPECT_THAT(scan_numbers(decode(joined({near, held}))), ElementsAre(2, 4, 4));
    const Bytes far = joined({near, {0x33}, held});
    EXPECT_THAT(scan_numbers(decode(far)), ElementsAre(2));
    EXPECT_EQ(decode(far).counts.bad_checksums, 1U);
    EXPECT_EQ(decode(far).counts.garbage_bytes, held.size() + gap.size() + 1);
}

TEST(S300Decoder, AFalseStartDoesNotKeepTheRightRuleOut) {
    // One telegram by a rule that nothing else follows, as chance may make one.
    const Decoded decoded = decode(
        joined({encoded(2, S300SizeRule::kFromByte4), encoded(4, S300SizeRule::kFromByte12),
                encoded(6, S300SizeRule::kFromByte12), encoded(8, S300SizeRule::kFromByte4)}));
    EXPECT_THAT(scan_numbers(decoded), ElementsAre(2, 4, 6));  // the last is doubted now
}

TEST(S300Decoder, ZerosBehindAChecksumOfEqualBytesMakeNoSecondTelegram) {
    Bytes stream;
    std::size_t telegrams = 0;
    for (std::uint32_t scan = 0; scan < 20000; ++scan) {
        const Bytes bytes = encoded(scan, S300SizeRule::kFromByte4, 0x0102);
        if (bytes[bytes.size() - 2] == bytes.back()) {
            append(stream, bytes);
            ++telegrams;
        }
    }
    ASSERT_GT(telegrams, 20U);
    const Decoded decoded = decode(stream);
    EXPECT_EQ(decoded.telegrams.size(), telegrams);
    EXPECT_EQ(decoded.counts.overlapping, 0U);
}

/// Nothing of `damaged` is found between intact telegrams.
void expect_refused(const Bytes& damaged) {
    const Decoded decoded =
        decode(joined({short_0103(), damaged, encode(telegram_of(8)), encode(telegram_of(10))}));
    ASSERT_THAT(scan_numbers(decoded), ElementsAre(0x00012345U, 8, 10));
}

TEST(S300Decoder, NoTwoFlippedBitsGetThrough) {
    const Bytes good = encode(telegram_of(3, {100, 200, 0}));
    const std::size_t bits = 8 * good.size();
    for (std::size_t first = 0; first < bits; ++first) {
        for (std::size_t second = first; second < bits; ++second) {
            Bytes damaged = good;
            damaged[first / 8] ^= static_cast<std::uint8_t>(1U << (first % 8));
            if (second != first) {
                damaged[second / 8] ^= static_cast<std::uint8_t>(1U << (second % 8));
            }
            expect_refused(damaged);
        }
    }
}

TEST(S300Decoder, NoBurstGetsThrough) {
    const Bytes good = encode(telegram_of(3, {100, 200, 0}));
    std::mt19937 rng(8);
    for (int trial = 0; trial < 20000; ++trial) {
        Bytes damaged = good;
        const unsigned pattern = 1U | (static_cast<unsigned>(rng()) & 0xFFFFU);
        const std::size_t first = rng() % (8 * good.size() - 16);
        for (std::size_t bit = 0; bit < 16; ++bit) {
            const unsigned flipped = (pattern >> bit) & 1U;
            damaged[(first + bit) / 8] ^= static_cast<std::uint8_t>(flipped << ((first + bit) % 8));
        }
        expect_refused(damaged);
    }
}

TEST(S300Decoder, SizesOfNoTelegramAreNotWaitedFor) {
    for (const char* size : {"00 00", "00 05", "07 FF", "FF FF"}) {
        Bytes fake = hex("00 00 00 00 00 00 00 00 FF 07 03 01 55 55 55 55 55 55 55 55 55 55 55 55");
        const Bytes digits = hex(size);
        std::copy(digits.begin(), digits.end(), fake.begin() + 6);
        const Decoded decoded = decode(fake);
        EXPECT_EQ(decoded.counts.candidates, 0U) << size;
        EXPECT_EQ(decoded.counts.garbage_bytes, fake.size() - 11) << size;
    }
}

TEST(S300Decoder, ContentsThatMakeNoSenseAreCounted) {
    Bytes bytes = short_0103();
    bytes[20] = 0xDD;
    const std::uint16_t checksum = s300_checksum(bytes.data() + 4, bytes.size() - 6);
    bytes[bytes.size() - 2] = static_cast<std::uint8_t>(checksum & 0xFFU);
    bytes[bytes.size() - 1] = static_cast<std::uint8_t>(checksum >> 8U);
    const Decoded decoded = decode(bytes);
    EXPECT_THAT(decoded.telegrams, IsEmpty());
    EXPECT_EQ(decoded.counts.bad_contents, 1U);
    EXPECT_EQ(decoded.counts.bad_checksums, 0U);
}

TEST(S300Decoder, TelegramsThatAreFetchedLateAreAllThere) {
    S300Decoder decoder;
    S300Telegram telegram;
    std::uint32_t fetched = 0;
    for (std::uint32_t scan = 0; scan < 1000; ++scan) {
        const Bytes bytes = encode(telegram_of(scan));
        decoder.push(bytes.data(), bytes.size());
        for (int i = scan % 3 == 0 ? 0 : 1; i > 0; --i) {
            ASSERT_TRUE(decoder.next(telegram));
            ASSERT_EQ(telegram.scan_number, fetched++);
        }
    }
    while (decoder.next(telegram)) {
        ASSERT_EQ(telegram.scan_number, fetched++);
    }
    EXPECT_EQ(fetched, 1000U);
}

/// A telegram whose checksum fits by the rule of six bytes fewer too, as one in 65536 does.
std::vector<std::uint8_t> ambiguous_telegram(std::uint32_t scan_number) {
    std::mt19937 random(scan_number);
    S300Telegram telegram;
    telegram.scan_number = scan_number;
    telegram.field = 1;
    for (;;) {
        telegram.words.assign(9, 0);
        for (std::uint16_t& word : telegram.words) {
            word = static_cast<std::uint16_t>(1 + random() % 2900);
        }
        std::vector<std::uint8_t> bytes = encode(telegram);
        const std::size_t end = bytes.size() - 8;
        const unsigned there = bytes[end] | (static_cast<unsigned>(bytes[end + 1]) << 8U);
        if (s300_checksum(bytes.data() + 4, end - 4) == there) {
            return bytes;
        }
    }
}

TEST(S300Decoder, WhatFitsByAnotherRuleByChanceIsNoLoss) {
    std::vector<std::uint8_t> stream;
    S300Telegram plain;
    plain.field = 1;
    plain.words.assign(9, 150);
    for (std::uint32_t number = 0; number < 6; ++number) {
        plain.scan_number = 100 + number;
        const auto bytes = number % 2 == 0 ? encode(plain) : ambiguous_telegram(100 + number);
        stream.insert(stream.end(), bytes.begin(), bytes.end());
    }
    stream.insert(stream.end(), 200000, 0);  // so that nothing is held back any more
    S300Decoder decoder;
    decoder.push(stream.data(), stream.size());
    S300Telegram telegram;
    std::uint32_t number = 100;
    while (decoder.next(telegram)) {
        EXPECT_EQ(telegram.scan_number, number);
        EXPECT_EQ(telegram.words.size(), 9U);
        ++number;
    }
    EXPECT_EQ(number, 106U);
    EXPECT_EQ(decoder.counts().bad_checksums, 0U);
}

}  // namespace
}  // namespace hybrid_slam
