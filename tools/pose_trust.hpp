// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/localization/localizer.hpp"

namespace hybrid_slam::tools {

/// Follows whether the pose of a localization can be believed: a start that somebody named is only
/// a claim until a scan agrees with the map there.
class PoseTrust {
  public:
    /// The result of the next scan.
    void see(const LocalizationResult& result);

    /// The place is known: the status is tracking or degraded, and since the pose was taken up a
    /// scan has agreed with the map.
    bool known() const { return known_; }
    /// Sure enough to start from it next time: known, and this scan does not speak against it.
    bool sure() const { return sure_; }

  private:
    bool known_ = false;
    bool sure_ = false;
};

}  // namespace hybrid_slam::tools
