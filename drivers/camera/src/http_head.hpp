// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace hybrid_slam {

inline constexpr std::size_t kMostHttpHead = 16 * 1024;  // bytes

std::string lowered(std::string_view text);

/// Without the blanks around it.
std::string_view trimmed(std::string_view text);

/// At most `most`, else empty.
std::optional<std::size_t> parse_count(std::string_view text, unsigned base, std::size_t most);

/// Behind the empty line that ends a head; 0 when there is none yet.
std::size_t end_of_head(std::string_view text);

/// The head of an answer, or of a part of one: its first line as it is and the fields by their
/// names in small letters; of two of a name the last. Lines may end in LF alone, as some cameras'
/// do.
struct HttpHead {
    explicit HttpHead(std::string_view text);

    /// Empty when there is none.
    const std::string& operator[](const std::string& name) const;

    std::string first;
    std::map<std::string, std::string> fields;
};

}  // namespace hybrid_slam
