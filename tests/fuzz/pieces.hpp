// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdlib>
#include <string_view>

namespace hybrid_slam::fuzz {

inline void require(bool condition) {
    if (!condition) {
        std::abort();
    }
}

/// Hands out `bytes` in pieces whose lengths the bytes themselves give.
template <typename Take>
void in_pieces(std::string_view bytes, Take&& take) {
    while (!bytes.empty()) {
        const std::size_t length = 1 + static_cast<unsigned char>(bytes.front()) % 23U;
        const std::size_t piece = std::min(length, bytes.size());
        take(bytes.substr(0, piece));
        bytes.remove_prefix(piece);
    }
}

}  // namespace hybrid_slam::fuzz
