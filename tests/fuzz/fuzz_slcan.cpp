// SPDX-License-Identifier: Apache-2.0
// Both texts of CAN frames: SLCAN from an adapter (and to one), and candump's log.
#include <fstream>

#include "hybrid_slam/can/candump.hpp"
#include "hybrid_slam/can/slcan.hpp"
#include "hybrid_slam/core/error.hpp"
#include "input_file.hpp"
#include "pieces.hpp"

namespace {

using namespace hybrid_slam;  // NOLINT
using fuzz::require;

bool same(const std::vector<SlcanLine>& a, const std::vector<SlcanLine>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const SlcanLine& left, const SlcanLine& right) {
                          return left.kind == right.kind && left.frame == right.frame &&
                                 left.milliseconds == right.milliseconds && left.text == right.text;
                      });
}

void check_slcan(std::string_view bytes) {
    SlcanParser parser;
    const std::vector<SlcanLine> whole = parser.push(bytes);
    SlcanParser piecewise;
    std::vector<SlcanLine> lines;
    fuzz::in_pieces(bytes, [&](std::string_view piece) {
        const std::vector<SlcanLine> more = piecewise.push(piece);
        lines.insert(lines.end(), more.begin(), more.end());
    });
    require(same(whole, lines) && parser.dropped() == piecewise.dropped());
    for (const SlcanLine& line : whole) {
        if (line.kind != SlcanLine::Kind::kFrame) {
            continue;
        }
        require(line.frame.valid());
        require(!line.milliseconds || (*line.milliseconds >= 0 && *line.milliseconds < 60000));
        SlcanParser again;
        const std::vector<SlcanLine> said = again.push(to_slcan(line.frame));
        require(said.size() == 1 && said.front().frame == line.frame);
    }
}

void check_adapter(std::string_view bytes) {
    SlcanAdapter adapter;
    const SlcanAdapter::Result whole = adapter.push(bytes);
    SlcanAdapter piecewise;
    SlcanAdapter::Result sum;
    fuzz::in_pieces(bytes, [&](std::string_view piece) {
        const SlcanAdapter::Result more = piecewise.push(piece);
        sum.frames.insert(sum.frames.end(), more.frames.begin(), more.frames.end());
        sum.answer += more.answer;
    });
    require(whole.frames == sum.frames && whole.answer == sum.answer);
    require(adapter.is_open() == piecewise.is_open());
    for (const CanFrame& frame : whole.frames) {
        require(frame.valid());
    }
}

void check_candump_line(std::string_view text) {
    CandumpLine line;
    try {
        line = parse_candump(text);
    } catch (const Error&) {
        return;
    }
    require(line.frame.valid());
    const CandumpLine again = parse_candump(to_candump(line));
    require(again.microseconds == line.microseconds && again.bus == line.bus &&
            again.frame == line.frame);
}

void check_candump(std::string_view bytes) {
    std::size_t lines = 0;
    for (std::string_view rest = bytes; !rest.empty(); ++lines) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        check_candump_line(rest.substr(0, end));
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    const fuzz::InputFile file(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    try {
        require(read_candump(file.path()).size() <= lines);
    } catch (const Error&) {
        return;
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string bytes(data, data + size);
    check_slcan(bytes);
    check_adapter(bytes);
    check_candump(bytes);
    return 0;
}
