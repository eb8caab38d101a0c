// SPDX-License-Identifier: Apache-2.0
#include "navigation/process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam::test {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(5);

/// Between fork and exec of a process with threads, hardly anything is allowed.
[[noreturn]] void become(char* const* arguments, const char* folder, const char* output) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int file = open(output, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file >= 0 && dup2(file, STDOUT_FILENO) >= 0 && dup2(file, STDERR_FILENO) >= 0 &&
        chdir(folder) == 0) {
        close_range(3, ~0U, 0);  // else it would keep our connections open
        execv(arguments[0], arguments);
    }
    _exit(127);
}

}  // namespace

WorkFolder::WorkFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "hybrid_slam_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
        throw Error(name + ": cannot be made");
    }
    path_ = name;
}

WorkFolder::~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string contents_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

Process::Process(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                 const std::filesystem::path& output)
    : output_(std::filesystem::absolute(output)),
      name_(arguments.size() > 1 ? arguments[1] : arguments.at(0)) {
    std::vector<std::string> own = arguments;  // execv asks for words that it could change
    std::vector<char*> words;
    words.reserve(own.size() + 1);
    for (std::string& argument : own) {
        words.push_back(argument.data());
    }
    words.push_back(nullptr);
    std::filesystem::remove(output_);
    pid_ = fork();
    if (pid_ == 0) {
        become(words.data(), folder.c_str(), output_.c_str());
    }
    if (pid_ < 0) {
        throw Error(name_ + ": cannot be started");
    }
    setpgid(pid_, pid_);  // by both, since nobody knows who comes first
}

Process::~Process() {
    if (!code_) {
        kill(-pid_, SIGKILL);
        int status = 0;
        waitpid(pid_, &status, 0);
    }
}

void Process::send(int signal) {
    if (running()) {
        kill(pid_, signal);
    }
}

bool Process::running() {
    int status = 0;
    if (!code_ && waitpid(pid_, &status, WNOHANG) == pid_) {
        code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    return !code_;
}

std::optional<int> Process::wait(double seconds) {
    const Stopwatch clock;
    while (running() && clock.seconds() < seconds) {
        std::this_thread::sleep_for(kPoll);
    }
    return code_;
}

std::string Process::wait_for(const std::string& text, double seconds) {
    const Stopwatch clock;
    for (bool runs = true; runs && clock.seconds() < seconds;) {
        runs = running();  // before looking, so that its last words are not missed
        const std::string all = output();
        const std::size_t at = all.find(text);
        const std::size_t end = at == std::string::npos ? at : all.find('\n', at);
        if (end != std::string::npos) {
            return all.substr(at + text.size(), end - at - text.size());
        }
        std::this_thread::sleep_for(kPoll);
    }
    throw Error(name_ + ": does not say '" + text + "' but: " + output());
}

int run_process(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                const std::filesystem::path& output, double seconds) {
    Process process(arguments, folder, output);
    const std::optional<int> code = process.wait(seconds);
    if (!code) {
        throw Error(arguments.at(0) + ": does not end; " + process.output());
    }
    return *code;
}

}  // namespace hybrid_slam::test
