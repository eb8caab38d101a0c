// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/core/metrics.hpp"
#include "hybrid_slam/core/source.hpp"

namespace hybrid_slam {

/// One mapping session with what it cost.
struct Session {
    SlamMap map;
    std::size_t scans = 0;
    double cpu_seconds = 0.0;      ///< of this process, reading and refinement included
    double slowest_scan_ms = 0.0;  ///< wall clock, of Slam::process
    std::size_t not_aligned = 0;   ///< frames carried by the prior alone
};

/// The default configuration with "key=value" overrides. Throws Error for an unknown key.
SlamConfig slam_config(const std::vector<std::string>& overrides);

Session run_session(Source& source, const SlamConfig& config);

/// Peak resident memory of this process so far.
double peak_memory_mb();

/// How much memory comes into use from now on.
class MemoryGrowth {
  public:
    MemoryGrowth();
    double peak_mb() const;
    /// Of what is in use now, and the peak begins anew there.
    double held_mb();

  private:
    double before_mb_;
};

/// Accepted closures held against what is known better.
struct ClosureAudit {
    std::size_t accepted = 0;
    std::size_t wrong = 0;           ///< off by more than 0.5 m or 5 degrees
    std::size_t undecided = 0;       ///< what is known is not sure enough to tell
    double worst_translation = 0.0;  ///< metres, among the decided ones
    double worst_rotation = 0.0;     ///< radians
};

inline constexpr double kWrongTranslation = 0.5;        // metres
inline constexpr double kWrongRotation = 0.0872664626;  // radians, 5 degrees

/// Against our own odometry re-optimised together with the relations (and without any closure). A
/// closure is undecided where that solution leaves it uncertain by more than half of what counts as
/// wrong.
ClosureAudit audit_by_relations(const SlamMap& map, const std::vector<Relation>& relations);

/// Against true poses at the stamps of the keyframes.
ClosureAudit audit_by_truth(const SlamMap& map, const Trajectory& truth);

}  // namespace hybrid_slam
