// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/correlative_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam {

namespace {

constexpr double kFull = 255.0;

// The query at one heading, as cells of the grid at the window's centre.
struct RotatedQuery {
    double heading = 0.0;
    std::vector<Cell> cells;
};

// A block of translations: offsets x .. x + 2^level - 1, and likewise y, in cells from the centre.
struct Node {
    int sum = 0;
    int level = 0;
    int rotation = 0;
    int x = 0;
    int y = 0;
};

// Best bound first; every tie is broken, so that results do not depend on the queue's inner order.
struct Worse {
    bool operator()(const Node& a, const Node& b) const {
        if (a.sum != b.sum) {
            return a.sum < b.sum;
        }
        if (a.level != b.level) {
            return a.level > b.level;
        }
        return std::tie(a.rotation, a.x, a.y) > std::tie(b.rotation, b.x, b.y);
    }
};

class Search {
  public:
    Search(const LikelihoodPyramid& pyramid, const Points& query, const SearchWindow& window,
           const SearchLimits& limits)
        : pyramid_(pyramid),
          limits_(limits),
          center_(window.center),
          full_sum_(kFull * static_cast<double>(query.size())),
          reach_(static_cast<int>(std::ceil(window.half_width / pyramid.geometry().resolution))) {
        for (const double heading : headings_of(window)) {
            rotations_.push_back(rotate(query, center_.heading + heading));
        }
        if (limits.allowed != nullptr) {
            allowed_center_ = limits.allowed->geometry().cell_of(center_.translation);
        }
    }

    SearchResult run() {
        start();
        while (!open_.empty() && !result_.exhausted) {
            const Node node = open_.top();
            if (static_cast<double>(node.sum) < wanted_now()) {
                break;
            }
            open_.pop();
            if (is_known(node)) {
                continue;
            }
            if (node.level == 0) {
                accept(node);
                if (result_.places.size() >= limits_.max_places) {
                    result_.truncated = may_be_more();
                    break;
                }
                continue;
            }
            branch(node);
            if (gave_up()) {
                break;
            }
        }
        result_.found = result_.found && !result_.exhausted;
        return result_;
    }

  private:
    static std::vector<double> headings_of(const SearchWindow& window) {
        std::vector<double> headings;
        if (window.half_angle >= kPi) {
            const int count = static_cast<int>(std::ceil(2.0 * kPi / window.angle_step));
            for (int k = 0; k < count; ++k) {
                headings.push_back(2.0 * kPi * k / count);
            }
            return headings;
        }
        const int steps = static_cast<int>(std::ceil(window.half_angle / window.angle_step));
        for (int k = -steps; k <= steps; ++k) {
            headings.push_back(k * window.angle_step);
        }
        return headings;
    }

    RotatedQuery rotate(const Points& query, double heading) const {
        RotatedQuery rotated;
        rotated.heading = normalize_angle(heading);
        rotated.cells.reserve(query.size());
        const Pose2d pose(center_.translation, heading);
        const Eigen::Matrix2d rotation = pose.rotation();
        for (const Point2& point : query) {
            rotated.cells.push_back(
                pyramid_.geometry().cell_of(rotation * point + pose.translation));
        }
        return rotated;
    }

    bool gave_up() {
        const bool late = limits_.max_seconds > 0.0 && clock_.seconds() > limits_.max_seconds;
        result_.exhausted = late || result_.nodes > limits_.max_nodes;
        return result_.exhausted;
    }

    void start() {
        const int level = pyramid_.levels() - 1;
        const int stride = 1 << level;
        for (int rotation = 0; rotation < static_cast<int>(rotations_.size()); ++rotation) {
            for (int y = -reach_; y <= reach_; y += stride) {
                for (int x = -reach_; x <= reach_; x += stride) {
                    push(level, rotation, x, y);
                }
                if (gave_up()) {
                    return;
                }
            }
        }
    }

    void branch(const Node& node) {
        const int half = 1 << (node.level - 1);
        for (const int y : {node.y, node.y + half}) {
            for (const int x : {node.x, node.x + half}) {
                if (x <= reach_ && y <= reach_) {
                    push(node.level - 1, node.rotation, x, y);
                }
            }
        }
    }

    bool is_allowed(int level, int x, int y) const {
        return limits_.allowed == nullptr ||
               limits_.allowed->at(level, allowed_center_.x + x, allowed_center_.y + y) > 0;
    }

    void push(int level, int rotation, int x, int y) {
        if (!is_allowed(level, x, y)) {
            return;
        }
        ++result_.nodes;
        const double wanted = wanted_later();
        const int sum =
            sum_of(level, rotations_[static_cast<std::size_t>(rotation)].cells, x, y, wanted);
        if (static_cast<double>(sum) >= wanted) {
            open_.push({sum, level, rotation, x, y});
        }
    }

    // Gives up, with too little, as soon as `wanted` is out of reach.
    int sum_of(int level, const std::vector<Cell>& cells, int x, int y, double wanted) const {
        constexpr std::size_t kAtOnce = 16;
        const std::uint8_t* const grid = pyramid_.cells(level).data();
        const auto width = static_cast<unsigned>(pyramid_.geometry().width);
        const auto height = static_cast<unsigned>(pyramid_.geometry().height);
        int sum = 0;
        for (std::size_t first = 0; first < cells.size(); first += kAtOnce) {
            const std::size_t last = std::min(cells.size(), first + kAtOnce);
            for (std::size_t i = first; i < last; ++i) {
                const auto column = static_cast<unsigned>(cells[i].x + x);
                const auto row = static_cast<unsigned>(cells[i].y + y);
                if (column < width && row < height) {
                    sum += grid[static_cast<std::size_t>(row) * width + column];
                }
            }
            if (sum + kFull * static_cast<double>(cells.size() - last) < wanted) {
                break;
            }
        }
        return sum;
    }

    // What the next pose must reach to be of interest: the best, and then its runner-up.
    double wanted_now() const {
        return full_sum_ * (result_.found ? limits_.runner_up_ratio * result_.places.front().score
                                          : limits_.min_score);
    }

    // What is kept in the queue: a runner-up may score less than the least that the best must.
    double wanted_later() const {
        return full_sum_ * limits_.runner_up_ratio *
               (result_.found ? result_.places.front().score : std::min(limits_.min_score, 1.0));
    }

    bool may_be_more() const {
        return !open_.empty() && static_cast<double>(open_.top().sum) >= wanted_now();
    }

    Pose2d pose_of(const Node& node) const {
        const double resolution = pyramid_.geometry().resolution;
        return {center_.x() + node.x * resolution, center_.y() + node.y * resolution,
                rotations_[static_cast<std::size_t>(node.rotation)].heading};
    }

    // The whole block lies within the neighbourhood of one place: nothing in it is another.
    bool is_known(const Node& node) const {
        return std::any_of(result_.places.begin(), result_.places.end(),
                           [&](const SearchPlace& place) { return is_near(node, place); });
    }

    bool is_near(const Node& node, const SearchPlace& place) const {
        const double turned =
            normalize_angle(rotations_[static_cast<std::size_t>(node.rotation)].heading -
                            place.reference_from_query.heading);
        if (std::abs(turned) > limits_.runner_up_angle) {
            return false;
        }
        const int last = (1 << node.level) - 1;
        for (const int y : {node.y, node.y + last}) {
            for (const int x : {node.x, node.x + last}) {
                const Point2 there = pose_of({0, 0, node.rotation, x, y}).translation;
                if ((there - place.reference_from_query.translation).norm() >
                    limits_.runner_up_distance) {
                    return false;
                }
            }
        }
        return true;
    }

    // The first single pose to arrive is the best, those after it (elsewhere) are the next best.
    void accept(const Node& node) {
        result_.found = true;
        result_.places.push_back({pose_of(node), node.sum / full_sum_});
    }

    const LikelihoodPyramid& pyramid_;
    const SearchLimits& limits_;
    Pose2d center_;
    double full_sum_;
    int reach_;
    std::vector<RotatedQuery> rotations_;
    Cell allowed_center_;
    Stopwatch clock_;
    std::priority_queue<Node, std::vector<Node>, Worse> open_;
    SearchResult result_;
};

}  // namespace

SearchResult branch_and_bound(const LikelihoodPyramid& pyramid, const Points& query,
                              const SearchWindow& window, const SearchLimits& limits) {
    if (query.empty()) {
        return {};
    }
    return Search(pyramid, query, window, limits).run();
}

double match_score(const LikelihoodPyramid& pyramid, const Points& query,
                   const Pose2d& reference_from_query) {
    if (query.empty()) {
        return 0.0;
    }
    const Eigen::Matrix2d rotation = reference_from_query.rotation();
    int sum = 0;
    for (const Point2& point : query) {
        const Cell cell =
            pyramid.geometry().cell_of(rotation * point + reference_from_query.translation);
        sum += pyramid.at(0, cell.x, cell.y);
    }
    return sum / (kFull * static_cast<double>(query.size()));
}

}  // namespace hybrid_slam
