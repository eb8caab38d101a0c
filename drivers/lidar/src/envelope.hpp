// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace hybrid_slam {

/// An arrival, from the first one of a fit on; the grid of the nominal period is taken off `late`,
/// so that little is lost of seconds since 1970.
struct Arrival {
    double count = 0.0;
    double late = 0.0;  ///< seconds
};

/// late = base + slope * count
struct ArrivalLine {
    double slope = 0.0;  ///< seconds per count
    double base = 0.0;   ///< seconds

    double at(double count) const { return base + slope * count; }
};

/// The lower convex hull of the arrivals of a window that slides on, and the line beneath it
/// (Andrew's chain: each arrival enters and leaves the hull once).
class ArrivalEnvelope {
  public:
    void clear();
    /// Counts must rise. Forgets what lies more than `window` counts back (or a little later).
    void add(const Arrival& arrival, double window);

    /// The line beneath all arrivals that is to be expected (not the most likely one), when all
    /// slopes up to +-`most` seconds per count were equally likely before.
    ArrivalLine fit(double most) const;

  private:
    void extend(const Arrival& arrival);
    void forget(double before);
    double edge(std::size_t right) const;
    double highest(double most, double count) const;

    std::vector<Arrival> arrivals_;
    std::vector<Arrival> corners_;  ///< the oldest first
    Arrival sum_;
};

}  // namespace hybrid_slam
