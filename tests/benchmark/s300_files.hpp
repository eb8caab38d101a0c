// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <string>
#include <vector>

#include "hybrid_slam/lidar/lidar_reader.hpp"

namespace hybrid_slam {

/// What the facts say of a given file.
struct GivenS300File {
    std::string name;
    std::size_t points;
    std::vector<std::uint32_t> numbers;  ///< of its intact telegrams
    bool standby = false;
    std::uint64_t bad_checksums = 0;

    std::size_t scans() const { return standby ? 0 : numbers.size(); }
};

/// What was read of one.
struct ReadS300File {
    std::vector<std::uint32_t> numbers;
    std::vector<Scan> scans;
    LidarCounts counts;
    std::size_t telegram_bytes = 0;
    std::size_t other_bytes = 0;
};

inline constexpr double kFirstArrival = 1.8e9;  ///< seconds
inline constexpr double kFactsStep = 0.040;     ///< seconds in a step of the scan number

/// Each telegram arrives when its scanner, that counts every 40 ms, has sent it.
inline ReadS300File read_s300_file(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(stream), {}};
    ReadS300File read;
    S300Decoder decoder;
    LidarReader reader(LidarConfig{});
    decoder.push(bytes.data(), bytes.size());
    S300Telegram telegram;
    read.other_bytes = bytes.size();
    std::uint64_t pushed = 0;
    while (decoder.next(telegram)) {
        read.numbers.push_back(telegram.scan_number);
        read.telegram_bytes = telegram.end - telegram.begin;
        read.other_bytes -= read.telegram_bytes;
        const auto at = [&](std::uint64_t offset) {
            return bytes.begin() + static_cast<std::ptrdiff_t>(offset);
        };
        const std::uint32_t steps = telegram.scan_number - read.numbers.front();
        reader.push({kFirstArrival + kFactsStep * steps, {at(pushed), at(telegram.end)}});
        pushed = telegram.end;
        while (std::optional<Scan> scan = reader.next()) {
            read.scans.push_back(std::move(*scan));
        }
    }
    read.counts = reader.counts();
    return read;
}

/// Seconds by which the stamps differ at most from arrival less 20 us for each byte and 40 ms.
inline double worst_stamp(const GivenS300File& given, const ReadS300File& read) {
    double worst = 0.0;
    for (std::size_t i = 0; i < std::min(read.scans.size(), given.scans()); ++i) {
        const double truth = kFirstArrival + kFactsStep * (given.numbers[i] - given.numbers[0]) -
                             2e-5 * static_cast<double>(read.telegram_bytes) - 0.040;
        worst = std::max(worst, std::abs(read.scans[i].stamp - truth));
    }
    return worst;
}

/// 541 points from 1 m on by 3 cm, or 5 from 1.5 m on by 1 cm, of which the last has measured
/// nothing; bits 13, 14 and 15 at points 10, 20 and 30, or 1, 2 and 3.
inline bool has_given_beams(const GivenS300File& given, const Scan& scan) {
    const bool full = given.points == 541;
    const std::size_t step = full ? 10 : 1;
    const bool warns = given.name.find("v0102") != std::string::npos;
    bool equal = scan.ranges.size() == given.points && scan.flags.size() == given.points;
    for (std::size_t i = 0; equal && i < given.points; ++i) {
        const double centimetres = static_cast<double>(full ? 100 + 3 * i : 150 + i);
        const int flags = i == step                ? int{kReflector}
                          : i == 2 * step          ? int{kProtectiveField}
                          : i == 3 * step && warns ? int{kWarningField}
                                                   : 0;
        equal = i + 1 == given.points ? !scan.is_return(scan.ranges[i])
                                      : std::abs(100.0 * scan.ranges[i] - centimetres) < 1e-3;
        equal = equal && int{scan.flags[i]} == flags;
    }
    return equal;
}

inline bool is_as_given(const GivenS300File& given, const ReadS300File& read) {
    const LidarCounts& counts = read.counts;
    const bool scans = read.scans.size() == given.scans() &&
                       std::all_of(read.scans.begin(), read.scans.end(),
                                   [&](const Scan& scan) { return has_given_beams(given, scan); });
    return scans && read.numbers == given.numbers &&
           counts.standby_scans == (given.standby ? 1U : 0U) &&
           counts.stream.bad_checksums == given.bad_checksums && counts.stream.bad_contents == 0 &&
           counts.stream.garbage_bytes == read.other_bytes;
}

/// Reads the files of `folder`, prints a table and returns how many are not as the facts say.
inline int check_given_s300_files(const std::filesystem::path& folder, std::ostream& out) {
    constexpr double kAskedStamp = 1e-5;  // s; a fit to two arrivals allows for some jitter
    if (!std::filesystem::is_directory(folder)) {
        out << fmt::format("the given files are not at {}: left out\n\n", folder.string());
        return 0;
    }
    const std::vector<GivenS300File> files{
        {"short5_v0102.bin", 5, {0x12345}},
        {"short5_v0103.bin", 5, {0x12345}},
        {"full541_v0102.bin", 541, {0x12345}},
        {"full541_v0103.bin", 541, {0x12345}},
        {"io_full541_v0102.bin", 541, {0x12345}},
        {"io_full541_v0103.bin", 541, {0x12345}},
        {"slave08_full541_v0103.bin", 541, {0x12345}},
        {"standby_full541_v0103.bin", 541, {0x12345}, true},
        {"stream_garbage_good_corrupt_good.bin", 541, {100, 104}, false, 1}};
    int misses = 0;
    out << "| given file | scans (asked) | scan numbers | beams | stand-by | bad checksums (asked) "
           "| "
           "stamps off by, us | verdict |\n|---|---|---|---|---|---|---|---|\n";
    for (const GivenS300File& given : files) {
        const ReadS300File read = read_s300_file(folder / given.name);
        const double stamp = worst_stamp(given, read);
        const bool ok = is_as_given(given, read) && stamp <= kAskedStamp;
        misses += ok ? 0 : 1;
        out << fmt::format("| {} | {} ({}) | {} | {} | {} | {} ({}) | {:.2f} | {} |\n", given.name,
                           read.scans.size(), given.scans(), fmt::join(read.numbers, ", "),
                           read.counts.beams, read.counts.standby_scans,
                           read.counts.stream.bad_checksums, given.bad_checksums, 1e6 * stamp,
                           ok ? "ok" : "MISS");
    }
    out << '\n';
    return misses;
}

}  // namespace hybrid_slam
