// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/sensors/sensor_source.hpp"

#include <utility>

namespace hybrid_slam {

struct SensorSource::State {
    State(SensorStream& stream_in, const RobotConfig& robot, Images images_in)
        : stream(stream_in),
          reader(robot.lidar),
          camera_latency(robot.camera.latency),
          images(images_in) {}

    std::optional<Image> image_of(const CameraFrame& frame);

    SensorStream& stream;
    LidarReader reader;
    double camera_latency;
    Images images;
    SensorCounts counts;
};

std::optional<Image> SensorSource::State::image_of(const CameraFrame& frame) {
    if (images == Images::kSkip) {
        return std::nullopt;
    }
    const ImageColor color = images == Images::kGray ? ImageColor::kGray : ImageColor::kBgr;
    std::optional<Image> image = decode_image(frame.image, color);
    if (!image) {
        ++counts.bad_images;
        return std::nullopt;
    }
    ++counts.images;
    image->stamp = frame.arrival - camera_latency;
    return image;
}

SensorSource::SensorSource(SensorStream& stream, const RobotConfig& robot, Images images)
    : state_(std::make_unique<State>(stream, robot, images)) {}
SensorSource::~SensorSource() = default;

std::optional<Measurement> SensorSource::next() {
    while (true) {
        if (std::optional<Scan> scan = state_->reader.next()) {
            return Measurement(std::move(*scan));
        }
        const std::optional<SensorEvent> event = state_->stream.next();
        if (!event) {
            return std::nullopt;
        }
        if (const auto* bytes = std::get_if<LidarBytes>(&*event)) {
            state_->reader.push(*bytes);
        } else if (auto image = state_->image_of(std::get<CameraFrame>(*event))) {
            return Measurement(std::move(*image));
        }
    }
}

double SensorSource::progress() const {
    return state_->stream.progress();
}

const SensorCounts& SensorSource::counts() const {
    state_->counts.lidar = state_->reader.counts();
    return state_->counts;
}

}  // namespace hybrid_slam
