// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "localization_config.hpp"
#include "place_belief.hpp"
#include "pose_keeper.hpp"
#include "pose_predictor.hpp"
#include "sweep_history.hpp"
#include "tracking_doubt.hpp"

namespace hybrid_slam {
namespace {

constexpr double kDegradedScore = 0.5;  // of the score of a pose that rests on odometry
constexpr double kSearchTurn = 2.0;     // query angles turned between two searches
constexpr double kSearchSeconds = 1.0;  // between searches of a map that the robot is not in
constexpr double kNewestWay = 0.3;      // of a query's path, of one that begins anew
constexpr double kCloseBy = 1.0;        // metres from a tracked pose that was off, and
constexpr double kCloseByAngle = radians(20.0);
constexpr double kAsGood = 0.01;          // of the best score
constexpr double kContradicts = 0.5;      // of what is explained
constexpr double kNowhereWay = 3.0;       // metres
constexpr std::size_t kMostSettled = 40;  // clusters of the filter
constexpr double kLeastShare = 1e-4;      // of them

LocalizationStatus status_of(TrackingStatus status) {
    switch (status) {
        case TrackingStatus::kTracking:
            return LocalizationStatus::kTracking;
        case TrackingStatus::kDegraded:
            return LocalizationStatus::kDegraded;
        case TrackingStatus::kLost:
            break;
    }
    return LocalizationStatus::kLost;
}

std::optional<Place> place_of(const Relocalization& found) {
    return found.verdict == PlaceVerdict::kFound ? std::optional<Place>(found.places.front())
                                                 : std::nullopt;
}

/// Of the places that score more than `least`, the one close by.
std::optional<Place> nearest_to(const Pose2d& pose, const std::vector<Place>& places,
                                double least) {
    std::optional<Place> nearest;
    double nearest_way = kCloseBy;
    for (const Place& place : places) {
        const Pose2d apart = between(pose, place.map_from_robot);
        const double way = apart.translation.norm();
        if (place.fit.score > least && way < nearest_way &&
            std::abs(apart.heading) < kCloseByAngle) {
            nearest = place;
            nearest_way = way;
        }
    }
    return nearest;
}

/// Several places are possible, or more may be than were looked at.
bool is_open(const Relocalization& found) {
    return !found.places.empty() && (found.verdict == PlaceVerdict::kAmbiguous ||
                                     found.verdict == PlaceVerdict::kUnfinished);
}

/// Of several places that are all possible, none is sure.
double score_of(const Relocalization& found) {
    if (found.places.empty() || found.verdict == PlaceVerdict::kNotInMap) {
        return 0.0;
    }
    std::size_t possible = found.verdict == PlaceVerdict::kFound ? 1 : found.places.size();
    if (found.verdict == PlaceVerdict::kUnfinished) {
        ++possible;  // what was not looked at
    }
    return found.places.front().fit.score / static_cast<double>(possible);
}

}  // namespace

struct Localizer::State {
    State(std::shared_ptr<const ReferenceMap> map_in, const LocalizationConfig& config_in)
        : map(std::move(map_in)),
          config(checked(config_in)),
          odometry(config.odometry),
          relocalizer(map, config.relocalization, config.odometry.icp),
          tracker(map, config.tracking, config.odometry.icp),
          belief(map, config.particles),
          history({config.query_path, config.query_spacing, config.query_angle}),
          predictor(config.odometry.prior) {}

    /// One scan with what is known of it so far.
    struct Scan {
        const Frame& frame;
        OdometryResult odometry;
        LocalizationResult result;
    };
    struct Search {
        PlaceVerdict verdict = PlaceVerdict::kNotInMap;
        double stamp = 0.0;
        double path = 0.0;
        double turn = 0.0;
    };

    void report_jump(LocalizationResult& result);
    void track_from(const PoseBelief& known, Scan& scan);
    void track(Scan& scan);
    void look_up(Scan& scan);
    bool is_nowhere(const Relocalization& found, const Scan& scan);
    void lose(Scan& scan);
    void look_around(Scan& scan);
    bool is_search_due(double stamp) const;
    void search(Scan& scan);
    Relocalization find();
    bool is_confirmed(const Place& place) const;
    Relocalization begin_anew();
    std::optional<Place> decided_place(const Relocalization& searched) const;
    void report_belief(LocalizationResult& result) const;

    std::shared_ptr<const ReferenceMap> map;
    LocalizationConfig config;
    Odometry odometry;
    Relocalizer relocalizer;
    MapTracker tracker;
    PlaceBelief belief;
    SweepHistory history;
    PosePredictor predictor;
    TrackingDoubt doubt;
    PoseKeeper keeper;
    bool tracking = false;
    std::optional<PoseBelief> given;  ///< by start_at, for the next scan
    std::optional<Search> searched;   ///< the last one since the place was lost
    /// Where the first of the looks in a row was that found this place nowhere in the map.
    std::optional<Pose2d> refused_at;
};

Localizer::Localizer(std::shared_ptr<const ReferenceMap> map, const LocalizationConfig& config)
    : state_(std::make_unique<State>(std::move(map), config)) {}
Localizer::~Localizer() = default;
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;

void Localizer::start_at(const Pose2d& map_from_robot, const Eigen::Matrix3d& covariance) {
    const PoseBelief given{map_from_robot, covariance};
    if (!is_sound(given) || (covariance.diagonal().array() <= 0.0).any()) {
        throw Error("the pose to start at is not finite, or its covariance is none");
    }
    state_->given = given;
}

LocalizationResult Localizer::process(const Frame& frame) {
    State& s = *state_;
    State::Scan scan{frame, s.odometry.register_frame(frame), {}};
    for (const VisualMotion& motion : frame.visual) {
        s.predictor.see(motion);
    }
    scan.result.stamp = frame.scan.stamp;
    scan.result.prior_used = scan.odometry.prior_used;
    scan.result.visual_lag = scan.odometry.visual_lag;
    s.keeper.carry(frame.scan.stamp, scan.odometry.before_from_now);
    if (s.given) {
        s.track_from(*std::exchange(s.given, std::nullopt), scan);
    } else if (s.tracking) {
        s.track(scan);
    } else {
        s.look_around(scan);
    }
    s.report_jump(scan.result);
    if (s.tracking) {
        s.predictor.anchor(
            {scan.result.stamp, *scan.result.map_from_robot, scan.result.covariance});
    } else {
        s.predictor.forget();
    }
    return std::move(scan.result);
}

std::optional<PredictedPose> Localizer::predict(const VisualMotion& motion) {
    state_->predictor.see(motion);
    return state_->predictor.at(motion.stamp);
}

/// Once a scan, for several poses may be tried on the way to the one that is told.
void Localizer::State::report_jump(LocalizationResult& result) {
    if (result.map_from_robot) {
        result.jump = keeper.jump_to(*result.map_from_robot);
        keeper.hold({*result.map_from_robot, result.covariance});
    }
}

/// The pose of this scan is known by other means than the motion.
void Localizer::State::track_from(const PoseBelief& known, Scan& scan) {
    belief.stop();
    history.clear();
    searched.reset();
    refused_at.reset();
    doubt = TrackingDoubt();
    tracker.start(known.map_from_robot, known.covariance);
    tracking = true;
    track(scan);
}

void Localizer::State::track(Scan& scan) {
    const Track found =
        tracker.track(scan.frame.scan.stamp, scan.odometry, scan.frame.scan.robot_from_laser);
    LocalizationResult& result = scan.result;
    result.status = status_of(found.status);
    result.map_from_robot = found.map_from_robot;
    result.covariance = found.covariance;
    result.weak_direction = found.weak_direction;
    result.fit = found.fit;
    result.score = found.fit.score;
    if (found.status == TrackingStatus::kDegraded || !found.anchored) {
        result.score *= kDegradedScore;
    }
    if (found.status == TrackingStatus::kLost) {
        lose(scan);
    } else {
        look_up(scan);
    }
}

/// A scan that the tracked place explains badly is looked up in the whole map. Of places that
/// explain it far better, one close by is where the robot is, for there are look-alikes elsewhere;
/// without such a one it was carried away, if it sees through walls where it is held to be: what is
/// merely new, or not mapped, is no reason to go to a look-alike.
void Localizer::State::look_up(Scan& scan) {
    const LocalizationResult& result = scan.result;
    // What ends where the map knows nothing does not speak against the pose: the map ends there.
    const double level = result.fit.explained - result.fit.against() + result.fit.unknown;
    if (result.fit.points == 0 || !doubt.is_due(result.stamp, level)) {
        return;
    }
    doubt.settle(result.stamp, level);
    const Relocalization found =
        relocalizer.find({{scan.frame.scan.robot_from_laser.translation, scan.odometry.surface}});
    const bool contradicted = result.fit.violated > config.relocalization.max_violated &&
                              result.fit.violated > kContradicts * result.fit.explained;
    const double least = level + 2.0 * config.relocalization.margin;
    const bool better = found.verdict != PlaceVerdict::kNotInMap && !found.places.empty() &&
                        found.places.front().fit.score > least;
    if (const auto nearest =
            better ? nearest_to(*result.map_from_robot, found.places, least) : std::nullopt) {
        track_from({nearest->map_from_robot, nearest->covariance}, scan);
    } else if ((better && contradicted && found.verdict != PlaceVerdict::kUnfinished) ||
               is_nowhere(found, scan)) {
        lose(scan);
    }
}

/// Whether all looks of the last metres say that this is not in the map, while the pose sees
/// through walls: another building, or another floor, of which a part looks alike. An open door, or
/// a wall that is gone, is soon left behind.
bool Localizer::State::is_nowhere(const Relocalization& found, const Scan& scan) {
    const LocalizationResult& result = scan.result;
    if (found.verdict != PlaceVerdict::kNotInMap ||
        result.fit.violated <= config.relocalization.margin) {
        refused_at.reset();
        return false;
    }
    refused_at = refused_at.value_or(*result.map_from_robot);
    return between(*refused_at, *result.map_from_robot).translation.norm() >= kNowhereWay;
}

/// The odometry begins anew too: who was carried away has a local map of another place.
void Localizer::State::lose(Scan& scan) {
    scan.result.status = LocalizationStatus::kLost;
    scan.result.score = 0.0;
    tracking = false;
    history.clear();
    searched.reset();
    odometry = Odometry(config.odometry);
    odometry.register_frame(scan.frame);
}

void Localizer::State::look_around(Scan& scan) {
    const Point2& origin = scan.frame.scan.robot_from_laser.translation;
    history.add(scan.odometry, origin);
    belief.follow(scan.odometry, history.newest(), history.path());
    if (is_search_due(scan.frame.scan.stamp)) {
        search(scan);
    } else if (belief.is_running()) {
        report_belief(scan.result);
    }
    scan.result.particles = belief.size();
}

bool Localizer::State::is_search_due(double stamp) const {
    if (history.newest().surface.size() == 0) {
        return false;
    }
    // Where it stands still, seeing the same again decides nothing; but somebody who stood before
    // the scanner may have gone.
    return !searched || history.path() - searched->path >= config.search_every ||
           history.turn() - searched->turn >= kSearchTurn * config.query_angle ||
           ((searched->verdict == PlaceVerdict::kNotInMap ||
             searched->verdict == PlaceVerdict::kUnfinished) &&
            std::abs(stamp - searched->stamp) >= kSearchSeconds);
}

void Localizer::State::search(Scan& scan) {
    Relocalization found = find();
    std::optional<Place> place = place_of(found);
    if (!place && is_open(found)) {
        place = decided_place(found);
    }
    if (place && !is_confirmed(*place)) {
        found = begin_anew();
        place = place_of(found);
    }
    searched = Search{found.verdict, scan.frame.scan.stamp, history.path(), history.turn()};
    if (!place && belief.is_hopeless()) {
        belief.stop();
    }
    if (!place && is_open(found) && !belief.is_running()) {
        belief.start(found.places, scan.odometry, history.path());
    }
    scan.result.score = score_of(found);
    if (place) {
        track_from({place->map_from_robot, place->covariance}, scan);
    } else if (!found.places.empty()) {
        scan.result.fit = found.places.front().fit;
    }
    scan.result.relocalization = std::move(found);
}

/// By all that was seen of late; where that is nowhere in the map, by the newest alone: the robot
/// may have come in from outside.
Relocalization Localizer::State::find() {
    const Query all = history.query(config.query_path);
    Relocalization found = relocalizer.find(all);
    if (found.verdict != PlaceVerdict::kNotInMap) {
        return found;
    }
    const double way = kNewestWay * config.query_path;
    const Query newest = history.query(way);
    if (newest.size() == all.size()) {
        return found;
    }
    Relocalization of_newest = relocalizer.find(newest);
    if (of_newest.verdict == PlaceVerdict::kNotInMap) {
        return found;
    }
    history.forget_beyond(way);
    return of_newest;
}

/// Odometry that slips, as in a bare corridor, ties scans together that only fit a wrong place: the
/// newest one alone must not do much better elsewhere.
bool Localizer::State::is_confirmed(const Place& place) const {
    if (history.query(config.query_path).size() == 1) {
        return true;
    }
    const Query newest{history.newest()};
    const double score = fit_of(*map, newest, place.map_from_robot).score;
    const Relocalization alone = relocalizer.find(newest);
    return alone.verdict != PlaceVerdict::kUnfinished &&
           (alone.places.empty() ||
            score >= alone.places.front().fit.score - config.relocalization.margin);
}

/// The way that was driven is of no use.
Relocalization Localizer::State::begin_anew() {
    history.forget_beyond(0.0);
    belief.stop();
    return relocalizer.find({history.newest()});
}

/// The particle filter's one place, if all that was seen of late agrees with it alone, and the
/// search holds no other to be better: the filter knows only of the places that it began with.
std::optional<Place> Localizer::State::decided_place(const Relocalization& searched_now) const {
    if (!belief.is_decided(history.path())) {
        return std::nullopt;
    }
    const Query query = history.query(config.query_path);
    std::vector<Place> clusters = belief.places();
    clusters.resize(std::min(clusters.size(), kMostSettled));
    std::vector<Place> settled;
    for (const Place& cluster : clusters) {
        if (settled.empty() || cluster.share > kLeastShare) {
            settled.push_back(relocalizer.settle(query, cluster.map_from_robot));
        }
    }
    const Relocalization judged = relocalizer.judge(std::move(settled));
    if (judged.verdict != PlaceVerdict::kFound) {
        return std::nullopt;
    }
    const Place& place = judged.places.front();
    const auto is_it = [&](const Place& other) {
        return !are_apart(other.map_from_robot, place.map_from_robot, config.relocalization);
    };
    const Place& best = searched_now.places.front();
    const bool possible =
        is_it(clusters.front()) &&
        std::any_of(searched_now.places.begin(), searched_now.places.end(), is_it) &&
        (is_it(best) || place.fit.score >= best.fit.score - kAsGood);
    return possible ? std::optional<Place>(place) : std::nullopt;
}

void Localizer::State::report_belief(LocalizationResult& result) const {
    Relocalization relocalization;
    relocalization.verdict = PlaceVerdict::kAmbiguous;
    relocalization.places = belief.places();
    relocalization.of_filter = true;
    result.fit = fit_of(*map, {history.newest()}, relocalization.places.front().map_from_robot);
    result.score = kDegradedScore * relocalization.places.front().share;
    result.relocalization = std::move(relocalization);
}

}  // namespace hybrid_slam
