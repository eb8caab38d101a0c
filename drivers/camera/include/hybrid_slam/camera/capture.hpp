// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "hybrid_slam/camera/camera_config.hpp"
#include "hybrid_slam/camera/image_codec.hpp"

namespace hybrid_slam {

/// One image as the camera gave it.
struct CameraFrame {
    double arrival = 0.0;  ///< seconds
    EncodedImage image;    ///< as it came: the JPEG of a camera that compresses, else PNM
};

/// Where images come from. Blocking; used from one thread.
class Capture {
  public:
    Capture() = default;
    Capture(const Capture&) = delete;
    Capture& operator=(const Capture&) = delete;
    virtual ~Capture() = default;

    /// Waits for the next image and replaces `image` by it; false when none came within about
    /// `timeout` seconds (a stall), or when the files have ended. Throws Error when the device is
    /// gone; it has to be opened anew then.
    virtual bool read(EncodedImage& image, double timeout) = 0;

    /// True once files were read to their end: nothing more will come. A device never ends.
    virtual bool ended() const { return false; }
};

/// Opens what config.device names. Through OpenCV: a V4L2 device (asking for config.model's size,
/// the rate, and MJPEG passed on undecoded), a video file or a folder of images in the order of
/// their names (both at config.rate). Throws Error with the device's name and the reason. The first
/// image of a device that sends none keeps read waiting for OpenCV's own 10 s.
///
/// http:// is an MJPEG stream as network cameras, mjpg-streamer, ustreamer and MjpegServer send it
/// (HTTP/1.1, multipart/x-mixed-replace, its parts passed on undecoded; basic authentication; no
/// https). A thread takes all that comes, so that a slow reader gets the newest image and misses
/// those before it.
///
/// The first camera or video file silences OpenCV's log for the process and for good, the first
/// video file FFmpeg's too: both write to stderr about each damaged file.
std::unique_ptr<Capture> open_capture(const CameraConfig& config);

}  // namespace hybrid_slam
