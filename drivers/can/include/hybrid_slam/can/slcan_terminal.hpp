// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hybrid_slam/can/slcan.hpp"

namespace hybrid_slam {

/// An SLCAN adapter that needs no hardware: whoever opens `path` as "slcan:<path>" exchanges frames
/// with this end. Destroying it pulls the adapter out.
class SlcanTerminal {
  public:
    /// Throws Error when the system has no pseudo-terminal left.
    SlcanTerminal();
    ~SlcanTerminal();
    SlcanTerminal(const SlcanTerminal&) = delete;
    SlcanTerminal& operator=(const SlcanTerminal&) = delete;

    const std::string& path() const { return path_; }
    /// Whether the host has opened the bus.
    bool is_open() const { return adapter_.is_open(); }

    /// Answers the host and gives the frames that it sent, waiting at most `timeout` seconds for
    /// the first bytes.
    std::vector<CanFrame> receive(double timeout);

    /// To the host; dropped when the bus is not open or the host does not read. Never waits.
    void send(const CanFrame& frame);

    /// Bytes as they are: for tests of the other end.
    void write(const std::string& bytes);

    std::uint64_t dropped() const { return dropped_; }  ///< frames and answers

  private:
    SlcanAdapter adapter_;
    std::string path_;
    int master_ = -1;
    std::uint64_t dropped_ = 0;
};

}  // namespace hybrid_slam
