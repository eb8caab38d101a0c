// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "hybrid_slam/camera/image_codec.hpp"
#include "hybrid_slam/lidar/s300_telegram.hpp"
#include "hybrid_slam/recording/recording.hpp"

namespace hybrid_slam::test {

/// A recording to be made: along a room of 14 x 8 m, straight ahead.
struct Drive {
    double seconds = 4.0;
    double rate = 12.5;              ///< scans per second
    double speed = 0.5;              ///< m/s
    double pause_at = 1e9;           ///< seconds, when the lidar stops ...
    double pause = 0.0;              ///< ... and for how long
    int lose_every = 0;              ///< every so many scans one is lost; 0 = none
    bool returns = true;             ///< whether anything is there to be hit
    std::uint16_t standby_word = 0;  ///< in place of all distances
    double images = 0.0;             ///< per second
};

/// Centimetres to the walls at x = +-7 m and y = +-4 m from (x, 0), heading along x.
inline std::uint16_t distance_word(double x, double angle) {
    const double ahead = std::cos(angle) > 0.0 ? 7.0 - x : 7.0 + x;
    const double along_x = ahead / std::max(1e-9, std::abs(std::cos(angle)));
    const double along_y = 4.0 / std::max(1e-9, std::abs(std::sin(angle)));
    return static_cast<std::uint16_t>(std::lround(100.0 * std::min(along_x, along_y)));
}

inline std::vector<std::uint8_t> telegram_at(const Drive& drive, std::uint32_t number) {
    S300Telegram telegram;
    // The counter counts turns of 40 ms, however many of them are sent.
    telegram.scan_number = number * static_cast<std::uint32_t>(std::lround(25.0 / drive.rate));
    telegram.telegram_number = static_cast<std::uint16_t>(number);
    telegram.field = 1;
    const double x = -4.0 + drive.speed * number / drive.rate;
    for (int beam = 0; beam < 541; ++beam) {
        const double angle = radians(0.5 * beam - 135.0);
        telegram.words.push_back(drive.standby_word != 0 ? drive.standby_word
                                 : drive.returns         ? distance_word(x, angle)
                                                         : kS300NoReturn);
    }
    return encode(telegram);
}

inline EncodedImage image_at(std::uint32_t number) {
    Image image;
    image.width = 64;
    image.height = 48;
    image.channels = 3;
    image.pixels.assign(64U * 48U * 3U, static_cast<std::uint8_t>(40 + 5 * number % 200));
    return encode_jpeg(image, 80);
}

/// The telegrams of a drive with their times, as a recorder would get them.
inline std::vector<LidarBytes> telegrams_of(const Drive& drive) {
    std::vector<LidarBytes> telegrams;
    const auto count = static_cast<std::uint32_t>(drive.seconds * drive.rate);
    for (std::uint32_t i = 0; i < count; ++i) {
        const double time = i / drive.rate;
        const bool paused = time > drive.pause_at && time < drive.pause_at + drive.pause;
        const bool lost = drive.lose_every > 0 && i % drive.lose_every == 2;
        if (!paused && !lost) {
            telegrams.push_back({1000.0 + time, telegram_at(drive, i)});
        }
    }
    return telegrams;
}

inline void record_drive(const std::filesystem::path& folder, const Drive& drive,
                         const RecordingOptions& options = {}) {
    RobotConfig robot;
    robot.name = "truck 3";
    robot.camera.enabled = drive.images > 0.0;
    robot.camera.model.width = 64;
    robot.camera.model.height = 48;
    RecordingWriter writer(folder, robot, options);
    for (const LidarBytes& telegram : telegrams_of(drive)) {
        writer.push(telegram);
    }
    for (std::uint32_t i = 0; i < drive.seconds * drive.images; ++i) {
        writer.push(CameraFrame{1000.0 + i / drive.images, image_at(i)});
    }
    writer.close();
}

}  // namespace hybrid_slam::test
