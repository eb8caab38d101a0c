// SPDX-License-Identifier: Apache-2.0
#include "thesis_words.hpp"

#include <algorithm>
#include <array>

#include "s300_layout.hpp"

namespace hybrid_slam {
namespace {

constexpr std::array<std::uint8_t, 8> kHeader{0, 0, 0, 0, 0xBB, 0xBB, 0x11, 0x11};
constexpr std::size_t kWords = 541;
constexpr std::size_t kTotal = kHeader.size() + 2 * kWords;

}  // namespace

void ThesisWordsDecoder::push(const std::uint8_t* bytes, std::size_t count) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(read_));
    begin_ += read_;
    read_ = 0;
    buffer_.insert(buffer_.end(), bytes, bytes + count);
    counts_.bytes += count;
}

/// The place of the first header that lies within; `to` when there is none.
std::size_t ThesisWordsDecoder::find_header(std::size_t from, std::size_t to) const {
    const auto begin = buffer_.begin();
    const auto found =
        std::search(begin + static_cast<std::ptrdiff_t>(from),
                    begin + static_cast<std::ptrdiff_t>(to), kHeader.begin(), kHeader.end());
    return static_cast<std::size_t>(found - begin);
}

void ThesisWordsDecoder::skip_to(std::size_t place) {
    counts_.garbage_bytes += place - read_;
    read_ = place;
}

bool ThesisWordsDecoder::next(S300Telegram& telegram) {
    for (;;) {
        const std::size_t size = buffer_.size();
        const std::size_t begin = find_header(read_, size);
        if (begin == size) {
            skip_to(std::max(read_ + kHeader.size() - 1, size) - (kHeader.size() - 1));
            return false;
        }
        skip_to(begin);
        const std::size_t end = begin + kTotal;
        const std::size_t known = std::min(end, size);
        const std::size_t intruder = find_header(begin + 1, known);
        if (intruder < known) {
            skip_to(intruder);
            ++counts_.bad_contents;
            continue;
        }
        if (size < end) {
            return false;
        }
        telegram = {};
        telegram.begin = begin_ + begin;
        telegram.end = begin_ + end;
        telegram.field = 1;
        telegram.scan_number = static_cast<std::uint32_t>(counts_.telegrams);
        telegram.words.resize(kWords);
        for (std::size_t i = 0; i < kWords; ++i) {
            telegram.words[i] = little_endian16(&buffer_[begin + kHeader.size() + 2 * i]);
        }
        read_ = end;
        ++counts_.telegrams;
        return true;
    }
}

}  // namespace hybrid_slam
