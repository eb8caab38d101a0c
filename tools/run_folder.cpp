// SPDX-License-Identifier: Apache-2.0
#include "run_folder.hpp"

#include <dirent.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostSummary = std::size_t{1} << 26U;

Error system_error(const fs::path& place, int number) {
    return Error(place.string() + ": " + std::generic_category().message(number));
}

bool is_run(const fs::path& folder) {
    const fs::path summary = folder / RunFiles::kSummary;
    if (!fs::is_regular_file(summary)) {
        return false;
    }
    const auto json = nlohmann::json::parse(read_whole_file(summary, kMostSummary), nullptr, false);
    return json.is_object() && json.contains("format") &&
           json["format"] == nlohmann::json(kRunFormat);
}

void expect_usable(const fs::path& folder) {
    if (!fs::exists(folder)) {
        return;
    }
    if (!fs::is_directory(folder)) {
        throw Error(folder.string() + ": is a file; a run needs a folder");
    }
    if (!fs::is_empty(folder) && !is_run(folder)) {
        throw Error(folder.string() +
                    ": is not empty and not a localization run, so it is left alone");
    }
}

}  // namespace

struct RunFolder::Lock {
    explicit Lock(const fs::path& folder) : handle(opendir(folder.c_str())) {
        if (handle == nullptr) {
            throw system_error(folder, errno);
        }
        if (flock(dirfd(handle), LOCK_EX | LOCK_NB) != 0) {
            closedir(handle);
            throw Error(folder.string() + ": another process fills it");
        }
    }
    ~Lock() { closedir(handle); }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;

    DIR* handle;
};

RunFolder::RunFolder(const fs::path& folder) : folder_(folder) {
    try {
        expect_usable(folder);
        fs::create_directories(folder);
    } catch (const fs::filesystem_error& error) {
        throw Error(folder.string() + ": " + error.code().message());
    }
    lock_ = std::make_unique<Lock>(folder);
}

RunFolder::~RunFolder() {
    std::error_code ignored;
    fs::remove(folder_, ignored);  // fails, as it should, when anything is in it
}

void RunFolder::begin(bool keep_last_pose) const {
    const nlohmann::ordered_json begun = {
        {"format", kRunFormat}, {"version", kRunVersion}, {"finished", false}};
    replace_text(folder_ / RunFiles::kSummary, begun.dump(2) + "\n");
    for (const char* name : {RunFiles::kConfig, RunFiles::kPoses, RunFiles::kEvents,
                             RunFiles::kTrajectory, RunFiles::kCameraPoses, RunFiles::kPicture}) {
        std::error_code ignored;
        fs::remove(folder_ / name, ignored);
    }
    if (!keep_last_pose) {
        std::error_code ignored;
        fs::remove(folder_ / RunFiles::kLastPose, ignored);
    }
}

LineFile::LineFile(const fs::path& file) : file_(file), handle_(std::fopen(file.c_str(), "w")) {
    if (!handle_) {
        throw system_error(file, errno);
    }
}

void LineFile::add(std::string_view line) {
    if (std::fwrite(line.data(), 1, line.size(), handle_.get()) != line.size() ||
        std::fputc('\n', handle_.get()) == EOF) {
        throw system_error(file_, errno);
    }
}

void LineFile::flush() {
    if (std::fflush(handle_.get()) != 0) {
        throw system_error(file_, errno);
    }
}

void LineFile::sync() {
    flush();
    if (fsync(fileno(handle_.get())) != 0) {
        throw system_error(file_, errno);
    }
}

void replace_text(const fs::path& file, std::string_view text) {
    const fs::path target = replaceable_file(file);
    fs::path part = target;
    part += ".part";
    {
        LineFile writer(part);
        writer.add(text.substr(0, text.size() - 1));
        writer.sync();
    }
    if (std::rename(part.c_str(), target.c_str()) != 0) {
        throw system_error(file, errno);
    }
}

}  // namespace hybrid_slam::tools
