// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <vector>

#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/pose2.hpp"
#include "scene.hpp"
#include "skyline.hpp"

namespace hybrid_slam {

/// Takes a ray (x, y, 1) of the camera to the texel (U / W, V / W) of level 0 that it meets on a
/// plane: a homography. W is positive where the plane lies ahead.
struct PlaneMap {
    Eigen::Matrix3f rows = Eigen::Matrix3f::Zero();

    Eigen::Vector2f meet(const Eigen::Vector3f& ray) const {
        const Eigen::Vector3f met = rows * ray;
        return met.head<2>() / std::max(met.z(), kLeastDepthShare);
    }
};

/// A surface as one frame sees it.
struct Slot {
    enum class Kind { kFloor, kRoof, kWall, kPerson };

    Kind kind = Kind::kWall;
    CellGrid cells;
    float u_least = 0.0F;  ///< texels of level 0
    float u_most = 0.0F;
    float v_most = 0.0F;
    float shade = 1.0F;
    /// The place (x, y) in the world is origin + u u_step + v v_step; walls rise by `rise` per v.
    Eigen::Vector2f origin = Eigen::Vector2f::Zero();
    Eigen::Vector2f u_step = Eigen::Vector2f::Zero();
    Eigen::Vector2f v_step = Eigen::Vector2f::Zero();
    float rise = 0.0F;
    std::size_t figure = 0;  ///< of Scene::figures, for a person
};

/// The camera in the world at one moment.
struct CameraPose {
    Eigen::Matrix3d world_from_camera;
    Eigen::Vector3d position;
    Eigen::Vector2d ahead;  ///< level, of length 1
};

/// What stands where around the camera during one exposure.
class View {
  public:
    static constexpr int kFloorSlot = 0;
    static constexpr int kRoofSlot = 1;

    View(const Scene& scene, const CameraMounting& mounting, const RenderConfig& config,
         const LensMap& lens);

    /// The moments are times in seconds around that of `world_from_robot`.
    void look(const Pose2d& world_from_robot, const Eigen::Vector3d& twist,
              const std::vector<double>& moments, const std::vector<Circle>& people);

    const std::vector<Slot>& slots() const { return slots_; }
    /// In the middle of the exposure.
    const PlaneMap& map(int slot) const { return maps_[static_cast<std::size_t>(slot)]; }
    const PlaneMap& map(std::size_t moment, int slot) const {
        return maps_[(moment + 1) * slots_.size() + static_cast<std::size_t>(slot)];
    }
    const Skyline& skyline(std::size_t moment) const { return skylines_[moment]; }
    const CameraPose& middle() const { return middle_; }

  private:
    CameraPose pose_at(const Pose2d& world_from_robot) const;
    bool is_out_of_sight(const Segment& segment) const;
    void collect(const std::vector<Circle>& people);
    void add_standing(const WallSurface& surface, double height, Slot::Kind kind);
    void add_person(const Circle& person, std::size_t number);
    void add_backdrop();
    Eigen::Vector2d level_origin(double cell, const CellGrid& cells) const;
    void lay_level_slot(double cell, const CellGrid& cells, Slot::Kind kind);
    void map_all(const CameraPose& pose);
    void fill(Skyline& skyline, const CameraPose& pose) const;

    const Scene& scene_;
    const LensMap& lens_;
    CameraMounting mounting_;
    double floor_tile_;
    double wall_height_;
    double ceiling_height_;
    int first_entry_ = 0;
    int last_entry_ = 0;
    double texels_;  ///< of a cell's side

    CameraPose middle_;
    double moved_ = 0.0;                 ///< metres, at most, from there in the exposure
    double turned_ = 0.0;                ///< radians
    std::vector<WallSurface> standing_;  ///< their slots begin at kFirstStanding
    std::vector<double> heights_;
    std::vector<Slot> slots_;
    std::vector<PlaneMap> maps_;
    std::vector<Skyline> skylines_;
};

}  // namespace hybrid_slam
