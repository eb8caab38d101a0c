// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

enum class LidarProtocol {
    kS300,        ///< SICK S300 and S3000, continuous output
    kThesisWords  ///< the simplified stream of the thesis (section 3.5.1): zeros, BB BB 11 11,
                  ///< words; without length, counter or checksum, so that damage goes unnoticed
};

/// A lidar: how it is connected, how it sits on the robot, how its clock runs.
struct LidarConfig {
    LidarProtocol protocol = LidarProtocol::kS300;
    /// A serial device, tcp://host:port (a serial-to-Ethernet converter) or a file of recorded
    /// bytes.
    std::string port = "/dev/ttyUSB0";
    int baud = 500000;  ///< bits per second, 8N1; over TCP that of the line behind the converter
    /// Of the scanner to follow, where several speak on one line: 7 alone or host, 8 guest; 0 = the
    /// one whose distances come first. The thesis's words have none.
    int address = 0;

    double x = 1.3;    ///< metres, of the scanner in the robot's frame
    double y = 0.0;    ///< metres
    double yaw = 0.0;  ///< radians
    bool upside_down = false;
    double angle_step = radians(0.5);  ///< radians between beams
    double angle_offset =
        0.0;  ///< radians, from straight ahead to the middle of the fan, to the left
    /// Degrees in the scanner's frame, pairs from-to, of what the vehicle itself hides.
    std::vector<double> blind_sectors_deg;
    double range_min = 0.05;  ///< metres
    double range_max = 29.5;  ///< metres; words tell up to 81.91, of which 29.96 is no return

    double count_period = 0.040;  ///< seconds in one step of the scan counter, by the data sheet
    double turn_time = 0.040;     ///< seconds of one turn of the mirror
    double latency = 0.040;       ///< seconds from the first beam to the first byte on the wire

    Pose2d robot_from_laser() const { return {x, y, yaw}; }
    double time_increment() const { return turn_time * angle_step / (2.0 * kPi); }  ///< seconds
    /// Seconds that so many bytes take on the line: 8 bits, a start and a stop bit each.
    double wire_time(std::size_t bytes) const { return 10.0 * static_cast<double>(bytes) / baud; }
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, LidarConfig& config);

}  // namespace hybrid_slam
