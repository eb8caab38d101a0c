// SPDX-License-Identifier: Apache-2.0
#include "camera_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "blocks.hpp"
#include "film.hpp"
#include "hash.hpp"
#include "hybrid_slam/core/error.hpp"
#include "looks.hpp"

namespace hybrid_slam {
namespace {

constexpr double kPixelSigma = 0.2887;  ///< pixels, of a square of one pixel: 1 / sqrt(12)
constexpr unsigned kMostGroupBits = 3;
/// What comes through around a covered lens, the same for all pixels: gray levels, and one of each
/// colour.
constexpr float kCoveredLevel = 3.0F;
constexpr Texel kGray = 1U | 1U << kFieldBits | 1U << (2 * kFieldBits);
/// Where the four rays of a group go through the pixel, in half spacings: each column and each row
/// has one.
constexpr std::array<std::array<int, 2>, 4> kPlaces = {{{-3, -1}, {-1, 3}, {1, -3}, {3, 1}}};

/// In (0, 1): the digits of the number to that base behind the point.
float halton(std::size_t number, std::size_t base) {
    double share = 0.0;
    double digit = 1.0;
    for (std::size_t rest = number + 1; rest > 0; rest /= base) {
        digit /= static_cast<double>(base);
        share += digit * static_cast<double>(rest % base);
    }
    return static_cast<float>(share);
}

/// Rays spread over the pixel, and wider by the lens's blur.
double spacing_of(const RenderConfig& config) {
    return 0.25 * std::hypot(1.0, config.blur / kPixelSigma);
}

/// So fine that the nearest floor in sight is shown well.
int side_bits_of(const CameraModel& model, const CameraMounting& mounting,
                 const RenderConfig& config) {
    const Eigen::Isometry3d robot_from_camera = mounting.robot_from_camera();
    double steepest = 0.05;
    for (const int row : {0, model.height - 1}) {
        for (const int column : {0, model.width - 1}) {
            if (const auto ray = model.ray(Pixel(column, row))) {
                steepest = std::max(steepest, -(robot_from_camera.linear() * *ray).z());
            }
        }
    }
    // One pixel covers z / f across; z is the depth along the optical axis.
    const double footprint = mounting.z / steepest / std::max(model.fx, model.fy);
    constexpr int kLeast = 6;
    constexpr int kMost = 8;
    int bits = kLeast;
    while (bits < kMost && config.floor_tile / (1 << bits) > footprint) {
        ++bits;
    }
    return bits;
}

void check_spans(std::string_view key, const std::vector<double>& spans) {
    bool ordered = spans.size() % 2 == 0;
    for (std::size_t i = 1; i < spans.size(); i += 2) {
        ordered = ordered && spans[i - 1] < spans[i];
    }
    if (!ordered) {
        throw Error("render." + std::string(key) +
                    ": must hold pairs of from and to in seconds, from before to");
    }
}

bool is_within(const std::vector<double>& spans, double time) {
    for (std::size_t i = 1; i < spans.size(); i += 2) {
        if (time >= spans[i - 1] && time < spans[i]) {
            return true;
        }
    }
    return false;
}

RenderConfig checked(const RenderConfig& config, const CameraMounting& mounting) {
    RenderConfig copy = config;
    ConfigSchema schema;
    describe(schema, copy);
    for (const ConfigField& field : schema.fields()) {
        field.set(field.get());
    }
    if (!(mounting.z < config.wall_height)) {
        throw Error("wall_height: must be more than the camera's mounting.z");
    }
    if (config.ceiling_height < config.wall_height) {
        throw Error("ceiling_height: must not be less than wall_height");
    }
    check_spans("covered", config.covered);
    check_spans("dimmed", config.dimmed);
    return config;
}

}  // namespace

struct CameraRenderer::State {
    State(const World& world, const CameraModel& model_in, const CameraMounting& mounting_in,
          const RenderConfig& config_in, std::uint64_t seed)
        : model(model_in),
          mounting(mounting_in),
          config(checked(config_in, mounting_in)),
          scene(world, config, side_bits_of(model, mounting, config), hash(seed, 101)),
          lens(model, mounting, config.vignetting, 1.5 * spacing_of(config)),
          looks(scene, lens, model, config),
          view(scene, mounting, config, lens),
          mixed(looks),
          film(model.width, config.noise_sigma, hash(seed, 102)) {}

    Eigen::Vector2d smear(const Eigen::Vector3d& twist) const;
    Rays rays_for(const Eigen::Vector3d& twist) const;
    void take_along_motion(const Eigen::Vector2d& smeared, Rays& rays) const;
    void scatter(Rays& rays) const;
    void paint(const Rays& rays, int block, BlockLight& light);

    CameraModel model;
    CameraMounting mounting;
    RenderConfig config;
    Scene scene;
    LensMap lens;
    Looks looks;
    View view;
    MixedPainter mixed;
    Film film;
};

/// Pixels over which the nearest floor, or in a turn all, moves across and down the image in the
/// exposure. Roughly: more rays than needed do no harm.
Eigen::Vector2d CameraRenderer::State::smear(const Eigen::Vector3d& twist) const {
    constexpr double kSteepest = 1.5;
    double steepest = 0.1;
    for (const LensBlock& block : lens.blocks) {
        steepest = std::clamp(-static_cast<double>(block.least_slope), steepest, kSteepest);
    }
    const Eigen::Vector2d velocity(twist.x() - twist.z() * mounting.y,
                                   twist.y() + twist.z() * mounting.x);
    const Eigen::Vector2d ahead = Eigen::Rotation2Dd(-mounting.yaw) * velocity;
    const double nearest = mounting.z / steepest;
    return config.exposure * Eigen::Vector2d(model.fx * (twist.z() + ahead.y() / nearest),
                                             model.fy * ahead.x() / nearest * steepest);
}

Rays CameraRenderer::State::rays_for(const Eigen::Vector3d& twist) const {
    constexpr double kStill = 0.1;       // pixels
    constexpr double kTwoMoments = 2.0;  // pixels
    constexpr double kPerGroup = 6.0;    // pixels
    const Eigen::Vector2d smeared = smear(twist);
    const double length = smeared.norm();
    Rays rays;
    rays.spacing = static_cast<float>(spacing_of(config));
    while (rays.group_bits < kMostGroupBits && length > kPerGroup * (1U << rays.group_bits)) {
        ++rays.group_bits;
    }
    for (const auto& [du, dv] : kPlaces) {
        const float half = 0.5F * rays.spacing;
        rays.samples.push_back({half * static_cast<float>(du), half * static_cast<float>(dv), 0});
    }
    if (length < kStill) {
        rays.moments = {0.0};
    } else if (length < kTwoMoments) {
        // With the variance of the whole exposure, and neither goes with one side of the pixel.
        rays.moments = {-kPixelSigma * config.exposure, kPixelSigma * config.exposure};
        rays.samples[1].moment = 1;
        rays.samples[2].moment = 1;
    } else if (rays.group_bits == 0) {
        take_along_motion(smeared, rays);
    } else {
        scatter(rays);
    }
    return rays;
}

/// Each ray at its own moment, in the order in which they lie along the motion, so that place and
/// moment together draw one line of evenly spaced points without gaps; its length is then such
/// that its variance is that of the motion and the pixel.
void CameraRenderer::State::take_along_motion(const Eigen::Vector2d& smeared, Rays& rays) const {
    const std::size_t axis = std::abs(smeared.x()) >= std::abs(smeared.y()) ? 0 : 1;
    const double motion = smeared[static_cast<int>(axis)];
    const double pixel = 4.0 * static_cast<double>(rays.spacing);
    // What moves by m in the image is met by the ray at u - m.
    const double scale = (pixel - std::hypot(motion, pixel)) / motion * config.exposure;
    for (std::size_t i = 0; i < rays.samples.size(); ++i) {
        rays.moments.push_back(scale * kPlaces[i][axis] / 8.0);
        rays.samples[i].moment = i;
    }
}

/// Many rays, evenly spread in time, and in the pixel as Halton's sequence does.
void CameraRenderer::State::scatter(Rays& rays) const {
    const std::size_t count = 4U << rays.group_bits;
    const float width = 4.0F * rays.spacing;
    Eigen::Vector2f mean = Eigen::Vector2f::Zero();
    rays.samples.clear();
    for (std::size_t i = 0; i < count; ++i) {
        const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count) - 0.5;
        rays.moments.push_back(config.exposure * share);
        rays.samples.push_back({width * halton(i, 2), width * halton(i, 3), i});
        mean += Eigen::Vector2f(rays.samples.back().du, rays.samples.back().dv);
    }
    mean /= static_cast<float>(count);
    for (RaySample& sample : rays.samples) {
        sample.du -= mean.x();
        sample.dv -= mean.y();
    }
}

void CameraRenderer::State::paint(const Rays& rays, int block, BlockLight& light) {
    const Exposure exposure{looks, view, rays};
    const int slot = only_slot(exposure, block);
    if (slot == Skyline::kNone) {
        mixed.paint(view, rays, block, light);
    } else {
        paint_surface(exposure, block, slot, light);
    }
}

CameraRenderer::CameraRenderer(const World& world, const CameraModel& model,
                               const CameraMounting& mounting, const RenderConfig& config,
                               std::uint64_t seed)
    : state_(std::make_unique<State>(world, model, mounting, config, seed)) {}
CameraRenderer::~CameraRenderer() = default;
CameraRenderer::CameraRenderer(CameraRenderer&&) noexcept = default;
CameraRenderer& CameraRenderer::operator=(CameraRenderer&&) noexcept = default;

Image CameraRenderer::render(const Pose2d& world_from_robot, const Eigen::Vector3d& twist,
                             const std::vector<Circle>& people, std::uint64_t frame,
                             const CameraLight& camera_light) {
    State& state = *state_;
    Image image;
    image.width = state.model.width;
    image.height = state.model.height;
    image.channels = 3;
    image.pixels.resize(static_cast<std::size_t>(image.width * image.height) * 3);
    const Rays rays = state.rays_for(twist);
    state.looks.brightness = static_cast<float>(camera_light.lamps * state.config.brightness);
    state.view.look(world_from_robot, twist, rays.moments, people);
    state.film.expose(frame, image.height);
    BlockLight light;
    light.sums.setConstant(kGray);
    light.gains.setConstant(kCoveredLevel);
    for (int block = 0; block < static_cast<int>(state.lens.blocks.size()); ++block) {
        if (!camera_light.covered) {
            state.paint(rays, block, light);
        }
        const int column = block % state.lens.blocks_across * kBlock;
        const int row = block / state.lens.blocks_across * kBlock;
        state.film.develop(light, column, row, image);
    }
    return image;
}

CameraLight camera_light_at(const RenderConfig& config, double time) {
    constexpr double kDimmed = 0.5;
    return {is_within(config.dimmed, time) ? kDimmed : 1.0, is_within(config.covered, time)};
}

}  // namespace hybrid_slam
