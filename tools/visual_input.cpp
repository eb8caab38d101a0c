// SPDX-License-Identifier: Apache-2.0
#include "visual_input.hpp"

#include <utility>

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

class VisualInput : public Input {
  public:
    VisualInput(std::unique_ptr<Input> input, const VisionConfig& config)
        : input_(std::move(input)),
          odometry_(visual_odometry_of(*input_->camera(), config)),
          source_(input_->source(), odometry_) {}

    Source& source() override { return source_; }
    bool live() const override { return input_->live(); }
    double now() const override { return input_->now(); }
    Json counts() const override {
        Json counts = input_->counts();
        counts["vision"] = to_json(source_.counts());
        return counts;
    }
    std::vector<std::string> warnings() const override {
        std::vector<std::string> warnings = input_->warnings();
        const std::vector<std::string> more = warnings_of(source_.counts());
        warnings.insert(warnings.end(), more.begin(), more.end());
        return warnings;
    }

  private:
    std::unique_ptr<Input> input_;
    VisualOdometry odometry_;
    VisualSource source_;
};

}  // namespace

Json to_json(const VisualCounts& counts) {
    Json statuses = Json::object();
    for (const auto& [status, count] : counts.statuses) {
        statuses[std::string(to_string(status))] = count;
    }
    return {{"images", counts.images},
            {"backward", counts.backward},
            {"wrong_size", counts.wrong_size},
            {"statuses", statuses}};
}

std::vector<std::string> warnings_of(const VisualCounts& counts) {
    return warnings_of(std::vector<Loss>{
        {counts.backward, "", "images stamped no later than the one before"},
        {counts.wrong_size, "", "images of another size than the camera model's"}});
}

VisualOdometry visual_odometry_of(const CameraConfig& camera, const VisionConfig& config) {
    std::unique_ptr<FloorSegmenter> segmenter;
    if (!config.segmentation.file.empty() && config.odometry.method == VisualMethod::kJoint) {
        segmenter = std::make_unique<DnnFloorSegmenter>(config.segmentation);
    }
    return {camera.model, camera.mounting, config.odometry, std::move(segmenter)};
}

std::unique_ptr<Input> with_vision(std::unique_ptr<Input> input, const VisionConfig& config) {
    if (input->camera() == nullptr) {
        return input;
    }
    return std::make_unique<VisualInput>(std::move(input), config);
}

}  // namespace hybrid_slam::tools
