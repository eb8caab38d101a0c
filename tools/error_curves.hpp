// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "canvas.hpp"
#include "error_plot.hpp"

namespace hybrid_slam::tools {

struct ErrorCurve {
    std::string name;
    Color color;
    std::vector<PoseError> errors;
};

/// A stretch of time that explains something, shaded.
struct TimeBand {
    double from = 0.0;  ///< seconds, as the errors have them
    double to = 0.0;    ///< seconds
    std::string label;
};

/// Several errors over the same time, on scales by powers of ten, so that one that diverges leaves
/// the others readable.
struct ErrorCurves {
    std::string title;
    std::string subtitle;
    std::vector<ErrorCurve> curves;  ///< the last on top
    std::vector<TimeBand> bands;
    bool dots = false;  ///< errors that are no course in time
    std::string noun = "error";
};
Canvas draw(const ErrorCurves& picture);

}  // namespace hybrid_slam::tools
