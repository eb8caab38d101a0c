// SPDX-License-Identifier: Apache-2.0
#include "messages.hpp"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam::tools {
namespace {

spdlog::logger& logger() {
    static const auto kMade = [] {
        auto fresh = spdlog::stderr_color_mt("hybrid-slam");
        fresh->set_pattern("%n: %^%v%$");
        return fresh;
    }();
    return *kMade;
}

}  // namespace

void print_error(std::string_view text) {
    logger().error("{}", text);
}

void print_warning(std::string_view text) {
    logger().warn("warning: {}", text);
}

void print_info(std::string_view text) {
    logger().info("{}", text);
}

void silence_messages() {
    logger().set_level(spdlog::level::err);
}

void print_result(std::string_view text) {
    const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() &&
                         std::fputc('\n', stdout) != EOF;
    if (!written) {
        throw Error("standard output: cannot be written");
    }
}

void print_json(const nlohmann::ordered_json& json) {
    // Names of files may hold any bytes; what is no UTF-8 is replaced rather than refused.
    print_result(json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void write_text(const std::filesystem::path& file, std::string_view text) {
    TextFileWriter writer(file);
    writer.write(text);
    writer.close();
}

double rounded(double value) {
    return std::round(value * 1e6) / 1e6;
}

std::string megabytes(std::uint64_t bytes) {
    return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes));
}

std::string with_commas(std::size_t number) {
    std::string digits = std::to_string(number);
    for (std::size_t place = digits.size(); place > 3;) {
        place -= 3;
        digits.insert(place, 1, ',');
    }
    return digits;
}

std::string counted(std::size_t number, std::string_view noun) {
    return fmt::format("{} {}{}", with_commas(number), noun, number == 1 ? "" : "s");
}

std::string duration_text(double seconds) {
    if (seconds < 120.0) {
        return fmt::format("{:.0f} s", seconds);
    }
    return seconds < 7200.0 ? fmt::format("{:.0f} min", seconds / 60.0)
                            : fmt::format("{:.1f} h", seconds / 3600.0);
}

std::string stem_of(const std::filesystem::path& file) {
    std::filesystem::path name = file.filename();
    if (name.extension() == ".gz") {
        name = name.stem();
    }
    return name.stem().string();
}

}  // namespace hybrid_slam::tools
