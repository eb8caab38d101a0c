// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hybrid_slam/can/slcan.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"

namespace hybrid_slam {

/// An SLCAN adapter that needs no hardware: whoever opens `path` as "slcan:<path>" exchanges frames
/// with this end. Destroying it pulls the adapter out.
class SlcanTerminal {
  public:
    /// With `link`, a symbolic link of that name points to the terminal for as long as it lives, as
    /// PseudoTerminal's does. Throws Error when that name is taken by something else or cannot be
    /// made, and when the system has no terminal left.
    explicit SlcanTerminal(const std::filesystem::path& link = {});

    /// What to open: the link, or without one the terminal itself.
    std::string path() const { return line_.path(); }
    /// Whether the host has opened the bus.
    bool is_open() const { return adapter_.is_open(); }

    /// Answers the host and gives the frames that it sent, waiting at most `timeout` seconds for
    /// the first bytes.
    std::vector<CanFrame> receive(double timeout);

    /// To the host; false, and dropped, when the bus is not open or the host does not read. Never
    /// waits.
    bool send(const CanFrame& frame);

    /// Bytes as they are: for tests of the other end. False when they were dropped.
    bool write(const std::string& bytes);

    std::uint64_t dropped() const { return dropped_; }  ///< frames and answers

  private:
    PseudoTerminal line_;
    SlcanAdapter adapter_;
    std::uint64_t dropped_ = 0;
};

}  // namespace hybrid_slam
