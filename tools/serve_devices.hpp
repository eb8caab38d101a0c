// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "hybrid_slam/camera/mjpeg_server.hpp"
#include "hybrid_slam/can/slcan_terminal.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "serve_unplug.hpp"

namespace hybrid_slam::tools {

/// The ends of the lines that a simulated forklift talks on: what others open.
class ServeDevices {
  public:
    struct Options {
        std::filesystem::path folder;  ///< of the links s300 and can
        bool camera = false;
        int camera_port = 0;    ///< 0 = any
        bool lossless = false;  ///< every image to every reader
    };
    /// All are plugged. Throws Error when one cannot be made.
    explicit ServeDevices(const Options& options);

    void plug(ServedDevice device);
    void pull(ServedDevice device);

    PseudoTerminal* lidar() { return lidar_.get(); }  ///< null while it is pulled
    SlcanTerminal* can() { return can_.get(); }       ///< null while it is pulled

    bool has_camera() const { return options_.camera; }
    /// Any thread. Whether somebody would see an image now.
    bool camera_is_watched() const;
    /// Any thread.
    void publish(EncodedImage jpeg);

    /// How to open them: lidar, camera (null without one), can.
    nlohmann::ordered_json endpoints() const;

  private:
    Options options_;
    std::unique_ptr<PseudoTerminal> lidar_;
    std::unique_ptr<SlcanTerminal> can_;
    mutable std::mutex mutex_;  ///< of the camera, which images come to from another thread
    std::unique_ptr<MjpegServer> camera_;
    std::string camera_url_;
};

}  // namespace hybrid_slam::tools
