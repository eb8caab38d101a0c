// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "canvas.hpp"
#include "evaluation.hpp"

namespace hybrid_slam::tools {

struct PoseError {
    double time = 0.0;         ///< seconds since the first stamp
    double translation = 0.0;  ///< metres
    double rotation = 0.0;     ///< radians
};

/// Each relation at the earlier of its stamps, or each pose that has a truth.
std::vector<PoseError> errors_over_time(const Trajectory& trajectory, const Yardstick& yardstick,
                                        const Evaluation& evaluation);

/// Both errors over time, with their means.
Canvas draw_errors(const std::string& title, const std::string& subtitle,
                   const std::vector<PoseError>& errors);

}  // namespace hybrid_slam::tools
