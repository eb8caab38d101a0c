// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hybrid_slam/backend/likelihood_pyramid.hpp"

namespace hybrid_slam {

/// The poses that a search looks at: a box around a guess.
struct SearchWindow {
    Pose2d center;               ///< reference_from_query
    double half_width = 1.0;     ///< metres, in x and in y
    double half_angle = 0.3;     ///< radians; pi and more: all headings, each once
    double angle_step = 0.0175;  ///< radians
};

struct SearchLimits {
    double min_score = 0.5;           ///< poses below are not looked for
    double runner_up_ratio = 0.9;     ///< others below this share of the best are not looked for
    double runner_up_distance = 0.5;  ///< metres from each better place, or
    double runner_up_angle = 0.26;    ///< radians from it, to be another place
    std::size_t max_places = 2;       ///< the best and so many others less one
    std::size_t max_nodes = 200000;   ///< effort, in scored nodes
    double max_seconds = 0.0;         ///< likewise, when results need not repeat; 0: no limit
    /// Where the query's origin may be, if not everywhere: cells that are not 0. Must outlive the
    /// search, and have the resolution and the levels of the pyramid that is searched.
    const LikelihoodPyramid* allowed = nullptr;
};

struct SearchPlace {
    Pose2d reference_from_query;
    double score = 0.0;  ///< mean likelihood of the query's points, 0 to 1
};

struct SearchResult {
    bool found = false;               ///< a pose with at least min_score, and all is proven
    bool exhausted = false;           ///< stopped by a limit of effort: nothing is proven
    bool truncated = false;           ///< max_places were found, and there may be more
    std::vector<SearchPlace> places;  ///< the best first, then those elsewhere
    std::size_t nodes = 0;

    double runner_up_score() const { return places.size() < 2 ? 0.0 : places[1].score; }
};

/// The best pose of the window's grid by branch and bound (best first), and the best ones
/// elsewhere. Exactly what scoring every pose finds, at a fraction of the effort. Deterministic
/// without max_seconds.
SearchResult branch_and_bound(const LikelihoodPyramid& pyramid, const Points& query,
                              const SearchWindow& window, const SearchLimits& limits = {});

/// The score of one pose, as the search counts it.
double match_score(const LikelihoodPyramid& pyramid, const Points& query,
                   const Pose2d& reference_from_query);

}  // namespace hybrid_slam
