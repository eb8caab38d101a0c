// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "lens_map.hpp"

namespace hybrid_slam {

/// What stands nearest in each horizontal direction of the camera: a depth buffer of one row.
/// Things are numbered by slots, as the caller likes.
class Skyline {
  public:
    static constexpr int kNone = -1;

    /// What one direction meets; nearness is 1 / depth before the face.
    struct Layer {
        std::vector<float> nearness;
        std::vector<int> slot;
    };

    /// Has the entries from `first` up to `last`.
    Skyline(const HorizonFaces& faces, int first, int last);

    /// Nothing stands anywhere.
    void clear();
    /// From `start` to `end`, in metres ahead and to the left of the camera.
    void add_wall(const Eigen::Vector2d& start, const Eigen::Vector2d& end, int slot) {
        add(walls_, start, end, slot);
    }
    /// In front of walls, but lower; the nearer one hides the other whole.
    void add_person(const Eigen::Vector2d& start, const Eigen::Vector2d& end, int slot) {
        add(people_, start, end, slot);
        has_people_ = true;
    }
    /// After the last one.
    void finish();

    int first() const { return first_; }
    int size() const { return static_cast<int>(run_end_.size()); }
    const Layer& walls() const { return walls_; }
    const Layer& people() const { return people_; }
    bool has_people() const { return has_people_; }
    /// The last index up to which the same wall goes on, and the first from here with a person.
    const std::vector<int>& run_end() const { return run_end_; }
    const std::vector<int>& next_person() const { return next_person_; }

  private:
    void add(Layer& layer, const Eigen::Vector2d& start, const Eigen::Vector2d& end, int slot);
    void add_in_face(Layer& layer, Eigen::Vector2d start, Eigen::Vector2d end, int face, int slot);

    HorizonFaces faces_;
    int first_;
    Layer walls_;
    Layer people_;
    bool has_people_ = false;
    std::vector<int> run_end_;
    std::vector<int> next_person_;
};

}  // namespace hybrid_slam
