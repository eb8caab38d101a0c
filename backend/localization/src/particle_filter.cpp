// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/particle_filter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <unordered_set>
#include <utility>

#include "beam_field.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/uncertainty.hpp"
#include "pose_bins.hpp"

namespace hybrid_slam {
namespace {

// ICP's covariance of a place knows nothing of errors of the map; and a belief of one point could
// never be corrected by weighing.
constexpr double kPlaceFloor = 0.05;               // metres
constexpr double kPlaceAngleFloor = radians(1.0);  // radians
// Of each motion, so that copies of one particle part again.
constexpr double kMotionFloor = 0.003;               // metres
constexpr double kMotionAngleFloor = radians(0.1);   // radians
constexpr double kMotionRatio = 0.03;                // of the way and of the turn
constexpr double kDeadShare = 1e-6;                  // a cluster below is given up
constexpr double kBestShare = 0.02;                  // of the particles that tell the quality
constexpr double kGoldenRatio = 0.6180339887498949;  // less one

// Normal errors with the given covariance, widened by floors (metres, radians).
class Noise {
  public:
    Noise(const Eigen::Matrix3d& covariance, double translation_floor, double rotation_floor) {
        const Eigen::Vector3d floor(translation_floor, translation_floor, rotation_floor);
        const Eigen::Matrix3d least = floor.cwiseAbs2().asDiagonal();
        const Eigen::LLT<Eigen::Matrix3d> factor(covariance + least);
        // What is no covariance (not finite, not positive) is no reason to stop.
        root_ = factor.info() == Eigen::Success && covariance.allFinite()
                    ? Eigen::Matrix3d(factor.matrixL())
                    : Eigen::Matrix3d(floor.asDiagonal());
    }

    Eigen::Vector3d sample(std::mt19937_64& random) {
        Eigen::Vector3d unit;
        for (double& value : unit) {
            value = normal_(random);
        }
        return root_ * unit;
    }

  private:
    Eigen::Matrix3d root_;
    std::normal_distribution<double> normal_;
};

// Counts the bins that samples fill, and says when they are enough (Fox 2003, table 1).
class KldCounter {
  public:
    KldCounter(const ParticleFilterConfig& config, const PoseBins& bins, std::size_t least,
               std::size_t most)
        : config_(config), bins_(bins), needed_(least), most_(most) {}

    void add(const Pose2d& pose) {
        ++samples_;
        if (filled_.insert(bins_.key_of(pose)).second) {
            needed_ = std::max(needed_,
                               kld_bound(filled_.size(), config_.kld_error, config_.kld_quantile));
        }
    }
    bool enough() const { return samples_ >= needed_ || samples_ >= most_; }

  private:
    const ParticleFilterConfig& config_;
    const PoseBins& bins_;
    std::unordered_set<PoseBins::Key> filled_;
    std::size_t samples_ = 0;
    std::size_t needed_;
    std::size_t most_;
};

double mean_of_best(std::vector<double>& values) {
    const auto count = std::max<std::size_t>(
        1, static_cast<std::size_t>(kBestShare * static_cast<double>(values.size())));
    const auto end = values.begin() + static_cast<std::ptrdiff_t>(count);
    std::partial_sort(values.begin(), end, values.end(), std::greater<>());
    double sum = 0.0;
    for (auto value = values.begin(); value != end; ++value) {
        sum += *value;
    }
    return sum / static_cast<double>(count);
}

double total_of(const std::vector<Place>& places) {
    double total = 0.0;
    for (const Place& place : places) {
        total += std::max(place.share, 0.0);
    }
    return total;
}

}  // namespace

std::size_t kld_bound(std::size_t bins, double error, double quantile) {
    if (bins < 2) {
        return 1;
    }
    const auto freedom = static_cast<double>(bins - 1);
    const double part = 2.0 / (9.0 * freedom);
    const double root = 1.0 - part + std::sqrt(part) * quantile;
    return static_cast<std::size_t>(std::ceil(freedom / (2.0 * error) * root * root * root));
}

ParticleFilter::ParticleFilter(std::shared_ptr<const ReferenceMap> map,
                               const ParticleFilterConfig& config)
    : map_(std::move(map)),
      config_(config),
      random_(static_cast<std::mt19937_64::result_type>(config.seed)) {
    ConfigSchema schema;
    const ConfigSchema::Section section(schema, "particles");
    describe(schema, config_);  // throws for values out of their ranges
    if (config_.min_particles > config_.max_particles) {
        throw Error("particles.min_particles: must not exceed particles.max_particles");
    }
}

void ParticleFilter::start(const std::vector<Place>& places) {
    particles_.clear();
    evidence_.assign(places.size(), 0.0);
    quality_ = 0.0;
    const double total = total_of(places);
    const PoseBins bins(config_.bin_size, config_.bin_angle);
    const auto most = static_cast<std::size_t>(config_.max_particles);
    const std::size_t part =
        std::max<std::size_t>(1, most / std::max<std::size_t>(1, places.size()));
    const std::size_t least = std::min(part, static_cast<std::size_t>(config_.min_particles));
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double share = total > 0.0 ? std::max(places[i].share, 0.0) / total
                                         : 1.0 / static_cast<double>(places.size());
        Noise noise(places[i].covariance, kPlaceFloor, kPlaceAngleFloor);
        KldCounter counter(config_, bins, least, part);
        const std::size_t first = particles_.size();
        do {
            const Eigen::Vector3d error = noise.sample(random_);
            const Pose2d& mean = places[i].map_from_robot;
            const Pose2d pose(mean.translation + error.head<2>(),
                              normalize_angle(mean.heading + error.z()));
            particles_.push_back({pose, 0.0, static_cast<std::uint32_t>(i)});
            counter.add(pose);
        } while (!counter.enough());
        const double weight = share / static_cast<double>(particles_.size() - first);
        for (std::size_t k = first; k < particles_.size(); ++k) {
            particles_[k].weight = weight;
        }
    }
}

void ParticleFilter::move(const Pose2d& before_from_now, const Eigen::Matrix3d& covariance) {
    const double way = before_from_now.translation.norm();
    const double turn = std::abs(normalize_angle(before_from_now.heading));
    Noise noise(covariance, kMotionFloor + kMotionRatio * way,
                kMotionAngleFloor + kMotionRatio * turn);
    for (Particle& particle : particles_) {
        const Eigen::Vector3d error = noise.sample(random_);
        particle.map_from_robot =
            particle.map_from_robot * Pose2d(before_from_now.translation + error.head<2>(),
                                             before_from_now.heading + error.z());
    }
}

void ParticleFilter::weigh(const Sweep& sweep) {
    if (particles_.empty() || sweep.surface.points.empty()) {
        return;
    }
    reweigh(log_likelihoods(sweep));
    if (is_depleted()) {
        resample();
    }
}

std::vector<double> ParticleFilter::log_likelihoods(const Sweep& sweep) {
    const BeamField field(*map_, config_.hit);
    const std::vector<Beam> beams = beams_of(sweep, config_);
    std::vector<double> logs;
    std::vector<double> means;
    logs.reserve(particles_.size());
    means.reserve(particles_.size());
    for (const Particle& particle : particles_) {
        const BeamsFit fit = field.fit_of(beams, particle.map_from_robot);
        logs.push_back(config_.beam_weight * fit.log_likelihood);
        means.push_back(fit.mean);
    }
    quality_ = mean_of_best(means);
    return logs;
}

/// Bayes, but what has spoken for a place against another fades.
void ParticleFilter::reweigh(const std::vector<double>& log_likelihoods) {
    const double best = *std::max_element(log_likelihoods.begin(), log_likelihoods.end());
    std::vector<double> before(evidence_.size(), 0.0);
    std::vector<double> after(evidence_.size(), 0.0);
    for (std::size_t i = 0; i < particles_.size(); ++i) {
        Particle& particle = particles_[i];
        before[particle.cluster] += particle.weight;
        particle.weight *= std::exp(std::max(log_likelihoods[i] - best, -600.0));
        after[particle.cluster] += particle.weight;
    }
    std::vector<double> fading(evidence_.size(), 0.0);
    double most = -1e300;
    for (std::size_t c = 0; c < evidence_.size(); ++c) {
        if (before[c] > 0.0 && after[c] > 0.0) {
            fading[c] = (config_.evidence_kept - 1.0) * evidence_[c];
            evidence_[c] += fading[c] + std::log(after[c] / before[c]);
            most = std::max(most, fading[c]);
        }
    }
    double total = 0.0;
    for (Particle& particle : particles_) {
        particle.weight *= std::exp(fading[particle.cluster] - most);
        total += particle.weight;
    }
    for (Particle& particle : particles_) {
        particle.weight /= total;
    }
}

/// By each cluster's own effective share: that they are not equally heavy is no depletion.
bool ParticleFilter::is_depleted() const {
    std::vector<double> sums(evidence_.size(), 0.0);
    std::vector<double> squares(evidence_.size(), 0.0);
    std::vector<double> counts(evidence_.size(), 0.0);
    for (const Particle& particle : particles_) {
        sums[particle.cluster] += particle.weight;
        squares[particle.cluster] += particle.weight * particle.weight;
        counts[particle.cluster] += 1.0;
    }
    for (std::size_t c = 0; c < sums.size(); ++c) {
        if (sums[c] > kDeadShare &&
            sums[c] * sums[c] < config_.resample_below * counts[c] * squares[c]) {
            return true;
        }
    }
    return false;
}

/// Each cluster on its own, with as many particles as its spread needs: its share is in their
/// weights, so that no cluster dies by chance.
void ParticleFilter::resample() {
    const PoseBins bins(config_.bin_size, config_.bin_angle);
    const Clusters clusters = clusters_of(poses(), bins);
    std::vector<Group> groups(clusters.count);
    for (std::size_t i = 0; i < particles_.size(); ++i) {
        Group& group = groups[clusters.of_pose[i]];
        group.members.push_back(particles_[i]);
        group.share += particles_[i].weight;
        // Clusters that met share what spoke for each.
        group.evidence += particles_[i].weight * evidence_[particles_[i].cluster];
    }
    groups.erase(std::remove_if(groups.begin(), groups.end(),
                                [](const Group& group) { return group.share <= kDeadShare; }),
                 groups.end());
    std::size_t count = 0;
    double total = 0.0;
    for (Group& group : groups) {
        group.members = drawn(group, bins);
        group.evidence /= group.share;
        count += group.members.size();
        total += group.share;
    }
    // Of a low-variance sequence each part from its beginning is one too.
    const double room =
        std::min(1.0, static_cast<double>(config_.max_particles) / static_cast<double>(count));
    particles_.clear();
    evidence_.clear();
    for (Group& group : groups) {
        const auto kept = std::max<std::size_t>(
            1, static_cast<std::size_t>(room * static_cast<double>(group.members.size())));
        group.members.resize(kept);
        for (Particle& particle : group.members) {
            particle.weight = group.share / (total * static_cast<double>(kept));
            particle.cluster = static_cast<std::uint32_t>(evidence_.size());
            particles_.push_back(particle);
        }
        evidence_.push_back(group.evidence);
    }
}

/// Draws by the golden ratio's sequence: spread as evenly over the weights as systematic
/// resampling does, but it can be stopped at any number, as KLD sampling asks.
std::vector<ParticleFilter::Particle> ParticleFilter::drawn(const Group& group,
                                                            const PoseBins& bins) {
    std::vector<double> sums;
    sums.reserve(group.members.size());
    double sum = 0.0;
    for (const Particle& particle : group.members) {
        sums.push_back(sum += particle.weight);
    }
    // A few that strayed from their cluster are no place of their own, to be filled up.
    const std::size_t least =
        std::min(group.members.size(), static_cast<std::size_t>(config_.min_particles));
    KldCounter counter(config_, bins, least, static_cast<std::size_t>(config_.max_particles));
    std::vector<Particle> samples;
    double at = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
    do {
        const auto found = std::upper_bound(sums.begin(), sums.end(), at * sum);
        const auto index =
            std::min(found - sums.begin(), static_cast<std::ptrdiff_t>(group.members.size()) - 1);
        samples.push_back(group.members[static_cast<std::size_t>(index)]);
        counter.add(samples.back().map_from_robot);
        at += kGoldenRatio;
        at -= std::floor(at);
    } while (!counter.enough());
    return samples;
}

std::vector<Pose2d> ParticleFilter::poses() const {
    std::vector<Pose2d> result;
    result.reserve(particles_.size());
    for (const Particle& particle : particles_) {
        result.push_back(particle.map_from_robot);
    }
    return result;
}

std::vector<Place> ParticleFilter::places() const {
    const Clusters clusters = clusters_of(poses(), PoseBins(config_.bin_size, config_.bin_angle));
    std::vector<Place> places(clusters.count);
    std::vector<Eigen::Vector4d> sums(clusters.count, Eigen::Vector4d::Zero());
    for (Place& place : places) {
        place.share = 0.0;
    }
    for (std::size_t i = 0; i < particles_.size(); ++i) {
        const Pose2d& pose = particles_[i].map_from_robot;
        const double weight = particles_[i].weight;
        places[clusters.of_pose[i]].share += weight;
        sums[clusters.of_pose[i]] +=
            weight *
            Eigen::Vector4d(pose.x(), pose.y(), std::cos(pose.heading), std::sin(pose.heading));
    }
    for (std::size_t c = 0; c < places.size(); ++c) {
        const double share = std::max(places[c].share, std::numeric_limits<double>::min());
        places[c].map_from_robot = {sums[c].x() / share, sums[c].y() / share,
                                    std::atan2(sums[c].w(), sums[c].z())};
    }
    for (std::size_t i = 0; i < particles_.size(); ++i) {
        Place& place = places[clusters.of_pose[i]];
        const Eigen::Vector3d error =
            difference(particles_[i].map_from_robot, place.map_from_robot);
        const double share = std::max(place.share, std::numeric_limits<double>::min());
        place.covariance += particles_[i].weight / share * error * error.transpose();
    }
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& a, const Place& b) { return a.share > b.share; });
    return places;
}

void describe(ConfigSchema& schema, ParticleFilterConfig& config) {
    schema.add("min_particles", config.min_particles, 1, 1000000, "for each place");
    schema.add("max_particles", config.max_particles, 1, 1000000, "all together");
    schema.add("kld_error", config.kld_error, 1e-4, 1.0, "between sampled and true belief");
    schema.add("kld_quantile", config.kld_quantile, 0.0, 10.0,
               "of the standard normal: how surely the error is kept");
    schema.add("bin_size", config.bin_size, 0.01, 10.0, "m");
    schema.add_degrees("bin_angle_deg", config.bin_angle, 1.0, 180.0, "degrees");
    schema.add("beams", config.beams, 1, 10000, "of a scan that are weighed");
    schema.add("beam_weight", config.beam_weight, 1e-3, 1.0, "exponent of one beam's likelihood");
    schema.add("hit", config.hit, 0.01, 1.0, "share of beams that end at a wall of the map");
    schema.add("short_hit", config.short_hit, 0.0, 1.0,
               "share of beams that end at people and things before it");
    schema.add("random_hit", config.random_hit, 1e-4, 1.0, "share of beams that end anywhere");
    schema.add("short_range", config.short_range, 0.1, 100.0,
               "m, scale of how far away people and things are");
    schema.add("resample_below", config.resample_below, 0.0, 1.0,
               "effective share of the particles");
    schema.add("evidence_kept", config.evidence_kept, 0.0, 1.0,
               "of what speaks for one place against another, from scan to scan");
    schema.add("seed", config.seed, 0, 2147483647, "of the random numbers");
}

}  // namespace hybrid_slam
