// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>

#include "support/temp_folder.hpp"

namespace hybrid_slam::test {

/// The program as a child process.
class Child {
  public:
    Child(const TempFolder& folder, const std::string& arguments) : pid_(fork()) {
        if (pid_ == 0) {
            const std::string command =
                "exec '" HYBRID_SLAM_PROGRAM "' " + arguments + " > stdout.txt 2> stderr.txt";
            if (chdir(folder.path().c_str()) == 0) {
                execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
            }
            _exit(127);
        }
    }

    /// Until it catches SIGINT, and a little longer.
    void wait_until_it_catches_signals() const {
        for (int i = 0; i < 2000 && !catches_signals(); ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }

    void send(int signal) const { kill(pid_, signal); }

    /// The status as waitpid has it.
    int wait() const {
        int status = 0;
        waitpid(pid_, &status, 0);
        return status;
    }

  private:
    /// As proc(5) tells; the shell before the program catches SIGINT too.
    bool catches_signals() const {
        std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
        std::string word;
        std::string name;
        status >> word >> name;  // the first line: "Name: hybrid-slam"
        while (status >> word && word != "SigCgt:") {
        }
        unsigned long caught = 0;
        status >> std::hex >> caught;
        return name == "hybrid-slam" && ((caught >> (SIGINT - 1)) & 1U) == 1U;
    }

    pid_t pid_;
};

}  // namespace hybrid_slam::test
