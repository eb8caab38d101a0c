// SPDX-License-Identifier: Apache-2.0
#include "drive_picture.hpp"

#include <utility>

#include "map_backdrop.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr Color kPlan{90, 150, 235};
constexpr Color kDriven{222, 60, 50};
constexpr Color kBody{40, 110, 70};
constexpr Color kGoal{20, 150, 75};
constexpr Color kStop{235, 150, 20};
constexpr Color kWhite{255, 255, 255};
constexpr double kMarginShare = 0.03;
constexpr double kGap = 0.5;  ///< metres between two poses that do not belong together

std::vector<Point2> footprint(const VehicleConfig& vehicle, const Pose2d& pose) {
    const double side = vehicle.footprint_width / 2.0;
    std::vector<Point2> corners;
    for (const Point2& corner :
         {Point2(vehicle.footprint_front, side), Point2(-vehicle.footprint_rear, side),
          Point2(-vehicle.footprint_rear, -side), Point2(vehicle.footprint_front, -side),
          Point2(vehicle.footprint_front, side)}) {
        corners.push_back(pose * corner);
    }
    return corners;
}

void draw_body(Canvas& canvas, const View& view, const VehicleConfig& vehicle, const Pose2d& pose) {
    canvas.polyline(view(footprint(vehicle, pose)), {kBody, 2});
    // A line across shows where the front is: at the wheel that steers ahead, the lidar sits.
    const double side = vehicle.footprint_width / 2.0;
    const double nose = vehicle.footprint_front - 0.2;
    canvas.line(view(pose * Point2(nose, side)), view(pose * Point2(nose, -side)), {kBody, 2});
    canvas.disc(view(pose.translation), 4.0, kBody);
}

void draw_planned(Canvas& canvas, const View& view, const Route& route) {
    std::vector<Pixel> pixels;
    for (const PathPoint& point : route.points) {
        pixels.push_back(view(point.map_from_robot.translation));
    }
    canvas.polyline(pixels, {kPlan, 5});
}

void draw_goals(Canvas& canvas, const View& view, const Route& route) {
    for (const std::size_t end : route.waypoint_ends) {
        const Pixel at = view(route.points[end].map_from_robot.translation);
        canvas.disc(at, 8.0, kWhite);
        canvas.disc(at, 6.0, kGoal);
    }
}

void draw_driven(Canvas& canvas, const View& view, const Trajectory& driven) {
    std::vector<Pixel> pixels;
    for (std::size_t i = 0; i < driven.size(); ++i) {
        const Point2& at = driven[i].pose.translation;
        if (i > 0 && (at - driven[i - 1].pose.translation).norm() > kGap) {
            canvas.polyline(pixels, {kDriven, 2});
            pixels.clear();
        }
        pixels.push_back(view(at));
    }
    canvas.polyline(pixels, {kDriven, 2});
}

}  // namespace

Canvas draw(const DrivePicture& picture) {
    Panel panel;
    for (const Point2& point : picture.map.surface().points) {
        panel.bounds.include(point);
    }
    panel.bounds = panel.bounds.with_margin(kMarginShare);
    panel.draw = [&picture](Canvas& canvas, const View& view) {
        draw_map(canvas, view, picture.map);
        for (const Route& route : picture.routes) {
            draw_planned(canvas, view, route);
        }
        for (const Pose2d& pose : picture.stood) {
            draw_body(canvas, view, picture.vehicle, pose);
        }
        draw_driven(canvas, view, picture.driven);
        for (const Route& route : picture.routes) {
            draw_goals(canvas, view, route);
        }
        for (const Pose2d& stop : picture.stops) {
            canvas.disc(view(stop.translation), 4.0, kStop);
        }
    };
    std::vector<LegendEntry> legend = {{Mark::kLine, kPlan, "planned"},
                                       {Mark::kLine, kDriven, "driven, by SLAM"},
                                       {Mark::kDot, kGoal, "waypoint"},
                                       {Mark::kLine, kBody, "vehicle where it stood"}};
    if (!picture.stops.empty()) {
        legend.push_back({Mark::kDot, kStop, "stopped on the way"});
    }
    return draw(Figure{picture.title, picture.subtitle, {panel}, std::move(legend)});
}

}  // namespace hybrid_slam::tools
