// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "measure.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {

struct SessionTimings {
    StageTime read;
    StageTime odometry;
    StageTime loop_closing;  ///< over all scans; most of them have none
    StageTime optimization;
    StageTime scan;       ///< the three above together, reading left out
    double refine = 0.0;  ///< seconds
    double total = 0.0;   ///< seconds, from opening the log to the refined map
    double cpu = 0.0;     ///< seconds of processor time, likewise
};

/// A log run through the pipeline, with all that was learned about the run.
struct Session {
    std::filesystem::path log;
    bool interrupted = false;  ///< before the end of the log
    CarmenLogCounts input;
    std::size_t scans = 0;
    double recorded = 0.0;  ///< seconds between the earliest and the latest stamp
    double path = 0.0;      ///< metres, along the trajectory of the map
    std::map<std::string, std::size_t> priors_used;  ///< by kind, of all scans but the first
    std::map<std::string, std::size_t> statuses;     ///< of the odometry
    std::size_t optimizations = 0;
    std::size_t most_search_nodes = 0;
    OptimizeSummary refinement;
    SlamMap map;
    Trajectory wheels;  ///< wheel odometry at the scans that have it
    SessionTimings timings;

    std::size_t icp_failures() const;
    std::size_t closures_with(ClosureVerdict verdict) const;
    double scans_per_second() const;
    double real_time_factor() const;
};

/// Runs the log to its end or until a signal comes (see interrupt.hpp). Throws Error for a log that
/// cannot be read or has no scan with a return in it.
Session run_session(const std::filesystem::path& log, const Settings& settings, bool quiet,
                    const std::string& label);

/// What in the log was not as it should be: "kind: count" each.
std::vector<std::string> warnings_of(const CarmenLogCounts& counts);

}  // namespace hybrid_slam::tools
