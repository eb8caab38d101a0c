// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <tuple>
#include <vector>

#include "hybrid_slam/lidar/lidar_reader.hpp"

namespace {

using namespace hybrid_slam;  // NOLINT

struct Decoded {
    std::vector<S300Telegram> telegrams;
    S300StreamCounts counts;
};

/// In pieces whose lengths the fuzzer's first bytes give, over and over.
Decoded decode(const std::uint8_t* data, std::size_t size, std::size_t lengths) {
    S300Decoder decoder;
    Decoded decoded;
    S300Telegram telegram;
    std::size_t turn = 0;
    for (std::size_t at = 0; at < size;) {
        const std::size_t length = lengths == 0 ? size : 1 + data[turn++ % lengths];
        const std::size_t piece = std::min(length, size - at);
        decoder.push(data + at, piece);
        at += piece;
        while (decoder.next(telegram)) {
            decoded.telegrams.push_back(telegram);
        }
    }
    decoded.counts = decoder.counts();
    return decoded;
}

void require(bool condition) {
    if (!condition) {
        std::abort();
    }
}

void check_counts(const Decoded& decoded) {
    std::vector<bool> covered(decoded.counts.bytes);
    for (const S300Telegram& telegram : decoded.telegrams) {
        require(telegram.begin < telegram.end && telegram.end <= covered.size());
        std::fill(covered.begin() + static_cast<std::ptrdiff_t>(telegram.begin),
                  covered.begin() + static_cast<std::ptrdiff_t>(telegram.end), true);
    }
    const auto bytes = std::count(covered.begin(), covered.end(), true);
    require(decoded.counts.telegrams == decoded.telegrams.size());
    require(static_cast<std::uint64_t>(bytes) + decoded.counts.garbage_bytes <=
            decoded.counts.bytes);
}

void check_same(const Decoded& a, const Decoded& b) {
    const auto numbers = [](const S300StreamCounts& counts) {
        return std::make_tuple(counts.bytes, counts.telegrams, counts.candidates,
                               counts.garbage_bytes, counts.bad_checksums, counts.bad_contents,
                               counts.overlapping);
    };
    require(numbers(a.counts) == numbers(b.counts));
    for (std::size_t i = 0; i < a.telegrams.size(); ++i) {
        require(a.telegrams[i].begin == b.telegrams[i].begin &&
                a.telegrams[i].end == b.telegrams[i].end &&
                a.telegrams[i].words == b.telegrams[i].words);
    }
}

/// What was decoded says the same when it is encoded. (A reflector block of none is not.)
void check_encoding(const S300Telegram& telegram) {
    const bool empty = telegram.io.empty() && telegram.field == 0 && telegram.reflectors.empty();
    if (empty || telegram.more_fields != 0) {  // what encode leaves out
        return;
    }
    const std::vector<std::uint8_t> bytes = encode(telegram);
    const Decoded again = decode(bytes.data(), bytes.size(), 0);
    require(!again.telegrams.empty());  // it may hold another one, or be shorter by another rule
    for (const S300Telegram& other : again.telegrams) {
        const bool whole = other.begin == 0 && other.end == bytes.size();
        require(!whole || (other.scan_number == telegram.scan_number && other.io == telegram.io &&
                           other.words == telegram.words &&
                           other.reflectors.size() == telegram.reflectors.size()));
    }
}

void read_scans(const std::uint8_t* data, std::size_t size, LidarProtocol protocol) {
    LidarConfig config;
    config.protocol = protocol;
    config.blind_sectors_deg = {-20.0, 30.0};
    LidarReader reader(config);
    for (std::size_t at = 0; at < size;) {
        const std::size_t piece = std::min<std::size_t>(1 + data[at], size - at);
        // Arrivals that go back too.
        reader.push({1.8e9 + 0.01 * data[at], {data + at, data + at + piece}});
        at += piece;
        while (const auto scan = reader.next()) {
            require(!scan->ranges.empty() && scan->ranges.size() == scan->flags.size());
            require(scan->stamp > 1.7e9 && scan->stamp < 1.9e9);
        }
    }
    require(reader.counts().beams >= reader.counts().scans);
}

/// The bytes with right checksums behind whatever looks like a header, which a fuzzer hardly finds.
std::vector<std::uint8_t> mended(std::vector<std::uint8_t> bytes) {
    for (std::size_t at = 0; at + 26 <= bytes.size(); ++at) {
        std::uint8_t* const begin = &bytes[at];
        const std::size_t uncounted = begin[9] % 3 == 0 ? 4 : begin[9] % 3 == 1 ? 14 : 8;
        const std::size_t total = uncounted + 2 * (256U * begin[6] + begin[7]);
        if (begin[8] == 0xFF && begin[11] == 1 && total >= 26 && total <= bytes.size() - at) {
            const std::uint16_t checksum = s300_checksum(begin + 4, total - 6);
            begin[total - 2] = static_cast<std::uint8_t>(checksum & 0xFFU);
            begin[total - 1] = static_cast<std::uint8_t>(checksum >> 8U);
        }
    }
    return bytes;
}

void check(const std::uint8_t* data, std::size_t size) {
    const Decoded whole = decode(data, size, 0);
    check_counts(whole);
    check_same(whole, decode(data, size, std::min<std::size_t>(size, 8)));
    std::for_each(whole.telegrams.begin(), whole.telegrams.end(), check_encoding);
    read_scans(data, size, LidarProtocol::kS300);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    check(data, size);
    const std::vector<std::uint8_t> sound = mended({data, data + size});
    check(sound.data(), sound.size());
    read_scans(data, size, LidarProtocol::kThesisWords);
    return 0;
}
