// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

/// The path of a real recording beside the project; skips the calling test when it is absent.
#define HYBRID_SLAM_SHARED_OR_SKIP(variable, relative)                                 \
    const std::filesystem::path variable =                                             \
        std::filesystem::path(HYBRID_SLAM_SHARED_DIR) / (relative);                    \
    if (!std::filesystem::exists(variable)) {                                          \
        GTEST_SKIP() << "needs the recording " << (relative) << ", which is not here"; \
    }                                                                                  \
    static_assert(true)
