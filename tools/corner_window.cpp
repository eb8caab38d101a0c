// SPDX-License-Identifier: Apache-2.0
#include "corner_window.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>

#include "corner_picker.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration)

namespace hybrid_slam::tools {
namespace {

constexpr auto kProgram = "hybrid-slam-window";
constexpr int kGivenUp = 3;

class Descriptor {
  public:
    explicit Descriptor(int number) : number_(number) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    int get() const { return number_; }
    void close() {
        if (number_ >= 0) {
            ::close(number_);
            number_ = -1;
        }
    }

  private:
    int number_;
};

[[noreturn]] void throw_no_window(const std::string& why) {
    throw Error("no window to click corners in (" + why +
                "): give them as --corners u,v u,v u,v u,v");
}

/// A file in memory: a pipe would end us, were its reader gone.
int file_of(const Image& image) {
    const std::string header = fmt::format("{} {} {}\n", image.width, image.height, image.channels);
    const int file = memfd_create("image", MFD_CLOEXEC);
    const auto put = [file](const void* bytes, std::size_t size) {
        const auto* at = static_cast<const char*>(bytes);
        while (size > 0) {
            const ssize_t written = ::write(file, at, size);
            if (written <= 0) {
                throw_no_window("out of memory");
            }
            at += written;
            size -= static_cast<std::size_t>(written);
        }
    };
    put(header.data(), header.size());
    put(image.pixels.data(), image.pixels.size());
    lseek(file, 0, SEEK_SET);
    return file;
}

pid_t start(const std::filesystem::path& program, int input, int output) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
    // A window's libraries write many lines when they find no display; ours says it in one.
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    std::string name = program.string();
    std::array<char*, 2> arguments{name.data(), nullptr};
    pid_t process = -1;
    const int error =
        posix_spawn(&process, name.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) {
        throw_no_window(name + " cannot be started");
    }
    return process;
}

std::string read_all(int file) {
    std::string text;
    std::array<char, 512> bytes{};
    while (true) {
        const ssize_t count = ::read(file, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) {
            continue;
        }
        if (count <= 0) {
            return text;
        }
        text.append(bytes.data(), static_cast<std::size_t>(count));
    }
}

int exit_code_of(pid_t process) {
    int status = 0;
    while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::vector<Pixel> parse_corners(std::string_view text) {
    Tokens tokens(text);
    std::vector<Pixel> corners;
    for (std::size_t i = 0; i < CornerPicker::kCorners; ++i) {
        Pixel corner;
        if (!parse_double(tokens.next(), corner.x()) || !parse_double(tokens.next(), corner.y())) {
            throw_no_window("it answered with something else than four corners");
        }
        corners.push_back(corner);
    }
    return corners;
}

/// Beside this program in a build, in libexec once installed.
std::filesystem::path window_program() {
    std::error_code error;
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
    for (const auto* folder : {".", HYBRID_SLAM_LIBEXEC_FROM_BIN}) {
        const std::filesystem::path program = self.parent_path() / folder / kProgram;
        if (std::filesystem::exists(program, error)) {
            return program.lexically_normal();
        }
    }
    throw_no_window(std::string(kProgram) + " is not installed");
}

bool is_set(const char* variable) {
    const char* const value = std::getenv(variable);
    return value != nullptr && *value != '\0';
}

}  // namespace

std::vector<Pixel> pick_corners_by(const std::filesystem::path& program, const Image& image) {
    const Descriptor input(file_of(image));
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) {
        throw_no_window("no pipe");
    }
    const Descriptor answer(ends[0]);
    Descriptor output(ends[1]);
    const pid_t process = start(program, input.get(), output.get());
    output.close();
    std::string text = read_all(answer.get());
    const int code = exit_code_of(process);
    if (code == kGivenUp) {
        throw Error("no corners: the window was closed");
    }
    if (code != 0) {
        throw_no_window("it could not be opened");
    }
    for (char& letter : text) {
        letter = letter == '\n' ? ' ' : letter;
    }
    return parse_corners(text);
}

std::vector<Pixel> pick_corners(const Image& image) {
    if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY") && !is_set("QT_QPA_PLATFORM")) {
        throw_no_window("there is no display");
    }
    return pick_corners_by(window_program(), image);
}

}  // namespace hybrid_slam::tools
