// SPDX-License-Identifier: Apache-2.0
#include "interrupt.hpp"

#include <csignal>

namespace hybrid_slam::tools {
namespace {

// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables): all that a handler may touch
volatile std::sig_atomic_t signal_came = 0;

void on_signal(int number) {
    if (signal_came != 0) {
        std::signal(number, SIG_DFL);
        std::raise(number);
        return;
    }
    signal_came = 1;
}

}  // namespace

void catch_interrupts() {
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
