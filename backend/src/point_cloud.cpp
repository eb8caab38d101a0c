// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/point_cloud.hpp"

#include <fmt/format.h>

#include <iterator>
#include <string>

#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

void write_lines(const std::filesystem::path& file, const std::string& head, const Points& points) {
    fmt::memory_buffer text;
    fmt::format_to(std::back_inserter(text), "{}", head);
    for (const Point2& point : points) {
        fmt::format_to(std::back_inserter(text), "{:.4f} {:.4f} 0\n", point.x(), point.y());
    }
    TextFileWriter writer(file);
    writer.write({text.data(), text.size()});
    writer.close();
}

}  // namespace

void write_ply(const std::filesystem::path& file, const Points& points) {
    write_lines(file,
                fmt::format("ply\nformat ascii 1.0\ncomment hybrid_slam point map, metres\n"
                            "element vertex {}\nproperty float x\nproperty float y\n"
                            "property float z\nend_header\n",
                            points.size()),
                points);
}

void write_pcd(const std::filesystem::path& file, const Points& points) {
    write_lines(file,
                fmt::format("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
                            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\n"
                            "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA ascii\n",
                            points.size()),
                points);
}

}  // namespace hybrid_slam
