// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid_slam/can/can_frame.hpp"

namespace hybrid_slam {

/// SLCAN, the text that USB adapters speak on a serial line (Lawicel's): lines that end with a
/// carriage return, or with a bell for a refusal.
struct SlcanLine {
    enum class Kind {
        kFrame,    ///< `frame`, either way
        kDone,     ///< the adapter's yes: an empty line, z or Z
        kRefused,  ///< the adapter's no: a bell
        kText      ///< `text`: a command (S5, O, C, V) or the answer to one (V1013)
    };
    Kind kind = Kind::kDone;
    CanFrame frame;
    std::optional<int> milliseconds;  ///< the adapter's time stamp, 0 to 59999
    std::string text;
};

/// With its carriage return. Throws Error for a frame that is not valid.
std::string to_slcan(const CanFrame& frame);

/// The letter and digit of the command for a bit rate: S5 for 250000. Throws Error when SLCAN has
/// none for it.
std::string slcan_bit_rate(int bit_rate);

/// Takes the bytes of one direction as they come. What makes no sense is counted and skipped up to
/// the next line end.
class SlcanParser {
  public:
    /// The lines that end within `bytes`.
    std::vector<SlcanLine> push(std::string_view bytes);

    std::uint64_t dropped() const { return dropped_; }  ///< lines

  private:
    void end_line(std::vector<SlcanLine>& lines);

    std::string line_;
    bool too_long_ = false;
    std::uint64_t dropped_ = 0;
};

/// The adapter's end without any wire, for a simulator: bytes of the host in, its frames out, and
/// answers to put on the line.
class SlcanAdapter {
  public:
    struct Result {
        std::vector<CanFrame> frames;  ///< for the bus
        std::string answer;            ///< for the host
    };
    Result push(std::string_view bytes);

    bool is_open() const { return open_; }
    std::uint64_t dropped() const { return parser_.dropped(); }

  private:
    void push_line(std::string_view bytes, Result& result);
    std::string answer_to(const std::string& command);

    SlcanParser parser_;
    bool open_ = false;
};

}  // namespace hybrid_slam
