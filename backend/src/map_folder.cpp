// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/map_folder.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "hybrid_slam/backend/g2o.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "map_files.hpp"
#include "map_manifest.hpp"

namespace hybrid_slam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

Error system_error(const fs::path& place, const std::error_code& code) {
    return Error(place.string() + ": " + code.message());
}

std::error_code last_error() {
    return {errno, std::generic_category()};
}

/// What goes wrong with files as an Error that names the place.
template <typename Call>
auto told_plainly(const fs::path& place, Call&& call) {
    try {
        return call();
    } catch (const fs::filesystem_error& error) {
        throw system_error(error.path1().empty() ? place : error.path1(), error.code());
    }
}

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
struct CloseFolder {
    void operator()(DIR* folder) const { closedir(folder); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;
using Folder = std::unique_ptr<DIR, CloseFolder>;

/// Some file systems do not sync folders (EINVAL): those have nothing to lose.
void sync_folder(const fs::path& place) {
    const Folder folder(opendir(place.c_str()));
    if (!folder || (fsync(dirfd(folder.get())) != 0 && errno != EINVAL)) {
        throw system_error(place, last_error());
    }
}

/// So that a power cut after the renaming finds the bytes on the disk, not only the names.
void sync_tree(const fs::path& root) {
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
        if (entry.is_directory()) {
            sync_folder(entry.path());
        } else if (entry.is_regular_file()) {
            const File file(std::fopen(entry.path().c_str(), "rb"));
            if (!file || fsync(fileno(file.get())) != 0) {
                throw system_error(entry.path(), last_error());
            }
        }
    }
    sync_folder(root);
}

// A map is replaced whole: what somebody else keeps beside it, the log perhaps, would be lost.
void expect_nothing_foreign(const fs::path& folder) {
    const json manifest = manifest_in(folder);
    const json files = manifest.value("files", json::object());
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        const std::string name = entry.path().lexically_relative(folder).generic_string();
        if (!entry.is_directory() && name != kManifestName && !files.contains(name)) {
            throw Error(folder.string() + ": holds '" + name +
                        "' which is not of the map, so it is not replaced");
        }
    }
}

void expect_replaceable(const fs::path& folder) {
    if (!fs::exists(folder)) {
        return;
    }
    if (!fs::is_directory(folder)) {
        throw Error(folder.string() + ": is a file; a map needs a folder");
    }
    if (!manifest_in(folder).is_null()) {
        expect_nothing_foreign(folder);
        return;
    }
    if (!fs::is_empty(folder)) {
        throw Error(folder.string() + ": is not empty and not a map, so it is not replaced");
    }
}

/// Without links, "." and slashes at the end: a name that has a parent.
fs::path plain_name(const fs::path& folder) {
    fs::path plain = folder.empty() ? folder : fs::weakly_canonical(fs::absolute(folder));
    if (!plain.empty() && !plain.has_filename()) {
        plain = plain.parent_path();
    }
    if (!plain.has_filename()) {
        throw Error("'" + folder.string() + "': a map cannot be written there");
    }
    return plain;
}

/// A folder that no one else holds, held until it is closed or the process is gone.
Folder lock_folder(const fs::path& place) {
    Folder folder(opendir(place.c_str()));
    if (folder && flock(dirfd(folder.get()), LOCK_EX | LOCK_NB) != 0) {
        folder.reset();
    }
    return folder;
}

std::string staging_prefix(const fs::path& folder) {
    return "." + folder.filename().string() + ".part";
}

/// What a crash has left behind; a folder that another writer is filling now is left alone.
void clear_leftovers(const fs::path& folder) {
    const std::string prefix = staging_prefix(folder);
    std::vector<fs::path> leftovers;
    for (const auto& entry : fs::directory_iterator(folder.parent_path())) {
        const std::string name = entry.path().filename().string();
        const bool numbered =
            name.size() > prefix.size() &&
            name.find_first_not_of("0123456789", prefix.size()) == std::string::npos;
        if (numbered && name.compare(0, prefix.size(), prefix) == 0 && entry.is_directory() &&
            !entry.is_symlink()) {
            leftovers.push_back(entry.path());
        }
    }
    for (const fs::path& leftover : leftovers) {
        if (const Folder lock = lock_folder(leftover)) {
            fs::remove_all(leftover);
        }
    }
    if (fs::exists(side_of(folder))) {
        if (fs::exists(folder)) {
            fs::remove_all(side_of(folder));
        } else {
            fs::rename(side_of(folder), folder);  // the crash came between the two renames
        }
    }
}

fs::path create_staging(const fs::path& folder) {
    const fs::path first =
        folder.parent_path() / (staging_prefix(folder) + std::to_string(getpid()));
    fs::path staging = first;
    while (!fs::create_directory(staging)) {
        staging += "0";  // a second writer of this process
    }
    return staging;
}

void check_counts(const fs::path& folder, const json& manifest, const StoredMap& map) {
    const fs::path place = folder / kManifestName;
    const json& counts = member(place, manifest, "counts");
    const bool right = count_of(place, counts, "keyframes") == map.keyframes.size() &&
                       count_of(place, counts, "edges") == map.graph.edges.size() &&
                       count_of(place, counts, "scans") == map.trajectory.size() &&
                       map.graph.nodes.size() == map.keyframes.size();
    if (!right) {
        fail_damaged(place, "its counts are not those of the files");
    }
}

/// Those that a map may do without: its version has none, or it has nothing to put there.
void read_optional_files(const fs::path& folder, const json& files, StoredMap& map) {
    const fs::path odometry = folder / "odometry.tum";
    if (files.contains("odometry.tum") && fs::file_size(odometry) > 0) {
        map.odometry_trajectory = read_tum(odometry);
    }
    if (map.version >= 2 && files.contains(kPyramidName)) {
        map.pyramid = read_pyramid(folder / kPyramidName);
    }
}

}  // namespace

fs::path side_of(const fs::path& folder) {
    return folder.parent_path() / ("." + folder.filename().string() + ".old");
}

void put_into_place(const fs::path& staging, const fs::path& folder, bool exchange) {
    std::error_code error;
    if (!fs::exists(folder)) {
        fs::rename(staging, folder, error);
    } else if (exchange && renameat2(AT_FDCWD, staging.c_str(), AT_FDCWD, folder.c_str(),
                                     RENAME_EXCHANGE) == 0) {
        fs::remove_all(staging, error);  // the old map; what stays is cleared by the next writer
        return;
    } else {
        const fs::path side = side_of(folder);
        fs::rename(folder, side);
        fs::rename(staging, folder, error);
        std::error_code ignored;
        if (error) {
            fs::rename(side, folder, ignored);
        } else {
            fs::remove_all(side, ignored);
        }
    }
    if (error) {
        throw system_error(folder, error);
    }
}

struct MapFolderWriter::Lock {
    Folder folder;
};

MapFolderWriter::MapFolderWriter(const fs::path& folder) {
    told_plainly(folder, [&] {
        folder_ = plain_name(folder);
        fs::create_directories(folder_.parent_path());
        clear_leftovers(folder_);
        expect_replaceable(folder_);
        staging_ = create_staging(folder_);
        lock_ = std::make_unique<Lock>(Lock{lock_folder(staging_)});
    });
}

MapFolderWriter::~MapFolderWriter() {
    if (!committed_) {
        std::error_code ignored;
        fs::remove_all(staging_, ignored);
    }
}

void MapFolderWriter::commit() {
    if (committed_) {
        return;
    }
    told_plainly(folder_, [&] {
        if (manifest_in(staging_).is_null()) {
            throw Error(folder_.string() + ": no map was written, so none can be put there");
        }
        write_manifest(staging_, read_map_manifest(staging_));
        sync_tree(staging_);
        expect_replaceable(folder_);
        std::error_code ignored;
        const bool standing_in_it = fs::current_path(ignored) == folder_;
        put_into_place(staging_, folder_, true);
        staging_ = folder_;
        committed_ = true;
        lock_.reset();
        if (standing_in_it) {
            fs::current_path(folder_, ignored);  // else we would be in the folder that is gone
        }
        sync_folder(folder_.parent_path());
    });
}

StoredMap read_map(const fs::path& folder) {
    return told_plainly(folder, [&] {
        const json manifest = read_map_manifest(folder);
        check_files(folder, manifest);
        StoredMap map;
        map.version = manifest["version"].get<int>();
        map.keyframes = read_keyframes(folder / "keyframes.bin");
        map.graph = read_g2o(folder / "graph.g2o").graph;
        map.trajectory = read_tum(folder / "trajectory.tum");
        map.grid = read_map_server(folder / "map.yaml");
        read_optional_files(folder, manifest["files"], map);
        check_counts(folder, manifest, map);
        return map;
    });
}

}  // namespace hybrid_slam
