// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/link/link_client.hpp"
#include "navigation/pose_relay.hpp"
#include "navigation/process.hpp"

namespace hybrid_slam::test {

using Json = nlohmann::ordered_json;

/// A map that the program itself made of a world, and how it lies there.
struct LoopMap {
    std::filesystem::path program;
    std::filesystem::path world;
    std::filesystem::path folder;  ///< of the map
    Pose2d map_from_world;         ///< best fit of the drive that made it
};

/// Drives through the world with `simulate`, and maps with `map`, both with the lidar alone, in
/// folders in `folder`. Throws Error.
LoopMap make_loop_map(const std::filesystem::path& program, const std::filesystem::path& world,
                      const std::filesystem::path& folder);

struct LoopOptions {
    Pose2d world_from_start{0.0, 1.6, 0.0};
    int seed = 1;
    bool lockstep = false;
    bool camera = false;
    bool relay = false;              ///< a PoseRelay between `localize` and `drive`
    double duration = 0.0;           ///< s of the simulator's clock; 0: until end()
    std::vector<std::string> pull;   ///< of simulate --unplug
    std::vector<std::string> drive;  ///< more arguments of `drive`
};

enum class TripEnd { kArrived, kRefused, kGivenUp, kTimeout };

struct Trip {
    TripEnd end = TripEnd::kTimeout;
    std::string why;     ///< of what did not arrive
    LinkStatus status;   ///< the last one
    double longest = 0;  ///< m of way that the drive had planned
};

/// The truck and its sensors, SLAM and the drive, as processes in a folder, connected by nothing
/// but lines, frames and sockets. Begins without goals; all end with it.
class ClosedLoop {
  public:
    /// Throws Error with what a process said when it does not come up.
    ClosedLoop(const LoopMap& map, const LoopOptions& options);
    ~ClosedLoop();
    ClosedLoop(const ClosedLoop&) = delete;
    ClosedLoop& operator=(const ClosedLoop&) = delete;

    /// Places of the robot's origin, in the world. Throws Error when the drive is not there.
    void send_goals(const std::vector<Eigen::Vector2d>& world_places);
    /// Listens until the goals are reached or will not be, at most so many seconds.
    Trip wait_for_arrival(double seconds);
    /// Until it drives this fast, m/s; false when it does not within the time.
    bool wait_for_speed(double speed, double seconds);
    void listen(double seconds);

    /// `hybrid-slam goto` with these arguments, to its end; what it says is in text(`said`).
    int visit(const std::vector<std::string>& arguments);
    std::string place(const Eigen::Vector2d& world_place) const;  ///< as `goto` takes it
    std::string visit_said() const { return contents_of(folder() / "goto.txt"); }

    Process& simulate() { return *simulate_; }
    Process& localize() { return *localize_; }
    Process& drive() { return *drive_; }
    PoseRelay& relay() { return *relay_; }
    const LinkStatus& status() const { return status_; }

    /// Starts `localize` (anew).
    void start_localize();
    /// Ends all, in order, and waits; the logs are whole then. The worst exit code of simulate and
    /// drive.
    int end();
    /// Waits for the end of `duration`.
    int wait_for_end(double seconds);

    std::filesystem::path folder() const { return work_.path(); }
    Trajectory truth() const;      ///< world_from_robot
    Trajectory published() const;  ///< map_from_robot of each scan, while known
    std::vector<Json> events(const std::string& what = {}) const;  ///< the simulator's
    Json summary() const;                                          ///< the simulator's
    std::filesystem::path bus() const { return folder() / "sim/bus.log"; }

  private:
    void start_simulate();
    void start_drive();
    void take(const ServerMessage& message);

    LoopMap map_;
    LoopOptions options_;
    WorkFolder work_;
    Json endpoints_;
    std::string drive_at_;  ///< host:port
    std::string goals_id_;
    LinkStatus status_;
    std::string refusal_;
    double longest_ = 0.0;
    int localizers_ = 0;
    // Destroyed from the last to the first.
    std::unique_ptr<Process> simulate_;
    std::unique_ptr<Process> drive_;
    std::unique_ptr<PoseRelay> relay_;
    std::unique_ptr<Process> localize_;
    std::unique_ptr<LinkClient> client_;
};

}  // namespace hybrid_slam::test
