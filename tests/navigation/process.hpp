// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace hybrid_slam::test {

/// A folder of its own, gone with its owner.
class WorkFolder {
  public:
    WorkFolder();
    ~WorkFolder();
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

std::string contents_of(const std::filesystem::path& file);

/// A child process and its descendants. Killed with its owner, and with the thread that started it.
class Process {
  public:
    /// `arguments` begin with the program. What it prints goes into the file `output`. Throws Error
    /// when it cannot be started.
    Process(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
            const std::filesystem::path& output);
    ~Process();
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;

    void send(int signal);
    bool running();
    /// Waits at most so many seconds. The exit code, 128 and more after a signal; empty when it
    /// runs still.
    std::optional<int> wait(double seconds);

    std::string output() const { return contents_of(output_); }
    /// The rest of the line behind `text`, waited for. Throws Error with what was printed when it
    /// does not come or the process ends.
    std::string wait_for(const std::string& text, double seconds = 30.0);

  private:
    std::filesystem::path output_;
    std::string name_;
    pid_t pid_ = -1;
    std::optional<int> code_;
};

/// Runs to its end; the exit code. Throws Error with what it printed when it takes longer.
int run_process(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                const std::filesystem::path& output, double seconds = 120.0);

}  // namespace hybrid_slam::test
