// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/localization/localizer.hpp"
#include "input.hpp"
#include "localization_log.hpp"
#include "localization_monitor.hpp"
#include "measure.hpp"
#include "place_pictures.hpp"
#include "vision_watch.hpp"

namespace hybrid_slam::tools {

/// A drive through a map, with all that was learned about it.
// NOLINTNEXTLINE(bugprone-exception-escape): moving JSON checks itself, and throws nothing
struct LocalizationRun {
    std::string name;                   ///< of the drive
    bool interrupted = false;           ///< before its end
    nlohmann::ordered_json input;       ///< its counts
    std::vector<std::string> warnings;  ///< what in it was not as it should be
    std::size_t scans = 0;
    double recorded = 0.0;              ///< seconds between the earliest and the latest scan
    double path = 0.0;                  ///< metres driven while the place was known
    std::optional<double> found_after;  ///< seconds from the first scan to the first known pose
    std::map<std::string, std::size_t> statuses;
    std::map<std::string, std::size_t> priors_used;  ///< of all scans but the first
    std::map<PlaceVerdict, std::size_t> searches;    ///< by verdict
    std::size_t most_nodes = 0;                      ///< of a search
    std::size_t trusted = 0;                         ///< scans with a pose to be sure of
    double score_sum = 0.0;                          ///< over these
    double unmapped_sum = 0.0;                       ///< over these
    double misfit_sum = 0.0;                         ///< over these, metres
    std::vector<Jump> jumps;
    Trajectory trajectory;      ///< at scans, while the place is known (see pose_trust.hpp)
    std::vector<WayPoint> way;  ///< the same for a picture, and where it was lost
    Trajectory camera_poses;    ///< between them
    Vision vision;
    StageTime read;
    StageTime scan;
    double total = 0.0;  ///< seconds
    double cpu = 0.0;    ///< seconds of processor time

    std::size_t with(LocalizationStatus status) const;
    double share_of(LocalizationStatus status) const;
    double mean_of(double sum) const;  ///< over the trusted scans
    /// Of a drive that was never found: what most of its searches say, ambiguous or not in the map;
    /// unfinished when there was none.
    PlaceVerdict why_not_found() const;
};

/// Who wants to know what a localization says while it goes on, or has a say in it.
class LocalizationListener {
  public:
    LocalizationListener() = default;
    LocalizationListener(const LocalizationListener&) = delete;
    LocalizationListener& operator=(const LocalizationListener&) = delete;
    virtual ~LocalizationListener() = default;

    /// Before each scan.
    virtual void before(Localizer& localizer) = 0;
    /// After it; `known`: the pose can be believed (see pose_trust.hpp).
    virtual void after(const Frame& frame, const LocalizationResult& result, bool known) = 0;
};

/// Runs the input through the localizer to its end or until a signal comes (see interrupt.hpp).
/// Throws Error for one that ends without a scan with a return in it, and when the disk is full.
/// `listener` may be nullptr.
LocalizationRun run_localization(Input& input, Localizer& localizer, LocalizationLog& log,
                                 LocalizationMonitor& monitor,
                                 LocalizationListener* listener = nullptr);

}  // namespace hybrid_slam::tools
