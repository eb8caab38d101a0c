// SPDX-License-Identifier: Apache-2.0
#include "measure.hpp"

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <string>

#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam::tools {

void StageTime::add(double seconds) {
    ++count;
    total += seconds;
    longest = std::max(longest, seconds);
}

double cpu_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double peak_memory_mb() {
    // getrusage counts what the parent used before it started us, too.
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        Tokens tokens(line);
        double kilobytes = 0.0;
        if (tokens.next() == "VmHWM:" && parse_double(tokens.next(), kilobytes)) {
            return kilobytes / 1024.0;
        }
    }
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void reset_peak_memory() {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << "5";  // proc(5): resets the peak
}

}  // namespace hybrid_slam::tools
