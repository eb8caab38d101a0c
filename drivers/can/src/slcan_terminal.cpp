// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/slcan_terminal.hpp"

#include <unistd.h>

#include "deadline.hpp"

namespace hybrid_slam {

SlcanTerminal::SlcanTerminal(const std::filesystem::path& link) : line_(link) {}

std::vector<CanFrame> SlcanTerminal::receive(double timeout) {
    const Deadline deadline(timeout);
    // While nobody has it open, polling tells of the hang-up at once.
    while (deadline.wait_for(line_.descriptor())) {
        const std::string bytes = line_.read();
        if (!bytes.empty()) {
            SlcanAdapter::Result result = adapter_.push(bytes);
            write(result.answer);
            return std::move(result.frames);
        }
        if (deadline.passed()) {
            break;
        }
        constexpr double kMostSleep = 0.005;  // seconds
        usleep(static_cast<useconds_t>(std::min(kMostSleep, deadline.left()) * 1e6));
    }
    return {};
}

bool SlcanTerminal::send(const CanFrame& frame) {
    if (is_open()) {
        return write(to_slcan(frame));
    }
    ++dropped_;
    return false;
}

bool SlcanTerminal::write(const std::string& bytes) {
    const bool written = bytes.empty() || line_.write(bytes) == bytes.size();
    dropped_ += written ? 0 : 1;
    return written;
}

}  // namespace hybrid_slam
