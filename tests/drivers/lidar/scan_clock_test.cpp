// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/scan_clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace hybrid_slam {
namespace {

constexpr double kNominal = 0.040;
constexpr double kEpoch = 1.8e9;  ///< seconds since 1970, as a host's clock tells
constexpr double kJitter = 0.030;

struct Scanner {
    double rate_error = 0.0;  ///< share by which its period is off
    double drift = 0.0;       ///< of that share, per second
    double loss = 0.0;        ///< probability that a scan does not arrive
};

struct Arrived {
    std::uint32_t count;
    double truth;  ///< when it would have arrived without delay
    double arrival;
};

/// Every second turn of the mirror, delayed by 0 to 30 ms.
std::vector<Arrived> arrivals_of(const Scanner& scanner, double seconds, unsigned seed) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> delay(0.0, kJitter);
    std::uniform_real_distribution<double> dice(0.0, 1.0);
    std::vector<Arrived> arrived;
    double elapsed = 0.0;
    for (std::uint32_t count = 1000; elapsed < seconds; count += 2) {
        const double truth = kEpoch + elapsed;
        const double arrival = truth + delay(rng);
        if (dice(rng) >= scanner.loss) {
            arrived.push_back({count, truth, arrival});
        }
        elapsed += 2.0 * kNominal * (1.0 + scanner.rate_error + scanner.drift * elapsed);
    }
    return arrived;
}

struct Errors {
    double worst = 0.0;
    double squares = 0.0;
    int count = 0;

    void add(double error) {
        worst = std::max(worst, std::abs(error));
        squares += error * error;
        ++count;
    }
    double rms() const { return std::sqrt(squares / count); }
};

/// Of the stamps between two times after the begin.
Errors errors(const std::vector<Arrived>& arrived, double from, double to) {
    ScanClock clock;
    Errors errors;
    for (const Arrived& scan : arrived) {
        const double stamp = clock.stamp(scan.count, scan.arrival);
        if (scan.truth >= kEpoch + from && scan.truth < kEpoch + to) {
            errors.add(stamp - scan.truth);
        }
    }
    return errors;
}

TEST(ScanClock, StampsAreWithinAMillisecondAfterAMinute) {
    for (const double rate_error : {-0.007, -5e-5, 0.0, 0.007}) {
        for (unsigned seed = 0; seed < 10; ++seed) {
            const auto arrived = arrivals_of({rate_error}, 600.0, seed);
            EXPECT_LT(errors(arrived, 60.0, 600.0).worst, 1e-3) << rate_error << ' ' << seed;
        }
    }
}

TEST(ScanClock, StampsAreWithinAMillisecondWhenTheScannerWarmsUp) {
    for (const double drift : {-5e-6 / 60.0, 5e-6 / 60.0}) {  // 5 ppm in a minute
        for (unsigned seed = 0; seed < 10; ++seed) {
            const auto arrived = arrivals_of({1e-4, drift}, 600.0, seed);
            EXPECT_LT(errors(arrived, 60.0, 600.0).worst, 1e-3) << drift << ' ' << seed;
        }
    }
}

TEST(ScanClock, LostScansDoNotMatter) {
    for (unsigned seed = 0; seed < 10; ++seed) {
        const auto arrived = arrivals_of({0.003, 0.0, 0.4}, 300.0, seed);
        EXPECT_LT(errors(arrived, 60.0, 300.0).worst, 1e-3) << seed;
    }
}

TEST(ScanClock, FirstSecondsAreBetterThanTheJitter) {
    for (const double rate_error : {-0.007, 0.0, 0.007}) {
        Errors early;
        Errors later;
        for (unsigned seed = 0; seed < 30; ++seed) {
            const auto arrived = arrivals_of({rate_error}, 10.0, seed);
            early.add(errors(arrived, 2.0, 3.0).rms());
            later.add(errors(arrived, 5.0, 10.0).rms());
        }
        EXPECT_LT(early.rms(), 0.15 * kJitter) << rate_error;
        EXPECT_LT(later.rms(), 0.05 * kJitter) << rate_error;
    }
}

TEST(ScanClock, StampsAlwaysIncreaseAndLieBeforeArrivals) {
    for (unsigned seed = 0; seed < 10; ++seed) {
        ScanClock clock;
        double before = 0.0;
        std::uint32_t count = 0;
        for (const Arrived& scan : arrivals_of({0.007, 0.0, 0.2}, 200.0, seed)) {
            const double stamp = clock.stamp(scan.count, scan.arrival);
            if (before > 0.0) {
                ASSERT_GE(stamp - before, 0.49 * kNominal * (scan.count - count));
            }
            ASSERT_LE(stamp, scan.arrival + 1e-6);
            before = stamp;
            count = scan.count;
        }
        EXPECT_EQ(clock.resets(), 0U);
    }
}

TEST(ScanClock, WithoutJitterStampsAreTheArrivals) {
    ScanClock clock;
    for (std::uint32_t i = 0; i < 5000; ++i) {
        const double arrival = kEpoch + 0.0803 * i;
        ASSERT_NEAR(clock.stamp(2 * i, arrival), arrival, 2e-6);
    }
    EXPECT_NEAR(clock.count_period(), 0.04015, 1e-8);
}

TEST(ScanClock, TheCounterMayWrap) {
    ScanClock clock;
    ScanClock wrapping;
    for (const Arrived& scan : arrivals_of({0.001}, 100.0, 3)) {
        ASSERT_EQ(wrapping.stamp(scan.count - 2000U, scan.arrival),
                  clock.stamp(scan.count, scan.arrival));
    }
    EXPECT_EQ(wrapping.resets(), 0U);
}

TEST(ScanClock, TheSameCountAgainGivesTheSameStamp) {
    ScanClock clock;
    const double stamp = clock.stamp(7, kEpoch);
    EXPECT_EQ(clock.stamp(7, kEpoch + 0.02), stamp);
    EXPECT_GT(clock.stamp(9, kEpoch + 0.08), stamp);
    EXPECT_EQ(clock.resets(), 0U);
}

TEST(ScanClock, AnInterruptionKeepsTheFit) {
    auto arrived = arrivals_of({0.002}, 400.0, 5);
    arrived.erase(arrived.begin() + 1500, arrived.begin() + 2500);  // 80 s
    EXPECT_LT(errors(arrived, 60.0, 400.0).worst, 1.2e-3);
}

/// What the host could not fetch for some seconds comes at once.
TEST(ScanClock, AStalledHostKeepsTheFit) {
    auto arrived = arrivals_of({0.002}, 100.0, 6);
    for (std::size_t i = 1000; i < 1050; ++i) {
        arrived[i].arrival = arrived[1050].arrival;
    }
    ScanClock clock;
    for (const Arrived& scan : arrived) {
        const double stamp = clock.stamp(scan.count, scan.arrival);
        if (scan.truth > kEpoch + 60.0) {
            ASSERT_NEAR(stamp, scan.truth, 1e-3);
        }
    }
    EXPECT_EQ(clock.resets(), 0U);
}

/// The stamps' errors against the shifted truth, from `settled` seconds after the shift on.
double worst_after_shift(double shift, double settled, ScanClock& clock) {
    double worst = 0.0;
    for (const Arrived& scan : arrivals_of({0.0001}, 120.0, 8)) {
        const bool shifted = scan.truth > kEpoch + 60.0;
        const double by = shifted ? shift : 0.0;
        const double stamp = clock.stamp(scan.count, scan.arrival + by);
        if (scan.truth > kEpoch + 60.0 + settled) {
            worst = std::max(worst, std::abs(stamp - (scan.truth + by)));
        }
    }
    return worst;
}

TEST(ScanClock, AHostClockThatIsSetBackStartsANewFitAtOnce) {
    for (const double shift : {-0.2, -5.0, -3600.0}) {
        ScanClock clock;
        EXPECT_LT(worst_after_shift(shift, 0.0, clock), kJitter) << shift;
        EXPECT_EQ(clock.resets(), 1U) << shift;
    }
}

TEST(ScanClock, AHostClockThatIsSetForwardStartsANewFitSoon) {
    for (const double shift : {0.2, 5.0, 3600.0}) {
        ScanClock clock;
        EXPECT_LT(worst_after_shift(shift, 2.5, clock), kJitter) << shift;
        EXPECT_EQ(clock.resets(), 1U) << shift;
    }
}

TEST(ScanClock, ACounterThatRestartsStartsANewFit) {
    ScanClock clock;
    for (const Arrived& scan : arrivals_of({}, 30.0, 1)) {
        clock.stamp(scan.count, scan.arrival);
    }
    const double arrival = kEpoch + 60.0;
    EXPECT_EQ(clock.stamp(3, arrival), arrival);
    EXPECT_EQ(clock.resets(), 1U);
    EXPECT_NEAR(clock.stamp(5, arrival + 0.08), arrival + 0.08, 1e-5);
}

TEST(ScanClock, ATruePeriodIsFittedWithinItsTolerance) {
    ScanClock clock;
    for (const Arrived& scan : arrivals_of({0.007}, 120.0, 2)) {
        clock.stamp(scan.count, scan.arrival);
        ASSERT_NEAR(clock.count_period(), kNominal, 0.01 * kNominal + 1e-12);
    }
    EXPECT_NEAR(clock.count_period(), 1.007 * kNominal, 1e-5 * kNominal);
}

}  // namespace
}  // namespace hybrid_slam
