// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "hybrid_slam/core/source.hpp"

namespace hybrid_slam {

struct CarmenLogConfig {
    /// Readings of this or more metres are no return, whatever the log says; a smaller maximum in
    /// the log (PARAM robot_front_laser_max, the own field of ROBOTLASER and RAWLASER) counts too.
    double range_max = 50.0;
    double range_min = 0.02;     ///< metres; smaller readings are no return
    bool use_odom_lines = true;  ///< ODOM lines besides the poses in the laser lines
};

/// What a reader met in a log; everything here was survived.
struct CarmenLogCounts {
    std::size_t lines = 0;
    std::size_t scans = 0;
    std::size_t odometry = 0;  ///< ODOM lines
    std::size_t parameters = 0;
    std::size_t beams = 0;
    std::size_t no_returns = 0;        ///< beams too near, at maximum range and more, inf or NaN
    std::size_t not_finite = 0;        ///< of these, inf or NaN
    std::size_t bad_poses = 0;         ///< laser lines whose poses were not numbers or far apart
    std::size_t backward_stamps = 0;   ///< scans stamped earlier than the scan before
    std::size_t duplicate_stamps = 0;  ///< scans stamped the same as the scan before
    std::size_t malformed_lines = 0;   ///< of a known kind, but not readable; skipped
    std::size_t torn_last_line = 0;    ///< 1 when the file, or its gzip, ends in the middle
    /// Lines of other kinds and of other lasers, by their first word ("#" for comments).
    std::map<std::string, std::size_t> ignored;
};

/// A CARMEN log as a source, plain or gzip: FLASER, RLASER, RAWLASER, ROBOTLASER (both vintages),
/// ODOM and PARAM. The order of the lines is the order of the measurements. A laser line that
/// carries the pose of the robot yields WheelOdometry with the stamp of the scan, then the Scan.
///
/// Stamp: the line's own ipc timestamp (the first of the two).
///
/// One laser is delivered: of those in the first lines, FLASER or ROBOTLASER1 (whichever comes
/// first), else ROBOTLASER0, RLASER, a further ROBOTLASER or LASER, and RAWLASER only when there is
/// no other, for it repeats one of them without poses. Lines of the others count as ignored.
///
/// Angles: RAWLASER and ROBOTLASER say theirs. A FLASER or RLASER of 180 beams spans the half
/// circle 1 degree apart, of 360 or 361 beams 0.5 degrees, the first at -90 degrees. For other
/// counts PARAM laser_front_laser_resolution (degrees; laser_rear_... for RLASER) counts, the fan
/// being centred; without it an even number n of beams is 180 / n degrees apart, an odd one
/// 180 / (n - 1), the first at -90.
///
/// Mounting: robot_from_laser by the two poses of the line, kept while they only jitter (2 mm, 0.05
/// degrees) and identity when they are more than 2 m apart. Logs in which the robot's pose is zero
/// throughout carry no wheel odometry in their laser lines, and none is made of it.
class CarmenLog : public Source {
  public:
    /// Throws Error when the file cannot be read or does not begin as a log with a laser line
    /// ("no CARMEN log").
    explicit CarmenLog(const std::filesystem::path& file, const CarmenLogConfig& config = {});
    ~CarmenLog() override;

    std::optional<Measurement> next() override;
    double progress() const override;
    const CarmenLogCounts& counts() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Writes a log that CarmenLog and other readers take. gzip when the name ends in .gz. A scan
/// becomes a FLASER line when a reader can infer its fan, else ROBOTLASER1, which the first scan
/// decides; it carries the newest wheel odometry, or zeros before there is any. WheelOdometry at
/// the stamp of the scan after it is in the scan's line, any other becomes an ODOM line. No-returns
/// are written as range_max. Images and what came of them are left out.
class CarmenLogWriter : public Sink {
  public:
    explicit CarmenLogWriter(const std::filesystem::path& file);
    ~CarmenLogWriter() override;
    /// Throws Error for a scan that this log cannot hold: no beams, or a FLASER fan that changed.
    void push(const Measurement& measurement) override;
    void close();  ///< throws Error when not everything could be written

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
