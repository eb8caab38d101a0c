// SPDX-License-Identifier: Apache-2.0
#include "output_guard.hpp"

#include <fstream>
#include <string>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam::tools {
namespace fs = std::filesystem;

bool is_map_or_recording(const fs::path& folder) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 26U;
    const fs::path manifest = folder / "manifest.json";
    return fs::is_regular_file(manifest) &&
           read_whole_file(manifest, kMostBytes).find("\"hybrid_slam ") != std::string::npos;
}

void expect_replaceable(const fs::path& file, std::string_view magic) {
    const fs::path target = replaceable_file(file);
    if (is_map_or_recording(fs::absolute(target).parent_path())) {
        throw Error(file.string() +
                    ": a map or recording is in that folder, nothing may be put beside its files");
    }
    if (!fs::exists(target) || fs::file_size(target) == 0) {
        return;
    }
    std::string begin(magic.size(), '\0');
    std::ifstream(target, std::ios::binary)
        .read(begin.data(), static_cast<std::streamsize>(begin.size()));
    if (begin != magic) {
        throw Error(file.string() + ": is there and of another kind, so it is not replaced");
    }
}

}  // namespace hybrid_slam::tools
