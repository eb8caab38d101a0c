// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "hybrid_slam/backend/slam.hpp"
#include "input.hpp"
#include "measure.hpp"
#include "progress.hpp"
#include "settings.hpp"
#include "vision_watch.hpp"

namespace hybrid_slam::tools {

struct SessionTimings {
    StageTime read;
    StageTime odometry;
    StageTime loop_closing;  ///< over all scans; most of them have none
    StageTime optimization;
    StageTime scan;       ///< the three above together, reading left out
    double refine = 0.0;  ///< seconds
    double total = 0.0;   ///< seconds, from the first measurement to the refined map
    double cpu = 0.0;     ///< seconds of processor time, likewise
};

/// An input run through the pipeline, with all that was learned about the run.
struct Session {
    std::string name;                   ///< of the input
    bool interrupted = false;           ///< before its end
    nlohmann::ordered_json input;       ///< its counts
    std::vector<std::string> warnings;  ///< what in it was not as it should be
    std::size_t scans = 0;
    double recorded = 0.0;  ///< seconds between the earliest and the latest stamp
    double path = 0.0;      ///< metres, along the trajectory of the map
    std::map<std::string, std::size_t> priors_used;  ///< by kind, of all scans but the first
    std::map<std::string, std::size_t> statuses;     ///< of the odometry
    std::size_t optimizations = 0;
    std::size_t most_search_nodes = 0;
    OptimizeSummary refinement;
    SlamMap map;
    Vision vision;      ///< without images when there were none or they were not asked for
    Trajectory wheels;  ///< wheel odometry at the scans that have it
    SessionTimings timings;

    std::size_t icp_failures() const;
    std::size_t with_prior(PriorKind kind) const;
    std::size_t closures_with(ClosureVerdict verdict) const;
    double scans_per_second() const;
    double real_time_factor() const;
};

/// Runs the input to its end or until a signal comes (see interrupt.hpp). Throws Error for one that
/// has no scan with a return in it.
Session run_session(Input& input, const std::string& name, const Settings& settings,
                    Progress& progress);

}  // namespace hybrid_slam::tools
