// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hybrid_slam/can/can_frame.hpp"

namespace hybrid_slam {

/// `digits` of the lowest bits of `value`, upper case.
std::string to_hex(std::uint32_t value, std::size_t digits);

/// One to eight digits of either case and nothing else.
std::optional<std::uint32_t> parse_hex(std::string_view digits);

std::string data_to_hex(const CanFrame& frame);

/// Fills size and data; false when `digits` are no pairs, or more than eight.
bool parse_data(std::string_view digits, CanFrame& frame);

}  // namespace hybrid_slam
