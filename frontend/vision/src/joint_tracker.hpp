// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "landmarks.hpp"
#include "motion_solver.hpp"
#include "visual_tracker.hpp"

namespace hybrid_slam {

/// Features are followed from a key image until the robot has moved on or too few are left; the
/// motion since the key image is solved jointly, so that errors add up from key to key only.
class JointTracker : public VisualTracker {
  public:
    JointTracker(const CameraOnRobot& camera, const VisualOdometryConfig& config,
                 std::unique_ptr<FloorSegmenter> segmenter);

    void see(const Scan& scan) override { scan_ = scan; }
    VisualMotion track(const Image& image) override;
    void restart() override;
    const Features& features() const override { return features_; }

  private:
    struct Key {
        Pyramid pyramid;
        std::vector<Landmark> landmarks;
    };
    /// What one image says of the motion since the key image.
    struct Look {
        VisualStatus status = VisualStatus::kTooFewFeatures;
        SolvedMotion motion;
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< belief included
        std::vector<Sighting> sightings;
        std::vector<std::size_t> owners;  ///< landmarks of the sightings
        ImagePoints places;               ///< of the sightings
    };

    Pyramid pyramid_like_key(const cv::Mat& gray, double stamp) const;
    VisualStatus judge_light(const Pyramid& pyramid) const;
    void start_key(Pyramid pyramid, const ImagePoints& kept);
    std::optional<FloorBorder> border_at(double stamp) const;

    Look find_motion(const Pyramid& now, double elapsed) const;
    Look look(const Pyramid& now, const SightBelief& belief, int levels) const;
    void sight(Look& look, const Pyramid& now, const Pose2d& key_from_now, int levels) const;
    ImagePoints guesses(const Pose2d& key_from_now) const;
    SightBelief belief_after(double elapsed, const Eigen::Vector3d& twist,
                             double speed_sigma) const;
    static VisualStatus judge_motion(const SolvedMotion& motion, std::size_t sightings);
    static bool floor_is_lost(const Look& look);
    bool worn_out(const Look& look) const;

    void report(const Look& look, VisualMotion& motion) const;
    void adopt(const Look& look, const VisualMotion& motion);
    void learn_aim(const SolvedMotion& motion);
    VisualMotion lose(VisualMotion motion, VisualStatus status);

    CameraOnRobot camera_;
    VisualOdometryConfig config_;
    std::unique_ptr<FloorSegmenter> segmenter_;
    Eigen::Matrix2d aim_information_;  ///< of pitch and yaw of camera_, 1/rad2
    std::optional<Scan> scan_;
    std::optional<Key> key_;
    Pyramid before_;  ///< the image before, empty after one that was no good
    Pose2d key_from_before_;
    Eigen::Matrix3d covariance_before_ = Eigen::Matrix3d::Zero();
    std::optional<Eigen::Vector3d> twist_;  ///< m/s, m/s, rad/s
    double twist_stamp_ = 0.0;              ///< seconds
    std::optional<double> stamp_;
    Features features_;
    double usual_sharpness_ = 0.0;
};

}  // namespace hybrid_slam
