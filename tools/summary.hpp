// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "session.hpp"

namespace hybrid_slam::tools {

/// Seconds of what is done once, after the session.
struct OutputTimings {
    double write_map = 0.0;
    double draw_pictures = 0.0;
};

/// What a run has learned; everything that differs between two runs on the same input is inside of
/// "timings" and "memory".
nlohmann::ordered_json summary_of(const Session& session, const OutputTimings& output);

nlohmann::ordered_json closures_by_verdict(const Session& session);
nlohmann::ordered_json statuses_json(const Vision& vision);

/// The same for people, in a few lines.
std::string summary_text(const Session& session);

}  // namespace hybrid_slam::tools
