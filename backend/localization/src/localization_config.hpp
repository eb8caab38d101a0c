// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/localization/localizer.hpp"

namespace hybrid_slam {

/// Throws Error that names the key for values out of their ranges and against each other.
LocalizationConfig checked(LocalizationConfig config);

}  // namespace hybrid_slam
