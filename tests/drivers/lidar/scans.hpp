// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "hybrid_slam/lidar/lidar_reader.hpp"
#include "telegrams.hpp"

namespace hybrid_slam::test {

inline constexpr double kEpoch = 1.8e9;

inline std::vector<Scan> scans_of(LidarReader& reader, const Bytes& bytes,
                                  double arrival = kEpoch) {
    reader.push({arrival, bytes});
    std::vector<Scan> scans;
    while (auto scan = reader.next()) {
        scans.push_back(std::move(*scan));
    }
    return scans;
}

inline std::vector<std::uint16_t> level_words(std::size_t count, std::uint16_t word = 500) {
    return std::vector<std::uint16_t>(count, word);
}

}  // namespace hybrid_slam::test
