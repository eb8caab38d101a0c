// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>

#include <cstdarg>
#include <mutex>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>

#include "captures.hpp"
#include "hybrid_slam/core/error.hpp"
#include "opencv_capture.hpp"

namespace hybrid_slam {
namespace {

void say_nothing(void*, int, const char*, std::va_list) {}

/// FFmpeg, inside of OpenCV, writes to stderr about each damaged file. OpenCV offers nothing to
/// stop it but an environment variable, which must not be set beside running threads.
void silence_ffmpeg() {
    using Callback = void (*)(void*, int, const char*, std::va_list);
    static std::once_flag once;
    std::call_once(once, [] {
        void* symbol = dlsym(RTLD_DEFAULT, "av_log_set_callback");
        if (symbol != nullptr) {
            reinterpret_cast<void (*)(Callback)>(symbol)(&say_nothing);
        }
    });
}

class VideoFile : public Capture {
  public:
    explicit VideoFile(const CameraConfig& config) : name_(config.device), pace_(config.rate) {
        silence_ffmpeg();
        silence_opencv();
        if (!video_.open(name_, cv::CAP_FFMPEG) && !video_.open(name_, cv::CAP_OPENCV_MJPEG)) {
            throw Error(name_ + ": no video that can be read");
        }
        video_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0.0);
        if (!video_.read(frame_)) {
            throw Error(name_ + ": a video without a frame");
        }
    }

    bool read(EncodedImage& image, double timeout) override {
        if (ended() || !pace_.wait(timeout)) {
            return false;
        }
        image = pnm_of(frame_, name_);
        if (!video_.read(frame_)) {
            frame_.release();
        }
        return true;
    }

    bool ended() const override { return frame_.empty(); }

  private:
    std::string name_;
    cv::VideoCapture video_;
    cv::Mat frame_;  // the next one; empty at the end
    Pace pace_;
};

}  // namespace

void silence_opencv() {
    static std::once_flag once;
    std::call_once(once,
                   [] { cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT); });
}

EncodedImage pnm_of(const cv::Mat& frame, const std::string& name) {
    if (frame.type() != CV_8UC1 && frame.type() != CV_8UC3) {
        throw Error(name + ": frames are neither gray nor BGR of 8 bits");
    }
    Image image;
    image.width = frame.cols;
    image.height = frame.rows;
    image.channels = frame.channels();
    const cv::Mat whole = frame.isContinuous() ? frame : frame.clone();
    image.pixels.assign(whole.datastart, whole.dataend);
    return encode_pnm(image);
}

std::unique_ptr<Capture> open_video_file(const CameraConfig& config) {
    return std::make_unique<VideoFile>(config);
}

}  // namespace hybrid_slam
