// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

/// The standard's names of errors.
inline constexpr const char* kValidationError = "validationError";
inline constexpr const char* kOrderError = "orderError";
inline constexpr const char* kOrderUpdateError = "orderUpdateError";
inline constexpr const char* kNoRouteError = "noRouteError";
inline constexpr const char* kNoOrderToCancel = "noOrderToCancel";

using References = std::vector<std::pair<std::string, std::string>>;

/// One entry of the state's errors; each is a WARNING.
struct FleetProblem {
    std::string type;
    std::string text;
    References references;

    bool operator==(const FleetProblem& other) const {
        return type == other.type && text == other.text && references == other.references;
    }
};

/// Why a message is not taken.
class FleetRefusal : public Error {
  public:
    FleetRefusal(const char* type, const std::string& text, References references = {})
        : Error(text), problem{type, text, std::move(references)} {}

    FleetProblem problem;
};

}  // namespace hybrid_slam
