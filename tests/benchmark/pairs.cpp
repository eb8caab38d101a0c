// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "benchmarks.hpp"
#include "hybrid_slam/core/frame.hpp"
#include "hybrid_slam/core/metrics.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "hybrid_slam/odometry/scan_filter.hpp"
#include "hybrid_slam/registration/icp.hpp"

namespace hybrid_slam {

namespace {

// What counts, as in the published side by side: relations up to 1.5 m and 60 degrees apart,
// without those whose odometry is off by more than a metre; OK is within 10 cm and 2 degrees.
constexpr double kMaxDistance = 1.5;
constexpr double kMaxAngle = radians(60.0);
constexpr double kMaxOdometryError = 1.0;
constexpr double kOkTranslation = 0.1;
constexpr double kOkRotation = radians(2.0);

struct ScanPair {
    const Frame* from;
    const Frame* to;
    Pose2d truth;
    Pose2d odometry;
};

std::vector<Frame> read_frames(const std::filesystem::path& log) {
    std::vector<Frame> frames;
    CarmenLog source(log);
    FrameAssembler assembler;
    while (auto measurement = source.next()) {
        if (auto frame = assembler.push(std::move(*measurement))) {
            frames.push_back(std::move(*frame));
        }
    }
    return frames;
}

std::vector<ScanPair> find_pairs(const std::vector<Frame>& frames,
                                 const std::vector<Relation>& relations) {
    std::map<double, const Frame*> by_stamp;
    for (const Frame& frame : frames) {
        by_stamp.emplace(frame.scan.stamp, &frame);
    }
    const auto at = [&](double stamp) -> const Frame* {
        const auto next = by_stamp.lower_bound(stamp);
        const Frame* best = nullptr;
        double distance = 0.001;
        for (auto it = next == by_stamp.begin() ? next : std::prev(next);
             it != by_stamp.end() && it->first < stamp + 0.001; ++it) {
            if (std::abs(it->first - stamp) <= distance) {
                distance = std::abs(it->first - stamp);
                best = it->second;
            }
        }
        return best;
    };
    std::vector<ScanPair> pairs;
    for (const Relation& relation : relations) {
        const Frame* from = at(relation.from_stamp);
        const Frame* to = at(relation.to_stamp);
        const Pose2d& truth = relation.from_from_to;
        if (from == nullptr || to == nullptr || truth.translation.norm() > kMaxDistance ||
            std::abs(truth.heading) > kMaxAngle) {
            continue;
        }
        const Pose2d odometry = between(*from->odom_from_robot, *to->odom_from_robot);
        if ((odometry.translation - truth.translation).norm() <= kMaxOdometryError) {
            pairs.push_back({from, to, truth, odometry});
        }
    }
    return pairs;
}

double quantile(std::vector<double> values, double share) {
    const auto at = values.begin() +
                    static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

struct PairsScore {
    double ok_percent = 0.0;
    double median_translation = 0.0;
    double median_rotation = 0.0;
    double mean_ms = 0.0;
    double p99_ms = 0.0;
};

PairsScore align_all(const std::vector<ScanPair>& pairs, bool with_odometry) {
    const ScanFilterConfig filter;
    const IcpConfig icp;
    std::vector<double> translations;
    std::vector<double> rotations;
    std::vector<double> milliseconds;
    double total = 0.0;
    double ok = 0.0;
    for (const ScanPair& pair : pairs) {
        const Stopwatch clock;
        const Reference reference(to_surface(pair.from->scan, filter));
        const IcpGuess guess{with_odometry ? pair.odometry : Pose2d()};
        const IcpResult result = align(to_surface(pair.to->scan, filter), reference, guess, icp);
        const double elapsed_ms = 1e3 * clock.seconds();
        const Pose2d error = between(pair.truth, result.reference_from_points);
        translations.push_back(error.translation.norm());
        rotations.push_back(std::abs(error.heading));
        milliseconds.push_back(elapsed_ms);
        total += elapsed_ms;
        ok += translations.back() < kOkTranslation && rotations.back() < kOkRotation ? 1.0 : 0.0;
    }
    const auto count = static_cast<double>(pairs.size());
    return {100.0 * ok / count, quantile(translations, 0.5), quantile(rotations, 0.5),
            total / count, quantile(milliseconds, 0.99)};
}

constexpr double kAny = 1e9;  // nothing asked

struct AskedOfPairs {
    double ok_percent;
    double median_translation;
    double mean_ms;
};

int report(const char* log, const char* start, const PairsScore& score,
           const std::optional<AskedOfPairs>& asked, std::ostream& out) {
    const bool ok = !asked || (score.ok_percent >= asked->ok_percent &&
                               score.median_translation <= asked->median_translation &&
                               score.mean_ms <= asked->mean_ms);
    fmt::print(
        out, "{:<10} {:<9} OK {:6.2f} %   median {:.4f} m {:.3f} deg   mean {:.3f} ms (p99 {:.2f})",
        log, start, score.ok_percent, score.median_translation, degrees(score.median_rotation),
        score.mean_ms, score.p99_ms);
    if (asked) {
        fmt::print(out, "   asked {:.1f} %", asked->ok_percent);
        if (asked->mean_ms < kAny) {
            fmt::print(out, ", {:.3f} m, {:.2f} ms", asked->median_translation, asked->mean_ms);
        }
        fmt::print(out, "   {}", ok ? "ok" : "MISS");
    }
    fmt::print(out, "\n");
    return ok ? 0 : 1;
}

}  // namespace

int run_pairs_benchmark(const std::filesystem::path& shared_data, std::ostream& out) {
    fmt::print(out, "Aligning one pair of scans, trees and normals included\n");
    int misses = 0;
    for (const char* log : {"intel", "fr079"}) {
        const auto folder = shared_data / "data" / "slam2d";
        const std::vector<Frame> frames = read_frames(folder / (std::string(log) + ".clf.gz"));
        const auto pairs =
            find_pairs(frames, read_relations(folder / (std::string(log) + ".relations")));
        const bool is_intel = std::string(log) == "intel";
        const auto asked = [&](const AskedOfPairs& figures) {
            return is_intel ? std::optional<AskedOfPairs>(figures) : std::nullopt;
        };
        misses += report(log, "odometry", align_all(pairs, true), asked({99.5, 0.011, 0.35}), out);
        misses += report(log, "identity", align_all(pairs, false), asked({88.0, kAny, kAny}), out);
    }
    fmt::print(out, "\n");
    return misses;
}

}  // namespace hybrid_slam
