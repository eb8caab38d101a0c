// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/core/pose2.hpp"
#include "s300_layout.hpp"

namespace hybrid_slam {
namespace {

constexpr std::uint16_t kIoBlock = 0xAAAA;
constexpr std::uint16_t kFieldBlock = 0xBBBB;
constexpr std::uint16_t kReflectorBlock = 0xCCCC;
constexpr std::uint16_t kFieldStep = 0x1111;  ///< field f has the id f * kFieldStep
constexpr int kFields = 5;
constexpr unsigned kFullTurn = 36000;  ///< hundredths of a degree
constexpr std::uint16_t kWarningBit = 0x8000;
constexpr std::uint16_t kProtectiveBit = 0x4000;
constexpr std::uint16_t kReflectorBit = 0x2000;

/// The blocks of a telegram as 16-bit words.
struct Blocks {
    const std::uint8_t* bytes;
    std::size_t words;

    std::uint16_t operator[](std::size_t word) const { return little_endian16(bytes + 2 * word); }
    std::uint32_t pair(std::size_t word) const { return little_endian32(bytes + 2 * word); }

    bool field_begins(std::size_t word) const {
        return word + 1 < words && (*this)[word] == kFieldBlock &&
               (*this)[word + 1] % kFieldStep == 0 && (*this)[word + 1] >= kFieldStep &&
               (*this)[word + 1] <= kFields * kFieldStep;
    }

    /// Distances may spell the id by chance; so the count has to fit what is left, and the angles
    /// have to be some.
    bool reflectors_begin(std::size_t word) const {
        if (word + 1 >= words || (*this)[word] != kReflectorBlock ||
            word + 2 + 2 * std::size_t{(*this)[word + 1]} != words) {
            return false;
        }
        for (std::size_t i = word + 2; i < words; i += 2) {
            if ((*this)[i] > kFullTurn) {
                return false;
            }
        }
        return true;
    }
};

/// The I/O block has no length of its own: it ends where another block begins.
std::size_t take_io(const Blocks& blocks, S300Telegram& telegram) {
    std::size_t word = 1;
    for (; word < blocks.words && !(word > 1 && blocks.field_begins(word)) &&
           !(word > 1 && blocks.reflectors_begin(word));
         ++word) {
        telegram.io.push_back(blocks[word]);
    }
    return word;
}

/// Nor has the block of a measuring field, which other fields and reflectors may follow. No S300
/// measures the 70.99 m that 0xBBBB would be.
std::size_t end_of_field(const Blocks& blocks, std::size_t word) {
    word += 2;
    while (word < blocks.words && !blocks.field_begins(word) && !blocks.reflectors_begin(word)) {
        ++word;
    }
    return word;
}

std::size_t take_field(const Blocks& blocks, std::size_t word, S300Telegram& telegram) {
    telegram.field = static_cast<std::uint8_t>(blocks[word + 1] / kFieldStep);
    const std::size_t begin = word + 2;
    const std::size_t end = end_of_field(blocks, word);
    telegram.words.resize(end - begin);
    for (std::size_t i = 0; i < telegram.words.size(); ++i) {
        telegram.words[i] = blocks[begin + i];
    }
    return end;
}

void take_reflectors(const Blocks& blocks, std::size_t word, S300Telegram& telegram) {
    for (std::size_t i = word + 2; i < blocks.words; i += 2) {
        const std::uint32_t hit = blocks.pair(i);
        telegram.reflectors.push_back({radians(0.01 * (hit & 0xFFFFU)),
                                       0.01 * ((hit >> 16U) & kS300DistanceMask),
                                       beam_flags(hit >> 16U, telegram.protocol)});
    }
}

void put16(std::vector<std::uint8_t>& bytes, unsigned value) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>((value >> 8U) & 0xFFU));
}

void put32(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
    put16(bytes, value & 0xFFFFU);
    put16(bytes, value >> 16U);
}

void put_blocks(std::vector<std::uint8_t>& bytes, const S300Telegram& telegram) {
    if (!telegram.io.empty()) {
        put16(bytes, kIoBlock);
        std::for_each(telegram.io.begin(), telegram.io.end(),
                      [&](unsigned word) { put16(bytes, word); });
    }
    if (telegram.field != 0) {
        put16(bytes, kFieldBlock);
        put16(bytes, static_cast<unsigned>(telegram.field * kFieldStep));
        std::for_each(telegram.words.begin(), telegram.words.end(),
                      [&](unsigned word) { put16(bytes, word); });
    }
    if (!telegram.reflectors.empty()) {
        put16(bytes, kReflectorBlock);
        put16(bytes, static_cast<unsigned>(telegram.reflectors.size()));
    }
    for (const S300Reflector& reflector : telegram.reflectors) {
        const auto angle = static_cast<unsigned>(std::lround(100.0 * degrees(reflector.angle)));
        const auto distance = static_cast<unsigned>(std::lround(100.0 * reflector.distance));
        put16(bytes, angle);
        put16(bytes, (distance & kS300DistanceMask) |
                         ((reflector.flags & kWarningField) != 0 ? kWarningBit : 0U) |
                         ((reflector.flags & kProtectiveField) != 0 ? kProtectiveBit : 0U) |
                         ((reflector.flags & kReflector) != 0 ? kReflectorBit : 0U));
    }
}

void check(const S300Telegram& telegram) {
    const int field = telegram.field;
    if (field > kFields || (field == 0 && !telegram.words.empty())) {
        throw Error(fmt::format("telegram: measuring field {} must be 1 to {}", field, kFields));
    }
    for (const S300Reflector& reflector : telegram.reflectors) {
        const double angle = std::round(100.0 * degrees(reflector.angle));
        const double distance = std::round(100.0 * reflector.distance);
        const bool sound =
            angle >= 0.0 && angle <= kFullTurn && distance >= 0.0 && distance <= kS300DistanceMask;
        if (!sound) {
            throw Error(fmt::format("telegram: reflector at {} rad, {} m cannot be told",
                                    reflector.angle, reflector.distance));
        }
    }
}

}  // namespace

std::uint8_t beam_flags(unsigned word, std::uint16_t protocol) {
    constexpr std::uint16_t kFirstWithoutWarnings = 0x0103;
    const bool warns = protocol < kFirstWithoutWarnings && (word & kWarningBit) != 0;
    const int flags = ((word & kProtectiveBit) != 0 ? int{kProtectiveField} : 0) |
                      (warns ? int{kWarningField} : 0) |
                      ((word & kReflectorBit) != 0 ? int{kReflector} : 0);
    return static_cast<std::uint8_t>(flags);
}

bool take_apart(const std::uint8_t* bytes, std::size_t total, S300Telegram& telegram) {
    telegram.address = bytes[9];
    telegram.protocol = little_endian16(bytes + 10);
    telegram.status = little_endian16(bytes + 12);
    telegram.scan_number = little_endian32(bytes + 14);
    telegram.telegram_number = little_endian16(bytes + 18);
    telegram.io.clear();
    telegram.words.clear();
    telegram.reflectors.clear();
    telegram.field = 0;
    telegram.more_fields = 0;
    const Blocks blocks{bytes + kHeaderBytes, (total - kHeaderBytes - kChecksumBytes) / 2};
    std::size_t word = blocks[0] == kIoBlock ? take_io(blocks, telegram) : 0;
    if (blocks.field_begins(word)) {
        word = take_field(blocks, word, telegram);
    }
    for (; blocks.field_begins(word); word = end_of_field(blocks, word)) {
        ++telegram.more_fields;
    }
    if (blocks.reflectors_begin(word)) {
        take_reflectors(blocks, word, telegram);
        word = blocks.words;
    }
    return word == blocks.words;
}

std::vector<std::uint8_t> encode(const S300Telegram& telegram) {
    check(telegram);
    const std::size_t uncounted = kUncountedBytes[static_cast<std::size_t>(telegram.size_rule)];
    std::vector<std::uint8_t> bytes;
    bytes.reserve(S300Decoder::kMostBytes);
    bytes.assign(8, 0);  // of which the last two become the size
    bytes.push_back(0xFF);
    bytes.push_back(telegram.address);
    put16(bytes, telegram.protocol);
    put16(bytes, telegram.status);
    put32(bytes, telegram.scan_number);
    put16(bytes, telegram.telegram_number);
    put_blocks(bytes, telegram);
    const std::size_t total = bytes.size() + kChecksumBytes;
    if (total < kLeastBytes || total > S300Decoder::kMostBytes) {
        throw Error(fmt::format("telegram of {} bytes: must have {} to {}", total, kLeastBytes,
                                S300Decoder::kMostBytes));
    }
    const std::size_t size = (total - uncounted) / 2;
    bytes[6] = static_cast<std::uint8_t>(size >> 8U);  // big endian, unlike all others
    bytes[7] = static_cast<std::uint8_t>(size & 0xFFU);
    put16(bytes, s300_checksum(bytes.data() + kUncheckedBytes, bytes.size() - kUncheckedBytes));
    return bytes;
}

}  // namespace hybrid_slam
