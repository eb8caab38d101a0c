// SPDX-License-Identifier: Apache-2.0
#include "interrupt.hpp"

#include <csignal>
#include <ctime>

namespace hybrid_slam::tools {
namespace {

// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables): all that a handler may touch
volatile std::sig_atomic_t signal_came = 0;
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t came_at = 0;
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t seconds_to_end = 0;

void on_signal(int number) {
    const auto now = static_cast<std::sig_atomic_t>(std::time(nullptr));
    if (signal_came == 0) {
        came_at = now;
        signal_came = 1;
    } else if (number != SIGHUP && now - came_at >= seconds_to_end) {
        std::signal(number, SIG_DFL);
        std::raise(number);
    }
}

}  // namespace

void catch_interrupts(int grace) {
    seconds_to_end = grace;
    // Who reads our messages may go away; that is no reason to die in the middle of a write.
    std::signal(SIGPIPE, SIG_IGN);
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    // Of a terminal that was closed or a line that broke; who started us by nohup wants none of it.
    struct sigaction before {};
    sigaction(SIGHUP, nullptr, &before);
    if (before.sa_handler != SIG_IGN) {
        sigaction(SIGHUP, &action, nullptr);
    }
}

bool interrupted() {
    return signal_came != 0;
}

}  // namespace hybrid_slam::tools
