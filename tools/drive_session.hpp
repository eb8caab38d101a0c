// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "drive_log.hpp"
#include "drive_settings.hpp"
#include "fleet_port.hpp"
#include "hybrid_slam/lockstep/lockstep_client.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "recorder.hpp"
#include "route_finder.hpp"
#include "truck_port.hpp"

namespace hybrid_slam::tools {

/// What `drive` works with.
struct DriveSetup {
    std::shared_ptr<const ReferenceMap> map;
    std::string map_name;
    RobotConfig robot;
    DriveSettings settings;
    std::filesystem::path out;  ///< empty: nothing is written
    std::string clock;          ///< of a simulator in lockstep; empty: real time
    bool quiet = false;
};

/// The vehicle's end of it all: listens, decides, drives, tells, until a signal comes. Throws Error
/// when it cannot begin: an address or a bus that is not to be had.
class DriveSession {
  public:
    explicit DriveSession(DriveSetup setup);

    /// Returns what drive's summary.json holds.
    nlohmann::ordered_json run();

  private:
    void run_in_real_time();
    void run_in_lockstep();
    /// One cycle: `events` are those that came since the one before.
    void cycle(double now, double seconds, std::vector<LinkEvent> events);
    void say(double now, const std::string& text);
    void take_note(const std::vector<LinkEvent>& events, double now);
    void tell(const PilotOutput& output, double now);
    void show(const LinkStatus& status, double now);
    std::vector<LinkEvent> events_for(const LockstepTick& tick);

    DriveSetup setup_;
    std::string identity_;
    DriveLog log_;
    StatusLine line_;
    LinkServer server_;
    Pilot pilot_;
    RouteFinder routes_;
    FleetPort fleet_;
    std::unique_ptr<TruckPort> truck_;
    double may_say_ = 20.0;   ///< messages about clients
    double said_at_ = 0.0;    ///< seconds
    std::size_t unsaid_ = 0;  ///< messages
    LinkStatus told_;
    bool told_any_ = false;
    double next_status_ = 0.0;  ///< seconds
    double next_draw_ = 0.0;    ///< seconds
    double lockstep_now_ = 0.0;
    bool had_goals_ = false;  ///< in lockstep
};

}  // namespace hybrid_slam::tools
