// SPDX-License-Identifier: Apache-2.0
#include "envelope.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace hybrid_slam {
namespace {

constexpr double kMost = 4e-4;  ///< seconds per count

/// h of the slope at a count, from all arrivals.
double height(const std::vector<Arrival>& arrivals, double slope, double count) {
    double least = HUGE_VAL;
    for (const Arrival& arrival : arrivals) {
        least = std::min(least, arrival.late + slope * (count - arrival.count));
    }
    return least;
}

/// The expectation over slopes by a sum over very many of them.
ArrivalLine fit_by_oracle(const std::vector<Arrival>& arrivals) {
    Arrival mean;
    for (const Arrival& arrival : arrivals) {
        mean.count += arrival.count / static_cast<double>(arrivals.size());
        mean.late += arrival.late / static_cast<double>(arrivals.size());
    }
    constexpr int kSlopes = 20001;
    const auto slope_at = [](int i) { return kMost * (2.0 * i / (kSlopes - 1) - 1.0); };
    double top = -HUGE_VAL;
    for (int i = 0; i < kSlopes; ++i) {
        top = std::max(top, height(arrivals, slope_at(i), mean.count));
    }
    const double sharpness = 0.5 * static_cast<double>(arrivals.size()) / (mean.late - top);
    double weights = 0.0;
    double slopes = 0.0;
    double heights = 0.0;
    for (int i = 0; i < kSlopes; ++i) {
        const double high = height(arrivals, slope_at(i), mean.count);
        const double weight = std::exp(sharpness * (high - top));
        weights += weight;
        slopes += weight * slope_at(i);
        heights += weight * high;
    }
    const double slope = slopes / weights;
    return {slope, heights / weights - 1.0 / sharpness - slope * mean.count};
}

std::vector<Arrival> draw_arrivals(unsigned seed, int count) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> delay(0.0, 0.03);
    const double slope = std::uniform_real_distribution<double>(-kMost, kMost)(rng);
    std::vector<Arrival> arrivals;
    arrivals.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        arrivals.push_back({2.0 * i, slope * 2.0 * i + delay(rng)});
    }
    return arrivals;
}

TEST(ArrivalEnvelope, FitsTheLineThatASumOverSlopesGives) {
    for (const int count : {2, 3, 10, 100, 400}) {
        for (unsigned seed = 0; seed < 5; ++seed) {
            const std::vector<Arrival> arrivals = draw_arrivals(seed, count);
            ArrivalEnvelope envelope;
            for (const Arrival& arrival : arrivals) {
                envelope.add(arrival, 1e9);
            }
            const ArrivalLine line = envelope.fit(kMost);
            const ArrivalLine expected = fit_by_oracle(arrivals);
            EXPECT_NEAR(line.slope, expected.slope, 1e-7) << count << ' ' << seed;
            EXPECT_NEAR(line.at(2.0 * count), expected.at(2.0 * count), 2e-5);
        }
    }
}

TEST(ArrivalEnvelope, LiesUnderAllArrivals) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        ArrivalEnvelope envelope;
        std::vector<Arrival> arrivals;
        for (const Arrival& arrival : draw_arrivals(seed, 200)) {
            arrivals.push_back(arrival);
            envelope.add(arrival, 1e9);
            const ArrivalLine line = envelope.fit(kMost);
            ASSERT_LE(std::abs(line.slope), kMost);
            for (const Arrival& other : arrivals) {
                ASSERT_GE(other.late, line.at(other.count) - 1e-12);
            }
        }
    }
}

TEST(ArrivalEnvelope, ForgetsWhatLeavesTheWindow) {
    constexpr double kWindow = 100.0;
    const std::vector<Arrival> arrivals = draw_arrivals(4, 400);
    ArrivalEnvelope sliding;
    for (std::size_t newest = 0; newest < arrivals.size(); ++newest) {
        sliding.add(arrivals[newest], kWindow);
        // Windows may be an eighth longer.
        bool agrees = false;
        for (std::size_t oldest = 0; oldest <= newest && !agrees; ++oldest) {
            const double span = arrivals[newest].count - arrivals[oldest].count;
            if (span <= 1.125 * kWindow && (oldest == 0 || span >= kWindow - 2.0)) {
                ArrivalEnvelope fresh;
                for (std::size_t i = oldest; i <= newest; ++i) {
                    fresh.add(arrivals[i], 1e9);
                }
                agrees = std::abs(fresh.fit(kMost).slope - sliding.fit(kMost).slope) < 1e-15;
            }
        }
        ASSERT_TRUE(agrees) << newest;
    }
}

TEST(ArrivalEnvelope, OneArrivalGivesTheLevelLineThroughIt) {
    ArrivalEnvelope envelope;
    envelope.add({0.0, 0.0}, 10.0);
    EXPECT_NEAR(envelope.fit(kMost).slope, 0.0, 1e-12);
    EXPECT_NEAR(envelope.fit(kMost).at(0.0), 0.0, 1e-5);
    EXPECT_EQ(envelope.fit(0.0).at(5.0), 0.0);
}

}  // namespace
}  // namespace hybrid_slam
