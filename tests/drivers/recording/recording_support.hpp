// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "hybrid_slam/recording/recording.hpp"

namespace hybrid_slam::test {

using Bytes = std::vector<std::uint8_t>;

/// Bytes that look like nothing, the same for the same number. Here and there is a mark of records,
/// which says nothing among them.
inline Bytes noise_bytes(std::uint64_t number, std::size_t count) {
    Bytes bytes(count);
    std::uint64_t state = number * 0x9E3779B97F4A7C15U + 1U;
    for (std::size_t i = 0; i < count; ++i) {
        state = state * 6364136223846793005U + 1442695040888963407U;
        bytes[i] = static_cast<std::uint8_t>(state >> 56U);
        const bool mark = i % 97 == 4;
        if (mark) {
            bytes[i - 3] = 0xD7;
            bytes[i - 2] = 'R';
            bytes[i - 1] = 'E';
            bytes[i] = 'C';
        }
    }
    return bytes;
}

/// What a lidar and a camera would say: pieces of telegrams every 20 ms, images 30 times a second.
inline LidarBytes lidar_event(std::uint64_t number) {
    return {1.7e9 + 0.02 * static_cast<double>(number),
            noise_bytes(number, 200 + number * 37 % 300)};
}
inline CameraFrame image_event(std::uint64_t number, std::size_t bytes = 30'000) {
    return {1.7e9 + static_cast<double>(number) / 30.0,
            noise_bytes(~number, bytes + number * 991 % 7000)};
}

inline bool same(const SensorEvent& a, const SensorEvent& b) {
    if (a.index() != b.index() || arrival_of(a) != arrival_of(b)) {
        return false;
    }
    const auto* lidar = std::get_if<LidarBytes>(&a);
    return lidar != nullptr ? lidar->bytes == std::get<LidarBytes>(b).bytes
                            : std::get<CameraFrame>(a).image == std::get<CameraFrame>(b).image;
}

inline std::vector<SensorEvent> read_all(SensorStream& stream) {
    std::vector<SensorEvent> events;
    while (std::optional<SensorEvent> event = stream.next()) {
        events.push_back(std::move(*event));
    }
    return events;
}

inline std::vector<Record> read_records(RecordFileReader& reader) {
    std::vector<Record> records;
    while (std::optional<Record> record = reader.next()) {
        records.push_back(std::move(*record));
    }
    return records;
}

inline Bytes file_bytes(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// A new file rather than the old one cut to nothing, for which some file systems wait for the
/// disk.
inline void write_bytes(const std::filesystem::path& file, const Bytes& bytes) {
    std::filesystem::remove(file);
    std::ofstream stream(file, std::ios::binary);
    const std::string text(bytes.begin(), bytes.end());
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
}

}  // namespace hybrid_slam::test
