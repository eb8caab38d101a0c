// SPDX-License-Identifier: Apache-2.0
#include "tracking_doubt.hpp"

#include <algorithm>

namespace hybrid_slam {
namespace {

constexpr double kWorse = 0.07;           // than usual
constexpr double kMemory = 3.0;           // seconds of what is usual
constexpr double kSecondsOfDoubt = 0.35;  // so that passers-by are no reason
constexpr double kRest = 1.0;             // seconds between two looks
// A place so bad is looked up again and again, for it may have been wrong before.
constexpr double kBad = 0.8;
constexpr double kLongRest = 5.0;  // seconds

}  // namespace

bool TrackingDoubt::is_due(double stamp, double score) {
    if (before_ && stamp < *before_) {  // the clock was set back
        since_.reset();
        settled_.reset();
    }
    const double passed = before_ ? std::max(0.0, stamp - *before_) : 0.0;
    before_ = stamp;
    const double rested = settled_ ? stamp - *settled_ : kLongRest;
    const bool worse = score < usual_ - kWorse;
    if (!worse) {
        usual_ += std::min(1.0, passed / kMemory) * (score - usual_);
    }
    if (!worse && (score >= kBad || rested < kLongRest)) {
        since_.reset();
        return false;
    }
    since_ = since_.value_or(stamp);
    return stamp - *since_ >= kSecondsOfDoubt && rested >= kRest;
}

void TrackingDoubt::settle(double stamp, double score) {
    since_.reset();
    settled_ = stamp;
    usual_ = score;
}

}  // namespace hybrid_slam
