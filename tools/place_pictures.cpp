// SPDX-License-Identifier: Apache-2.0
#include "place_pictures.hpp"

#include <algorithm>
#include <cmath>

#include "map_backdrop.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr Color kBest{20, 150, 75};
constexpr Color kOther{235, 150, 20};
constexpr Color kMiss{150, 155, 163};
constexpr Color kScan{222, 60, 50};
constexpr Color kEarlier{240, 150, 140};
constexpr Color kTracking{70, 105, 190};
constexpr Color kDegraded{235, 150, 20};
constexpr Color kLost{222, 60, 50};
constexpr Color kJump{165, 60, 170};
constexpr Color kStart{20, 150, 75};
constexpr Color kWhite{255, 255, 255};
constexpr double kMarginShare = 0.03;

Bounds bounds_of(const Points& points) {
    Bounds bounds;
    for (const Point2& point : points) {
        bounds.include(point);
    }
    return bounds;
}

/// From the robot's place where it heads to, as long in any map.
void draw_arrow(Canvas& canvas, const View& view, const Pose2d& pose, const Color& color) {
    constexpr double kLength = 30.0;  // pixels
    constexpr double kBarb = 10.0;
    const Pixel tail = view(pose.translation);
    const auto along = [&](double angle, double length) {
        return Pixel(length * std::cos(angle), -length * std::sin(angle));
    };
    const Pixel tip = tail + along(pose.heading, kLength);
    for (const Stroke& stroke : {Stroke{kWhite, 6}, Stroke{color, 3}}) {
        canvas.line(tail, tip, stroke);
        for (const double side : {-0.5, 0.5}) {
            canvas.line(tip, tip - along(pose.heading + side, kBarb), stroke);
        }
    }
    canvas.disc(tail, 6.0, kWhite);
    canvas.disc(tail, 4.5, color);
}

void draw_number(Canvas& canvas, const View& view, const Pose2d& pose, std::size_t number) {
    const TextStyle style{13, {20, 20, 20}, Align::kCenter, true};
    const Pixel behind(-16.0 * std::cos(pose.heading), 16.0 * std::sin(pose.heading));
    const Pixel at = view(pose.translation) + behind;
    canvas.disc(at, 10.0, kWhite);
    canvas.text(at + Pixel(0.0, 6.0), std::to_string(number), style);
}

Color color_of(PlaceVerdict verdict, std::size_t index) {
    if (verdict == PlaceVerdict::kNotInMap) {
        return kMiss;
    }
    return verdict == PlaceVerdict::kFound && index == 0 ? kBest : kOther;
}

void draw_scans(Canvas& canvas, const View& view, const Query& query, const Pose2d& pose) {
    for (std::size_t i = query.size(); i-- > 0;) {
        for (const Pixel& pixel : view(transform(pose, query[i].surface.points))) {
            canvas.disc(pixel, i == 0 ? 1.8 : 1.2, i == 0 ? kScan : kEarlier);
        }
    }
}

std::vector<LegendEntry> legend_of(const PlacesPicture& picture) {
    std::vector<LegendEntry> legend;
    const PlaceVerdict verdict = picture.answer.verdict;
    if (picture.answer.places.empty()) {
        return legend;
    }
    if (verdict == PlaceVerdict::kFound) {
        legend.push_back({Mark::kDot, kBest, "found"});
        if (picture.answer.places.size() > 1) {
            legend.push_back({Mark::kDot, kOther, "runner-up"});
        }
    } else {
        const bool missed = verdict == PlaceVerdict::kNotInMap;
        legend.push_back({Mark::kDot, color_of(verdict, 0), missed ? "nearest miss" : "possible"});
    }
    legend.push_back({Mark::kDot, kScan, "scan, as seen from place 1"});
    if (picture.query.size() > 1) {
        legend.push_back({Mark::kDot, kEarlier, "scans before it"});
    }
    return legend;
}

Color color_of(LocalizationStatus status) {
    switch (status) {
        case LocalizationStatus::kTracking:
            return kTracking;
        case LocalizationStatus::kDegraded:
            return kDegraded;
        default:
            return kLost;
    }
}

/// Pieces of one status each; the last point of a piece is the first of the next.
void draw_way(Canvas& canvas, const View& view, const std::vector<WayPoint>& way) {
    for (std::size_t first = 0; first < way.size();) {
        std::vector<Pixel> pixels = {view(way[first].map_from_robot.translation)};
        std::size_t next = first + 1;
        const LocalizationStatus status = way[std::min(next, way.size() - 1)].status;
        for (; next < way.size() && way[next].follows && way[next].status == status; ++next) {
            pixels.push_back(view(way[next].map_from_robot.translation));
        }
        canvas.polyline(pixels, {color_of(status), 3});
        const bool gap = next >= way.size() || !way[next].follows;
        first = gap ? next : next - 1;
    }
}

void draw_marker(Canvas& canvas, const Pixel& at, const Color& color) {
    canvas.disc(at, 9.0, kWhite);
    canvas.disc(at, 7.0, color);
}

Panel way_panel(const WayPicture& picture) {
    Bounds bounds = bounds_of(picture.map.surface().points);
    for (const WayPoint& point : picture.way) {
        bounds.include(point.map_from_robot.translation);
    }
    Panel panel;
    panel.bounds = bounds.with_margin(kMarginShare);
    panel.draw = [&picture](Canvas& canvas, const View& view) {
        draw_map(canvas, view, picture.map);
        draw_way(canvas, view, picture.way);
        for (const Jump& jump : picture.jumps) {
            const Pixel from = view(jump.from.translation);
            const Pixel to = view(jump.to.translation);
            canvas.line(from, to, {kJump, 2});
            canvas.disc(from, 4.0, kJump);
            draw_arrow(canvas, view, jump.to, kJump);
        }
        if (!picture.way.empty()) {
            draw_marker(canvas, view(picture.way.front().map_from_robot.translation), kStart);
            draw_arrow(canvas, view, picture.way.back().map_from_robot,
                       color_of(picture.way.back().status));
        }
    };
    return panel;
}

}  // namespace

Canvas draw(const PlacesPicture& picture) {
    const std::vector<Place>& places = picture.answer.places;
    Bounds bounds = bounds_of(picture.map.surface().points);
    for (const Place& place : places) {
        bounds.include(place.map_from_robot.translation);
    }
    Panel panel;
    panel.bounds = bounds.with_margin(kMarginShare);
    panel.draw = [&picture, &places](Canvas& canvas, const View& view) {
        draw_map(canvas, view, picture.map);
        if (!places.empty()) {
            draw_scans(canvas, view, picture.query, places.front().map_from_robot);
        }
        for (std::size_t i = places.size(); i-- > 0;) {
            draw_arrow(canvas, view, places[i].map_from_robot, color_of(picture.answer.verdict, i));
            draw_number(canvas, view, places[i].map_from_robot, i + 1);
        }
    };
    return draw(Figure{picture.title, picture.subtitle, {panel}, legend_of(picture)});
}

Canvas draw(const WayPicture& picture) {
    const auto has = [&](LocalizationStatus status) {
        return std::any_of(picture.way.begin(), picture.way.end(),
                           [status](const WayPoint& point) { return point.status == status; });
    };
    std::vector<LegendEntry> legend = {{Mark::kLine, kTracking, "tracking"}};
    if (has(LocalizationStatus::kDegraded)) {
        legend.push_back({Mark::kLine, kDegraded, "degraded"});
    }
    if (has(LocalizationStatus::kLost)) {
        legend.push_back({Mark::kLine, kLost, "lost"});
    }
    if (!picture.jumps.empty()) {
        legend.push_back({Mark::kLine, kJump, "jump"});
    }
    legend.push_back({Mark::kDot, kStart, "found first"});
    return draw(Figure{picture.title, picture.subtitle, {way_panel(picture)}, std::move(legend)});
}

}  // namespace hybrid_slam::tools
