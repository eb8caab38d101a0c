// SPDX-License-Identifier: Apache-2.0
// Alone in its file: asm/termbits.h, which has rates such as 125000 and 250000 that <termios.h>
// lacks, cannot be included together with it.
#include "serial_line.hpp"

#include <asm/termbits.h>
#include <linux/serial.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cmath>
#include <system_error>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

/// A UART samples the tenth bit of a byte half a bit late at 5 %; both ends share that.
constexpr double kMostRateError = 0.025;

/// USB adapters hold bytes back for up to 16 ms unless told that delay matters. Not all can.
void ask_for_low_latency(int descriptor) {
    serial_struct serial{};
    if (ioctl(descriptor, TIOCGSERIAL, &serial) == 0) {
        serial.flags |= static_cast<int>(ASYNC_LOW_LATENCY);
        ioctl(descriptor, TIOCSSERIAL, &serial);
    }
}

}  // namespace

void set_up_serial_line(int descriptor, int baud, const std::string& name) {
    termios2 mode{};
    if (ioctl(descriptor, TCGETS2, &mode) != 0) {
        throw Error(name + ": not a serial port");
    }
    mode.c_iflag = IGNBRK;
    mode.c_oflag = 0;
    mode.c_lflag = 0;
    mode.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
    mode.c_ispeed = static_cast<speed_t>(baud);
    mode.c_ospeed = static_cast<speed_t>(baud);
    mode.c_cc[VMIN] = 1;
    mode.c_cc[VTIME] = 0;
    if (ioctl(descriptor, TCSETS2, &mode) != 0) {
        throw Error(name + ": " + std::to_string(baud) +
                    " baud refused: " + std::generic_category().message(errno));
    }
    // A driver that cannot do a rate takes another one and says so only here.
    if (ioctl(descriptor, TCGETS2, &mode) == 0 &&
        std::abs(static_cast<double>(mode.c_ospeed) - baud) > kMostRateError * baud) {
        throw Error(name + ": cannot do " + std::to_string(baud) + " baud (it offers " +
                    std::to_string(mode.c_ospeed) + ")");
    }
    ask_for_low_latency(descriptor);
    ioctl(descriptor, TCFLSH, TCIOFLUSH);
}

}  // namespace hybrid_slam
