// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "hybrid_slam/localization/localizer.hpp"
#include "input.hpp"

namespace hybrid_slam::tools {

/// What is asked of a map: where was this seen?
struct PlaceQuery {
    Query query;           ///< the newest first; empty when a signal came before a scan
    Scan scan;             ///< the newest
    double path = 0.0;     ///< metres driven from the oldest to the newest
    bool complete = true;  ///< the drive was long enough for what was asked for
};

/// Of a single scan.
PlaceQuery query_of(const Scan& scan, const LocalizationConfig& config);

/// Throws Error, which begins with `name`, for a single scan that shows too little to be looked up.
void expect_enough(const PlaceQuery& query, const std::string& name);

struct QuerySpan {
    double at = 0.0;     ///< seconds after the first scan, where to begin
    double drive = 0.0;  ///< metres from there; 0: one scan
};

/// Of the first scan at or after the start that has enough returns and, when asked for, of those
/// driven from there, tied by odometry. Throws Error, which begins with `name`, when there is no
/// such scan.
PlaceQuery collect_query(Input& input, const std::string& name, const LocalizationConfig& config,
                         const QuerySpan& span);

}  // namespace hybrid_slam::tools
