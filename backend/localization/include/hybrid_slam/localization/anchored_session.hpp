// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/localization/relocalization.hpp"

namespace hybrid_slam {

struct AnchoringConfig {
    int max_searches = 12;               ///< along the drive
    double query_path = 5.0;             ///< metres of the drive that a search sees
    double query_spacing = 0.5;          ///< metres, or
    double query_angle = radians(30.0);  ///< radians between its scans
    double min_explained = 0.4;  ///< of what the map can judge in a scan; less contradicts the map
    double max_violated = 0.15;  ///< likewise; more contradicts
    double max_unknown = 0.6;    ///< share of a scan; more is outside of the map
    double translation_floor = 0.01;       ///< metres, sigma of an anchor
    double rotation_floor = radians(0.1);  ///< radians
    double kernel_scale = 2.0;             ///< sigmas, Cauchy, of anchors and closures
    double max_chi2 = 25.0;                ///< anchors that end up beyond are thrown out
    double min_agreement = 0.5;            ///< share of the scans inside of the map that fit it
};

void describe(ConfigSchema& schema, AnchoringConfig& config);

enum class AnchorVerdict {
    kAccepted,
    kOutside,       ///< too little of the scan lies where the map knows anything
    kContradicted,  ///< the map does not explain the scan
    kDisagreeing    ///< it fits, but the rest of the session puts it elsewhere: thrown out
};
std::string_view to_string(AnchorVerdict verdict);

/// What the map says of one keyframe of the session.
struct Anchor {
    AnchorVerdict verdict = AnchorVerdict::kOutside;
    Pose2d map_from_robot;  ///< by the map alone; by the session where ICP found none
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< in the axes of the robot
    ScanFit fit;
    double chi2 = 0.0;  ///< against the solution
};

/// A place that was looked for, at the newest scan of a piece of the drive.
struct SessionPlace {
    std::size_t keyframe = 0;
    Relocalization found;
    bool agrees = false;  ///< with the places that were believed
};

enum class AnchoringVerdict {
    kAnchored,
    kAmbiguous,     ///< several places of the map look alike, all along the drive
    kNotInMap,      ///< no piece of the drive is found in the map
    kContradictory  ///< the places found, or the scans there, do not tell one story
};
std::string_view to_string(AnchoringVerdict verdict);

struct Anchoring {
    AnchoringVerdict verdict = AnchoringVerdict::kNotInMap;
    std::vector<SessionPlace> searches;
    std::vector<Anchor> anchors;  ///< of each keyframe; empty when no place was believed
    std::vector<Pose2d> nodes;    ///< map_from_robot of each keyframe; empty unless anchored
    std::size_t count(AnchorVerdict of) const;
};

/// Ties a finished session to a stored map: places found along the drive that agree, then a robust
/// map-anchored constraint for each keyframe whose scan fits the map, and the session's own graph
/// in between and beyond the map's border. Deterministic.
class SessionAnchorer {
  public:
    /// Throws Error that names the key for a value out of range.
    SessionAnchorer(std::shared_ptr<const ReferenceMap> map, const AnchoringConfig& config,
                    const RelocalizationConfig& relocalization, const IcpConfig& icp);

    Anchoring anchor(const SlamMap& session) const;

  private:
    void find_places(const SlamMap& session, Anchoring& result) const;
    SessionPlace search(const SlamMap& session, double from_path) const;
    Anchor look(const Keyframe& keyframe, const Pose2d& expected, int pass) const;
    void settle(PoseGraph& graph, const Keyframes& keyframes, Anchoring& result) const;
    void solve(PoseGraph& graph, const std::vector<Anchor>& anchors) const;

    std::shared_ptr<const ReferenceMap> map_;
    AnchoringConfig config_;
    Relocalizer relocalizer_;
    IcpConfig icp_;
};

/// Both sessions in one map. The keyframes of the stored one come first and stay where they are;
/// anchors become closures from the nearest of them; odometry is told in the frame of the map.
struct MergedMap {
    SlamMap map;
    std::size_t gone_points = 0;  ///< of the stored map that the session saw through: left out
};
/// `session` as it was anchored.
MergedMap merge(const StoredMap& stored, const SlamMap& session, const Anchoring& anchoring);

}  // namespace hybrid_slam
