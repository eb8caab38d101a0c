// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/reeds_shepp.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

/// One arc of a word in units of the radius: turn 1 left, -1 right, 0 straight.
struct Letter {
    double length = 0.0;
    int turn = 0;
};

struct Word {
    std::array<Letter, 5> letters;
    int size = 0;
};

using Words = std::vector<Word>;

constexpr int kLeft = 1;
constexpr int kRight = -1;
constexpr int kStraight = 0;
constexpr double kQuarter = kPi / 2.0;

void add(Words& words, std::initializer_list<Letter> letters) {
    Word word;
    for (const Letter& letter : letters) {
        word.letters[static_cast<std::size_t>(word.size++)] = letter;
    }
    words.push_back(word);
}

struct Polar {
    double radius = 0.0;
    double angle = 0.0;
};

Polar polar(double x, double y) {
    return {std::hypot(x, y), std::atan2(y, x)};
}

/// Equations 8.1 and 8.2 of the paper: a curve, a straight line, a curve.
void add_csc(Words& words, const Pose2d& goal) {
    const double s = std::sin(goal.heading);
    const double c = std::cos(goal.heading);
    const Polar same = polar(goal.x() - s, goal.y() - 1.0 + c);
    add(words, {{same.angle, kLeft},
                {same.radius, kStraight},
                {normalize_angle(goal.heading - same.angle), kLeft}});
    const Polar other = polar(goal.x() + s, goal.y() - 1.0 - c);
    if (other.radius >= 2.0) {
        const double u = std::sqrt(other.radius * other.radius - 4.0);
        const double t = normalize_angle(other.angle + std::atan2(2.0, u));
        add(words, {{t, kLeft}, {u, kStraight}, {normalize_angle(t - goal.heading), kRight}});
    }
}

/// Equation 8.3: three curves.
void add_ccc(Words& words, const Pose2d& goal) {
    const Polar to =
        polar(goal.x() - std::sin(goal.heading), goal.y() - 1.0 + std::cos(goal.heading));
    if (to.radius <= 4.0) {
        const double u = -2.0 * std::asin(to.radius / 4.0);
        const double t = normalize_angle(to.angle + u / 2.0 + kPi);
        add(words, {{t, kLeft}, {u, kRight}, {normalize_angle(goal.heading - t + u), kLeft}});
    }
}

/// First and last letter of four curves of which the middle ones are u and v.
std::pair<double, double> outer_curves(double u, double v, const Point2& to, double heading) {
    const double delta = normalize_angle(u - v);
    const double a = std::sin(u) - std::sin(delta);
    const double b = std::cos(u) - std::cos(delta) - 1.0;
    const double angle = std::atan2(to.y() * a - to.x() * b, to.x() * a + to.y() * b);
    const bool turned = 2.0 * (std::cos(delta) - std::cos(v) - std::cos(u)) + 3.0 < 0.0;
    const double first = normalize_angle(turned ? angle + kPi : angle);
    return {first, normalize_angle(first - u + v - heading)};
}

/// Equations 8.7 and 8.8: four curves, the middle ones alike.
void add_cccc(Words& words, const Pose2d& goal) {
    const Point2 to(goal.x() + std::sin(goal.heading), goal.y() - 1.0 - std::cos(goal.heading));
    const double near = (2.0 + to.norm()) / 4.0;
    if (near <= 1.0) {
        const double u = std::acos(near);
        const auto [t, v] = outer_curves(u, -u, to, goal.heading);
        add(words, {{t, kLeft}, {u, kRight}, {-u, kLeft}, {v, kRight}});
    }
    const double far = (20.0 - to.squaredNorm()) / 16.0;
    if (far >= 0.0 && far <= 1.0) {
        const double u = -std::acos(far);
        const auto [t, v] = outer_curves(u, u, to, goal.heading);
        add(words, {{t, kLeft}, {u, kRight}, {u, kLeft}, {v, kRight}});
    }
}

/// Equations 8.9 and 8.10: a quarter turn between a curve and the straight line.
void add_ccsc(Words& words, const Pose2d& goal) {
    const double s = std::sin(goal.heading);
    const double c = std::cos(goal.heading);
    const Polar same = polar(goal.x() - s, goal.y() - 1.0 + c);
    if (same.radius >= 2.0) {
        const double r = std::sqrt(same.radius * same.radius - 4.0);
        const double t = normalize_angle(same.angle + std::atan2(r, -2.0));
        add(words, {{t, kLeft},
                    {-kQuarter, kRight},
                    {2.0 - r, kStraight},
                    {normalize_angle(goal.heading - kQuarter - t), kLeft}});
    }
    const Polar other = polar(1.0 + c - goal.y(), goal.x() + s);
    if (other.radius >= 2.0) {
        add(words, {{other.angle, kLeft},
                    {-kQuarter, kRight},
                    {2.0 - other.radius, kStraight},
                    {normalize_angle(other.angle + kQuarter - goal.heading), kRight}});
    }
}

/// Equation 8.11: quarter turns on both sides of the straight line.
void add_ccscc(Words& words, const Pose2d& goal) {
    const double x = goal.x() + std::sin(goal.heading);
    const double y = goal.y() - 1.0 - std::cos(goal.heading);
    const double squared = x * x + y * y;
    if (squared < 4.0) {
        return;
    }
    const double u = 4.0 - std::sqrt(squared - 4.0);
    const double t = std::atan2((4.0 - u) * x - 2.0 * y, -2.0 * x + (u - 4.0) * y);
    add(words, {{t, kLeft},
                {-kQuarter, kRight},
                {u, kStraight},
                {-kQuarter, kLeft},
                {normalize_angle(t - goal.heading), kRight}});
}

Pose2d end_of(const Word& word) {
    Pose2d pose;
    for (int i = 0; i < word.size; ++i) {
        const Letter& letter = word.letters[static_cast<std::size_t>(i)];
        pose = pose * Pose2d::exp({letter.length, 0.0, letter.length * letter.turn});
    }
    return pose;
}

double length_of(const Word& word) {
    double length = 0.0;
    for (int i = 0; i < word.size; ++i) {
        length += std::abs(word.letters[static_cast<std::size_t>(i)].length);
    }
    return length;
}

void add_basic_words(Words& words, const Pose2d& goal) {
    add_csc(words, goal);
    add_ccc(words, goal);
    add_cccc(words, goal);
    add_ccsc(words, goal);
    add_ccscc(words, goal);
}

/// The symmetries of section 8 of the paper: driven with forward and backward exchanged, seen in a
/// mirror, and from the goal to the start.
Words words_to(const Pose2d& goal) {
    const double s = std::sin(goal.heading);
    const double c = std::cos(goal.heading);
    const Pose2d swapped(goal.x() * c + goal.y() * s, goal.x() * s - goal.y() * c, goal.heading);
    Words words;
    words.reserve(80);
    Words some;
    for (int symmetry = 0; symmetry < 8; ++symmetry) {
        const bool reversed = (symmetry & 1) != 0;
        const double along = (symmetry & 2) != 0 ? -1.0 : 1.0;
        const int across = (symmetry & 4) != 0 ? -1 : 1;
        Pose2d seen = reversed ? swapped : goal;
        seen = Pose2d(along * seen.x(), across * seen.y(), along * across * seen.heading);
        some.clear();
        add_basic_words(some, seen);
        for (Word& word : some) {
            for (Letter& letter : word.letters) {
                letter.length *= along;
                letter.turn *= across;
            }
            if (reversed) {
                std::reverse(word.letters.begin(), word.letters.begin() + word.size);
            }
            words.push_back(word);
        }
    }
    return words;
}

/// A formula may meet the goal with another sign than the one that it was made for: where a word
/// ends is what judges it.
bool meets(const Word& word, const Pose2d& goal) {
    const Pose2d end = end_of(word);
    return (end.translation - goal.translation).norm() < 1e-6 &&
           std::abs(normalize_angle(end.heading - goal.heading)) < 1e-6;
}

Pose2d scaled(const Pose2d& goal, double radius) {
    if (!(radius > 0.0)) {
        throw Error("turning radius must be positive");
    }
    return {goal.x() / radius, goal.y() / radius, goal.heading};
}

}  // namespace

Pose2d end_of(const Arcs& arcs) {
    Pose2d pose;
    for (const Arc& arc : arcs) {
        pose = pose * Pose2d::exp({arc.length, 0.0, arc.length * arc.curvature});
    }
    return pose;
}

double length_of(const Arcs& arcs) {
    double length = 0.0;
    for (const Arc& arc : arcs) {
        length += std::abs(arc.length);
    }
    return length;
}

std::vector<Arcs> reeds_shepp_ways(const Pose2d& goal, double radius) {
    const Pose2d unit_goal = scaled(goal, radius);
    std::vector<std::pair<double, Arcs>> ways;
    for (const Word& word : words_to(unit_goal)) {
        if (!meets(word, unit_goal)) {
            continue;
        }
        Arcs arcs;
        for (int i = 0; i < word.size; ++i) {
            const Letter& letter = word.letters[static_cast<std::size_t>(i)];
            if (std::abs(letter.length) > 1e-9) {
                arcs.push_back({letter.length * radius, letter.turn / radius});
            }
        }
        ways.emplace_back(length_of(word), std::move(arcs));
    }
    std::stable_sort(ways.begin(), ways.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Arcs> sorted;
    sorted.reserve(ways.size());
    for (auto& way : ways) {
        sorted.push_back(std::move(way.second));
    }
    return sorted;
}

double reeds_shepp_length(const Pose2d& goal, double radius) {
    const Pose2d unit_goal = scaled(goal, radius);
    Words words = words_to(unit_goal);
    double shortest = HUGE_VAL;
    for (const Word& word : words) {
        const double length = length_of(word);
        if (length < shortest && meets(word, unit_goal)) {
            shortest = length;
        }
    }
    return shortest * radius;
}

std::vector<Arcs> ways_to_position(const Point2& goal, double radius) {
    std::vector<Arcs> ways;
    for (const int turn : {kLeft, kRight}) {
        // Seen from the middle of the turning circle, mirrored when it lies to the right.
        const Polar to = polar(goal.x(), turn * goal.y() - radius);
        if (to.radius < radius) {
            continue;
        }
        const double tangent = std::sqrt(to.radius * to.radius - radius * radius);
        for (const double straight : {tangent, -tangent}) {
            const double heading =
                normalize_angle(to.angle + kQuarter - std::atan2(straight, radius));
            const double other_way = heading > 0.0 ? heading - 2.0 * kPi : heading + 2.0 * kPi;
            for (const double angle : {heading, other_way}) {
                ways.push_back({{angle * radius, turn / radius}, {straight, 0.0}});
            }
        }
    }
    return ways;
}

}  // namespace hybrid_slam
