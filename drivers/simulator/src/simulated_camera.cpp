// SPDX-License-Identifier: Apache-2.0
#include "simulated_camera.hpp"

#include "camera_renderer.hpp"

namespace hybrid_slam {
namespace {

constexpr std::uint64_t kCameraStream = std::uint64_t{4} << 32U;
constexpr double kFirstImage = 0.02;  ///< seconds

std::uint64_t seed_of(const SimulatedDriveConfig& config) {
    return kCameraStream + static_cast<std::uint64_t>(config.seed);
}

}  // namespace

SimulatedCamera::SimulatedCamera(const World& world, const Motion& motion,
                                 const CameraConfig& camera, const SimulatedDriveConfig& config)
    : world_(world),
      motion_(motion),
      camera_(camera),
      jitter_(config.camera_jitter),
      bus_noise_(seed_of(config)) {
    draw_arrival();
}

double SimulatedCamera::next_stamp() const {
    return kFirstImage + static_cast<double>(images_) / camera_.rate;
}

void SimulatedCamera::draw_arrival() {
    arrival_ = next_stamp() + camera_.latency + jitter_ * bus_noise_.uniform();
}

CameraMoment SimulatedCamera::next() {
    const double time = next_stamp();
    CameraMoment moment{images_,
                        time,
                        arrival_,
                        motion_.world_from_robot(time),
                        motion_.twist(time),
                        world_.people_at(time)};
    ++images_;
    draw_arrival();
    return moment;
}

struct MomentRenderer::State {
    RenderConfig config;
    CameraRenderer renderer;
};

MomentRenderer::MomentRenderer(const World& world, const CameraConfig& camera,
                               const SimulatedDriveConfig& config)
    : state_(new State{config.render, CameraRenderer(world, camera.model, camera.mounting,
                                                     config.render, seed_of(config))}) {}
MomentRenderer::~MomentRenderer() = default;

EncodedImage MomentRenderer::render(const CameraMoment& moment) {
    const Image image =
        state_->renderer.render(moment.world_from_robot, moment.twist, moment.people, moment.number,
                                camera_light_at(state_->config, moment.stamp));
    return encode_jpeg(image, state_->config.jpeg_quality);
}

}  // namespace hybrid_slam
