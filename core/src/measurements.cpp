// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

std::string_view to_string(VisualStatus status) {
    switch (status) {
        case VisualStatus::kFirst:
            return "first";
        case VisualStatus::kGood:
            return "good";
        case VisualStatus::kTooDark:
            return "too_dark";
        case VisualStatus::kBlurred:
            return "blurred";
        case VisualStatus::kTooFewFeatures:
            return "too_few_features";
        case VisualStatus::kGroundHidden:
            return "ground_hidden";
        case VisualStatus::kInconsistent:
            return "inconsistent";
    }
    return "unknown";
}

}  // namespace hybrid_slam
