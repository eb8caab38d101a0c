// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

namespace hybrid_slam::tools {

/// What happens when somebody clicks corners in a window that shows an image: the logic alone, fed
/// with the events of any window. Four corners and Enter end it.
class CornerPicker {
  public:
    static constexpr std::size_t kCorners = 4;

    enum class State { kPicking, kAccepted, kCancelled };

    /// The image is shown as large as fits into `most_width` x `most_height` pixels of the window,
    /// enlarged by three at most.
    CornerPicker(const Eigen::Vector2i& image_size, const Eigen::Vector2i& most_size);

    Eigen::Vector2i window_size() const;
    double scale() const { return scale_; }  ///< window pixels for each pixel of the image

    /// All positions are whole pixels of the window; clicks outside of the image do nothing, as do
    /// those after the fourth corner.
    void move(const Eigen::Vector2i& mouse);
    void click(const Eigen::Vector2i& mouse);
    void undo();  ///< takes the last corner back
    void close() { state_ = State::kCancelled; }
    /// Enter accepts four corners, Backspace and Delete undo, Escape and q cancel; as OpenCV tells
    /// keys, in the lowest byte; -1 is none.
    void press(int key);

    State state() const { return state_; }
    /// In pixels of the image, of which the centre of the first is (0, 0); in order of clicking.
    const std::vector<Eigen::Vector2d>& corners() const { return corners_; }
    /// Where the mouse is, in pixels of the image.
    const Eigen::Vector2d& mouse() const { return mouse_; }
    Eigen::Vector2d to_image(const Eigen::Vector2i& in_window) const;
    Eigen::Vector2d to_window(const Eigen::Vector2d& in_image) const;
    std::string prompt() const;  ///< what to do next

  private:
    bool shows(const Eigen::Vector2i& in_window) const;

    Eigen::Vector2i image_size_;
    double scale_;
    std::vector<Eigen::Vector2d> corners_;
    Eigen::Vector2d mouse_ = Eigen::Vector2d::Zero();
    State state_ = State::kPicking;
};

}  // namespace hybrid_slam::tools
