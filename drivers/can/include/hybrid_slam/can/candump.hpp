// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid_slam/can/can_frame.hpp"

namespace hybrid_slam {

/// A line of a log as `candump -L` of can-utils writes it:
/// (1700000000.000000) can0 203#03F4010A0A18FC00
struct CandumpLine {
    std::int64_t microseconds = 0;  ///< since 1970, UTC
    std::string bus = "can0";       ///< without blanks
    CanFrame frame;
};

/// Without a line end. Throws Error for a frame that is not valid, a bus that is no word and a time
/// before 1970.
std::string to_candump(const CandumpLine& line);

/// Throws Error that says what is wrong; CAN FD (`##`) and error frames are refused by name. The
/// direction (R or T) that newer tools put behind the frame is passed over.
CandumpLine parse_candump(std::string_view line);

/// All lines of a log, empty ones passed over. Throws Error "file:line: ...".
std::vector<CandumpLine> read_candump(const std::filesystem::path& file);

}  // namespace hybrid_slam
