// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "hybrid_slam/camera/image_codec.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "vision.hpp"

namespace hybrid_slam {
namespace {

constexpr double kCameraHeight = 1.65;  ///< metres
constexpr double kInterval = 0.1;       ///< seconds between images
constexpr double kAskedLength = 3.0;    ///< percent
constexpr double kAskedHeading_deg = 0.3;

/// A car nods, its camera is not levelled to the tenth of a degree, and its street is far away.
const std::vector<std::string>& car_options() {
    static const std::vector<std::string> options{"vo.aim_sigma_deg=2", "vo.tilt_sigma_deg=0.1",
                                                  "vo.features=600"};
    return options;
}

std::vector<double> numbers_of(const std::string& line) {
    std::istringstream words(line);
    std::vector<double> numbers;
    for (double number = 0.0; words >> number;) {
        numbers.push_back(number);
    }
    return numbers;
}

std::vector<std::vector<double>> read_rows(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::vector<std::vector<double>> rows;
    for (std::string line; std::getline(in, line);) {
        rows.push_back(numbers_of(line));
        if (rows.back().size() != 12) {
            throw Error(fmt::format("{}:{}: needs 12 numbers", file.string(), rows.size()));
        }
    }
    if (rows.empty()) {
        throw Error(file.string() + ": holds nothing");
    }
    return rows;
}

/// Rows of [R | t] in the first camera's axes (x right, y down, z ahead), as seen from above.
Trajectory read_truth(const std::filesystem::path& file) {
    Trajectory truth;
    for (const std::vector<double>& row : read_rows(file)) {
        const Pose2d pose(row[11], -row[3], std::atan2(-row[2], row[10]));
        truth.push_back({kInterval * static_cast<double>(truth.size()), pose});
    }
    return truth;
}

Image read_image(const std::filesystem::path& folder, std::size_t number) {
    constexpr std::size_t kMostBytes = 1U << 24U;
    const auto file = folder / "image_l" / fmt::format("{:06}.png", number);
    const std::string text = read_whole_file(file, kMostBytes);
    auto image = decode_image(EncodedImage(text.begin(), text.end()), ImageColor::kGray);
    if (!image) {
        throw Error(file.string() + ": no image");
    }
    image->stamp = kInterval * static_cast<double>(number);
    return std::move(*image);
}

VisualOdometry viewer_for(const std::filesystem::path& folder, const Image& image,
                          const VisualOdometryConfig& config) {
    const std::vector<double> projection = read_rows(folder / "calib.txt").front();
    CameraModel model;
    model.width = image.width;
    model.height = image.height;
    model.fx = projection[0];
    model.cx = projection[2];
    model.fy = projection[5];
    model.cy = projection[6];
    model.k1 = model.k2 = model.p1 = model.p2 = model.k3 = 0.0;
    CameraMounting mounting;
    mounting.x = 0.0;
    mounting.z = kCameraHeight;
    mounting.pitch = 0.0;
    return VisualOdometry(model, mounting, config);
}

double way_of(const Trajectory& trajectory) {
    double way = 0.0;
    for (std::size_t i = 1; i < trajectory.size(); ++i) {
        way += between(trajectory[i - 1].pose, trajectory[i].pose).translation.norm();
    }
    return way;
}

struct KittiErrors {
    double length = 0.0;  ///< percent
    double first_deg = 0.0;
    double fitted_deg = 0.0;
    double position = 0.0;  ///< metres, anchored at the first pose

    KittiErrors(const Trajectory& estimate, const Trajectory& truth)
        : length(100.0 * (way_of(estimate) / way_of(truth) - 1.0)) {
        TruthOptions options;
        options.alignment = TruthAlignment::kFirstPose;
        const TruthError first = truth_error(estimate, truth, options);
        first_deg = degrees(first.heading_rmse);
        position = first.ate_rmse;
        fitted_deg = degrees(truth_error(estimate, truth).heading_rmse);
    }
    bool good() const {
        return std::abs(length) <= kAskedLength && first_deg <= kAskedHeading_deg &&
               fitted_deg <= kAskedHeading_deg;
    }
};

void print_errors(const std::string& name, const KittiErrors& errors, const std::string& remark,
                  std::ostream& out) {
    fmt::print(out, "{:<26} {:>+9.2f} {:>12.3f} {:>12.3f} {:>12.3f}   {}\n", name, errors.length,
               errors.first_deg, errors.fitted_deg, errors.position, remark);
}

/// Returns the images without a motion.
std::size_t follow(const std::filesystem::path& folder, std::size_t images,
                   const VisualOdometryConfig& config, Trajectory& estimate) {
    VisualOdometry viewer = viewer_for(folder, read_image(folder, 0), config);
    std::size_t unusable = 0;
    Pose2d pose;
    for (std::size_t i = 0; i < images; ++i) {
        const VisualMotion motion = viewer.track(read_image(folder, i));
        pose = motion.usable() ? pose * motion.before_from_now : pose;
        unusable += i > 0 && !motion.usable() ? 1 : 0;
        estimate.push_back({motion.stamp, pose});
    }
    return unusable;
}

/// Straight on, as fast as the first true step.
Trajectory straight_on(const Trajectory& truth) {
    const double step = between(truth.at(0).pose, truth.at(1).pose).translation.norm();
    Trajectory line;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        line.push_back({truth[i].stamp, Pose2d(step * static_cast<double>(i), 0.0, 0.0)});
    }
    return line;
}

}  // namespace

int measure_kitti(const VisionOptions& options, std::ostream& out) {
    const std::filesystem::path folder = options.shared / "data" / "kitti";
    if (!std::filesystem::is_directory(folder)) {
        fmt::print(out, "KITTI: {} is not there: left out\n\n", folder.string());
        return 0;
    }
    const Trajectory truth = read_truth(folder / "poses.txt");
    std::string settings;
    for (const std::string& option : car_options()) {
        settings += " " + option;
    }
    fmt::print(out,
               "KITTI, {} real images, {:.1f} m of way, camera at {:g} m, level;{}\n{:<26} {:>9} "
               "{:>12} {:>12} {:>12}\n",
               truth.size(), way_of(truth), kCameraHeight, settings, "", "length %", "deg, first",
               "deg, fitted", "m, first");
    std::vector<std::string> overrides = car_options();
    overrides.insert(overrides.end(), options.overrides.begin(), options.overrides.end());
    int misses = 0;
    for (const VisualMethod method : {VisualMethod::kThesis, VisualMethod::kJoint}) {
        VisualOdometryConfig config = read_way({}, overrides).vo;
        config.method = method;
        Trajectory estimate;
        const std::size_t unusable = follow(folder, truth.size(), config, estimate);
        const KittiErrors errors(estimate, truth);
        std::string remark = fmt::format("{} images without a motion", unusable);
        if (method == VisualMethod::kJoint) {
            remark += fmt::format("   asked {:g} %, {:g} deg   {}", kAskedLength, kAskedHeading_deg,
                                  errors.good() ? "ok" : "MISS");
            misses += errors.good() ? 0 : 1;
        }
        print_errors(fmt::format("VO, {}", to_string(method)), errors, remark, out);
    }
    print_errors("null: straight on", KittiErrors(straight_on(truth), truth), "", out);
    fmt::print(out, "\n");
    return misses;
}

}  // namespace hybrid_slam
