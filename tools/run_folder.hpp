// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace hybrid_slam::tools {

/// Names of the files of a localization run.
struct RunFiles {
    static constexpr auto kSummary = "summary.json";  ///< says that the folder is a run
    static constexpr auto kConfig = "config.yaml";
    static constexpr auto kPoses = "poses.csv";
    static constexpr auto kEvents = "events.jsonl";
    static constexpr auto kTrajectory = "trajectory.tum";
    static constexpr auto kCameraPoses = "camera_poses.tum";
    static constexpr auto kLastPose = "last_pose.json";
    static constexpr auto kPicture = "localize.png";
};

/// The folder of a run, held so that no other process fills it too.
class RunFolder {
  public:
    /// Makes it when there is none. Throws Error when that fails, when it holds something that is
    /// no run, and when another process fills it.
    explicit RunFolder(const std::filesystem::path& folder);
    ~RunFolder();  ///< removes it when it is empty
    RunFolder(const RunFolder&) = delete;
    RunFolder& operator=(const RunFolder&) = delete;

    std::filesystem::path operator/(std::string_view name) const { return folder_ / name; }

    /// Removes the files of an earlier run, but for its last pose when it is still of use, and says
    /// that this one is not finished.
    void begin(bool keep_last_pose) const;

  private:
    struct Lock;

    std::filesystem::path folder_;
    std::unique_ptr<Lock> lock_;
};

/// What summary.json of a run begins with.
inline constexpr auto kRunFormat = "hybrid_slam localization run";
inline constexpr int kRunVersion = 1;

/// A text file that grows line by line.
class LineFile {
  public:
    /// Throws Error.
    explicit LineFile(const std::filesystem::path& file);

    /// All three throw Error when the disk is full.
    void add(std::string_view line);
    void flush();  ///< to the system: a killed program loses none of it
    void sync();   ///< to the disk: a power cut loses none of it

  private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };

    std::filesystem::path file_;
    std::unique_ptr<std::FILE, Close> handle_;
};

/// Puts a file with this text, which ends in a line end, there at once and for good: after a power
/// cut there is the old one or the new one. Throws Error.
void replace_text(const std::filesystem::path& file, std::string_view text);

}  // namespace hybrid_slam::tools
