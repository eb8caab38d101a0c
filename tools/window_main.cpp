// SPDX-License-Identifier: Apache-2.0
// The window of 'hybrid-slam calibrate ground': see corner_window.hpp.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <iostream>
#include <opencv2/highgui.hpp>
#include <opencv2/imgproc.hpp>

#include "corner_picker.hpp"

namespace {

using hybrid_slam::tools::CornerPicker;

constexpr auto kTitle = "hybrid-slam: corners of the floor tile";
constexpr int kGivenUp = 3;
constexpr int kBar = 26;               // pixels, of the prompt at the top: tiles lie at the bottom
const cv::Scalar kMark(60, 60, 230);   // BGR
const cv::Scalar kInk(255, 255, 255);  // of letters

cv::Mat read_image() {
    int width = 0;
    int height = 0;
    int channels = 0;
    std::cin >> width >> height >> channels;
    const bool fits = width > 0 && height > 0 && width <= 20000 && height <= 20000 &&
                      (channels == 1 || channels == 3) && std::cin.get() == '\n';
    if (!fits) {
        return {};
    }
    cv::Mat image(height, width, channels == 1 ? CV_8UC1 : CV_8UC3);
    const auto bytes = static_cast<std::streamsize>(image.total() * image.elemSize());
    if (!std::cin.read(reinterpret_cast<char*>(image.data), bytes)) {  // NOLINT
        return {};
    }
    if (channels == 1) {
        cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
    }
    return image;
}

cv::Point point(const Eigen::Vector2d& at) {
    return {cvRound(at.x()), cvRound(at.y())};
}

/// What lies under the mouse, eight times as large, in the corner of the window away from it.
void draw_magnifier(const cv::Mat& image, const CornerPicker& picker, cv::Mat& picture) {
    constexpr int kReach = 10;  // pixels of the image
    constexpr int kTimes = 8;
    const int side = kTimes * (2 * kReach + 1);
    if (picture.cols < 2 * side || picture.rows < 2 * side + kBar) {
        return;
    }
    cv::Mat patch;
    cv::getRectSubPix(
        image, {2 * kReach + 1, 2 * kReach + 1},
        {static_cast<float>(picker.mouse().x()), static_cast<float>(picker.mouse().y())}, patch);
    cv::resize(patch, patch, {side, side}, 0.0, 0.0, cv::INTER_NEAREST);
    cv::drawMarker(patch, {side / 2, side / 2}, kMark, cv::MARKER_CROSS, side / 4);
    const bool left = picker.to_window(picker.mouse()).x() < picture.cols / 2.0;
    patch.copyTo(picture({left ? picture.cols - side : 0, kBar, side, side}));
}

cv::Mat draw(const cv::Mat& image, const CornerPicker& picker) {
    const Eigen::Vector2i size = picker.window_size();
    cv::Mat picture;
    cv::resize(image, picture, {size.x(), size.y()}, 0.0, 0.0,
               picker.scale() < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
    const auto& corners = picker.corners();
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const cv::Point at = point(picker.to_window(corners[i]));
        cv::drawMarker(picture, at, kMark, cv::MARKER_CROSS, 17, 1, cv::LINE_AA);
        cv::putText(picture, std::to_string(i + 1), at + cv::Point(8, -8), cv::FONT_HERSHEY_DUPLEX,
                    0.6, kMark, 1, cv::LINE_AA);
    }
    draw_magnifier(image, picker, picture);
    cv::rectangle(picture, {0, 0, picture.cols, kBar}, cv::Scalar::all(40), cv::FILLED);
    cv::putText(picture, picker.prompt(), {8, kBar - 8}, cv::FONT_HERSHEY_DUPLEX, 0.5, kInk, 1,
                cv::LINE_AA);
    return picture;
}

void on_mouse(int event, int x, int y, int /*flags*/, void* target) {
    auto& picker = *static_cast<CornerPicker*>(target);
    switch (event) {
        case cv::EVENT_LBUTTONDOWN:
            picker.click({x, y});
            break;
        case cv::EVENT_RBUTTONDOWN:
            picker.undo();
            break;
        default:
            picker.move({x, y});
    }
}

int run() {
    const cv::Mat image = read_image();
    if (image.empty()) {
        return 1;
    }
    CornerPicker picker({image.cols, image.rows}, {1280, 800});
    cv::namedWindow(kTitle, cv::WINDOW_AUTOSIZE | cv::WINDOW_GUI_NORMAL);
    cv::setMouseCallback(kTitle, on_mouse, &picker);
    while (picker.state() == CornerPicker::State::kPicking) {
        cv::imshow(kTitle, draw(image, picker));
        picker.press(cv::waitKey(30));
        if (cv::getWindowProperty(kTitle, cv::WND_PROP_VISIBLE) < 1.0) {
            picker.close();
        }
    }
    if (picker.state() == CornerPicker::State::kCancelled) {
        return kGivenUp;
    }
    for (const Eigen::Vector2d& corner : picker.corners()) {
        std::cout << corner.x() << ' ' << corner.y() << '\n';
    }
    return std::cout.flush() ? 0 : 1;
}

}  // namespace

int main() {
    try {
        return run();
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
}
