// SPDX-License-Identifier: Apache-2.0
#include "drawings.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam::tools {
namespace {

constexpr Color kChain{70, 105, 190};
constexpr Color kAccepted{20, 150, 75};
constexpr Color kRefused{222, 60, 50};
constexpr Color kWaiting{235, 150, 20};
constexpr Color kStart{20, 150, 75};
constexpr Color kEnd{222, 60, 50};
constexpr Color kWall{70, 76, 88};
constexpr Color kFaded{150, 155, 163};
constexpr Color kTruth{10, 10, 10};
constexpr Color kWhite{255, 255, 255};
constexpr double kMarginShare = 0.03;

Points positions_of(const Trajectory& trajectory) {
    Points points;
    points.reserve(trajectory.size());
    for (const StampedPose& stamped : trajectory) {
        points.push_back(stamped.pose.translation);
    }
    return points;
}

Points positions_of(const std::vector<Pose2d>& nodes) {
    Points points;
    points.reserve(nodes.size());
    for (const Pose2d& node : nodes) {
        points.push_back(node.translation);
    }
    return points;
}

Points walls_of(const StateGrid& grid) {
    Points walls;
    for (int y = 0; y < grid.geometry.height; ++y) {
        for (int x = 0; x < grid.geometry.width; ++x) {
            if (grid.at({x, y}) == CellState::kOccupied) {
                walls.push_back(grid.geometry.center_of({x, y}));
            }
        }
    }
    return walls;
}

Bounds bounds_of(const Points& points) {
    Bounds bounds;
    for (const Point2& point : points) {
        bounds.include(point);
    }
    return bounds;
}

/// The same for walls: the few returns from far outside, through a window, are left out.
Bounds inner_bounds_of(const Points& points) {
    constexpr double kLeftOut = 0.002;
    if (points.empty()) {
        return {};
    }
    std::vector<double> xs;
    std::vector<double> ys;
    for (const Point2& point : points) {
        xs.push_back(point.x());
        ys.push_back(point.y());
    }
    std::sort(xs.begin(), xs.end());
    std::sort(ys.begin(), ys.end());
    const auto skip = static_cast<std::size_t>(kLeftOut * static_cast<double>(points.size()));
    const std::size_t last = points.size() - 1 - skip;
    Bounds bounds;
    bounds.include(Point2(xs[skip], ys[skip]));
    bounds.include(Point2(xs[last], ys[last]));
    return bounds;
}

void draw_marker(Canvas& canvas, const Pixel& at, const Color& color) {
    canvas.disc(at, 9.0, kWhite);
    canvas.disc(at, 7.0, color);
}

/// In pieces, each of the colour of its time.
void draw_way(Canvas& canvas, const View& view, const Trajectory& trajectory, int width) {
    if (trajectory.empty()) {
        return;
    }
    const std::vector<Pixel> pixels = view(positions_of(trajectory));
    constexpr std::size_t kPieces = 200;
    const std::size_t length = std::max<std::size_t>(1, pixels.size() / kPieces);
    for (std::size_t first = 0; first + 1 < pixels.size(); first += length) {
        const std::size_t last = std::min(first + length, pixels.size() - 1);
        const auto begin = pixels.begin() + static_cast<std::ptrdiff_t>(first);
        const auto end = pixels.begin() + static_cast<std::ptrdiff_t>(last) + 1;
        canvas.polyline(
            {begin, end},
            {ramp(static_cast<double>(first) / static_cast<double>(pixels.size())), width});
    }
    draw_marker(canvas, pixels.front(), kStart);
    draw_marker(canvas, pixels.back(), kEnd);
}

/// A way without its time, or several of them, one after the other.
void draw_faded(Canvas& canvas, const View& view, const Trajectory& trajectory) {
    constexpr double kJump = 2.0;  // metres; farther apart are two drives
    Points piece;
    for (const StampedPose& stamped : trajectory) {
        const Point2& place = stamped.pose.translation;
        if (!piece.empty() && (place - piece.back()).norm() > kJump) {
            canvas.polyline(view(piece), {kFaded, 2});
            piece.clear();
        }
        piece.push_back(place);
    }
    canvas.polyline(view(piece), {kFaded, 2});
}

/// A polyline in dashes of one length, however short its own pieces are.
void dashed(Canvas& canvas, const std::vector<Pixel>& pixels, const Stroke& stroke) {
    constexpr double kDash = 9.0;
    constexpr double kPeriod = 15.0;
    double walked = 0.0;
    for (std::size_t i = 1; i < pixels.size(); ++i) {
        const Pixel step = pixels[i] - pixels[i - 1];
        const double length = step.norm();
        for (double at = 0.0; at < length;) {
            const double phase = std::fmod(walked + at, kPeriod);
            const double until =
                std::min(length, at + std::max(0.01, (phase < kDash ? kDash : kPeriod) - phase));
            if (phase < kDash) {
                canvas.line(pixels[i - 1] + at / length * step,
                            pixels[i - 1] + until / length * step, stroke);
            }
            at = until;
        }
        walked += length;
    }
}

std::vector<LegendEntry> way_legend() {
    return {{Mark::kRamp, {}, "way driven, from start to end"},
            {Mark::kDot, kStart, "start"},
            {Mark::kDot, kEnd, "end"}};
}

void draw_pairs(Canvas& canvas, const View& view, const std::vector<Pose2d>& nodes,
                const std::vector<NodePair>& pairs, const Stroke& stroke) {
    for (const auto& [from, to] : pairs) {
        canvas.line(view(nodes[from].translation), view(nodes[to].translation), stroke);
    }
}

/// The same for both where they are of about the same size, so that they can be compared.
std::pair<Bounds, Bounds> graph_bounds(const GraphPicture& picture) {
    constexpr double kAlike = 1.3;
    const Bounds before = bounds_of(positions_of(picture.before)).with_margin(kMarginShare);
    const Bounds after = bounds_of(positions_of(picture.after)).with_margin(kMarginShare);
    Bounds both = before;
    both.include(after);
    const bool alike = (both.size().array() < kAlike * after.size().array()).all() &&
                       (both.size().array() < kAlike * before.size().array()).all();
    return alike ? std::pair(both, both) : std::pair(before, after);
}

Panel graph_panel(const GraphPicture& picture, const std::vector<Pose2d>& nodes,
                  const Bounds& bounds) {
    Panel panel;
    panel.bounds = bounds;
    panel.draw = [&picture, &nodes](Canvas& canvas, const View& view) {
        draw_pairs(canvas, view, nodes, picture.refused, {mix(kRefused, kWhite, 0.35), 1});
        draw_pairs(canvas, view, nodes, picture.waiting, {kWaiting, 1});
        draw_pairs(canvas, view, nodes, picture.accepted, {kAccepted, 2});
        draw_pairs(canvas, view, nodes, picture.odometry, {kChain, 2});
        draw_marker(canvas, view(nodes.front().translation), kStart);
    };
    return panel;
}

}  // namespace

Canvas draw(const MapPicture& picture) {
    Bounds bounds = inner_bounds_of(walls_of(picture.grid));
    bounds.include(bounds_of(positions_of(picture.trajectory)));
    bounds.include(bounds_of(positions_of(picture.earlier)));
    Panel panel;
    panel.bounds = bounds.with_margin(kMarginShare);
    panel.draw = [&picture](Canvas& canvas, const View& view) {
        const GridGeometry& geometry = picture.grid.geometry;
        const GridShades shades;
        canvas.fill({0, 0, canvas.width(), canvas.height()}, shades.unknown);
        const Point2 corner = geometry.origin + Point2(0.0, geometry.height * geometry.resolution);
        canvas.grid(picture.grid, view(corner), view.pixels_per_metre() * geometry.resolution,
                    shades);
        draw_faded(canvas, view, picture.earlier);
        draw_way(canvas, view, picture.trajectory, 2);
    };
    std::vector<LegendEntry> legend = way_legend();
    if (!picture.earlier.empty()) {
        legend.push_back({Mark::kLine, kFaded, "driven before"});
    }
    return draw(Figure{picture.title, picture.subtitle, {panel}, std::move(legend)});
}

Canvas draw(const GraphPicture& picture) {
    Figure figure;
    figure.title = picture.title;
    figure.subtitle = std::to_string(picture.after.size()) + " nodes, " +
                      std::to_string(picture.odometry.size()) + " odometry edges, " +
                      std::to_string(picture.accepted.size()) + " loop closures";
    const auto [before_bounds, after_bounds] = graph_bounds(picture);
    figure.panels = {graph_panel(picture, picture.before, before_bounds),
                     graph_panel(picture, picture.after, after_bounds)};
    figure.panels[0].caption = picture.before_caption;
    figure.panels[1].caption = picture.after_caption;
    figure.legend = {{Mark::kLine, kChain, "odometry"}, {Mark::kLine, kAccepted, "loop closure"}};
    if (!picture.waiting.empty()) {
        figure.legend.push_back({Mark::kLine, kWaiting, "closure without a second witness"});
    }
    if (!picture.refused.empty()) {
        figure.legend.push_back(
            {Mark::kLine, mix(kRefused, kWhite, 0.35), "refused or thrown out"});
    }
    figure.legend.push_back({Mark::kDot, kStart, "start"});
    return draw(figure);
}

void add_closures(GraphPicture& picture, const std::vector<Closure>& closures) {
    for (const Closure& closure : closures) {
        auto& pairs = closure.verdict == ClosureVerdict::kAccepted  ? picture.accepted
                      : closure.verdict == ClosureVerdict::kPending ? picture.waiting
                                                                    : picture.refused;
        pairs.emplace_back(closure.from, closure.to);
    }
}

void add_edges(GraphPicture& picture, const PoseGraph& graph) {
    for (const Edge& edge : graph.edges) {
        auto& pairs = edge.kind == EdgeKind::kOdometry ? picture.odometry : picture.accepted;
        pairs.emplace_back(edge.from, edge.to);
    }
}

Canvas draw(const PathsPicture& picture) {
    Bounds bounds = inner_bounds_of(picture.points);
    bounds.include(bounds_of(positions_of(picture.truth)));
    const Bounds most = bounds.with_margin(0.25);
    Figure figure{picture.title, picture.subtitle, {}, {}};
    if (!picture.truth.empty()) {
        figure.legend.push_back({Mark::kDashes, kTruth, "truth"});
    }
    for (const DrawnPath& path : picture.paths) {
        Bounds own = bounds_of(positions_of(path.trajectory));
        const bool leaves = (own.lower.array() < most.lower.array()).any() ||
                            (own.upper.array() > most.upper.array()).any();
        own.lower = own.lower.cwiseMax(most.lower);
        own.upper = own.upper.cwiseMin(most.upper);
        bounds.include(own);
        figure.legend.push_back(
            {Mark::kLine, path.color, path.name + (leaves ? " (leaves the picture)" : "")});
    }
    figure.legend.push_back({Mark::kDot, kStart, "start"});
    figure.legend.push_back({Mark::kDot, kFaded, "end, in the colour of its way"});
    Panel panel;
    panel.bounds = bounds.with_margin(kMarginShare);
    panel.draw = [&picture](Canvas& canvas, const View& view) {
        for (const Pixel& pixel : view(picture.points)) {
            canvas.disc(pixel, 1.3, kFaded);  // a speckle would be too faint beside the ways
        }
        for (const DrawnPath& path : picture.paths) {
            canvas.polyline(view(positions_of(path.trajectory)), {path.color, 3});
        }
        dashed(canvas, view(positions_of(picture.truth)), {kTruth, 1});
        for (const DrawnPath& path : picture.paths) {
            if (!path.trajectory.empty()) {
                draw_marker(canvas, view(path.trajectory.back().pose.translation), path.color);
            }
        }
        const Trajectory& first =
            picture.truth.empty() ? picture.paths.back().trajectory : picture.truth;
        if (!first.empty()) {
            draw_marker(canvas, view(first.front().pose.translation), kStart);
        }
    };
    figure.panels.push_back(std::move(panel));
    return draw(figure);
}

Canvas draw_comparison(const std::string& title, const std::string& subtitle,
                       const std::vector<VariantPicture>& variants) {
    Bounds bounds = inner_bounds_of(variants.back().points);
    const Bounds most = bounds.with_margin(0.25);
    for (const VariantPicture& variant : variants) {
        Bounds own = bounds_of(positions_of(variant.trajectory));
        own.include(inner_bounds_of(variant.points));
        own.lower = own.lower.cwiseMax(most.lower);
        own.upper = own.upper.cwiseMin(most.upper);
        bounds.include(own);
    }
    Figure figure{title, subtitle, {}, way_legend()};
    figure.legend.push_back({Mark::kLine, kWall, "scans, drawn from these poses"});
    for (const VariantPicture& variant : variants) {
        Panel panel;
        panel.caption = variant.caption;
        panel.bounds = bounds.with_margin(kMarginShare);
        panel.draw = [&variant](Canvas& canvas, const View& view) {
            canvas.speckle(view(variant.points), kWall);
            draw_way(canvas, view, variant.trajectory, 2);
        };
        figure.panels.push_back(std::move(panel));
    }
    return draw(figure);
}

}  // namespace hybrid_slam::tools
