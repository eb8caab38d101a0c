// SPDX-License-Identifier: Apache-2.0
#include "joint_tracker.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {
namespace {

constexpr double kLeastContrast = 4.0;  ///< gray levels
constexpr double kSameLight = 0.02;     ///< share by which brightness may differ for nothing
constexpr double kBlurredShare = 0.4;   ///< of the usual sharpness
constexpr double kSharpnessMemory = 0.05;
constexpr double kScanAge = 0.5;  ///< seconds after which a scan says nothing about an image
// Of a look that is good.
constexpr double kLeastInlierShare = 0.45;
constexpr double kMostHeadingSigma = radians(0.3);
constexpr double kMostSigma = 0.01;       ///< metres, in the weaker direction
constexpr double kWornShare = 0.6;        ///< of the landmarks of a key image, still followed
constexpr double kWayBack = 12.0;         ///< chi2 of what the way back misses by
constexpr std::size_t kLeastFloor = 8;    ///< features, to say anything about the floor
constexpr double kLeastFloorShare = 0.3;  ///< of them agree, or the speed is wrong
// What a vehicle does by itself.
constexpr double kAcceleration = 0.5;         ///< m/s2
constexpr double kAngularAcceleration = 1.0;  ///< rad/s2
constexpr double kSlip = 0.01;                ///< m/s, sideways
constexpr double kTwistShare = 0.3;           ///< of the newest motion in the speed
constexpr double kTwistAge = 0.5;             ///< seconds for which a speed is remembered
/// m/s, tried when nothing is known of the speed.
constexpr std::array<double, 8> kSpeeds{0.0, 0.75, 1.5, 3.0, 6.0, 12.0, 24.0, -1.0};
constexpr double kSpeedSigma = 0.5;  ///< m/s, around each of them, and
constexpr double kSpeedShare = 0.5;  ///< of it
constexpr double kTopRate = 2.0;     ///< rad/s
constexpr int kLevelsKnown = 2;      ///< of the pyramid, above the image, when a motion is expected
constexpr int kLevelsUnknown = 4;
constexpr double kAimDrift = radians(0.002);  ///< from one key image to the next

void append(ImagePoints& points, const ImagePoints& more) {
    points.insert(points.end(), more.begin(), more.end());
}

ImagePoints agreed(const VisualTracker::Features& features) {
    ImagePoints points;
    for (const auto& feature : features) {
        if (feature.used) {
            points.emplace_back(static_cast<float>(feature.now.x()),
                                static_cast<float>(feature.now.y()));
        }
    }
    return points;
}

/// What a segmenter takes.
Image image_of(const cv::Mat& gray) {
    Image image;
    image.width = gray.cols;
    image.height = gray.rows;
    for (int row = 0; row < gray.rows; ++row) {
        image.pixels.insert(image.pixels.end(), gray.ptr(row), gray.ptr(row) + gray.cols);
    }
    return image;
}

void check(const FloorMask& mask, const cv::Mat& image) {
    if (mask.width != image.cols || mask.height != image.rows ||
        mask.is_floor.size() != image.total()) {
        throw Error("a floor mask that is not as large as its image");
    }
}

}  // namespace

JointTracker::JointTracker(const CameraOnRobot& camera, const VisualOdometryConfig& config,
                           std::unique_ptr<FloorSegmenter> segmenter)
    : camera_(camera),
      config_(config),
      segmenter_(std::move(segmenter)),
      aim_information_(Eigen::Matrix2d::Identity() / (config.aim_sigma * config.aim_sigma)) {}

VisualMotion JointTracker::track(const Image& image) {
    VisualMotion motion;
    motion.from_stamp = stamp_.value_or(image.stamp);
    motion.stamp = image.stamp;
    const double elapsed = motion.stamp - motion.from_stamp;
    stamp_ = image.stamp;
    features_.clear();

    const cv::Mat gray = gray_of(image);
    Pyramid now = pyramid_like_key(gray, image.stamp);
    if (const VisualStatus light = judge_light(now); light != VisualStatus::kGood) {
        return lose(motion, light);
    }
    if (twist_ && image.stamp - twist_stamp_ > kTwistAge) {
        twist_.reset();
    }
    if (!key_) {
        start_key(std::move(now), {});
        before_ = key_->pyramid;
        return motion;
    }
    Look found = find_motion(now, elapsed);
    if (!is_usable(found.status) && key_->pyramid.stamp != before_.stamp) {
        // The key image is too far back: once more from the image before.
        start_key(before_, {});
        found = find_motion(now, elapsed);
    }
    if (!is_usable(found.status)) {
        const bool blurred = now.sharpness < kBlurredShare * usual_sharpness_;
        return lose(motion, blurred ? VisualStatus::kBlurred : found.status);
    }
    report(found, motion);
    adopt(found, motion);
    usual_sharpness_ +=
        (usual_sharpness_ == 0.0 ? 1.0 : kSharpnessMemory) * (now.sharpness - usual_sharpness_);
    before_ = std::move(now);
    if (worn_out(found)) {
        learn_aim(found.motion);
        start_key(before_.gain == 1.0 ? before_ : make_pyramid(gray, 1.0, image.stamp),
                  agreed(features_));
        before_ = key_->pyramid;
    }
    return motion;
}

/// What was learned of the camera's aim stays.
void JointTracker::restart() {
    key_.reset();
    before_ = Pyramid();
    twist_.reset();
    stamp_.reset();
    features_.clear();
}

/// As bright as the key image, if there is one: what follows features takes them to stay as they
/// are.
Pyramid JointTracker::pyramid_like_key(const cv::Mat& gray, double stamp) const {
    const double ratio = key_ ? key_->pyramid.mean / std::max(mean_of(gray), 1.0) : 1.0;
    return make_pyramid(gray, std::abs(ratio - 1.0) > kSameLight ? ratio : 1.0, stamp);
}

VisualStatus JointTracker::judge_light(const Pyramid& pyramid) const {
    const bool dark = pyramid.light < config_.dark || pyramid.contrast < kLeastContrast;
    return dark ? VisualStatus::kTooDark : VisualStatus::kGood;
}

void JointTracker::start_key(Pyramid pyramid, const ImagePoints& kept) {
    const auto most = static_cast<std::size_t>(config_.features);
    ImagePoints points = kept;
    append(points, find_corners(pyramid, points, most));
    append(points, find_edges(pyramid, points, most));
    const std::optional<FloorBorder> border = border_at(pyramid.stamp);
    std::optional<FloorMask> mask;
    if (segmenter_) {
        mask = segmenter_->segment(image_of(pyramid.image(0)));
        check(*mask, pyramid.image(0));
    }
    const FloorHints hints{border ? &*border : nullptr, mask ? &*mask : nullptr};
    Key key;
    key.landmarks = make_landmarks(pyramid, points, camera_, hints, config_.pixel_sigma);
    key.pyramid = std::move(pyramid);
    key_ = std::move(key);
    key_from_before_ = Pose2d();
    covariance_before_.setZero();
}

/// By the newest scan, carried to the image by the speed.
std::optional<FloorBorder> JointTracker::border_at(double stamp) const {
    if (!scan_ || !config_.lidar_border || std::abs(stamp - scan_->stamp) > kScanAge) {
        return std::nullopt;
    }
    const Eigen::Vector3d twist = twist_.value_or(Eigen::Vector3d::Zero());
    const Pose2d scan_from_image = Pose2d::exp((stamp - scan_->stamp) * twist);
    return FloorBorder(*scan_, scan_from_image.inverse(), camera_.center().head<2>());
}

/// At the start, and when the floor does not move as it should, nothing is known of the speed: what
/// makes most of the floor fit is taken.
JointTracker::Look JointTracker::find_motion(const Pyramid& now, double elapsed) const {
    Look best;
    if (twist_) {
        best = look(now, belief_after(elapsed, *twist_, kAcceleration * elapsed), kLevelsKnown);
        if (!floor_is_lost(best)) {
            return best;
        }
    }
    const double turn = twist_ ? twist_->z() : 0.0;
    for (const double speed : kSpeeds) {
        const SightBelief belief = belief_after(elapsed, Eigen::Vector3d(speed, 0.0, turn),
                                                kSpeedSigma + kSpeedShare * std::abs(speed));
        Look other = look(now, belief, kLevelsUnknown);
        // What was found from a known speed is not given up lightly.
        const std::size_t needed = (twist_ ? 2 : 1) * best.motion.floor_inliers;
        if (best.sightings.empty() || (other.motion.floor_inliers > needed &&
                                       10 * other.motion.inliers > 7 * best.motion.inliers)) {
            best = std::move(other);
        }
    }
    return best;
}

/// Floor is in sight, but hardly any of it agrees.
bool JointTracker::floor_is_lost(const Look& look) {
    const auto floor = static_cast<std::size_t>(
        std::count_if(look.sightings.begin(), look.sightings.end(),
                      [](const Sighting& sighting) { return sighting.floor; }));
    return floor >= kLeastFloor && static_cast<double>(look.motion.floor_inliers) <
                                       kLeastFloorShare * static_cast<double>(floor);
}

JointTracker::Look JointTracker::look(const Pyramid& now, const SightBelief& belief,
                                      int levels) const {
    Look found;
    sight(found, now, belief.before_from_now, levels);
    if (found.sightings.size() < static_cast<std::size_t>(config_.least_features)) {
        return found;
    }
    found.motion = solve_motion(camera_, found.sightings, belief);
    found.covariance = (found.motion.information + belief.information).inverse();
    found.status = judge_motion(found.motion, found.sightings.size());
    return found;
}

/// Follows the landmarks to where they are now.
void JointTracker::sight(Look& look, const Pyramid& now, const Pose2d& key_from_now,
                         int levels) const {
    ImagePoints points;
    for (const Landmark& landmark : key_->landmarks) {
        points.push_back(landmark.pixel);
    }
    const ImagePoints expected = guesses(key_from_now);
    const Flow flow = follow(key_->pyramid, now, points, expected, levels);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Landmark& landmark = key_->landmarks[i];
        const Eigen::Vector2d miss(flow.miss[i].x, flow.miss[i].y);
        const cv::Point2f place = landmark.across(expected[i], flow.now[i]);
        const auto ray = camera_.model().ray(pixel_of(place));
        if (!flow.good[i] || miss.dot(landmark.texture * miss) > kWayBack || !ray) {
            continue;
        }
        Sighting sighting;
        sighting.before = landmark.ray;
        sighting.now = ray->head<2>();
        sighting.information = landmark.texture * camera_.focal_length() * camera_.focal_length();
        sighting.belief = landmark.belief;
        sighting.floor = landmark.floor;
        look.sightings.push_back(sighting);
        look.owners.push_back(i);
        look.places.push_back(place);
    }
}

ImagePoints JointTracker::guesses(const Pose2d& key_from_now) const {
    ImagePoints points;
    for (const Landmark& landmark : key_->landmarks) {
        const auto pixel_at = [&](const Pose2d& pose) -> std::optional<Pixel> {
            const double rho = std::max(landmark.inverse_depth, 1e-6);
            const Eigen::Vector3d point = camera_.center() + camera_.direction(landmark.ray) / rho;
            const Eigen::Vector2d flat = pose.inverse() * Eigen::Vector2d(point.head<2>());
            return camera_.project({flat.x(), flat.y(), point.z()});
        };
        const auto there = pixel_at(key_from_now);
        const auto then = pixel_at(key_from_before_);
        if (!there || !then) {
            points.push_back(landmark.now);
            continue;
        }
        // What the prediction missed before it will miss again.
        const cv::Point2f guess(static_cast<float>(there->x()), static_cast<float>(there->y()));
        const cv::Point2f miss = landmark.now - cv::Point2f(static_cast<float>(then->x()),
                                                            static_cast<float>(then->y()));
        points.push_back(landmark.across(guess, guess + miss));
    }
    return points;
}

/// Where the robot goes by itself: never sideways, as far as it can be told; `speed_sigma` in m/s.
SightBelief JointTracker::belief_after(double elapsed, const Eigen::Vector3d& twist,
                                       double speed_sigma) const {
    SightBelief belief;
    const Pose2d step = Pose2d::exp(elapsed * Eigen::Vector3d(twist.x(), 0.0, twist.z()));
    belief.before_from_now = key_from_before_ * step;
    const double rate_sigma = twist_ ? kAngularAcceleration * elapsed : kTopRate;
    const Eigen::Vector3d sigma = elapsed * Eigen::Vector3d(speed_sigma, kSlip, rate_sigma);
    const Eigen::Matrix3d covariance = sigma.cwiseAbs2().asDiagonal();
    belief.information =
        (turned(covariance, belief.before_from_now.rotation()) + covariance_before_).inverse();
    belief.tilt_sigma = config_.tilt_sigma;
    belief.aim_information = aim_information_;
    return belief;
}

VisualStatus JointTracker::judge_motion(const SolvedMotion& motion, std::size_t sightings) {
    if (static_cast<double>(motion.inliers) < kLeastInlierShare * static_cast<double>(sightings) ||
        !motion.information.allFinite()) {
        return VisualStatus::kInconsistent;
    }
    const Eigen::Matrix3d covariance =
        (motion.information + 1e-6 * Eigen::Matrix3d::Identity()).inverse();
    if (covariance(2, 2) > kMostHeadingSigma * kMostHeadingSigma) {
        return VisualStatus::kTooFewFeatures;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>());
    return solver.eigenvalues()(1) > kMostSigma * kMostSigma ? VisualStatus::kGroundHidden
                                                             : VisualStatus::kGood;
}

/// The motion since the image before.
void JointTracker::report(const Look& look, VisualMotion& motion) const {
    motion.status = look.status;
    motion.before_from_now = between(key_from_before_, look.motion.before_from_now);
    // Both ends of the step were measured from the key image, each with an error of its own: more
    // than what is left of it in the sum of several steps.
    motion.covariance =
        turned(look.covariance + covariance_before_, key_from_before_.rotation().transpose());
}

/// What the next image is to start from.
void JointTracker::adopt(const Look& look, const VisualMotion& motion) {
    for (std::size_t i = 0; i < look.sightings.size(); ++i) {
        const Sighting& sighting = look.sightings[i];
        Landmark& landmark = key_->landmarks[look.owners[i]];
        landmark.now = look.places[i];
        landmark.inverse_depth = sighting.inverse_depth;
        features_.push_back(
            {pixel_of(landmark.pixel), pixel_of(landmark.now), sighting.on_floor, sighting.inlier});
    }
    key_from_before_ = look.motion.before_from_now;
    covariance_before_ = look.covariance;
    const double elapsed = motion.stamp - motion.from_stamp;
    if (elapsed > 1e-3) {
        const Eigen::Vector3d twist = motion.before_from_now.log() / elapsed;
        twist_ = twist_ ? Eigen::Vector3d(*twist_ + kTwistShare * (twist - *twist_)) : twist;
        twist_stamp_ = motion.stamp;
    }
}

/// What a key image and all that followed it say of how the camera really looks.
void JointTracker::learn_aim(const SolvedMotion& motion) {
    camera_ = camera_.turned_by(motion.aim);
    const Eigen::Matrix2d covariance = (aim_information_ + motion.aim_information).inverse() +
                                       kAimDrift * kAimDrift * Eigen::Matrix2d::Identity();
    aim_information_ = covariance.inverse();
}

/// What cannot be used breaks the chain: the next good image starts anew.
VisualMotion JointTracker::lose(VisualMotion motion, VisualStatus status) {
    motion.status = status;
    key_.reset();
    before_ = Pyramid();
    return motion;
}

bool JointTracker::worn_out(const Look& look) const {
    const Pose2d& moved = look.motion.before_from_now;
    return moved.translation.norm() > config_.keyframe_distance ||
           std::abs(moved.heading) > config_.keyframe_angle ||
           static_cast<double>(look.motion.inliers) <
               kWornShare * static_cast<double>(key_->landmarks.size());
}

}  // namespace hybrid_slam
