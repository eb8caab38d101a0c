// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hybrid_slam {

/// Sets an open terminal to raw bytes, 8 data bits, no parity, one stop bit, no flow control and
/// any baud rate, and drops what it had
/// received or not sent. Throws Error with `name`, when the device is no
/// serial port or cannot do the rate.
void set_up_serial_line(int descriptor, int baud, const std::string& name);

}  // namespace hybrid_slam
