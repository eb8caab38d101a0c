// SPDX-License-Identifier: Apache-2.0
#include "recording_folder.hpp"

#include <system_error>
#include <vector>

#include "disk.hpp"
#include "hybrid_slam/core/error.hpp"
#include "manifest.hpp"

namespace hybrid_slam {

namespace {

namespace fs = std::filesystem;

/// The folder and those above it that are not there yet, the outermost last.
std::vector<fs::path> missing_folders(fs::path folder) {
    std::vector<fs::path> missing;
    std::error_code ignored;
    while (!folder.empty() && !fs::exists(folder, ignored)) {
        missing.push_back(folder);
        folder = folder.parent_path();
    }
    return missing;
}

void expect_empty(const fs::path& folder) {
    std::error_code error;
    const fs::file_status status = fs::status(folder, error);
    if (!fs::exists(status)) {
        return;
    }
    if (!fs::is_directory(status)) {
        throw Error(folder.string() + ": is a file; a recording needs a folder");
    }
    const bool empty = fs::is_empty(folder, error);
    if (error) {
        throw Error(folder.string() + ": " + error.message());
    }
    if (!empty) {
        throw Error(folder.string() + ": is not empty; a recording needs a folder of its own");
    }
}

RecordFileWriter fill(const fs::path& folder, const RobotConfig& robot,
                      const RecordingManifest& manifest) {
    disk::replace_file(folder / RecordingFiles::kManifest, to_text(manifest));
    disk::replace_file(folder / RecordingFiles::kRobot, to_yaml(robot));
    return RecordFileWriter(folder / RecordingFiles::kLidar);
}

}  // namespace

RecordFileWriter make_recording_folder(const fs::path& folder, const RobotConfig& robot,
                                       const RecordingManifest& manifest) {
    expect_empty(folder);
    const std::vector<fs::path> made = missing_folders(folder);
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) {
        throw Error(folder.string() + ": " + error.message());
    }
    try {
        for (const fs::path& fresh : made) {
            disk::sync_folder(fresh.parent_path());
        }
        return fill(folder, robot, manifest);
    } catch (...) {
        for (const char* name : {RecordingFiles::kManifest, RecordingFiles::kRobot}) {
            fs::remove(folder / name, error);
        }
        for (const fs::path& fresh : made) {
            fs::remove(fresh, error);  // if nothing else came into it
        }
        throw;
    }
}

}  // namespace hybrid_slam
