// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/camera_config.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, CameraConfig& config) {
    schema.add("enabled", config.enabled, "false: drive by the lidar alone");
    schema.add("device", config.device,
               "V4L2 device, http://... of a network camera, video file or folder of images");
    schema.add("rate", config.rate, 0.1, 1000.0, "images per second; the pace of files");
    schema.add("latency", config.latency, 0.0, 1.0,
               "s, from the middle of the exposure to the arrival");
    schema.add("stall_after", config.stall_after, 0.05, 60.0,
               "s without an image after which the camera counts as lost");
    {
        const ConfigSchema::Section section(schema, "model");
        describe(schema, config.model);
    }
    const ConfigSchema::Section section(schema, "mounting");
    describe(schema, config.mounting);
}

}  // namespace hybrid_slam
