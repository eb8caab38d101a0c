// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/localization/scan_fit.hpp"
#include "hybrid_slam/registration/icp.hpp"

namespace hybrid_slam {

enum class RelocalizationMethod {
    /// The thesis, section 3.5.5: ICP from so many headings; the least error wins, and is called
    /// found whatever the map says of it.
    kHeadings,
    kSearch  ///< branch and bound over all poses, then ICP, then a comparison of the places
};
std::string_view to_string(RelocalizationMethod method);

struct RelocalizationConfig {
    RelocalizationMethod method = RelocalizationMethod::kSearch;
    int headings = 72;           ///< of kHeadings
    double heading_grid = 0.0;   ///< metres between its starts; 0: all at the middle of the map
    int max_nodes = 4000000;     ///< effort of one search
    double max_seconds = 0.0;    ///< likewise, for live vehicles only; 0: no limit, results repeat
    int max_places = 100;        ///< looked at closely
    double min_score = 0.35;     ///< of the search, for a place to be looked at
    double min_explained = 0.6;  ///< share of the beams, below which the vehicle is elsewhere
    double max_violated = 0.15;  ///< ScanFit::against, above which the vehicle is elsewhere
    /// A place is ambiguous with those whose score comes as near to its own as
    /// margin + doubt (1 - its score).
    double margin = 0.05;
    double doubt = 0.2;
    double apart = 0.5;                  ///< metres between two places that are really two, or
    double apart_angle = radians(15.0);  ///< radians
};

void describe(ConfigSchema& schema, RelocalizationConfig& config);

/// Whether the two are really two places.
bool are_apart(const Pose2d& a, const Pose2d& b, const RelocalizationConfig& config);

enum class PlaceVerdict {
    kFound,      ///< one place, and no other comes near it
    kAmbiguous,  ///< several places look alike: drive a little
    kNotInMap,   ///< no place explains what is seen
    /// The effort ran out, or more places look alike than were looked at: as good as ambiguous.
    kUnfinished
};
std::string_view to_string(PlaceVerdict verdict);

/// Where the robot may be.
struct Place {
    Pose2d map_from_robot;
    /// Of (x, y, heading) of map_from_robot in the axes of the map: m2, m rad, rad2.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    ScanFit fit;
    double search_score = 0.0;  ///< mean likelihood of the search, 0 to 1
    double share = 1.0;         ///< of the belief; a particle filter spreads it over the places
};

/// Answer of each way to find a place: search, headings and particle filter.
struct Relocalization {
    PlaceVerdict verdict = PlaceVerdict::kNotInMap;
    /// The best first. kFound: it alone counts, the second one is the runner-up that is really
    /// elsewhere, if any. kAmbiguous: all that are possible. kNotInMap: the nearest misses.
    std::vector<Place> places;
    std::size_t nodes = 0;   ///< effort of the method search
    bool of_filter = false;  ///< the particle filter's belief, between searches
};

/// Finds the robot in a map without any idea where it is. Deterministic unless max_seconds is set.
class Relocalizer {
  public:
    /// Throws Error that names the key for a value out of range.
    Relocalizer(std::shared_ptr<const ReferenceMap> map, const RelocalizationConfig& config,
                const IcpConfig& icp);

    /// kNotInMap for a query whose newest scan has no points: it is not known where that is.
    Relocalization find(const Query& query) const;

    /// ICP from a guess, and what the map says of the pose that it finds; the guess itself when ICP
    /// fails. The covariance is that of ICP with some hundred points of the query.
    Place settle(const Query& query, const Pose2d& guess) const;

    /// The verdict over places that were settled: also for those of a particle filter.
    Relocalization judge(std::vector<Place> places) const;

  private:
    std::vector<Place> search(const Query& query, Relocalization& result) const;
    std::vector<Place> headings(const Query& query) const;

    struct State;
    std::shared_ptr<const State> state_;
    RelocalizationConfig config_;
    IcpConfig icp_;        ///< from a place that the search has found
    IcpConfig whole_icp_;  ///< from anywhere, as the thesis does
};

}  // namespace hybrid_slam
