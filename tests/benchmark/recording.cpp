// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include "../drivers/recording/crashes.hpp"
#include "benchmarks.hpp"
#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam {

namespace {

namespace fs = std::filesystem;

constexpr int kKills = 50;
constexpr std::uint64_t kTail = std::uint64_t{1} << 20U;
constexpr std::size_t kImageBytes = 100'000;
constexpr std::uint64_t kImages = 5000;

/// Gone at its end.
struct Folder {
    fs::path path = fs::temp_directory_path() /
                    ("hybrid_slam_benchmark_recording_" + std::to_string(::getpid()));

    Folder() { fs::create_directories(path); }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
};

const char* verdict(bool ok) {
    return ok ? "ok" : "MISS";
}

int kill_part(const fs::path& folder, std::ostream& out) {
    const test::KillOutcome outcome = test::kill_recorders(folder, kKills);
    const bool ok = outcome.opened == outcome.kills && outcome.missing == 0 && outcome.wrong == 0;
    fmt::print(out,
               "  killed (SIGKILL)    {} times, half of them syncing every second: {} open; {} "
               "events synced, {} read back, {} missing "
               "that were synced, {} wrong   asked all open, 0 missing   {}\n",
               outcome.kills, outcome.opened, outcome.synced, outcome.read, outcome.missing,
               outcome.wrong, verdict(ok));
    return ok ? 0 : 1;
}

int tail_line(const std::string& name, const test::CutOutcome& outcome, double seconds,
              std::ostream& out) {
    const bool ok = outcome.opened == outcome.tried && outcome.lost == 0 && outcome.wrong == 0;
    fmt::print(out,
               "  {:<18}  {} places: {} open, {} records before it lost, {} wrong ({:.0f} s)   "
               "asked all open, 0 lost   {}\n",
               name, outcome.tried, outcome.opened, outcome.lost, outcome.wrong, seconds,
               verdict(ok));
    return ok ? 0 : 1;
}

/// The last megabyte of a finished recording, cut and zeroed.
int tail_part(const fs::path& folder, const std::string& device, std::ostream& out) {
    const fs::path file = folder / "drive" / (device + ".rec");
    fs::copy_file(file, folder / "copy.rec", fs::copy_options::overwrite_existing);
    const Stopwatch cutting;
    const test::CutOutcome cut = test::cut_byte_by_byte(file, kTail);
    int misses = tail_line(device + " cut", cut, cutting.seconds(), out);
    const Stopwatch zeroing;
    const test::CutOutcome zeroed = test::zero_the_tail(folder / "copy.rec", kTail, 61);
    misses += tail_line(device + " zeroed", zeroed, zeroing.seconds(), out);
    return misses;
}

double write_large(const fs::path& folder) {
    RecordingOptions options;
    options.origin = "simulated";
    RecordingWriter writer(folder, RobotConfig(), options);
    const SensorEvent chunk = test::lidar_event(0);
    const SensorEvent image = test::image_event(0, kImageBytes);
    const Stopwatch clock;
    for (std::uint64_t i = 0; i < kImages; ++i) {
        writer.push(chunk);
        writer.push(image);
    }
    writer.close();
    return clock.seconds();
}

void speed_part(const fs::path& folder, std::ostream& out) {
    const double write_seconds = write_large(folder / "large");
    const Stopwatch reading;
    RecordingReader reader(folder / "large");
    double bytes = 0.0;
    while (const std::optional<SensorEvent> event = reader.next()) {
        const auto* chunk = std::get_if<LidarBytes>(&*event);
        bytes += static_cast<double>(chunk != nullptr ? chunk->bytes.size()
                                                      : std::get<CameraFrame>(*event).image.size());
    }
    fmt::print(out,
               "  speed               {:.0f} MB written at {:.0f} MB/s (synced at the end), read "
               "at {:.0f} MB/s (from memory)\n\n",
               1e-6 * bytes, 1e-6 * bytes / write_seconds, 1e-6 * bytes / reading.seconds());
}

}  // namespace

int run_recording_benchmark(std::ostream& out) {
    fmt::print(out, "Recordings after crashes\n");
    const Folder folder;
    int misses = kill_part(folder.path, out);
    test::record_drive(folder.path / "drive", 6000, 80);
    misses += tail_part(folder.path, "lidar", out);
    misses += tail_part(folder.path, "camera", out);
    speed_part(folder.path, out);
    return misses;
}

}  // namespace hybrid_slam
