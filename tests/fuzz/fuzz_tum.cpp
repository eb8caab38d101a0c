// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const hybrid_slam::fuzz::InputFile input(data, size);
    try {
        if (hybrid_slam::read_tum(input.path()).empty()) {
            std::abort();  // a file without poses is an Error
        }
    } catch (const hybrid_slam::Error&) {
        // The one way to refuse a file.
    }
    return 0;
}
