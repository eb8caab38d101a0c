// SPDX-License-Identifier: Apache-2.0
#include "serve_devices.hpp"

#include <charconv>
#include <nlohmann/json.hpp>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam::tools {
namespace {

/// Of http://host:port/...
int port_of(const std::string& url) {
    const std::size_t host = url.find("://") + 3;
    const std::size_t slash = std::min(url.find('/', host), url.size());
    const std::size_t colon = url.rfind(':', slash) + 1;
    int port = 0;
    std::from_chars(url.data() + colon, url.data() + slash, port);
    return port;
}

}  // namespace

ServeDevices::ServeDevices(const Options& options) : options_(options) {
    plug(ServedDevice::kLidar);
    plug(ServedDevice::kCan);
    plug(ServedDevice::kCamera);
}

void ServeDevices::plug(ServedDevice device) {
    switch (device) {
        case ServedDevice::kLidar:
            lidar_ = std::make_unique<PseudoTerminal>(options_.folder / "s300");
            return;
        case ServedDevice::kCan:
            can_ = std::make_unique<SlcanTerminal>(options_.folder / "can");
            return;
        case ServedDevice::kCamera:
            break;
    }
    if (!options_.camera) {
        return;
    }
    MjpegServerOptions options;
    options.port = static_cast<std::uint16_t>(options_.camera_port);
    options.lossless = options_.lossless;
    auto camera = std::make_unique<MjpegServer>(options);
    camera_url_ = camera->url();
    options_.camera_port = port_of(camera_url_);  // where it is to be found again
    const std::lock_guard<std::mutex> lock(mutex_);
    camera_ = std::move(camera);
}

void ServeDevices::pull(ServedDevice device) {
    if (device == ServedDevice::kLidar) {
        lidar_.reset();
    } else if (device == ServedDevice::kCan) {
        can_.reset();
    } else {
        const std::lock_guard<std::mutex> lock(mutex_);
        camera_.reset();
    }
}

bool ServeDevices::camera_is_watched() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return camera_ != nullptr && camera_->has_reader();
}

void ServeDevices::publish(EncodedImage jpeg) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (camera_ != nullptr) {
        camera_->publish(std::move(jpeg));
    }
}

nlohmann::ordered_json ServeDevices::endpoints() const {
    nlohmann::ordered_json json;
    json["lidar"] = (options_.folder / "s300").string();
    json["camera"] = options_.camera ? nlohmann::ordered_json(camera_url_) : nullptr;
    json["can"] = "slcan:" + (options_.folder / "can").string();
    return json;
}

}  // namespace hybrid_slam::tools
