// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "evaluation.hpp"
#include "localization_run.hpp"

namespace hybrid_slam::tools {

/// How true the poses of a run are.
struct RunTruth {
    Evaluation evaluation;
    std::string against;  ///< what they were held against, and how
};

/// In the order of the summary; everything that differs between two runs on the same input is
/// inside of "timings" and "memory".
nlohmann::ordered_json summary_of(const LocalizationRun& run, const std::optional<RunTruth>& truth);

/// The same for people, in a few lines.
std::string summary_text(const LocalizationRun& run, const std::optional<RunTruth>& truth);

}  // namespace hybrid_slam::tools
