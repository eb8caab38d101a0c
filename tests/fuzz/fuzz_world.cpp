// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/simulator/world.hpp"
#include "input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const hybrid_slam::fuzz::InputFile input(data, size);
    try {
        const hybrid_slam::World world = hybrid_slam::read_world(input.path());
        if (world.path.size() < 2 || world.laps < 1) {
            std::abort();
        }
    } catch (const hybrid_slam::Error&) {
        // The one way to refuse a file.
    }
    return 0;
}
