// SPDX-License-Identifier: Apache-2.0
#include "envelope.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybrid_slam {
namespace {

constexpr double kLeastDelay = 1e-6;  ///< seconds; doubles since 1970 are not much finer

/// Whether b lies on or above the line from a to c: no corner of the lower hull.
bool is_above(const Arrival& a, const Arrival& b, const Arrival& c) {
    return (b.late - a.late) * (c.count - a.count) >= (c.late - a.late) * (b.count - a.count);
}

/// The integral of exp(rate * t) over t from 0 to 1, and the mean of t under that weight; for rates
/// of 0 and less.
double unit_weight(double rate) {
    return rate > -1e-6 ? 1.0 + 0.5 * rate : std::expm1(rate) / rate;
}
double unit_mean(double rate) {
    return rate > -1e-3 ? 0.5 + rate / 12.0 : -1.0 / std::expm1(-rate) - 1.0 / rate;
}

/// Lines through one corner, told by their slopes.
struct Fan {
    Arrival corner;
    double from = 0.0;
    double to = 0.0;

    double height(double slope, double count) const {
        return corner.late + slope * (count - corner.count);
    }
};

struct Expectation {
    double weight = 0.0;
    double slope = 0.0;   ///< sum, weighted
    double height = 0.0;  ///< the same

    /// Slopes in proportion to exp(sharpness * (their height at `count` - `top`)).
    void add(const Fan& fan, double count, double top, double sharpness) {
        const double rise = fan.height(fan.to, count) - fan.height(fan.from, count);
        const double near = rise > 0.0 ? fan.to : fan.from;  // where the height is greatest
        const double far = rise > 0.0 ? fan.from : fan.to;
        const double rate = -sharpness * std::abs(rise);
        const double share = std::exp(sharpness * (fan.height(near, count) - top)) *
                             (fan.to - fan.from) * unit_weight(rate);
        const double mean = near + (far - near) * unit_mean(rate);
        weight += share;
        slope += share * mean;
        height += share * fan.height(mean, count);
    }
};

}  // namespace

void ArrivalEnvelope::clear() {
    arrivals_.clear();
    corners_.clear();
    sum_ = {};
}

void ArrivalEnvelope::add(const Arrival& arrival, double window) {
    extend(arrival);
    arrivals_.push_back(arrival);
    // The oldest arrival is always a corner, so that to forget it means to begin anew: rarely.
    constexpr double kSlack = 1.125;
    if (arrival.count - arrivals_.front().count > kSlack * window) {
        forget(arrival.count - window);
    }
}

void ArrivalEnvelope::extend(const Arrival& arrival) {
    sum_.count += arrival.count;
    sum_.late += arrival.late;
    while (corners_.size() >= 2 &&
           is_above(corners_[corners_.size() - 2], corners_.back(), arrival)) {
        corners_.pop_back();
    }
    corners_.push_back(arrival);
}

void ArrivalEnvelope::forget(double before) {
    const auto kept = std::find_if(arrivals_.begin(), arrivals_.end(),
                                   [before](const Arrival& old) { return old.count >= before; });
    arrivals_.erase(arrivals_.begin(), kept);
    corners_.clear();
    sum_ = {};
    for (const Arrival& arrival : arrivals_) {
        extend(arrival);
    }
}

/// The slope of the hull's edge that ends in a corner.
double ArrivalEnvelope::edge(std::size_t right) const {
    const Arrival& a = corners_[right - 1];
    const Arrival& b = corners_[right];
    return (b.late - a.late) / (b.count - a.count);
}

/// How high a line under all arrivals, of a slope within +-most, can be at this count.
double ArrivalEnvelope::highest(double most, double count) const {
    double slope = 0.0;
    if (corners_.size() > 1) {
        const auto right = std::lower_bound(
            corners_.begin() + 1, corners_.end() - 1, count,
            [](const Arrival& corner, double place) { return corner.count < place; });
        slope = std::clamp(edge(static_cast<std::size_t>(right - corners_.begin())), -most, most);
    }
    double least = std::numeric_limits<double>::infinity();
    for (const Arrival& corner : corners_) {
        least = std::min(least, corner.late + slope * (count - corner.count));
    }
    return least;
}

/// Where the earliest arrivals are, delays have a density of about 1 / (2 mean) as uniform ones do,
/// and so lines below all arrivals are likely in proportion to exp(sharpness * v) with their height
/// v at the mean count and sharpness = n / (2 mean delay). For each slope v reaches up to h(slope),
/// the line that touches the hull; integrating v out leaves exp(sharpness * h(slope)) as the
/// slope's weight and h - 1 / sharpness as the expected v. Each corner is what lines touch whose
/// slopes lie between those of its two edges, and there h is linear. (The most likely line alone is
/// the hull's edge at the mean count, as in Zhang et al.; its ends swing more.)
ArrivalLine ArrivalEnvelope::fit(double most) const {
    const auto count = static_cast<double>(arrivals_.size());
    const Arrival mean{sum_.count / count, sum_.late / count};
    const double top = highest(most, mean.count);
    const double sharpness = 0.5 * count / std::max(mean.late - top, kLeastDelay);
    Expectation expected;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
        const double from = i == 0 ? -most : std::max(edge(i), -most);
        const double to = i + 1 == corners_.size() ? most : std::min(edge(i + 1), most);
        if (from < to) {
            expected.add({corners_[i], from, to}, mean.count, top, sharpness);
        }
    }
    if (!(expected.weight > 0.0)) {  // a tolerance of nothing
        return {0.0, highest(0.0, 0.0)};
    }
    const double slope = expected.slope / expected.weight;
    const double height = expected.height / expected.weight - 1.0 / sharpness;
    return {slope, height - slope * mean.count};
}

}  // namespace hybrid_slam
