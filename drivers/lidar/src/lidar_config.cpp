// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/lidar_config.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, LidarConfig& config) {
    schema.add("protocol", config.protocol,
               {{"s300", LidarProtocol::kS300}, {"thesis_words", LidarProtocol::kThesisWords}},
               "s300, or thesis_words: the bare words of the thesis, without a checksum");
    schema.add("port", config.port, "serial device, tcp://host:port or a file of recorded bytes");
    schema.add("baud", config.baud, 1200, 4000000, "bits per second, 8N1");
    schema.add("address", config.address, 0, 255,
               "of the scanner to follow: 7 alone or host, 8 guest; 0 = the first met");
    schema.add("x", config.x, -100.0, 100.0, "m, of the scanner in the robot's frame");
    schema.add("y", config.y, -100.0, 100.0, "m");
    schema.add_degrees("yaw_deg", config.yaw, -360.0, 360.0, "of the scanner, to the left");
    schema.add("upside_down", config.upside_down, "the scanner hangs: its first beam is leftmost");
    schema.add_degrees("angle_step_deg", config.angle_step, 0.01, 10.0, "between beams");
    schema.add_degrees("angle_offset_deg", config.angle_offset, -360.0, 360.0,
                       "from straight ahead to the middle of the fan, to the left");
    schema.add("blind_sectors_deg", config.blind_sectors_deg, -360.0, 360.0,
               "pairs from, to, counter-clockwise in the scanner's frame: what the vehicle hides");
    constexpr double kFarthest = 81.9;  // m, below the greatest distance word, which is 81.91
    schema.add("range_min", config.range_min, 0.0, kFarthest, "m");
    schema.add("range_max", config.range_max, 0.1, kFarthest, "m; this or more is no return");
    schema.add("count_period", config.count_period, 1e-4, 10.0,
               "s in a step of the scan counter, by the data sheet");
    schema.add("turn_time", config.turn_time, 0.0, 10.0,
               "s of a turn of the mirror; 0 = not known, so no deskew");
    schema.add("latency", config.latency, -1.0, 1.0,
               "s from the first beam to the first byte on the wire");
}

}  // namespace hybrid_slam
