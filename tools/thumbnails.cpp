// SPDX-License-Identifier: Apache-2.0
#include "thumbnails.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "figure.hpp"
#include "hybrid_slam/camera/image_codec.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr std::size_t kTiles = 8;
constexpr int kTileWidth = 200;  // pixels
constexpr int kTileHeight = 150;
constexpr int kMargin = 12;
constexpr int kCaption = 24;
constexpr int kTitle = 48;
constexpr int kMostTries = 30;  // damaged images in a row

constexpr Color kPaper{246, 247, 249};
constexpr Color kInk{45, 50, 58};
constexpr Color kRobot{214, 69, 65};

Rect tile(std::size_t column, int top) {
    return {kMargin + static_cast<int>(column) * (kTileWidth + kMargin), top, kTileWidth,
            kTileHeight};
}

void caption(Canvas& canvas, const Rect& rect, double seconds) {
    canvas.text({rect.x + 0.5 * rect.width, rect.y + rect.height + 17.0},
                fmt::format("{:.1f} s", std::max(0.0, seconds)), {11, kInk, Align::kCenter, false});
}

/// What the lidar saw, in the robot's frame with x up, the robot in the middle.
void draw_scan(Canvas& canvas, const Rect& rect, const Scan& scan, double radius) {
    canvas.fill(rect, kPaper);
    canvas.clip_to(rect);
    const Pixel middle(rect.x + 0.5 * rect.width, rect.y + 0.75 * rect.height);
    const double scale = 0.75 * rect.height / radius;
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        if (scan.is_return(scan.ranges[i])) {
            const double range = scan.ranges[i];
            const Point2 point = scan.robot_from_laser * Point2(range * std::cos(scan.angle(i)),
                                                                range * std::sin(scan.angle(i)));
            canvas.disc(middle + scale * Pixel(-point.y(), -point.x()), 1.2, kInk);
        }
    }
    canvas.disc(middle, 3.0, kRobot);
    canvas.clip_to_all();
}

/// Metres that show nearly all that the scans saw.
double radius_of(const std::vector<Scan>& scans) {
    std::vector<float> ranges;
    for (const Scan& scan : scans) {
        std::copy_if(scan.ranges.begin(), scan.ranges.end(), std::back_inserter(ranges),
                     [&](float range) { return scan.is_return(range); });
    }
    if (ranges.empty()) {
        return 1.0;
    }
    const auto most = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() * 9 / 10);
    std::nth_element(ranges.begin(), most, ranges.end());
    return std::max(1.0, static_cast<double>(*most));
}

/// Some of them, evenly spread, the first and the last among them.
template <typename Item>
std::vector<Item> spread(const std::vector<Item>& items, std::size_t count) {
    std::vector<Item> chosen;
    const std::size_t wanted = std::min(count, items.size());
    for (std::size_t i = 0; i < wanted; ++i) {
        chosen.push_back(items[wanted < 2 ? 0 : i * (items.size() - 1) / (wanted - 1)]);
    }
    return chosen;
}

}  // namespace

std::vector<Image> read_thumbnails(const std::filesystem::path& recording, std::size_t count) {
    const std::filesystem::path file = recording / RecordingFiles::kCamera;
    std::vector<Image> images;
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) {
        return images;
    }
    RecordFileReader reader(file);
    std::uint64_t behind = 0;
    for (std::size_t i = 0; i < count; ++i) {
        reader.seek(std::max(behind, reader.size() / count * i));
        std::optional<Image> image;
        for (int tries = 0; !image && tries < kMostTries; ++tries) {
            const std::optional<Record> record = reader.next();
            if (!record) {
                return images;
            }
            image = decode_image(record->bytes, ImageColor::kBgr);
            if (image) {
                image->stamp = record->arrival;
                images.push_back(std::move(*image));
            }
        }
        behind = reader.position();
    }
    return images;
}

Canvas draw_strip(const std::string& title, const Inspection& inspection,
                  const std::vector<Image>& images) {
    constexpr int kRow = kTileHeight + kCaption;
    const int rows = (images.empty() ? 0 : 1) + (inspection.samples.empty() ? 0 : 1);
    Canvas canvas(kMargin + static_cast<int>(kTiles) * (kTileWidth + kMargin),
                  kTitle + rows * kRow + kMargin / 2);
    canvas.text({kMargin, 31.0}, title, {15, kInk, Align::kLeft, true});
    int top = kTitle;
    for (std::size_t i = 0; i < std::min(kTiles, images.size()); ++i) {
        canvas.image(images[i], tile(i, top));
        caption(canvas, tile(i, top), images[i].stamp - inspection.begin);
    }
    top += images.empty() ? 0 : kRow;
    const std::vector<Scan> scans = spread(inspection.samples, kTiles);
    const double radius = radius_of(scans);
    for (std::size_t i = 0; i < scans.size(); ++i) {
        draw_scan(canvas, tile(i, top), scans[i], radius);
        caption(canvas, tile(i, top), scans[i].stamp - inspection.begin);
    }
    return canvas;
}

}  // namespace hybrid_slam::tools
