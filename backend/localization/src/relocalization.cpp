// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/relocalization.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "hybrid_slam/backend/correlative_matcher.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostPoints = 150;   ///< of a query that are searched with
constexpr std::size_t kMostSettled = 400;  ///< of a query that ICP aligns while places are compared
constexpr double kReach = 0.2;  ///< metres that the farthest points move per heading step
constexpr double kLeastStep = radians(1.0);
constexpr double kMostStep = radians(3.0);
constexpr double kSearchRatio = 0.75;  ///< of the best score; ICP may still make up for so much
constexpr double kMayWin = 0.9;        ///< of the best score of the search, to be the best in truth
constexpr double kUnsettled = 0.2;     ///< metres, sigma of a place where ICP failed
constexpr double kUnsettledAngle = radians(3.0);
// ICP has little left to do after the search: half a cell and half a heading step.
constexpr double kIcpDistance = 0.6;  ///< metres
constexpr double kIcpGateFactor = 4.0;
/// Beams that end where the map knows nothing may be right in a place that is not the best.
constexpr double kUnknownMay = 0.7;
constexpr double kTranslationFloor = 0.003;       ///< metres, sigma of a settled place
constexpr double kRotationFloor = radians(0.03);  ///< radians

/// The beams of a query as one surface; every n-th point, so that no more than `most` are left.
Surface thinned(const Query& query, std::size_t most) {
    std::size_t points = 0;
    for (const Sweep& sweep : query) {
        points += sweep.surface.size();
    }
    const std::size_t stride = std::max<std::size_t>(1, (points + most - 1) / most);
    Surface thin;
    std::size_t next = 0;
    for (const Sweep& sweep : query) {
        for (; next < sweep.surface.size(); next += stride) {
            thin.points.push_back(sweep.surface.points[next]);
            thin.normals.push_back(sweep.surface.normals[next]);
        }
        next -= sweep.surface.size();
    }
    return thin;
}

/// One point for each cell, so that near walls do not outweigh far ones, and of these every n-th.
/// Far from each other in their order, so that a part of them speaks for all.
Points spread(const Query& query, double resolution, std::size_t most) {
    std::map<std::pair<int, int>, Point2> cells;
    for (const Sweep& sweep : query) {
        for (const Point2& point : sweep.surface.points) {
            const std::pair<int, int> cell(static_cast<int>(std::floor(point.x() / resolution)),
                                           static_cast<int>(std::floor(point.y() / resolution)));
            cells.emplace(cell, point);
        }
    }
    constexpr std::size_t kApart = 7;
    const std::size_t stride = std::max<std::size_t>(1, (cells.size() + most - 1) / most);
    std::array<Points, kApart> parts;
    std::size_t index = 0;
    for (const auto& [cell, point] : cells) {
        if (index++ % stride == 0) {
            parts[(index / stride) % kApart].push_back(point);
        }
    }
    Points points;
    for (const Points& part : parts) {
        points.insert(points.end(), part.begin(), part.end());
    }
    return points;
}

/// The range below which nine of ten points lie.
double reach_of(const Points& points, const Point2& origin) {
    std::vector<double> ranges;
    for (const Point2& point : points) {
        ranges.push_back((point - origin).norm());
    }
    const auto tenth = ranges.begin() + static_cast<std::ptrdiff_t>(9 * ranges.size() / 10);
    std::nth_element(ranges.begin(), tenth, ranges.end());
    return *tenth;
}

/// Where a laser may be: what the map has seen to be free, and a metre around it. A scanner does
/// not see where it stands itself, nor behind it: in a short drive its own way is not all free.
LikelihoodPyramid free_space(const ReferenceMap& map) {
    constexpr double kSigma = 0.4;  // metres; what is not 0 reaches 2.5 times as far
    const GridGeometry& geometry = map.grid().geometry;
    const double resolution = map.pyramid().geometry().resolution;
    const double step = 0.25 * kSigma;  // a mask needs no more
    const double width = geometry.width * geometry.resolution;
    const double height = geometry.height * geometry.resolution;
    Points free;
    for (double y = 0.5 * step; y < height; y += step) {
        for (double x = 0.5 * step; x < width; x += step) {
            const Point2 place = geometry.origin + Point2(x, y);
            if (map.grid().at(geometry.cell_of(place)) == CellState::kFree) {
                free.push_back(place);
            }
        }
    }
    if (free.empty()) {
        free = map.surface().points;
    }
    return LikelihoodPyramid(free, resolution, kSigma, map.pyramid().levels());
}

/// The best first; of places that ICP has brought together, the best.
std::vector<Place> distinct(std::vector<Place> places, const RelocalizationConfig& config) {
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& a, const Place& b) { return a.fit.score > b.fit.score; });
    std::vector<Place> kept;
    for (Place& place : places) {
        const bool is_new = std::all_of(kept.begin(), kept.end(), [&](const Place& other) {
            return are_apart(place.map_from_robot, other.map_from_robot, config);
        });
        if (is_new) {
            kept.push_back(std::move(place));
        }
    }
    return kept;
}

/// Where the map has its walls wrong, many beams do not help.
Eigen::Matrix3d covariance_of(const IcpResult& icp, const ReferenceMap& map) {
    Eigen::Matrix3d information = icp.information;
    information.diagonal().array() += 1e-6;
    Eigen::Matrix3d covariance = information.inverse();
    covariance = 0.5 * (covariance + covariance.transpose().eval());
    const double along = std::hypot(kTranslationFloor, map.wall_sigma());
    const double around = std::hypot(kRotationFloor, map.heading_sigma());
    covariance.diagonal() += Eigen::Vector3d(along, along, around).cwiseAbs2();
    return covariance;
}

}  // namespace

bool are_apart(const Pose2d& a, const Pose2d& b, const RelocalizationConfig& config) {
    const Pose2d apart = between(a, b);
    return apart.translation.norm() > config.apart || std::abs(apart.heading) > config.apart_angle;
}

std::string_view to_string(RelocalizationMethod method) {
    return method == RelocalizationMethod::kHeadings ? "headings" : "search";
}

std::string_view to_string(PlaceVerdict verdict) {
    switch (verdict) {
        case PlaceVerdict::kFound:
            return "found";
        case PlaceVerdict::kAmbiguous:
            return "ambiguous";
        case PlaceVerdict::kNotInMap:
            return "not_in_map";
        case PlaceVerdict::kUnfinished:
            break;
    }
    return "unfinished";
}

void describe(ConfigSchema& schema, RelocalizationConfig& config) {
    schema.add(
        "method", config.method,
        {{"headings", RelocalizationMethod::kHeadings}, {"search", RelocalizationMethod::kSearch}},
        "headings: ICP from so many headings, the thesis; search: branch and bound");
    schema.add("headings", config.headings, 1, 3600, "of the method headings");
    schema.add("heading_grid", config.heading_grid, 0.0, 100.0,
               "m between the places where headings begin; 0: the middle of the map alone");
    schema.add("max_nodes", config.max_nodes, 1000, 1000000000, "effort of one search");
    schema.add("max_seconds", config.max_seconds, 0.0, 3600.0,
               "s, likewise, for live vehicles; 0: no limit, and results repeat");
    schema.add("max_places", config.max_places, 2, 1000, "looked at closely");
    schema.add("min_score", config.min_score, 0.05, 1.0, "of the search, to be looked at");
    schema.add("min_explained", config.min_explained, 0.0, 1.0,
               "share of the beams that the map must explain");
    schema.add("max_violated", config.max_violated, 0.0, 1.0,
               "share of the beams that may have gone through walls, but to other walls");
    schema.add("margin", config.margin, 0.0, 1.0,
               "of the score; places as near as this to the best are as good");
    schema.add("doubt", config.doubt, 0.0, 1.0,
               "so much more of it for each unit that the best score lacks to 1");
    schema.add("apart", config.apart, 0.05, 100.0, "m between places that are two, or");
    schema.add_degrees("apart_angle_deg", config.apart_angle, 1.0, 180.0, "between them");
}

struct Relocalizer::State {
    explicit State(std::shared_ptr<const ReferenceMap> map_in)
        : map(std::move(map_in)), allowed(free_space(*map)) {}

    std::shared_ptr<const ReferenceMap> map;
    /// `spacing` metres apart in free space; 0: the middle of the map alone.
    Points starts(double spacing) const;

    LikelihoodPyramid allowed;
};

Points Relocalizer::State::starts(double spacing) const {
    Point2 lower = map->surface().points.front();
    Point2 upper = lower;
    for (const Point2& point : map->surface().points) {
        lower = lower.cwiseMin(point);
        upper = upper.cwiseMax(point);
    }
    const Point2 middle = 0.5 * (lower + upper);
    Points starts;
    if (spacing > 0.0) {
        const Point2 half = 0.5 * (upper - lower) / spacing;
        for (int y = -static_cast<int>(half.y()); y <= static_cast<int>(half.y()); ++y) {
            for (int x = -static_cast<int>(half.x()); x <= static_cast<int>(half.x()); ++x) {
                const Point2 start = middle + spacing * Point2(x, y);
                if (map->grid().at(map->grid().geometry.cell_of(start)) == CellState::kFree) {
                    starts.push_back(start);
                }
            }
        }
    }
    if (starts.empty()) {
        starts.push_back(middle);
    }
    return starts;
}

Relocalizer::Relocalizer(std::shared_ptr<const ReferenceMap> map,
                         const RelocalizationConfig& config, const IcpConfig& icp)
    : config_(config), icp_(icp) {
    if (!map) {
        throw Error("relocalization: no map");
    }
    state_ = std::make_shared<const State>(std::move(map));
    ConfigSchema schema;
    const ConfigSchema::Section section(schema, "relocalization");
    describe(schema, config_);  // throws for values out of their ranges
    whole_icp_ = icp_;
    icp_.max_distance = kIcpDistance;
    icp_.min_distance = std::min(icp_.min_distance, kIcpDistance);
    icp_.gate_factor = kIcpGateFactor;
}

Place Relocalizer::settle(const Query& query, const Pose2d& guess) const {
    const ReferenceMap& map = *state_->map;
    Place place;
    place.map_from_robot = guess;
    const IcpResult icp =
        align(thinned(query, kMostSettled), map.reference(), IcpGuess(guess), icp_);
    if (icp.usable()) {
        place.map_from_robot = icp.reference_from_points;
        place.covariance = covariance_of(icp, map);
    } else {
        place.covariance = Eigen::Vector3d(kUnsettled * kUnsettled, kUnsettled * kUnsettled,
                                           kUnsettledAngle * kUnsettledAngle)
                               .asDiagonal();
    }
    place.fit = fit_of(map, query, place.map_from_robot);
    return place;
}

/// Places whose scores are so near to each other that one scan cannot tell them apart.
Relocalization Relocalizer::judge(std::vector<Place> places) const {
    Relocalization result;
    result.places = distinct(std::move(places), config_);
    const auto fits = [this](const Place& place) {
        return place.fit.explained >= config_.min_explained &&
               place.fit.against() <= config_.max_violated;
    };
    const auto misfits = std::stable_partition(result.places.begin(), result.places.end(), fits);
    if (misfits == result.places.begin()) {
        result.verdict = PlaceVerdict::kNotInMap;
        return result;
    }
    const double best = result.places.front().fit.score;
    const double least = best - config_.margin - config_.doubt * (1.0 - best);
    const auto is_possible = [least](const Place& place) {
        const ScanFit& fit = place.fit;
        return std::max(fit.score, fit.explained - fit.against() + kUnknownMay * fit.unknown) >=
               least;
    };
    const auto others =
        std::stable_partition(result.places.begin() + 1, result.places.end(), is_possible);
    const auto possible = others - result.places.begin();
    result.verdict = possible > 1 ? PlaceVerdict::kAmbiguous : PlaceVerdict::kFound;
    result.places.resize(
        std::min<std::size_t>(result.places.size(), std::max<std::ptrdiff_t>(possible, 2)));
    return result;
}

std::vector<Place> Relocalizer::search(const Query& query, Relocalization& result) const {
    const LikelihoodPyramid& pyramid = state_->map->pyramid();
    const double resolution = pyramid.geometry().resolution;
    // Around the newest laser, which stood in free space.
    const Pose2d query_from_laser(query.front().origin, 0.0);
    Points points = spread(query, 1.5 * resolution, kMostPoints);
    for (Point2& point : points) {
        point -= query_from_laser.translation;
    }
    SearchWindow window;
    const GridGeometry& area = state_->allowed.geometry();
    const Point2 size(area.width * area.resolution, area.height * area.resolution);
    window.center = Pose2d(area.origin + 0.5 * size, 0.0);
    window.half_width = 0.5 * size.maxCoeff();
    window.half_angle = kPi;
    window.angle_step =
        std::clamp(kReach / reach_of(points, Point2::Zero()), kLeastStep, kMostStep);
    SearchLimits limits;
    limits.min_score = config_.min_score;
    limits.runner_up_ratio = kSearchRatio;
    limits.runner_up_distance = config_.apart;
    limits.runner_up_angle = config_.apart_angle;
    limits.max_places = static_cast<std::size_t>(config_.max_places);
    limits.max_nodes = static_cast<std::size_t>(config_.max_nodes);
    limits.max_seconds = config_.max_seconds;
    limits.allowed = &state_->allowed;
    const SearchResult found = branch_and_bound(pyramid, points, window, limits);
    result.nodes = found.nodes;
    // Those that were not looked at score no better in the search than the last of those that were.
    const bool cut_off =
        found.truncated && found.places.back().score >= kMayWin * found.places.front().score;
    result.verdict = found.exhausted || cut_off ? PlaceVerdict::kUnfinished : PlaceVerdict::kFound;
    std::vector<Place> places;
    for (const SearchPlace& candidate : found.places) {
        places.push_back(
            settle(query, candidate.reference_from_query * query_from_laser.inverse()));
        places.back().search_score = candidate.score;
    }
    return places;
}

/// Thesis section 3.5.5: from the middle of the map, or from a grid over its free space.
std::vector<Place> Relocalizer::headings(const Query& query) const {
    const ReferenceMap& map = *state_->map;
    const Surface surface = thinned(query, kMostSettled);
    struct Settled {
        double rms;
        Place place;
    };
    std::vector<Settled> settled;
    for (const Point2& start : state_->starts(config_.heading_grid)) {
        for (int k = 0; k < config_.headings; ++k) {
            const Pose2d guess(start, 2.0 * kPi * k / config_.headings);
            const IcpResult icp = align(surface, map.reference(), IcpGuess(guess), whole_icp_);
            if (icp.usable()) {
                settled.push_back({icp.rms, Place()});
                settled.back().place.map_from_robot = icp.reference_from_points;
                settled.back().place.covariance = covariance_of(icp, map);
            }
        }
    }
    std::stable_sort(settled.begin(), settled.end(),
                     [](const Settled& a, const Settled& b) { return a.rms < b.rms; });
    std::vector<Place> places;
    for (const Settled& candidate : settled) {
        if (places.empty() ||
            are_apart(places.front().map_from_robot, candidate.place.map_from_robot, config_)) {
            places.push_back(candidate.place);
            places.back().fit = fit_of(map, query, candidate.place.map_from_robot);
        }
        if (places.size() == 2) {
            break;
        }
    }
    return places;
}

Relocalization Relocalizer::find(const Query& query) const {
    Relocalization result;
    if (query.empty() || query.front().surface.size() == 0) {
        return result;
    }
    if (config_.method == RelocalizationMethod::kHeadings) {
        result.places = headings(query);
        result.verdict = result.places.empty() ? PlaceVerdict::kNotInMap : PlaceVerdict::kFound;
        return result;
    }
    std::vector<Place> places = search(query, result);
    const bool unfinished = result.verdict == PlaceVerdict::kUnfinished;
    const std::size_t nodes = result.nodes;
    result = judge(std::move(places));
    result.nodes = nodes;
    // More look-alikes than were looked at closely are ambiguous whatever these say.
    if (unfinished && result.verdict != PlaceVerdict::kAmbiguous) {
        result.verdict = PlaceVerdict::kUnfinished;
    }
    return result;
}

}  // namespace hybrid_slam
