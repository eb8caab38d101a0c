// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "hybrid_slam/recording/recording.hpp"
#include "recording_support.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Json = nlohmann::json;

RecordingOptions simulated() {
    RecordingOptions options;
    options.origin = "simulated";
    return options;
}

/// Two seconds of a drive, in the order of arrival.
std::vector<SensorEvent> drive(bool images = true) {
    std::vector<SensorEvent> events;
    std::uint64_t image = 0;
    for (std::uint64_t chunk = 0; chunk < 100; ++chunk) {
        const LidarBytes bytes = lidar_event(chunk);
        for (; images && image_event(image).arrival < bytes.arrival; ++image) {
            events.emplace_back(image_event(image));
        }
        events.emplace_back(bytes);
    }
    return events;
}

void record(const std::filesystem::path& folder, const std::vector<SensorEvent>& events,
            const RecordingOptions& options = simulated()) {
    RobotConfig robot;
    robot.name = "forklift 7";
    RecordingWriter writer(folder, robot, options);
    for (const SensorEvent& event : events) {
        writer.push(event);
    }
    writer.close();
}

void expect_same(const std::vector<SensorEvent>& read, const std::vector<SensorEvent>& expected) {
    ASSERT_EQ(read.size(), expected.size());
    for (std::size_t i = 0; i < read.size(); ++i) {
        EXPECT_TRUE(same(read[i], expected[i])) << i;
    }
}

Json manifest_in(const std::filesystem::path& folder) {
    return Json::parse(bytes_of(folder / "manifest.json"));
}

TEST(Recording, PlaysBackWhatWasPushed) {
    const TempFolder folder;
    record(folder / "drive", drive());
    RecordingReader reader(folder / "drive");
    EXPECT_LT(reader.progress(), 0.5);
    expect_same(read_all(reader), drive());
    EXPECT_EQ(reader.progress(), 1.0);
    EXPECT_EQ(reader.robot().name, "forklift 7");
    EXPECT_EQ(reader.damaged_bytes() + reader.torn_bytes(), 0U);
    EXPECT_TRUE(is_recording(folder / "drive"));
    EXPECT_FALSE(is_recording(folder.path()));
    EXPECT_FALSE(is_recording(folder / "nowhere"));
}

TEST(Recording, MergesByArrivalWithTheLidarFirst) {
    const TempFolder folder;
    const auto lidar = [](double arrival) { return SensorEvent(LidarBytes{arrival, {1}}); };
    const auto image = [](double arrival) { return SensorEvent(CameraFrame{arrival, {2, 3}}); };
    // Pushed as threads would: each device in order, but not the one against the other.
    record(folder / "a", {image(1.0), image(3.0), lidar(0.5), lidar(1.0), image(3.5), lidar(3.25)});
    RecordingReader reader(folder / "a");
    std::vector<std::string> order;
    while (const auto event = reader.next()) {
        order.push_back((event->index() == 0 ? "lidar " : "image ") +
                        std::to_string(arrival_of(*event)).substr(0, 4));
    }
    EXPECT_THAT(order, ElementsAre("lidar 0.50", "lidar 1.00", "image 1.00", "image 3.00",
                                   "lidar 3.25", "image 3.50"));
}

TEST(Recording, WithoutImagesTheirFileIsNotTouched) {
    const TempFolder folder;
    record(folder / "a", drive());
    folder.write("a/camera.rec", "this would be refused");
    RecordingReader reader(folder / "a", false);
    expect_same(read_all(reader), drive(false));
    EXPECT_THAT(error_of([&] { RecordingReader(folder / "a", true); }), HasSubstr("camera.rec"));
    std::filesystem::remove(folder / "a/camera.rec");
    RecordingReader lidar_only(folder / "a", true);
    expect_same(read_all(lidar_only), drive(false));
}

TEST(Recording, ImageFileIsMadeForTheFirstImage) {
    const TempFolder folder;
    record(folder / "a", drive(false));
    EXPECT_FALSE(std::filesystem::exists(folder / "a/camera.rec"));
    record(folder / "b", drive());
    EXPECT_TRUE(std::filesystem::exists(folder / "b/camera.rec"));
    EXPECT_FALSE(manifest_in(folder / "a")["files"].contains("camera"));
    EXPECT_EQ(manifest_in(folder / "b")["files"]["camera"], "camera.rec");
}

TEST(Recording, SimulatedOnesAreTheSameToTheByte) {
    const TempFolder folder;
    record(folder / "a", drive());
    record(folder / "b", drive());
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "a")) {
        EXPECT_EQ(file_bytes(entry.path()),
                  file_bytes(folder / "b" / entry.path().filename().string()))
            << entry.path();
        ++files;
    }
    EXPECT_EQ(files, 4U);
}

TEST(Recording, ManifestSaysWhatIsInIt) {
    const TempFolder folder;
    record(folder / "a", drive());
    const RecordingReader reader(folder / "a");
    const RecordingManifest& manifest = reader.manifest();
    EXPECT_EQ(manifest.version, 1);
    EXPECT_EQ(manifest.origin, "simulated");
    EXPECT_EQ(manifest.created, "");
    EXPECT_TRUE(manifest.closed);
    ASSERT_TRUE(manifest.counts);
    EXPECT_EQ(manifest.counts->lidar_chunks, 100U);
    EXPECT_EQ(manifest.counts->images, 60U);
    EXPECT_EQ(manifest.counts->dropped_images, 0U);
    EXPECT_EQ(manifest.counts->first_arrival, 1.7e9);
    EXPECT_EQ(manifest.counts->last_arrival, lidar_event(99).arrival);
    EXPECT_GT(manifest.counts->image_bytes, 60U * 30'000U);
    EXPECT_EQ(manifest_in(folder / "a")["format"], "hybrid_slam recording");
}

TEST(Recording, LiveOnesSayWhenTheyWereMade) {
    const TempFolder folder;
    record(folder / "a", drive(), {});
    const RecordingReader reader(folder / "a");
    EXPECT_EQ(reader.manifest().origin, "live");
    EXPECT_THAT(reader.manifest().created, ::testing::MatchesRegex("20..-..-..T..:..:..Z"));
}

TEST(Recording, ManifestSaysHowTheDevicesDid) {
    const TempFolder folder;
    RecordingWriter writer(folder / "a", {}, {});
    writer.close(RecordingDevices{1, 2, 3, 4});
    const std::optional<RecordingDevices> devices =
        RecordingReader(folder / "a").manifest().devices;
    ASSERT_TRUE(devices);
    EXPECT_EQ(devices->lidar_connects, 1U);
    EXPECT_EQ(devices->lidar_dropped, 2U);
    EXPECT_EQ(devices->camera_connects, 3U);
    EXPECT_EQ(devices->camera_dropped, 4U);
    record(folder / "b", drive());
    EXPECT_FALSE(RecordingReader(folder / "b").manifest().devices);
    EXPECT_FALSE(manifest_in(folder / "b").contains("devices"));
}

TEST(Recording, WhatWasNotClosedIsReadAll) {
    const TempFolder folder;
    RecordingOptions options;
    RecordingWriter writer(folder / "a", {}, options);
    for (const SensorEvent& event : drive()) {
        writer.push(event);
    }
    while (writer.counts().lidar_chunks + writer.counts().images < drive().size()) {
    }
    RecordingReader reader(folder / "a");
    expect_same(read_all(reader), drive());
    EXPECT_FALSE(reader.manifest().closed);
    EXPECT_FALSE(reader.manifest().counts);
}

TEST(Recording, ManifestMayBeMissingOrTorn) {
    const TempFolder folder;
    record(folder / "a", drive());
    const std::string whole = bytes_of(folder / "a/manifest.json");
    for (std::size_t size = 0; size < whole.size() - 1; size += 7) {
        std::filesystem::remove(folder / "a/manifest.json");
        folder.write("a/manifest.json", whole.substr(0, size));
        RecordingReader reader(folder / "a");
        EXPECT_FALSE(reader.manifest().closed) << size;
        EXPECT_EQ(reader.manifest().version, 1);
    }
    folder.write("a/manifest.json", std::string(500, '\0'));
    EXPECT_FALSE(RecordingReader(folder / "a").manifest().closed);
    folder.write("a/manifest.json", R"({"format": "hybrid_slam recording", "version": "x",
        "closed": 1, "origin": 3, "counts": {"images": -1, "lidar_chunks": 5}})");
    EXPECT_EQ(RecordingReader(folder / "a").manifest().counts->lidar_chunks, 5U);
    std::filesystem::remove(folder / "a/manifest.json");
    RecordingReader reader(folder / "a");
    expect_same(read_all(reader), drive());
    EXPECT_TRUE(is_recording(folder / "a"));
}

TEST(Recording, MissingPartsAreNamed) {
    const TempFolder folder;
    EXPECT_THAT(error_of([&] { RecordingReader(folder / "nowhere"); }),
                HasSubstr("nowhere: there is no such folder"));
    record(folder / "a", drive());
    std::filesystem::rename(folder / "a/robot.yaml", folder / "robot.yaml");
    EXPECT_THAT(error_of([&] { RecordingReader(folder / "a"); }), HasSubstr("a/robot.yaml"));
    std::filesystem::rename(folder / "robot.yaml", folder / "a/robot.yaml");
    std::filesystem::remove(folder / "a/lidar.rec");
    EXPECT_THAT(error_of([&] { RecordingReader(folder / "a"); }), HasSubstr("a/lidar.rec"));
}

TEST(Recording, OfANewerProgramIsRefusedBeforeAnythingElse) {
    const TempFolder folder;
    record(folder / "a", drive());
    std::filesystem::remove(folder / "a/robot.yaml");
    Json manifest = manifest_in(folder / "a");
    manifest["version"] = 2;
    folder.write("a/manifest.json", manifest.dump());
    EXPECT_THAT(error_of([&] { RecordingReader(folder / "a"); }),
                HasSubstr("a: the recording has version 2, but this program reads"));
    manifest["format"] = "somebody's";
    folder.write("a/manifest.json", manifest.dump());
    EXPECT_THAT(error_of([&] { RecordingReader(folder / "a"); }),
                HasSubstr("is not that of a recording"));
}

TEST(Recording, TakesOnlyAFolderOfItsOwn) {
    const TempFolder folder;
    std::filesystem::create_directory(folder / "empty");
    record(folder / "empty", drive());
    EXPECT_THAT(error_of([&] { record(folder / "empty", drive()); }), HasSubstr("is not empty"));
    folder.write("file", "");
    EXPECT_THAT(error_of([&] { record(folder / "file", drive()); }), HasSubstr("file: is a file"));
    record(folder / "deep/down/here/", drive());
    EXPECT_TRUE(is_recording(folder / "deep/down/here"));
    EXPECT_THAT(error_of([&] { record("/proc/no/such", drive()); }), StartsWith("/proc/no/such"));
}

TEST(Recording, DamageInBothFilesIsCounted) {
    const TempFolder folder;
    record(folder / "a", drive());
    for (const char* name : {"a/lidar.rec", "a/camera.rec"}) {
        Bytes bytes = file_bytes(folder / name);
        bytes[bytes.size() / 2] = static_cast<std::uint8_t>(bytes[bytes.size() / 2] + 1);
        bytes.resize(bytes.size() - 5);
        write_bytes(folder / name, bytes);
    }
    RecordingReader reader(folder / "a");
    EXPECT_EQ(read_all(reader).size(), drive().size() - 4);
    EXPECT_GT(reader.damaged_bytes(), 30'000U);
    EXPECT_GT(reader.torn_bytes(), 30'000U);
}

}  // namespace
}  // namespace hybrid_slam::test
