// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "hybrid_slam/camera/mjpeg_server.hpp"
#include "hybrid_slam/can/drive_codec.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "hybrid_slam/simulator/truck_world.hpp"
#include "navigation.hpp"

namespace hybrid_slam {
namespace {

constexpr double kAsked = 0.030;   ///< seconds, at the 99th percentile
constexpr double kSettling = 5.0;  ///< seconds that do not count: the place is searched first
constexpr double kPoll = 0.0005;   ///< seconds

/// Left about the middle of the hall, two metres from it.
const Pose2d kStart(0.0, -1.75, 0.0);
const DriveCommand kCircle{0.25, 0.6};

/// Renders and publishes images when they are due, beside the telegrams.
class Camera {
  public:
    Camera(const World& world, const SimulatedDriveConfig& config)
        : renderer_(world, RobotConfig().camera, config), thread_([this] { run(); }) {}
    ~Camera() {
        stop_ = true;
        thread_.join();
    }
    std::string url() const { return server_.url(); }
    void push(CameraMoment moment) {
        const std::lock_guard<std::mutex> lock(mutex_);
        moment_ = std::move(moment);  // who is too slow misses some
    }
    std::uint64_t sent() const { return server_.counts().sent; }

  private:
    std::optional<CameraMoment> take() {
        const std::lock_guard<std::mutex> lock(mutex_);
        return std::exchange(moment_, std::nullopt);
    }
    void run() {
        while (!stop_) {
            if (const auto moment = take()) {
                server_.publish(renderer_.render(*moment));
            } else {
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        }
    }

    MomentRenderer renderer_;
    MjpegServer server_;
    std::mutex mutex_;
    std::optional<CameraMoment> moment_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// The truck on its circle, and when its telegrams were written.
class Circling {
  public:
    Circling(const test::LoopMap& map, const std::filesystem::path& folder)
        : config_(config_of(map)),
          truck_(read_world(map.world), RobotConfig(), config_, kStart),
          camera_(read_world(map.world), config_),
          line_(folder / "s300"),
          codec_(make_drive_codec(DriveLayout(), VehicleConfig())) {
        for (const CanFrame& frame : codec_->start()) {
            truck_.receive(frame);
        }
    }
    std::string port() const { return line_.path(); }
    std::string camera() const { return camera_.url(); }
    std::uint64_t images() const { return camera_.sent(); }
    const std::vector<double>& written() const { return written_; }

    /// Up to now; in real time from the first call on.
    void go_on() {
        const double now = steady_seconds();
        start_ = start_ < 0.0 ? now : start_;
        if (now >= next_command_) {
            next_command_ = now + 0.02;
            for (const CanFrame& frame : codec_->encode(kCircle, true)) {
                truck_.receive(frame);
            }
        }
        TruckWorld::Events events = truck_.advance(now - start_);
        for (CameraMoment& moment : events.images) {
            camera_.push(std::move(moment));
        }
        for (const LidarBytes& telegram : events.lidar) {
            line_.write(telegram.bytes);
            written_.push_back(steady_seconds());
        }
    }

  private:
    static SimulatedDriveConfig config_of(const test::LoopMap& map) {
        SimulatedDriveConfig config;
        read_drive_section(map.world, config);
        return config;
    }

    SimulatedDriveConfig config_;
    TruckWorld truck_;
    Camera camera_;
    PseudoTerminal line_;
    std::unique_ptr<DriveCodec> codec_;
    double start_ = -1.0;
    double next_command_ = 0.0;
    std::vector<double> written_;
};

/// A pose that came: when, and the stamp of its scan by SLAM's clock.
struct Came {
    double arrival = 0.0;
    double stamp = 0.0;
};

/// From the telegram's last byte to its pose. Stamps are as far apart as telegrams, so that the
/// promptest pose tells for all others which telegram was theirs.
std::vector<double> delays(const std::vector<Came>& poses, const std::vector<double>& written) {
    double prompt = std::numeric_limits<double>::infinity();
    for (const Came& pose : poses) {
        prompt = std::min(prompt, pose.arrival - pose.stamp);
    }
    std::vector<double> delays;
    for (const Came& pose : poses) {
        double best = std::numeric_limits<double>::infinity();
        double delay = best;
        for (const double time : written) {
            const double off = std::abs(time - pose.stamp - prompt);
            if (time <= pose.arrival && off < best) {
                best = off;
                delay = pose.arrival - time;
            }
        }
        delays.push_back(delay);
    }
    std::sort(delays.begin(), delays.end());
    return delays;
}

struct Heard {
    std::vector<Came> poses;
    int unknown = 0;
};

void hear(LinkServer& server, double counts_from, Heard& heard) {
    for (const LinkEvent& event : server.events(kPoll)) {
        const auto* const pose = std::get_if<LinkPose>(&event.what);
        if (pose != nullptr && event.arrival > counts_from) {
            heard.poses.push_back({event.arrival, pose->stamp});
            heard.unknown += pose->is_known() ? 0 : 1;
        }
    }
}

}  // namespace

int measure_latency(const NavigationOptions& options, const test::LoopMap& map, std::ostream& out) {
    const std::size_t wanted =
        options.runs > 0 ? 20U * static_cast<std::size_t>(options.runs) : 2000;
    const test::WorkFolder folder;
    LinkServerConfig config;
    config.listen = "127.0.0.1:0";
    LinkServer server(config);
    Circling circling(map, folder.path());
    test::Process localize(
        {map.program, "localize", map.folder, "--live", "--lidar", circling.port(), "--camera",
         circling.camera(), "--publish", "tcp://" + server.endpoint().text(), "--out", "run"},
        folder.path(), folder.path() / "said.txt");
    Heard heard;
    const double counts_from = steady_seconds() + kSettling;
    const double end = counts_from + 0.2 * static_cast<double>(wanted);
    while (heard.poses.size() < wanted && steady_seconds() < end) {
        if (!localize.running()) {
            throw Error("localize: " + localize.output());
        }
        circling.go_on();
        hear(server, counts_from, heard);
    }
    localize.send(SIGINT);
    localize.wait(30.0);
    const std::vector<double> sorted = delays(heard.poses, circling.written());
    if (sorted.empty()) {
        throw Error("localize: no pose came: " + localize.output());
    }
    const auto at = [&](double share) {
        return 1e3 *
               sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
    };
    out << fmt::format(
        "\nFrom a telegram's last byte to its pose on the wire, in real time with camera: median "
        "{:.1f} ms, p99 {:.1f} ms (asked {:.0f}), least {:.1f}, most {:.1f} ms; {} telegrams, {} "
        "poses not known, {} images\n",
        at(0.5), at(0.99), 1e3 * kAsked, at(0.0), at(1.0), sorted.size(), heard.unknown,
        circling.images());
    return at(0.99) > 1e3 * kAsked || sorted.size() < wanted ? 1 : 0;
}

}  // namespace hybrid_slam
