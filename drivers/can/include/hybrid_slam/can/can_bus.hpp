// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "hybrid_slam/can/can_frame.hpp"
#include "hybrid_slam/core/config.hpp"

namespace hybrid_slam {

/// How the bus is reached.
struct CanConfig {
    /// can0 (SocketCAN), slcan:/dev/ttyACM0 (a serial adapter) or candump:FILE (a log of what would
    /// be sent; hears nothing).
    std::string port = "can0";
    int bit_rate = 250000;  ///< of the bus, bits per second; SocketCAN has its own from `ip link`
    int baud = 115200;      ///< of the serial line; USB adapters that are no UART ignore it
    /// The adapter never answers commands, so that its silence says nothing.
    bool slcan_silent = false;
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, CanConfig& config);

struct CanCounts {
    std::uint64_t sent = 0;
    std::uint64_t received = 0;
    std::uint64_t dropped = 0;  ///< frames that could not be sent, or were not fetched in time
    std::uint64_t errors = 0;   ///< lines without sense, refusals, error frames
};

/// For one thread. Only opening throws: a bus that breaks later has a fault, and stays so; it has
/// to be opened anew.
class CanBus {
  public:
    CanBus() = default;
    CanBus(const CanBus&) = delete;
    CanBus& operator=(const CanBus&) = delete;
    virtual ~CanBus() = default;

    /// Never waits: false when the bus did not take the frame, which is then forgotten, not sent
    /// late.
    virtual bool send(const CanFrame& frame) = 0;

    /// The next frame, waiting at most `timeout` seconds for it; returns at once when the bus has a
    /// fault.
    virtual std::optional<CanFrame> receive(double timeout) = 0;

    /// Whether anything can ever be received.
    virtual bool hears() const { return true; }

    const CanCounts& counts() const { return counts_; }
    /// One line with the port's name; empty while the bus works.
    const std::string& fault() const { return fault_; }

  protected:
    CanCounts counts_;
    std::string fault_;
};

/// Opens what `config.port` names. Throws Error with the port's name, the reason and, where there
/// is one, what to do. Takes up to two seconds while an SLCAN adapter does not answer.
std::unique_ptr<CanBus> open_can_bus(const CanConfig& config);

}  // namespace hybrid_slam
