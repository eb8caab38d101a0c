// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "hybrid_slam/backend/map_folder.hpp"
#include "map_files.hpp"
#include "map_support.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Changes the manifest as someone would who knows the format.
template <typename Change>
void edit_manifest(const fs::path& folder, Change&& change) {
    json manifest = json::parse(bytes_of(folder / kManifestName));
    change(manifest);
    manifest.erase("crc32");
    manifest["crc32"] = slow_crc(manifest.dump());
    overwrite(folder / kManifestName, manifest.dump());
}

TEST(MapFolder, DamageToAnyFileIsFound) {
    const TempFolder folder;
    store(folder / "hall", room(10));
    for (const auto& [name, bytes] : content_of(folder / "hall")) {
        if (name == kManifestName) {
            continue;
        }
        const fs::path file = folder / "hall" / name;
        const auto error = [&] { return error_of([&] { read_map(folder / "hall"); }); };
        const auto names_it = AllOf(HasSubstr("hall/" + name + ": "), Not(HasSubstr("\n")));
        for (const std::size_t at : {std::size_t{0}, bytes.size() / 2, bytes.size() - 1}) {
            overwrite(file, flipped(bytes, at, 3));
            EXPECT_THAT(error(), AllOf(names_it, HasSubstr("CRC-32")));
        }
        overwrite(file, bytes.substr(0, bytes.size() - 1));
        EXPECT_THAT(error(), AllOf(names_it, HasSubstr("bytes instead of")));
        overwrite(file, bytes + "x");
        EXPECT_THAT(error(), names_it);
        fs::remove(file);
        EXPECT_THAT(error(), AllOf(names_it, HasSubstr("missing")));
        overwrite(file, bytes);
    }
    EXPECT_NO_THROW(read_map(folder / "hall"));
}

TEST(MapFolder, AFlippedBitInTheManifestIsFoundOrChangesNothing) {
    const TempFolder folder;
    store(folder / "hall", room(3));
    const fs::path file = folder / "hall/manifest.json";
    const std::string bytes = bytes_of(file);
    const json meant = json::parse(bytes);
    for (std::size_t at = 0; at < bytes.size(); ++at) {
        const std::string damaged = flipped(bytes, at, at % 8);
        overwrite(file, damaged);
        if (json::parse(damaged, nullptr, false) == meant) {
            EXPECT_NO_THROW(read_map(folder / "hall")) << "byte " << at;
        } else {
            EXPECT_THROW(read_map(folder / "hall"), Error) << "byte " << at;
        }
    }
    for (std::size_t size = 0; size + 2 < bytes.size(); ++size) {
        overwrite(file, bytes.substr(0, size));
        EXPECT_THROW(read_map(folder / "hall"), Error) << "size " << size;
    }
}

TEST(MapFolder, AManifestThatDoesNotFitIsRefused) {
    const TempFolder folder;
    const auto error_after = [&](auto&& change) {
        fs::remove_all(folder / "hall");
        store(folder / "hall", room(10));
        edit_manifest(folder / "hall", change);
        return error_of([&] { read_map(folder / "hall"); });
    };
    store(folder / "hall", room(10));
    edit_manifest(folder / "hall", [](json& manifest) { manifest["note"] = "may be more"; });
    EXPECT_NO_THROW(read_map(folder / "hall"));

    EXPECT_THAT(error_after([](json& manifest) { manifest["version"] = 3; }),
                AllOf(HasSubstr("version 3"), HasSubstr("up to 2")));
    EXPECT_THAT(error_after([](json& manifest) { manifest["version"] = 0; }), HasSubstr("damaged"));
    EXPECT_THAT(error_after([](json& manifest) { manifest["version"] = -1.5; }),
                HasSubstr("'version' is no count"));
    EXPECT_THAT(error_after([](json& manifest) { manifest["counts"]["edges"] = 7; }),
                HasSubstr("counts"));
    EXPECT_THAT(error_after([](json& manifest) { manifest["files"].erase("map.pgm"); }),
                HasSubstr("'map.pgm' is missing"));
    EXPECT_THAT(error_after([](json& manifest) {
                    manifest["files"] = {1, 2};
                }),
                HasSubstr("'keyframes.bin' is missing"));
    EXPECT_THAT(error_after([](json& manifest) { manifest["files"]["map.pgm"] = "good"; }),
                HasSubstr("'bytes' is missing"));
    for (const char* name : {"../hall/map.pgm", "/etc/hostname", "a/../../b", ""}) {
        EXPECT_THAT(error_after([&](json& manifest) {
                        manifest["files"][name] = manifest["files"]["map.pgm"];
                    }),
                    HasSubstr("is not in the folder"));
    }
}

TEST(MapFolder, ReadsOnlyMapFolders) {
    const TempFolder folder;
    folder.write("file", "");
    EXPECT_THAT(error_of([&] { read_map(folder / "none"); }), HasSubstr("none: there is no such"));
    EXPECT_THAT(error_of([&] { read_map(folder / "file"); }), HasSubstr("no such folder"));
    EXPECT_THAT(error_of([&] { read_map(folder.path()); }), HasSubstr("no map folder"));
    folder.write("manifest.json", "[]");
    EXPECT_THAT(error_of([&] { read_map(folder.path()); }), HasSubstr("another program"));
    EXPECT_FALSE(fs::exists(folder / "none"));
}

TEST(MapFolder, RefusesAMapThatCouldNotBeReadBack) {
    const TempFolder folder;
    const auto error_after = [&](auto&& change) {
        SlamMap map = room(5);
        change(map);
        return error_of([&] { write_map(folder.path(), map); });
    };
    EXPECT_THAT(error_after([](SlamMap& map) { map = {}; }), HasSubstr("no keyframe"));
    EXPECT_THAT(error_after([](SlamMap& map) { map.keyframes.pop_back(); }),
                HasSubstr("5 keyframes do not go with a graph of 6"));
    EXPECT_THAT(error_after([](SlamMap& map) { map.trajectory.clear(); }),
                HasSubstr("no trajectory"));
    EXPECT_THAT(error_after([](SlamMap& map) { map.keyframes[1].surface.normals.pop_back(); }),
                HasSubstr("5 points but 4 normals"));
    EXPECT_THAT(error_after([](SlamMap& map) { map.keyframes[1].surface.points[0].x() = NAN; }),
                HasSubstr("not finite"));
    EXPECT_THAT(error_after([](SlamMap& map) { map.keyframes[1].surface.normals[0].y() = 1e39; }),
                HasSubstr("not finite"));
    EXPECT_THAT(error_after([](SlamMap& map) { map.keyframes[1].stamp = INFINITY; }),
                HasSubstr("not finite"));
}

TEST(KeyframesFile, EveryTruncationIsRefused) {
    const TempFolder folder;
    write_keyframes(folder / "all", room(4).keyframes);
    const std::string bytes = bytes_of(folder / "all");
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        overwrite(folder / "part", bytes.substr(0, size));
        EXPECT_THROW(read_keyframes(folder / "part"), Error) << size << " bytes";
    }
    overwrite(folder / "part", bytes + '\0');
    EXPECT_THAT(error_of([&] { read_keyframes(folder / "part"); }), HasSubstr("too many"));
}

TEST(KeyframesFile, NoFlippedBitDoesHarm) {
    const TempFolder folder;
    write_keyframes(folder / "all", room(4).keyframes);
    const std::string bytes = bytes_of(folder / "all");
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        overwrite(folder / "bad", flipped(bytes, bit / 8, bit % 8));
        try {
            const Keyframes keyframes = read_keyframes(folder / "bad");
            ASSERT_EQ(keyframes.size(), 6U);
            EXPECT_EQ(keyframes[5].surface.points.size(), keyframes[5].surface.normals.size());
        } catch (const Error& error) {
            ++refused;
            EXPECT_THAT(error.what(), HasSubstr("/bad: "));
        }
    }
    // Magic, version, number of keyframes and of points: each bit of these matters.
    EXPECT_GE(refused, 8U * (8 + 4 + 4 + 6 * 4));
}

TEST(KeyframesFile, LayoutIsTheOneInTheDocumentation) {
    const TempFolder folder;
    Keyframes keyframes(1);
    keyframes[0].stamp = 1.0;
    keyframes[0].robot_from_laser = {-2.0, 0.0, 0.0};
    keyframes[0].surface.points = {{1.0, -1.0}};
    keyframes[0].surface.normals = {{0.0, 0.5}};
    write_keyframes(folder / "one", keyframes);
    using namespace std::string_literals;
    const std::string zero(8, '\0');
    EXPECT_EQ(bytes_of(folder / "one"), "HSKEYFRM\x01\0\0\0\x01\0\0\0"s + "\0\0\0\0\0\0\xF0\x3F"s +
                                            zero + zero + zero + zero + "\0\0\0\0\0\0\0\xC0"s +
                                            zero + zero + "\x01\0\0\0"s +
                                            "\0\0\x80\x3F\0\0\x80\xBF"s + "\0\0\0\0\0\0\0\x3F"s);
}

}  // namespace
}  // namespace hybrid_slam
