// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hybrid_slam/core/occupancy_grid.hpp"

namespace hybrid_slam {

/// How likely a beam ends in each cell, blurred around reference points, and for every level L its
/// maximum over the 2^L x 2^L cells up and right of a cell: an upper bound for a whole block of
/// translations (Olson 2009; Hess et al. 2016).
class LikelihoodPyramid {
  public:
    /// `sigma` (metres) is the width of the Gaussian blur. Throws Error when there are no points or
    /// the area is absurdly large.
    LikelihoodPyramid(const Points& reference, double resolution, double sigma, int levels);

    int levels() const { return static_cast<int>(grids_.size()); }
    const GridGeometry& geometry() const { return geometry_; }

    /// 0 to 255; 0 outside of the grid.
    std::uint8_t at(int level, int x, int y) const {
        if (x < 0 || y < 0 || x >= geometry_.width || y >= geometry_.height) {
            return 0;
        }
        return grids_[static_cast<std::size_t>(level)]
                     [static_cast<std::size_t>(y) * static_cast<std::size_t>(geometry_.width) +
                      static_cast<std::size_t>(x)];
    }

  private:
    GridGeometry geometry_;
    std::vector<std::vector<std::uint8_t>> grids_;
};

/// The poses that a search looks at: a box around a guess.
struct SearchWindow {
    Pose2d center;               ///< reference_from_query
    double half_width = 1.0;     ///< metres, in x and in y
    double half_angle = 0.3;     ///< radians
    double angle_step = 0.0175;  ///< radians
};

struct SearchLimits {
    double min_score = 0.5;        ///< poses below are not looked for
    double runner_up_ratio = 0.9;  ///< runner-ups below this share of the best are not looked for
    double runner_up_distance = 0.5;  ///< metres from the best, or
    double runner_up_angle = 0.26;    ///< radians from the best, to be another place
    std::size_t max_nodes = 200000;   ///< effort, in scored nodes
};

struct SearchResult {
    bool found = false;      ///< a pose with at least min_score, and proven to be the best
    bool exhausted = false;  ///< stopped by max_nodes: nothing is proven
    Pose2d reference_from_query;
    double score = 0.0;            ///< mean likelihood of the query's points, 0 to 1
    double runner_up_score = 0.0;  ///< of the best pose elsewhere; 0 when none reaches the ratio
    Pose2d runner_up;
    std::size_t nodes = 0;
};

/// The best pose of the window's grid by branch and bound (best first), and the best one elsewhere.
/// Exactly what full_search finds, at a fraction of the effort. Deterministic.
SearchResult branch_and_bound(const LikelihoodPyramid& pyramid, const Points& query,
                              const SearchWindow& window, const SearchLimits& limits = {});

/// The score of one pose, as the search counts it.
double match_score(const LikelihoodPyramid& pyramid, const Points& query,
                   const Pose2d& reference_from_query);

}  // namespace hybrid_slam
