// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace hybrid_slam::tools {

/// To standard error, as "hybrid-slam: ...".
void print_error(std::string_view text);
void print_warning(std::string_view text);
void print_info(std::string_view text);
/// Keeps all but errors to ourselves.
void silence_messages();

/// To standard output. Throws Error when it cannot be written.
void print_result(std::string_view text);
void print_json(const nlohmann::ordered_json& json);

/// Throws Error when the file cannot be written.
void write_text(const std::filesystem::path& file, std::string_view text);

/// To six digits after the point: more would be noise to whoever reads it.
double rounded(double value);
/// Bytes as "0.9 MB".
std::string megabytes(std::uint64_t bytes);
/// 13631 as "13,631".
std::string with_commas(std::size_t number);
/// "1 scan", "2 scans".
std::string counted(std::size_t number, std::string_view noun);
/// Seconds as "42 s", "44 min" or "2.5 h".
std::string duration_text(double seconds);
/// The name of a file without folders, .gz and the extension before it.
std::string stem_of(const std::filesystem::path& file);

}  // namespace hybrid_slam::tools
