// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace hybrid_slam {

/// When a place that is tracked should be looked up anew: when its scans fit worse than usual. ICP
/// settles into many a wrong place that explains half of a scan and more; and no more than that is
/// explained in the right place when the hall has changed.
class TrackingDoubt {
  public:
    /// Whether to look now; each scan in order with the score of its fit.
    bool is_due(double stamp, double score);
    /// The place was looked up and is right: such scores are usual here.
    void settle(double stamp, double score);

  private:
    double usual_ = 1.0;            ///< score; at the start nothing excuses a bad one
    std::optional<double> before_;  ///< stamp of the scan before
    std::optional<double> since_;   ///< stamp of the first of the doubtful scans
    std::optional<double> settled_;
};

}  // namespace hybrid_slam
