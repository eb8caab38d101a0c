// SPDX-License-Identifier: Apache-2.0
#include "corner_picker.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam::tools {

CornerPicker::CornerPicker(const Eigen::Vector2i& image_size, const Eigen::Vector2i& most_size)
    : image_size_(image_size),
      scale_(std::min({3.0, static_cast<double>(most_size.x()) / image_size.x(),
                       static_cast<double>(most_size.y()) / image_size.y()})) {}

Eigen::Vector2i CornerPicker::window_size() const {
    const auto side = [this](int pixels) {
        return std::max(1, static_cast<int>(std::lround(scale_ * pixels)));
    };
    return {side(image_size_.x()), side(image_size_.y())};
}

Eigen::Vector2d CornerPicker::to_image(const Eigen::Vector2i& in_window) const {
    const Eigen::Vector2d half(0.5, 0.5);  // pixels have their centres at whole numbers
    return (in_window.cast<double>() + half) / scale_ - half;
}

Eigen::Vector2d CornerPicker::to_window(const Eigen::Vector2d& in_image) const {
    const Eigen::Vector2d half(0.5, 0.5);
    return (in_image + half) * scale_ - half;
}

bool CornerPicker::shows(const Eigen::Vector2i& in_window) const {
    return (in_window.array() >= 0).all() && (in_window.array() < window_size().array()).all();
}

void CornerPicker::move(const Eigen::Vector2i& mouse) {
    if (shows(mouse)) {
        mouse_ = to_image(mouse);
    }
}

void CornerPicker::click(const Eigen::Vector2i& mouse) {
    move(mouse);
    if (state_ == State::kPicking && corners_.size() < kCorners && shows(mouse)) {
        corners_.push_back(to_image(mouse));
    }
}

void CornerPicker::undo() {
    if (state_ == State::kPicking && !corners_.empty()) {
        corners_.pop_back();
    }
}

void CornerPicker::press(int key) {
    if (key < 0 || state_ != State::kPicking) {
        return;
    }
    switch (key & 0xFF) {
        case '\r':
        case '\n':
            if (corners_.size() == kCorners) {
                state_ = State::kAccepted;
            }
            return;
        case '\b':
        case 0x7F:  // Delete in ASCII
        case 0xFF:  // and as X11 spells it
            undo();
            return;
        case 0x1B:  // Escape
        case 'q':
            close();
            return;
        default:
            return;
    }
}

std::string CornerPicker::prompt() const {
    if (corners_.size() == kCorners) {
        return "Enter: take these   right click: take the last one back   Esc: give up";
    }
    return "Click corner " + std::to_string(corners_.size() + 1) + " of " +
           std::to_string(kCorners) + " of the tile   right click: take the last one back";
}

}  // namespace hybrid_slam::tools
