// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace hybrid_slam {

/// The device's end of a serial line that needs no hardware: whoever opens `path` as a serial port
/// reads what is written here, and the other way round. Like a scanner it talks whether anybody
/// listens or not, and never waits. Destroying it pulls the cable.
class PseudoTerminal {
  public:
    /// With `link`, a symbolic link of that name points to the terminal for as long as it lives; a
    /// link that is there already is replaced. Throws Error when that name is taken by something
    /// else or cannot be made, and when the system has no terminal left.
    explicit PseudoTerminal(std::filesystem::path link = {});
    ~PseudoTerminal();
    PseudoTerminal(const PseudoTerminal&) = delete;
    PseudoTerminal& operator=(const PseudoTerminal&) = delete;

    /// What to open: the link, or without one the terminal itself.
    std::string path() const { return link_.empty() ? device_ : link_.string(); }

    /// Whether somebody has it open.
    bool has_reader() const;

    /// Bytes are dropped when nobody has it open, and from where the reader's buffer is full.
    void write(const std::vector<std::uint8_t>& bytes);
    /// The same; how many were not dropped.
    std::size_t write(std::string_view bytes);

    /// What the other end wrote; empty when that is nothing so far.
    std::string read() const;

    /// To be polled: readable when `read` has something, or nobody has it open.
    int descriptor() const { return master_; }

    std::uint64_t dropped() const { return dropped_; }  ///< bytes

  private:
    void open();
    void make_link() const;
    void forget_leftovers();

    std::filesystem::path link_;
    std::string device_;
    int master_ = -1;
    bool had_reader_ = false;  // since leftovers were forgotten
    std::uint64_t dropped_ = 0;
};

}  // namespace hybrid_slam
