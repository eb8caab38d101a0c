// SPDX-License-Identifier: Apache-2.0
#include "view.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr int kFirstStanding = 2;
constexpr double kBackdrop = 250.0;  ///< metres; farther off there is haze
constexpr double kMargin = 0.2;      ///< around what may be seen: metres, and of the tangent

Eigen::Vector2d ahead_and_left(const CameraPose& pose, const Point2& point) {
    const Eigen::Vector2d offset = point - pose.position.head<2>();
    return {pose.ahead.dot(offset), pose.ahead.x() * offset.y() - pose.ahead.y() * offset.x()};
}

/// Of a level plane `above` the camera (negative: below), its cells counted from `origin`.
PlaneMap level_map(const CameraPose& pose, double above, const Eigen::Vector2d& origin,
                   double texels_per_metre) {
    const Eigen::Matrix3d& world = pose.world_from_camera;
    const Eigen::RowVector3d w = (above > 0.0 ? 1.0 : -1.0) * world.row(2);
    const Eigen::Vector2d from_origin = pose.position.head<2>() - origin;
    Eigen::Matrix3d rows;
    rows.row(0) = texels_per_metre * (from_origin.x() * w + std::abs(above) * world.row(0));
    rows.row(1) = texels_per_metre * (from_origin.y() * w + std::abs(above) * world.row(1));
    rows.row(2) = w;
    return {rows.cast<float>()};
}

/// With normal n and the camera c, the ray r meets the wall n (s - p) = 0 at t = n (s - c) / n r;
/// along it at a (c + t r - s), at the height c_z + t r_z.
PlaneMap wall_map(const CameraPose& pose, const WallSurface& wall, double height, double texels) {
    const Eigen::Vector2d normal(-wall.along.y(), wall.along.x());
    const Eigen::Vector2d from_start = pose.position.head<2>() - wall.segment.start;
    const double distance = -normal.dot(from_start);
    const auto world_rows = pose.world_from_camera.topRows<2>();
    const Eigen::RowVector3d w = (distance > 0.0 ? 1.0 : -1.0) * normal.transpose() * world_rows;
    const Eigen::RowVector3d along = wall.along.transpose() * world_rows;
    Eigen::Matrix3d rows;
    rows.row(0) = texels * wall.u_cells / wall.length *
                      (wall.along.dot(from_start) * w + std::abs(distance) * along) +
                  texels * wall.u_start * w;
    rows.row(1) = texels * wall.v_cells / height *
                  (pose.position.z() * w + std::abs(distance) * pose.world_from_camera.row(2));
    rows.row(2) = w;
    return {rows.cast<float>()};
}

}  // namespace

View::View(const Scene& scene, const CameraMounting& mounting, const RenderConfig& config,
           const LensMap& lens)
    : scene_(scene),
      lens_(lens),
      mounting_(mounting),
      floor_tile_(config.floor_tile),
      wall_height_(config.wall_height),
      ceiling_height_(config.ceiling_height),
      first_entry_(HorizonFaces::kFaces * lens.faces.entries),
      texels_(scene.atlas.side()) {
    for (const LensBlock& block : lens.blocks) {
        first_entry_ = std::min(first_entry_, block.least_entry);
        last_entry_ = std::max(last_entry_, block.most_entry);
    }
}

CameraPose View::pose_at(const Pose2d& world_from_robot) const {
    const Eigen::Isometry3d robot_from_camera = mounting_.robot_from_camera();
    const Eigen::AngleAxisd turn(world_from_robot.heading, Eigen::Vector3d::UnitZ());
    CameraPose pose;
    pose.world_from_camera = turn * robot_from_camera.linear();
    pose.position = turn * robot_from_camera.translation();
    pose.position.head<2>() += world_from_robot.translation;
    const double yaw = world_from_robot.heading + mounting_.yaw;
    pose.ahead = {std::cos(yaw), std::sin(yaw)};
    return pose;
}

/// Only tried when the image lies within the face ahead.
bool View::is_out_of_sight(const Segment& segment) const {
    const int entries = lens_.faces.entries;
    if (first_entry_ < entries || last_entry_ > 2 * entries) {
        return false;
    }
    const double margin = kMargin + 2.0 * turned_;
    const double least = 2.0 * first_entry_ / entries - 3.0 - margin;
    const double most = 2.0 * last_entry_ / entries - 3.0 + margin;
    const Eigen::Vector2d start = ahead_and_left(middle_, segment.start);
    const Eigen::Vector2d end = ahead_and_left(middle_, segment.end);
    const double reach = kMargin + moved_;
    return (start.x() < -reach && end.x() < -reach) ||
           (start.y() < least * start.x() - reach && end.y() < least * end.x() - reach) ||
           (start.y() > most * start.x() + reach && end.y() > most * end.x() + reach);
}

void View::look(const Pose2d& world_from_robot, const Eigen::Vector3d& twist,
                const std::vector<double>& moments, const std::vector<Circle>& people) {
    middle_ = pose_at(world_from_robot);
    std::vector<CameraPose> poses;
    moved_ = 0.0;
    turned_ = 0.0;
    for (const double moment : moments) {
        poses.push_back(pose_at(world_from_robot * Pose2d::exp(moment * twist)));
        moved_ = std::max(moved_, (poses.back().position - middle_.position).norm());
        turned_ = std::max(turned_, std::abs(moment * twist.z()));
    }
    collect(people);
    maps_.clear();
    map_all(middle_);
    while (skylines_.size() < moments.size()) {
        skylines_.emplace_back(lens_.faces, first_entry_, last_entry_);
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
        map_all(poses[i]);
        fill(skylines_[i], poses[i]);
    }
}

void View::collect(const std::vector<Circle>& people) {
    slots_.clear();
    standing_.clear();
    heights_.clear();
    lay_level_slot(floor_tile_, scene_.floor, Slot::Kind::kFloor);
    lay_level_slot(kRoofCell, scene_.roof, Slot::Kind::kRoof);
    add_backdrop();
    for (const WallSurface& wall : scene_.walls) {
        if (!is_out_of_sight(wall.segment)) {
            add_standing(wall, wall_height_, Slot::Kind::kWall);
        }
    }
    for (std::size_t i = 0; i < people.size(); ++i) {
        add_person(people[i], i);
    }
}

void View::add_standing(const WallSurface& surface, double height, Slot::Kind kind) {
    Slot slot;
    slot.kind = kind;
    slot.cells = surface.cells;
    slot.shade = surface.shade;
    slot.u_least = static_cast<float>(texels_ * surface.u_start);
    slot.u_most = static_cast<float>(texels_ * (surface.u_start + surface.u_cells));
    slot.v_most = static_cast<float>(texels_ * surface.v_cells);
    const double metres = surface.length / (texels_ * surface.u_cells);
    slot.u_step = (metres * surface.along).cast<float>();
    slot.origin =
        (surface.segment.start - metres * texels_ * surface.u_start * surface.along).cast<float>();
    slot.rise = static_cast<float>(height / (texels_ * surface.v_cells));
    slots_.push_back(slot);
    standing_.push_back(surface);
    heights_.push_back(height);
}

/// As a picture on a board that faces the camera.
void View::add_person(const Circle& person, std::size_t number) {
    const Eigen::Vector2d towards = person.center - middle_.position.head<2>();
    if (!(towards.norm() > person.radius) || !(person.radius > 0.0)) {
        return;
    }
    const Eigen::Vector2d half =
        person.radius * Eigen::Vector2d(-towards.y(), towards.x()).normalized();
    WallSurface board;
    board.segment = {person.center + half, person.center - half};
    board.length = 2.0 * person.radius;
    board.along = -half.normalized();
    board.v_cells = 3.0;
    const std::size_t figure = number % scene_.figures.size();
    board.cells = scene_.figures[figure].cells;
    add_standing(board, kPersonHeight, Slot::Kind::kPerson);
    slots_.back().figure = figure;
}

void View::add_backdrop() {
    const Point2 center = middle_.position.head<2>();
    const std::array<Point2, 4> corners = {
        center + Point2(kBackdrop, -kBackdrop), center + Point2(kBackdrop, kBackdrop),
        center + Point2(-kBackdrop, kBackdrop), center + Point2(-kBackdrop, -kBackdrop)};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        WallSurface side;
        side.segment = {corners[i], corners[(i + 1) % corners.size()]};
        side.length = 2.0 * kBackdrop;
        side.along = (side.segment.end - side.segment.start) / side.length;
        side.cells = scene_.haze;
        add_standing(side, wall_height_, Slot::Kind::kWall);
    }
}

/// Cells are counted from whole periods before the camera on: small numbers are more exact.
Eigen::Vector2d View::level_origin(double cell, const CellGrid& cells) const {
    const double period = cell * (1 << cells.u_bits);
    return period * ((middle_.position.head<2>() / period).array().floor() - 2.0);
}

void View::lay_level_slot(double cell, const CellGrid& cells, Slot::Kind kind) {
    Slot slot;
    slot.kind = kind;
    slot.cells = cells;
    slot.origin = level_origin(cell, cells).cast<float>();
    slot.u_step.x() = static_cast<float>(cell / texels_);
    slot.v_step.y() = static_cast<float>(cell / texels_);
    slot.u_most = 1e6F;
    slot.v_most = 1e6F;
    slots_.push_back(slot);
}

void View::map_all(const CameraPose& pose) {
    const double height = pose.position.z();
    maps_.push_back(
        level_map(pose, -height, level_origin(floor_tile_, scene_.floor), texels_ / floor_tile_));
    maps_.push_back(level_map(pose, ceiling_height_ - height, level_origin(kRoofCell, scene_.roof),
                              texels_ / kRoofCell));
    for (std::size_t i = 0; i < standing_.size(); ++i) {
        maps_.push_back(wall_map(pose, standing_[i], heights_[i], texels_));
    }
}

void View::fill(Skyline& skyline, const CameraPose& pose) const {
    skyline.clear();
    for (std::size_t i = 0; i < standing_.size(); ++i) {
        const Segment& segment = standing_[i].segment;
        const Eigen::Vector2d start = ahead_and_left(pose, segment.start);
        const Eigen::Vector2d end = ahead_and_left(pose, segment.end);
        const int slot = kFirstStanding + static_cast<int>(i);
        if (slots_[static_cast<std::size_t>(slot)].kind == Slot::Kind::kPerson) {
            skyline.add_person(start, end, slot);
        } else {
            skyline.add_wall(start, end, slot);
        }
    }
    skyline.finish();
}

}  // namespace hybrid_slam
