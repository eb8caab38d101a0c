// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sensor_motions.hpp"

namespace hybrid_slam {

using ExtrinsicsVector = Eigen::Matrix<double, kExtrinsics, 1>;
using ExtrinsicsMatrix = Eigen::Matrix<double, kExtrinsics, kExtrinsics>;

/// Sigmas of what intervals disagree by: of the bulk of them, whatever the outliers.
struct IntervalSigmas {
    double translation = 0.0;  ///< metres
    double heading = 0.0;      ///< radians
    double slip = 0.0;         ///< metres
};

struct ExtrinsicsSolution {
    ExtrinsicsVector values = ExtrinsicsVector::Zero();  ///< in the order of Extrinsic
    ExtrinsicsVector sigmas = ExtrinsicsVector::Zero();
    IntervalSigmas residuals;
    std::size_t intervals = 0;
    std::size_t outliers = 0;
    std::size_t blind = 0;
    int iterations = 0;
    bool converged = false;
};

/// `compared` and `slipping` are steps over the interval and the slip_interval of the config.
ExtrinsicsSolution solve_extrinsics(const ExtrinsicsDrive& drive,
                                    const std::vector<LaserStep>& compared,
                                    const std::vector<LaserStep>& slipping,
                                    const ExtrinsicsConfig& config);

}  // namespace hybrid_slam
