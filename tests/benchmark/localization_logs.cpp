// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <algorithm>
#include <limits>

#include "hybrid_slam/core/frame.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "hybrid_slam/odometry/scan_filter.hpp"
#include "localization.hpp"

namespace hybrid_slam {
namespace {

constexpr double kMapped = 1.0;     ///< metres from a mapped pose: its place must be found
constexpr double kSeen = 1.0;       ///< metres from what the map has seen to be free: beyond, not
constexpr double kQueryPath = 3.0;  ///< metres of the short drive that is tried beside one scan
constexpr double kQueryStep = 0.3;  ///< metres between its scans

std::vector<Frame> frames_of(const std::filesystem::path& log) {
    CarmenLog reader(log);
    FrameAssembler assembler;
    std::vector<Frame> frames;
    while (auto measurement = reader.next()) {
        if (auto frame = assembler.push(std::move(*measurement))) {
            frames.push_back(std::move(*frame));
        }
    }
    return frames;
}

SlamMap map_of(const std::vector<Frame>& frames, std::size_t count) {
    Slam slam(slam_config({}));
    for (std::size_t i = 0; i < count; ++i) {
        slam.process(frames[i]);
    }
    slam.refine();
    return slam.map();
}

/// A log of which one half is mapped; truth is the graph of the whole.
struct HalfMapped {
    std::vector<Frame> frames;
    SlamMap whole;
    SlamMap half;
    std::shared_ptr<const ReferenceMap> reference;

    std::size_t mapped() const { return half.trajectory.size(); }

    /// Scan of the first half whose true place is nearest.
    std::size_t nearest(std::size_t scan) const {
        std::size_t best = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < mapped(); ++i) {
            const double away = distance(i, scan);
            if (away < least) {
                least = away;
                best = i;
            }
        }
        return best;
    }
    double distance(std::size_t a, std::size_t b) const {
        return (whole.trajectory[a].pose.translation - whole.trajectory[b].pose.translation).norm();
    }
    Pose2d expected(std::size_t scan, std::size_t near) const {
        return half.trajectory[near].pose *
               between(whole.trajectory[near].pose, whole.trajectory[scan].pose);
    }

    /// Whether the scan was made where the map has seen something to be free, or close by.
    bool has_seen(std::size_t scan) const {
        const StateGrid& grid = reference->grid();
        const Cell middle = grid.geometry.cell_of(expected(scan, nearest(scan)).translation);
        const auto reach = static_cast<int>(kSeen / grid.geometry.resolution);
        for (int y = -reach; y <= reach; ++y) {
            for (int x = -reach; x <= reach; ++x) {
                if (x * x + y * y <= reach * reach &&
                    grid.at({middle.x + x, middle.y + y}) == CellState::kFree) {
                    return true;
                }
            }
        }
        return false;
    }

    Sweep sweep(std::size_t scan) const {
        const Scan& seen = frames[scan].scan;
        return {seen.robot_from_laser.translation, to_surface(seen, ScanFilterConfig())};
    }

    /// The scan alone, or with those of `path` metres before it, by odometry.
    Query query(std::size_t scan, double path) const {
        Query query{sweep(scan)};
        const Trajectory& odometry = whole.odometry_trajectory;
        double driven = 0.0;
        double last = 0.0;
        for (std::size_t i = scan; i-- > mapped() && driven < path;) {
            driven += (odometry[i].pose.translation - odometry[i + 1].pose.translation).norm();
            if (driven >= last + kQueryStep) {
                last = driven;
                query.push_back(
                    transform(between(odometry[scan].pose, odometry[i].pose), sweep(i)));
            }
        }
        return query;
    }
};

HalfMapped read_half_mapped(const std::filesystem::path& log) {
    HalfMapped read;
    read.frames = frames_of(log);
    read.whole = map_of(read.frames, read.frames.size());
    read.half = map_of(read.frames, read.frames.size() / 2);
    read.reference = reference_of(read.half);
    return read;
}

/// Every n-th, so that no more than `most` are left.
std::vector<std::size_t> thinned(const std::vector<std::size_t>& all, std::size_t most) {
    std::vector<std::size_t> some;
    const std::size_t stride = std::max<std::size_t>(1, (all.size() + most - 1) / most);
    for (std::size_t i = 0; i < all.size(); i += stride) {
        some.push_back(all[i]);
    }
    return some;
}

int measure_log(const std::string& name, const LocalizationOptions& options, std::ostream& out) {
    const HalfMapped log =
        read_half_mapped(options.shared / "data" / "slam2d" / (name + ".clf.gz"));
    const Relocalizer relocalizer(log.reference, RelocalizationConfig(), IcpConfig());
    std::vector<std::size_t> inside;
    std::vector<std::size_t> between;
    std::vector<std::size_t> outside;
    for (std::size_t scan = log.mapped(); scan < log.frames.size(); ++scan) {
        const bool near = log.distance(log.nearest(scan), scan) <= kMapped;
        (near ? inside : log.has_seen(scan) ? between : outside).push_back(scan);
    }
    const auto ask = [&](const std::vector<std::size_t>& scans, double path) {
        Tally tally;
        for (const std::size_t scan : thinned(scans, options.poses / 2)) {
            const Query query = log.query(scan, path);
            const Stopwatch clock;
            const Relocalization found = relocalizer.find(query);
            tally.take(found, log.expected(scan, log.nearest(scan)), clock.seconds());
        }
        return tally;
    };
    const Tally one = ask(inside, 0.0);
    const Tally drive = ask(inside, kQueryPath);
    const Tally afar = ask(between, 0.0);
    const Tally away = ask(outside, 0.0);
    fmt::print(out, "{}: one scan            {}\n", name, one.text());
    fmt::print(out, "{}: after {:g} m          {}\n", name, kQueryPath, drive.text());
    fmt::print(out, "{}: seen from afar      {}\n", name, afar.text());
    fmt::print(out, "{}: outside of the map  {}\n", name, away.text());
    const double share = 100.0 * static_cast<double>(one.right) /
                         static_cast<double>(std::max<std::size_t>(1, one.asked));
    const double refused = 100.0 * static_cast<double>(away.asked - away.right - away.wrong) /
                           static_cast<double>(std::max<std::size_t>(1, away.asked));
    const bool good = share >= 95.0 && one.wrong <= 1 && refused >= 98.0;
    fmt::print(out,
               "{}: found and right {:.1f} %, asked 95 %; wrong but sure {}, asked at most 1; "
               "outside refused {:.1f} %, asked 98 %   {}\n",
               name, share, one.wrong, refused, good ? "ok" : "MISS");
    return good ? 0 : 1;
}

}  // namespace

int measure_log_places(const LocalizationOptions& options, std::ostream& out) {
    fmt::print(
        out,
        "Real logs, map from the first half; later scans within {:g} m of a mapped pose, those "
        "farther away in what the map has seen from afar, and those more than {:g} m outside of "
        "that; truth: the graph of the whole log\n",
        kMapped, kSeen);
    int misses = 0;
    for (const char* name : {"intel", "fr079", "mit-csail"}) {
        misses += measure_log(name, options, out);
    }
    fmt::print(out, "\n");
    return misses;
}

}  // namespace hybrid_slam
