// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <atomic>
#include <thread>

#include "drives.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const Drive& drive) {
    Bytes bytes;
    for (const LidarBytes& telegram : telegrams_of(drive)) {
        bytes.insert(bytes.end(), telegram.bytes.begin(), telegram.bytes.end());
    }
    return bytes;
}

/// The bytes of a drive as a file, which the program plays back at the scanner's pace.
void write_lidar_file(const TempFolder& folder, const Drive& drive) {
    const Bytes bytes = bytes_of(drive);
    folder.write("bytes.bin", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void write_lidar_file(const TempFolder& folder, double seconds) {
    Drive drive;
    drive.seconds = seconds;
    write_lidar_file(folder, drive);
}

Bytes recorded_lidar(const std::filesystem::path& folder) {
    RecordingReader reader(folder);
    Bytes bytes;
    while (const auto event = reader.next()) {
        if (const auto* chunk = std::get_if<LidarBytes>(&*event)) {
            bytes.insert(bytes.end(), chunk->bytes.begin(), chunk->bytes.end());
        }
    }
    return bytes;
}

/// A scanner at the other end of a serial line, talking until it is switched off.
class Scanner {
  public:
    explicit Scanner(const std::filesystem::path& link)
        : line_(link), thread_([this] { talk(); }) {}
    ~Scanner() {
        off_ = true;
        thread_.join();
    }
    Scanner(const Scanner&) = delete;
    Scanner& operator=(const Scanner&) = delete;

  private:
    void talk() {
        for (std::uint32_t number = 0; !off_; ++number) {
            line_.write(telegram_at({}, number));
            std::this_thread::sleep_for(std::chrono::milliseconds(80));
        }
    }

    PseudoTerminal line_;
    std::atomic<bool> off_{false};
    std::thread thread_;
};

TEST(Record, KeepsTheBytesAsTheyCame) {
    const TempFolder folder;
    write_lidar_file(folder, 1.2);
    const Json json =
        run_well(folder, "record --lidar bytes.bin --no-camera --out drive --json").json();
    EXPECT_EQ(json["scans"], 15);
    EXPECT_EQ(json["counts"]["missed_scans"], 0);
    EXPECT_EQ(json["failure"], "");
    Drive drive;
    drive.seconds = 1.2;
    EXPECT_TRUE(recorded_lidar(folder / "drive") == bytes_of(drive));
    const RecordingReader reader(folder / "drive");
    EXPECT_EQ(reader.manifest().origin, "live");
    EXPECT_TRUE(reader.manifest().closed);
}

TEST(Record, WhatIsSetGoesIntoTheRecording) {
    const TempFolder folder;
    write_lidar_file(folder, 0.4);
    folder.write("robot.yaml",
                 "name: truck 5\nlidar: {port: bytes.bin, baud: 115200, x: 0.7}\n"
                 "camera: {enabled: false}\n");
    run_well(folder, "record --robot robot.yaml --out drive --set lidar.y=0.25 --set name=tug");
    const RobotConfig robot = read_robot(folder / "drive/robot.yaml");
    EXPECT_EQ(robot.name, "tug");
    EXPECT_EQ(robot.lidar.baud, 115200);
    EXPECT_EQ(robot.lidar.x, 0.7);
    EXPECT_EQ(robot.lidar.y, 0.25);
    const Outcome outcome = run(folder, "record --robot robot.yaml --out b --set lidar.boud=1");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("lidar.boud"));
    EXPECT_FALSE(std::filesystem::exists(folder / "b"));
}

TEST(Record, SerialLineUntilItsTimeIsOver) {
    const TempFolder folder;
    const Scanner scanner(folder / "s300");
    const Outcome outcome =
        run_well(folder, "record --lidar s300 --no-camera --out drive --duration 1.5");
    EXPECT_THAT(outcome.err, HasSubstr("lidar: streaming"));
    EXPECT_THAT(outcome.out, HasSubstr("recording  drive, "));
    EXPECT_THAT(outcome.out, HasSubstr("0 wrong checksums"));
    EXPECT_THAT(outcome.err, Not(HasSubstr("\r")));  // no status line outside of a terminal
    EXPECT_GT(recorded_lidar(folder / "drive").size(), 5000U);
}

TEST(Record, CtrlCIsTheUsualEnd) {
    const TempFolder folder;
    const Scanner scanner(folder / "s300");
    const Outcome outcome =
        run(folder,
            "--version > version.txt && timeout --foreground --preserve-status -s INT 4 "
            "'" HYBRID_SLAM_PROGRAM "' record --lidar s300 --no-camera --out drive");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(RecordingReader(folder / "drive").manifest().closed);
    EXPECT_THAT(outcome.out, HasSubstr("lidar      "));
}

TEST(Record, ScannerMayBeSwitchedOnLater) {
    const TempFolder folder;
    std::unique_ptr<Scanner> scanner;
    std::thread later([&] {
        for (int i = 0; i < 500 && !std::filesystem::exists(folder / "drive"); ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(700));
        scanner = std::make_unique<Scanner>(folder / "s300");
    });
    const Outcome outcome =
        run(folder, "record --lidar s300 --no-camera --out drive --duration 3.5");
    later.join();
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.err, HasSubstr("lidar: s300: No such file"));
    EXPECT_THAT(outcome.err, HasSubstr("lidar: streaming"));
}

TEST(Record, MissingCameraCostsNothingElse) {
    const TempFolder folder;
    write_lidar_file(folder, 1.0);
    const Outcome outcome =
        run_well(folder, "record --lidar bytes.bin --camera no_such_camera --out drive");
    EXPECT_THAT(outcome.err, HasSubstr("camera: no_such_camera: No such file"));
    EXPECT_THAT(outcome.err, HasSubstr("going on with the lidar alone"));
    EXPECT_FALSE(std::filesystem::exists(folder / "drive/camera.rec"));
}

TEST(Record, ImagesComeBesideTheScans) {
    const TempFolder folder;
    write_lidar_file(folder, 1.0);
    std::filesystem::create_directory(folder / "images");
    for (std::uint32_t i = 0; i < 5; ++i) {
        const EncodedImage jpeg = image_at(i);
        folder.write("images/" + std::to_string(i) + ".jpg",
                     {reinterpret_cast<const char*>(jpeg.data()), jpeg.size()});
    }
    const Json json =
        run_well(folder, "record --lidar bytes.bin --camera images --out drive --json").json();
    EXPECT_EQ(json["images"], 5);
    RecordFileReader reader(folder / "drive/camera.rec");
    for (std::uint32_t i = 0; i < 5; ++i) {
        EXPECT_TRUE(reader.next().value().bytes == image_at(i));
    }
}

TEST(Record, NothingAtAllLeavesNothingBehind) {
    const TempFolder folder;
    const Outcome outcome =
        run(folder, "record --lidar no_such_port --no-camera --out drive --duration 0.3");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("nothing was recorded: no_such_port: No such file"));
    EXPECT_EQ(outcome.out, "");
    EXPECT_FALSE(std::filesystem::exists(folder / "drive"));
}

TEST(Record, BytesWithoutScansAreKeptButAnError) {
    const TempFolder folder;
    folder.write("bytes.bin", std::string(5000, '\x55'));
    const Outcome outcome =
        run(folder, "record --lidar bytes.bin --no-camera --out drive --duration 2");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("no scan was recorded"));
    EXPECT_EQ(recorded_lidar(folder / "drive").size(), 5000U);
}

TEST(Record, StandbyIsToldWhileItLasts) {
    const TempFolder folder;
    Drive drive;
    drive.standby_word = kS300Standby;
    write_lidar_file(folder, drive);
    const Outcome outcome = run(folder, "record --lidar bytes.bin --no-camera --out drive");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("warning: lidar: no scans: the scanner stands by"));
    EXPECT_THAT(outcome.err, HasSubstr("no scan was recorded"));
}

TEST(Record, FullDiskEndsItAndSaysSo) {
    const TempFolder folder;
    write_lidar_file(folder, 4.0);
    const Outcome outcome = run(folder,
                                "--version > version.txt && trap '' XFSZ && ulimit -f 8 && "
                                "'" HYBRID_SLAM_PROGRAM
                                "' record --lidar bytes.bin "
                                "--no-camera --out drive --quiet");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("drive/lidar.rec: File too large"));
    EXPECT_THAT(outcome.out, HasSubstr("not closed"));
    EXPECT_GT(recorded_lidar(folder / "drive").size(), 1000U);
}

TEST(Record, NeverTouchesWhatIsThere) {
    const TempFolder folder;
    write_lidar_file(folder, 0.4);
    run_well(folder, "record --lidar bytes.bin --no-camera --out drive --quiet");
    const Outcome outcome = run(folder, "record --lidar bytes.bin --no-camera --out drive");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("drive: is not empty"));
    EXPECT_EQ(run(folder, "record --lidar bytes.bin").code, 2);
}

// The way of the README: record, look, map.
TEST(Record, InspectedAndMappedAfterwards) {
    const TempFolder folder;
    write_lidar_file(folder, 2.0);
    run_well(folder, "record --lidar bytes.bin --no-camera --out drive --quiet");
    run_well(folder, "info drive --quiet");
    const Json map = run_well(folder, "map drive --out hall --json --quiet").json();
    EXPECT_EQ(map["scans"], 25);
}

}  // namespace
}  // namespace hybrid_slam::test
