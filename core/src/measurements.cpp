// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

bool is_consistent(const Image& image) {
    return image.width > 0 && image.height > 0 && (image.channels == 1 || image.channels == 3) &&
           image.pixels.size() == static_cast<std::size_t>(image.width) * image.height *
                                      static_cast<std::size_t>(image.channels);
}

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
