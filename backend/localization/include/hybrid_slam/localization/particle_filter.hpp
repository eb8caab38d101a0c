// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/localization/relocalization.hpp"

namespace hybrid_slam {

class PoseBins;

struct ParticleFilterConfig {
    int min_particles = 200;  ///< for each place, as long as `max_particles` are enough for all
    int max_particles = 20000;
    double kld_error = 0.05;     ///< between sampled and true belief (Fox 2003)
    double kld_quantile = 2.33;  ///< upper standard normal quantile of 1 - delta, here 99 %
    double bin_size = 0.25;      ///< metres
    double bin_angle = radians(10.0);
    int beams = 60;            ///< of a scan that are weighed
    double beam_weight = 0.3;  ///< exponent of one beam: neighbouring beams err alike
    double hit = 0.8;          ///< shares of the likelihood field's mixture: at a wall of the map,
    double short_hit = 0.15;   ///< at people and things before it, within `short_range` metres,
    double random_hit = 0.05;  ///< and anywhere
    double short_range = 3.0;  ///< metres, scale of the exponential density
    double resample_below = 0.5;  ///< effective share of the particles
    /// Of what speaks for one place against another, so much is kept from scan to scan: the small
    /// errors of a map come again with each scan, and must not add up to certainty.
    double evidence_kept = 0.95;
    int seed = 1;
};

void describe(ConfigSchema& schema, ParticleFilterConfig& config);

/// How many samples keep a belief that fills so many bins within `error` of the true one (Fox 2003,
/// equation 7, with Wilson and Hilferty's quantile of chi2); 1 for a single bin.
std::size_t kld_bound(std::size_t bins, double error, double quantile);

/// Keeps several places alive until driving decides (KLD-adaptive Monte Carlo localization: Fox
/// 2003; likelihood field: Thrun et al. 2005; resampled place by place, so that chance alone never
/// lets one of two look-alikes die: Milstein et al. 2002). Deterministic for a seed.
class ParticleFilter {
  public:
    /// Throws Error that names the key for a value out of range.
    ParticleFilter(std::shared_ptr<const ReferenceMap> map, const ParticleFilterConfig& config);

    /// A belief around each place by its covariance, weighed by its share.
    void start(const std::vector<Place>& places);
    /// Moves all by the odometry, with the noise of its covariance (before_from_now's axes)
    /// sampled.
    void move(const Pose2d& before_from_now, const Eigen::Matrix3d& covariance);
    /// Weighs all by what a scan saw (in the frame of the robot), and resamples when few count. For
    /// scans that lie some way apart: what is seen twice from one spot is no new evidence.
    void weigh(const Sweep& sweep);

    std::size_t size() const { return particles_.size(); }
    /// Mean likelihood of the best particles' beams at the last weighing, 0 to 1: low means that
    /// none of them is right.
    double quality() const { return quality_; }
    /// The clusters, the heaviest first: mean, covariance and share; the fit is left empty.
    std::vector<Place> places() const;

  private:
    struct Particle {
        Pose2d map_from_robot;
        double weight = 0.0;        ///< all add up to 1
        std::uint32_t cluster = 0;  ///< index into evidence_
    };

    struct Group {
        std::vector<Particle> members;
        double share = 0.0;
        double evidence = 0.0;
    };

    std::vector<double> log_likelihoods(const Sweep& sweep);
    void reweigh(const std::vector<double>& log_likelihoods);
    bool is_depleted() const;
    void resample();
    std::vector<Particle> drawn(const Group& group, const PoseBins& bins);
    std::vector<Pose2d> poses() const;

    std::shared_ptr<const ReferenceMap> map_;
    ParticleFilterConfig config_;
    std::vector<Particle> particles_;
    std::vector<double> evidence_;  ///< of each cluster, log, what is kept of it
    std::mt19937_64 random_;
    double quality_ = 0.0;
};

}  // namespace hybrid_slam
