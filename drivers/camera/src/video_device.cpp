// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <opencv2/videoio.hpp>
#include <system_error>

#include "captures.hpp"
#include "hybrid_slam/core/error.hpp"
#include "opencv_capture.hpp"

namespace hybrid_slam {
namespace {

/// OpenCV only says that it could not.
void check_device(const std::string& name) {
    const int descriptor = ::open(name.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) {
        const int error = errno;
        const std::string advice = error == EACCES ? " (is the user in the group video?)"
                                   : error == ENOENT || error == ENODEV || error == ENXIO
                                       ? " (is it plugged in?)"
                                       : "";
        throw Error(name + ": " + std::generic_category().message(error) + advice);
    }
    struct stat status {};
    const bool device = fstat(descriptor, &status) == 0 && S_ISCHR(status.st_mode);
    close(descriptor);
    if (!device) {
        throw Error(name + ": neither a camera nor a video nor a folder");
    }
}

class VideoDevice : public Capture {
  public:
    explicit VideoDevice(const CameraConfig& config) : name_(config.device) {
        check_device(name_);
        silence_opencv();
        const int mjpeg = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
        try {
            if (!video_.open(name_, cv::CAP_V4L2)) {
                throw Error(name_ + ": no camera, or in use by another program");
            }
            // In this order: each one negotiates anew, and a rate belongs to a format and a size.
            video_.set(cv::CAP_PROP_FOURCC, mjpeg);
            video_.set(cv::CAP_PROP_FRAME_WIDTH, config.model.width);
            video_.set(cv::CAP_PROP_FRAME_HEIGHT, config.model.height);
            video_.set(cv::CAP_PROP_FPS, config.rate);
            // The compressed image is passed on as it is: it is what a recording keeps, and
            // decoding is left to who wants pixels.
            if (static_cast<int>(video_.get(cv::CAP_PROP_FOURCC)) == mjpeg) {
                video_.set(cv::CAP_PROP_CONVERT_RGB, 0.0);
            }
        } catch (const cv::Exception& error) {
            throw Error(name_ + ": " + error.err);
        }
        check_size(config);
    }

    bool read(EncodedImage& image, double timeout) override {
        try {
            return read_within(image, timeout);
        } catch (const cv::Exception&) {
            throw Error(name_ + ": unplugged");
        }
    }

  private:
    /// A calibration is good for one size only.
    void check_size(const CameraConfig& config) {
        const int width = static_cast<int>(video_.get(cv::CAP_PROP_FRAME_WIDTH));
        const int height = static_cast<int>(video_.get(cv::CAP_PROP_FRAME_HEIGHT));
        if (width != config.model.width || height != config.model.height) {
            throw Error(name_ + ": gives " + std::to_string(width) + " x " +
                        std::to_string(height) + " pixels, camera.model is of " +
                        std::to_string(config.model.width) + " x " +
                        std::to_string(config.model.height));
        }
    }

    bool read_within(EncodedImage& image, double timeout) {
        // waitAny has grabbed the image when it names the camera as ready. Its 0 means for ever.
        std::vector<int> ready;
        const auto nanoseconds = static_cast<std::int64_t>(std::max(timeout, 1e-3) * 1e9);
        if (!cv::VideoCapture::waitAny({video_}, ready, nanoseconds) || ready.empty()) {
            return false;
        }
        cv::Mat frame;
        if (!video_.grab() || !video_.retrieve(frame) || frame.empty()) {
            return false;
        }
        const bool compressed = frame.rows == 1 && frame.type() == CV_8UC1;
        if (compressed) {
            image.assign(frame.datastart, frame.dataend);
        } else {
            image = pnm_of(frame, name_);
        }
        return true;
    }

    std::string name_;
    cv::VideoCapture video_;
};

}  // namespace

std::unique_ptr<Capture> open_video_device(const CameraConfig& config) {
    return std::make_unique<VideoDevice>(config);
}

}  // namespace hybrid_slam
