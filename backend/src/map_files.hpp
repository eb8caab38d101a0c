// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "hybrid_slam/backend/keyframe.hpp"
#include "hybrid_slam/backend/likelihood_pyramid.hpp"
#include "hybrid_slam/backend/pose_graph.hpp"

namespace hybrid_slam {

inline constexpr const char* kManifestName = "manifest.json";
inline constexpr const char* kPyramidName = "pyramid.bin";

/// Throws Error when it is not so.
void expect_keyframe_per_node(const Keyframes& keyframes, const PoseGraph& graph);

/// keyframes.bin; docs/formats.md has its layout. Coordinates of surfaces are rounded to floats.
/// Writing throws Error for numbers that are not finite or do not fit, reading for all that is not
/// exactly such a file.
void write_keyframes(const std::filesystem::path& file, const Keyframes& keyframes);
Keyframes read_keyframes(const std::filesystem::path& file);

/// pyramid.bin: the finest level, compressed; the others follow from it. Both throw Error as those
/// of keyframes.
void write_pyramid(const std::filesystem::path& file, const LikelihoodPyramid& pyramid);
LikelihoodPyramid read_pyramid(const std::filesystem::path& file);

/// Writes the manifest of all files in the folder. `facts` may hold whatever else is to be said.
void write_manifest(const std::filesystem::path& folder, nlohmann::json facts);

/// Puts a finished folder in the place of another, or where nothing is. With `exchange` in one step
/// where the file system can do that; else the old folder goes to the side for a moment, and comes
/// back when the new one cannot be moved.
void put_into_place(const std::filesystem::path& staging, const std::filesystem::path& folder,
                    bool exchange);

/// Where the old folder is during that moment.
std::filesystem::path side_of(const std::filesystem::path& folder);

}  // namespace hybrid_slam
