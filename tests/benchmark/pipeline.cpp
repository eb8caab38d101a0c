// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <ostream>
#include <thread>
#include <utility>

#include "benchmarks.hpp"
#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/metrics.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "hybrid_slam/live/live_sensors.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "hybrid_slam/vision/visual_source.hpp"

namespace hybrid_slam {
namespace {

constexpr double kSpeed = 0.3;  ///< m/s
constexpr int kSeed = 1;
constexpr double kAskedShare = 0.35;   ///< of one core
constexpr double kAskedDelay = 0.025;  ///< seconds, 99 % of the poses
constexpr double kHeadStart = 2.0;     ///< seconds, in which the devices are opened

void sleep_until(double due) {
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::max(0.0, due - steady_seconds())));
}

/// Of this process, all its threads.
double cpu_seconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// A drive made beforehand. Its times begin near 0.
struct PreparedDrive {
    std::vector<LidarBytes> telegrams;
    std::vector<double> image_arrivals;
    Trajectory truth;
    double end = 0.0;  ///< the last arrival, seconds
};

/// A file that goes when this does.
struct TemporaryFile {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / fmt::format("hybrid_slam_{}.avi", getpid());

    TemporaryFile() = default;
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    ~TemporaryFile() {
        std::error_code ignored;
        std::filesystem::remove(path, ignored);
    }
};

void append(cv::VideoWriter& video, const CameraFrame& frame) {
    std::optional<Image> image = decode_image(frame.image, ImageColor::kBgr);
    if (!image) {
        throw Error("pipeline: a simulated image that cannot be decoded");
    }
    video.write(cv::Mat(image->height, image->width, CV_8UC3, image->pixels.data()));
}

PreparedDrive prepare(const World& world, const RobotConfig& robot, double minutes,
                      const std::filesystem::path& file) {
    SimulatedDriveConfig config;
    config.speed = kSpeed;
    config.distance = 60.0 * minutes * kSpeed;
    config.seed = kSeed;
    SimulatedVehicle vehicle(world, "figure_eight", robot, config);
    const cv::Size size(robot.camera.model.width, robot.camera.model.height);
    cv::VideoWriter video(file.string(), cv::CAP_FFMPEG,
                          cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), robot.camera.rate, size);
    if (!video.isOpened()) {
        throw Error(file.string() + ": no video can be written");
    }
    PreparedDrive drive;
    while (auto event = vehicle.next()) {
        drive.end = arrival_of(*event);
        if (auto* bytes = std::get_if<LidarBytes>(&*event)) {
            drive.telegrams.push_back(std::move(*bytes));
        } else {
            append(video, std::get<CameraFrame>(*event));
            drive.image_arrivals.push_back(drive.end);
        }
    }
    drive.truth = vehicle.truth();
    return drive;
}

/// A process of its own that plays the scanner, so that its processor time is not counted here.
class ScannerProcess {
  public:
    ScannerProcess(PseudoTerminal& terminal, const PreparedDrive& drive, double begin) {
        child_ = fork();
        if (child_ < 0) {
            throw Error("pipeline: no process for the scanner");
        }
        if (child_ == 0) {
            prctl(PR_SET_PDEATHSIG, SIGKILL);
            for (const LidarBytes& bytes : drive.telegrams) {
                sleep_until(begin + bytes.arrival);
                terminal.write(bytes.bytes);
            }
            _exit(terminal.dropped() == 0 ? 0 : 1);
        }
    }
    ScannerProcess(const ScannerProcess&) = delete;
    ScannerProcess& operator=(const ScannerProcess&) = delete;
    ~ScannerProcess() {
        if (child_ > 0) {
            kill(child_, SIGKILL);
            waitpid(child_, nullptr, 0);
        }
    }

    /// Waits for its end; whether all bytes found room.
    bool finish() {
        int status = 0;
        waitpid(std::exchange(child_, -1), &status, 0);
        return WIFEXITED(status) && WEXITSTATUS(status) == 0;
    }

  private:
    pid_t child_ = -1;
};

/// The images of a video file at the times of the drive: at the file's own pace every image would
/// add to the lateness of all later ones.
class TimedVideo : public Capture {
  public:
    TimedVideo(CameraConfig config, const PreparedDrive& drive, double begin)
        : drive_(drive), begin_(begin) {
        constexpr double kAtOnce = 1e6;
        config.rate = kAtOnce;
        video_ = open_capture(config);
    }

    bool read(EncodedImage& image, double timeout) override {
        if (next_.empty() && !video_->read(next_, timeout)) {
            return false;
        }
        const double due = begin_ + drive_.image_arrivals.at(count_);
        const double until = steady_seconds() + timeout;
        sleep_until(std::min(due, until));
        if (due > until) {
            return false;
        }
        image = std::exchange(next_, {});
        ++count_;
        return true;
    }
    bool ended() const override { return next_.empty() && video_->ended(); }

  private:
    const PreparedDrive& drive_;
    double begin_;
    std::unique_ptr<Capture> video_;
    EncodedImage next_;
    std::size_t count_ = 0;
};

/// Passes the events on until the drive is over, and remembers when the newest bytes came.
class WatchedStream : public SensorStream {
  public:
    WatchedStream(LiveSensors& sensors, double end) : sensors_(sensors), end_(end) {}

    std::optional<SensorEvent> next() override {
        while (true) {
            auto event = sensors_.next_within(0.1);
            if (event) {
                if (const auto* bytes = std::get_if<LidarBytes>(&*event)) {
                    last_byte_ = bytes->arrival;
                }
                return event;
            }
            if (steady_seconds() > end_) {
                return std::nullopt;
            }
        }
    }
    double last_byte() const { return last_byte_; }  ///< seconds

  private:
    LiveSensors& sensors_;
    double end_;
    double last_byte_ = 0.0;
};

struct Findings {
    std::vector<double> delays;      ///< seconds from a scan's last byte to its pose
    std::vector<double> image_lags;  ///< seconds by which a scan is newer than the newest image
    std::size_t visual = 0;          ///< priors
    std::size_t failures = 0;        ///< of ICP
    double cpu = 0.0;                ///< seconds
    double wall = 0.0;               ///< seconds
    std::uint64_t images = 0;
    Trajectory trajectory;
};

void take(const SlamResult& result, Findings& findings) {
    if (result.visual_lag) {
        findings.image_lags.push_back(*result.visual_lag);
    }
    findings.visual += result.prior_used == PriorKind::kVisual ? 1 : 0;
    findings.failures += result.status == OdometryStatus::kPriorOnly ? 1 : 0;
}

Findings run(WatchedStream& stream, const RobotConfig& robot, double begin) {
    SensorSource sensors(stream, robot, SensorSource::Images::kGray);
    VisualOdometry odometry(robot.camera.model, robot.camera.mounting);
    VisualSource source(sensors, odometry);
    FrameAssembler assembler(0.0);
    Slam slam{SlamConfig()};
    Findings findings;
    double cpu = 0.0;
    double wall = 0.0;
    while (auto measurement = source.next()) {
        if (findings.delays.empty()) {  // what was made ready before the first scan is no load
            cpu = cpu_seconds();
            wall = steady_seconds();
        }
        const auto frame = assembler.push(std::move(*measurement));
        if (!frame) {
            continue;
        }
        const SlamResult result = slam.process(*frame);
        const double now = steady_seconds();
        findings.delays.push_back(now - stream.last_byte());
        take(result, findings);
        findings.cpu = cpu_seconds() - cpu;
        findings.wall = now - wall;
    }
    findings.images = source.counts().images;
    findings.trajectory = slam.map().trajectory;
    for (StampedPose& pose : findings.trajectory) {
        pose.stamp -= begin;
    }
    return findings;
}

/// The value that this share of them does not exceed.
double quantile(std::vector<double> values, double share) {
    if (values.empty()) {
        return std::nan("");
    }
    std::sort(values.begin(), values.end());
    const auto place = static_cast<std::size_t>(share * static_cast<double>(values.size()));
    return values[std::min(place, values.size() - 1)];
}

int report(const Findings& found, const PreparedDrive& drive, const LiveStatus& status,
           std::ostream& out) {
    const double share = found.cpu / found.wall;
    const double tail = quantile(found.delays, 0.99);
    const std::size_t lost =
        drive.telegrams.size() - std::min(drive.telegrams.size(), found.delays.size());
    const std::uint64_t lost_images = drive.image_arrivals.size() - found.images;
    const bool lean = share < kAskedShare;
    const bool prompt = tail < kAskedDelay;
    const bool whole = lost == 0;
    const auto verdict = [](bool good) { return good ? "ok" : "MISS"; };
    TruthOptions options;
    options.alignment = TruthAlignment::kFirstPose;
    const TruthError error = truth_error(found.trajectory, drive.truth, options);
    out << fmt::format("| processor, of one core | {:.1f} % | {:g} % | {} |\n", 100.0 * share,
                       100.0 * kAskedShare, verdict(lean));
    out << fmt::format("| last byte to pose, 99 % | {:.2f} ms | {:g} ms | {} |\n", 1e3 * tail,
                       1e3 * kAskedDelay, verdict(prompt));
    out << fmt::format("| last byte to pose, median, worst | {:.2f}, {:.2f} ms | | |\n",
                       1e3 * quantile(found.delays, 0.5), 1e3 * quantile(found.delays, 1.0));
    out << fmt::format("| scans sent, lost | {}, {} | 0 | {} |\n", drive.telegrams.size(), lost,
                       verdict(whole));
    out << fmt::format("| images shown, lost (of these dropped) | {}, {} ({}) | | |\n",
                       drive.image_arrivals.size(), lost_images, status.camera.dropped);
    out << fmt::format("| priors that were visual | {:.1f} % | | |\n",
                       100.0 * static_cast<double>(found.visual) /
                           static_cast<double>(std::max<std::size_t>(1, found.delays.size())));
    out << fmt::format(
        "| scans newer than the newest image by: median, 99 %, worst | {:.1f}, "
        "{:.1f}, {:.1f} ms | | |\n",
        1e3 * quantile(found.image_lags, 0.5), 1e3 * quantile(found.image_lags, 0.99),
        1e3 * quantile(found.image_lags, 1.0));
    out << fmt::format("| ICP failures | {} | | |\n", found.failures);
    out << fmt::format("| RMSE at the first true pose | {:.2f} cm, {:.3f} deg | | |\n\n",
                       100.0 * error.ate_rmse, degrees(error.heading_rmse));
    return (lean ? 0 : 1) + (prompt ? 0 : 1) + (whole ? 0 : 1);
}

}  // namespace

int run_pipeline_benchmark(const std::filesystem::path& worlds, double minutes, std::ostream& out) {
    const TemporaryFile file;
    RobotConfig robot;
    const PreparedDrive drive =
        prepare(read_world(worlds / "thesis_hall.yaml"), robot, minutes, file.path);
    out << fmt::format(
        "| full pipeline live, thesis hall, figure_eight, {:g} min at {:g} m/s, seed {}: S300 at "
        "12.5 Hz by pseudo-terminal, images at {:g} Hz by video file | measured | asked | verdict "
        "|\n|---|---|---|---|\n",
        minutes, kSpeed, kSeed, robot.camera.rate);
    out.flush();
    PseudoTerminal terminal;
    robot.lidar.port = terminal.path();
    robot.camera.device = file.path.string();
    const double begin = steady_seconds() + kHeadStart;
    ScannerProcess scanner(terminal, drive, begin);
    LiveOptions options;
    options.now = steady_seconds;
    options.open_camera = [&drive, begin](const CameraConfig& config) {
        return std::make_unique<TimedVideo>(config, drive, begin);
    };
    LiveSensors sensors(robot, options);
    WatchedStream stream(sensors, begin + drive.end + 1.0);
    const Findings found = run(stream, robot, begin);
    const LiveStatus status = sensors.status();
    sensors.stop();
    if (!scanner.finish()) {
        throw Error("pipeline: the pseudo-terminal had no room for all bytes");
    }
    return report(found, drive, status, out);
}

}  // namespace hybrid_slam
