// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/corridor.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kStraight = 1e-6;  ///< 1/m, curvature that is none

struct Rectangle {
    double rear, front, right, left;

    bool contains(const Point2& point) const {
        return point.x() >= rear && point.x() <= front && point.y() >= right && point.y() <= left;
    }
};

double straight_way(const Rectangle& body, int direction, const Point2& point) {
    if (point.y() < body.right || point.y() > body.left) {
        return HUGE_VAL;
    }
    const double way = direction > 0 ? point.x() - body.front : body.rear - point.x();
    return way > 0.0 ? way : HUGE_VAL;
}

/// Seen from the vehicle on an arc, a point turns about the centre of the arc, at (0, 1/curvature).
class Turn {
  public:
    Turn(const Rectangle& body, double curvature, int direction)
        : body_(body),
          center_(0.0, 1.0 / curvature),
          turning_(curvature * direction > 0.0 ? -1.0 : 1.0) {}

    double way(const Point2& point) const {
        const Eigen::Vector2d from = point - center_;
        const double radius = from.norm();
        double least = HUGE_VAL;
        const auto meet = [&](double x, double y) {
            // Rounding must not move a cut off the edge that it was found on.
            constexpr double kSlack = 1e-9;
            if (x < body_.rear - kSlack || x > body_.front + kSlack || y < body_.right - kSlack ||
                y > body_.left + kSlack) {
                return;
            }
            const Eigen::Vector2d to = Point2(x, y) - center_;
            double angle = turning_ * (std::atan2(to.y(), to.x()) - std::atan2(from.y(), from.x()));
            angle -= 2.0 * kPi * std::floor(angle / (2.0 * kPi));
            least = std::min(least, angle * std::abs(center_.y()));
        };
        for (const double x : {body_.rear, body_.front}) {
            if (radius >= std::abs(x)) {
                const double y = std::sqrt(radius * radius - x * x);
                meet(x, center_.y() + y);
                meet(x, center_.y() - y);
            }
        }
        for (const double y : {body_.right, body_.left}) {
            const double height = y - center_.y();
            if (radius >= std::abs(height)) {
                const double x = std::sqrt(radius * radius - height * height);
                meet(x, y);
                meet(-x, y);
            }
        }
        return least;
    }

  private:
    Rectangle body_;
    Point2 center_;
    double turning_;  ///< of points seen from the vehicle: 1 is to the left
};

}  // namespace

double free_way(const VehicleConfig& vehicle, const Corridor& corridor, const Points& obstacles) {
    const double side = vehicle.footprint_width / 2.0 + corridor.margin;
    const Rectangle body{-vehicle.footprint_rear, vehicle.footprint_front, -side, side};
    const double steering =
        std::clamp(corridor.steering, -vehicle.steering_limit, vehicle.steering_limit);
    const double curvature = std::tan(steering) / vehicle.wheelbase;
    double least = corridor.most;
    for (const Point2& point : obstacles) {
        if (body.contains(point)) {
            return 0.0;
        }
        const double way = std::abs(curvature) < kStraight
                               ? straight_way(body, corridor.direction, point)
                               : Turn(body, curvature, corridor.direction).way(point);
        least = std::min(least, way);
    }
    return least;
}

}  // namespace hybrid_slam
