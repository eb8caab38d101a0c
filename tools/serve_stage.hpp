// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "hybrid_slam/simulator/truck_world.hpp"
#include "serve_devices.hpp"
#include "serve_log.hpp"
#include "serve_options.hpp"

namespace hybrid_slam::tools {

/// What is simulated, as the options say.
struct ServeScene {
    explicit ServeScene(const ServeOptions& options);

    SimulatedDriveConfig config;
    RobotConfig robot;
    World world;
    Pose2d world_from_start;
};

struct ServeCounts {
    std::uint64_t images = 0;             ///< sent
    std::uint64_t images_dropped = 0;     ///< that rendering was too slow for
    std::uint64_t telegrams = 0;          ///< written in whole
    std::uint64_t telegrams_unheard = 0;  ///< nobody had the line open
    std::uint64_t telegrams_dropped = 0;  ///< somebody had, but did not read
    std::uint64_t frames_received = 0;    ///< by the truck
    std::uint64_t frames_sent = 0;        ///< by the truck, to a host who listens
    std::uint64_t contacts = 0;
};

/// The truck in its world, its lines and its files: what a run in real time and one in lockstep
/// have in common. For one thread, but for ServeDevices::publish.
class ServeStage {
  public:
    ServeStage(const ServeScene& scene, const ServeOptions& options);

    /// Time begins. `epoch` as of ServeLog.
    void start(std::int64_t epoch);

    /// Pulls and plugs what is due, moves on and tells the bus. The scans and images are the
    /// caller's to deliver.
    TruckWorld::Events advance(double now);

    /// What the host has said, after `timeout` seconds at most.
    std::vector<CanFrame> heard(double timeout);
    /// The truck gets these frames now.
    void obey(const std::vector<CanFrame>& frames);

    /// False when nobody has heard it.
    bool say(const LidarBytes& telegram);

    /// Now and then, and at the end.
    void save();
    /// `ended_by` says why, for summary.json.
    void finish(const std::string& ended_by);
    nlohmann::ordered_json summary() const;

    ServeDevices& devices() { return devices_; }
    ServeCounts& counts() { return counts_; }
    double now() const { return truck_.now(); }
    void event(const std::string& what, const nlohmann::ordered_json& details);

  private:
    void change_plugs(double now);
    void tell(const std::vector<CanFrame>& frames);
    void note_changes(const std::vector<TruckContact>& contacts);
    nlohmann::ordered_json where() const;

    std::filesystem::path folder_;
    int seed_;
    ServeDevices devices_;
    ServeLog log_;
    std::string world_name_;
    std::string ended_by_;
    UnplugSchedule unplugs_;
    TruckWorld truck_;
    ServeCounts counts_;
    bool bus_open_ = false;
    bool driven_ = false;
    bool moves_ = false;
};

}  // namespace hybrid_slam::tools
