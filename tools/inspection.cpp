// SPDX-License-Identifier: Apache-2.0
#include "inspection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "hybrid_slam/camera/image_codec.hpp"
#include "input.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kLongGap = 3.0;  // periods
constexpr std::size_t kMostSamples = 32;

// What tells that a beam does not end where it did before: more than noise and quantisation.
constexpr double kChange = 0.2;           // metres
constexpr double kChangeShare = 0.02;     // of the range
constexpr double kMovedFrom = 0.05;       // share of the beams; in a long corridor few change
constexpr std::size_t kFewestScans = 10;  // for a map

// What is needed for a map.
constexpr double kLowestRate = 5.0;      // Hz
constexpr double kLongestGap = 1.0;      // seconds
constexpr double kMostMissed = 0.05;     // share of the scans
constexpr double kFewestReturns = 0.10;  // share of the beams of the median scan

double median_of(std::vector<double> values) {
    if (values.empty()) {
        return 0.0;
    }
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

double share_of_returns_in(const Scan& scan) {
    const auto returns = std::count_if(scan.ranges.begin(), scan.ranges.end(),
                                       [&](float range) { return scan.is_return(range); });
    return scan.ranges.empty()
               ? 0.0
               : static_cast<double>(returns) / static_cast<double>(scan.ranges.size());
}

/// Share of the beams that end elsewhere, of those that end in both.
double share_changed(const Scan& a, const Scan& b) {
    std::size_t both = 0;
    std::size_t changed = 0;
    for (std::size_t i = 0; i < std::min(a.ranges.size(), b.ranges.size()); ++i) {
        if (a.is_return(a.ranges[i]) && b.is_return(b.ranges[i])) {
            ++both;
            const double apart = std::abs(static_cast<double>(a.ranges[i]) - b.ranges[i]);
            changed += apart > kChange + kChangeShare * a.ranges[i] ? 1 : 0;
        }
    }
    return both == 0 ? 0.0 : static_cast<double>(changed) / static_cast<double>(both);
}

/// Keeps some scans of a drive whose length is not known beforehand.
class Sampler {
  public:
    void take(const Scan& scan) {
        if (seen_++ % stride_ != 0) {
            return;
        }
        kept_.push_back(scan);
        if (kept_.size() > kMostSamples) {
            for (std::size_t i = 0; 2 * i < kept_.size(); ++i) {
                std::swap(kept_[i], kept_[2 * i]);
            }
            kept_.resize((kept_.size() + 1) / 2);
            stride_ *= 2;
        }
    }
    std::vector<Scan> scans() && { return std::move(kept_); }

  private:
    std::vector<Scan> kept_;
    std::size_t seen_ = 0;
    std::size_t stride_ = 1;
};

/// Counts what passes through on the way from the recording to the decoder.
class Tap : public SensorStream {
  public:
    explicit Tap(RecordingReader& reader) : reader_(reader) {}

    std::optional<SensorEvent> next() override {
        std::optional<SensorEvent> event = reader_.next();
        if (!event) {
            return std::nullopt;
        }
        const double arrival = arrival_of(*event);
        first_ = any_ ? std::min(first_, arrival) : arrival;
        last_ = any_ ? std::max(last_, arrival) : arrival;
        any_ = true;
        if (const auto* frame = std::get_if<CameraFrame>(&*event)) {
            images_.push_back(arrival);
            image_bytes_ += frame->image.size();
            measure(*frame);
        } else {
            lidar_bytes_ += std::get<LidarBytes>(*event).bytes.size();
            ++lidar_chunks_;
        }
        return event;
    }
    double progress() const override { return reader_.progress(); }

    double first() const { return first_; }
    double last() const { return last_; }
    const std::vector<double>& images() const { return images_; }
    std::uint64_t image_bytes() const { return image_bytes_; }
    std::uint64_t lidar_bytes() const { return lidar_bytes_; }
    std::uint64_t lidar_chunks() const { return lidar_chunks_; }
    int image_width() const { return width_; }
    int image_height() const { return height_; }

  private:
    /// The first image that can be read tells the size of all.
    void measure(const CameraFrame& frame) {
        if (width_ > 0 || images_.size() > kMostTries) {
            return;
        }
        if (const auto image = decode_image(frame.image, ImageColor::kGray)) {
            width_ = image->width;
            height_ = image->height;
        }
    }

    static constexpr std::size_t kMostTries = 30;

    RecordingReader& reader_;
    bool any_ = false;
    double first_ = 0.0;
    double last_ = 0.0;
    std::vector<double> images_;
    std::uint64_t image_bytes_ = 0;
    std::uint64_t lidar_bytes_ = 0;
    std::uint64_t lidar_chunks_ = 0;
    int width_ = 0;
    int height_ = 0;
};

/// What is learned from the scans themselves.
class ScanStatistics {
  public:
    void take(const Scan& scan) {
        stamps_.push_back(scan.stamp);
        returns_.push_back(share_of_returns_in(scan));
        if (stamps_.size() == 1) {
            first_ = scan;
        }
        most_changed_ = std::max(most_changed_, share_changed(first_, scan));
        sampler_.take(scan);
    }

    void tell(Inspection& inspection) && {
        inspection.scans = cadence_of(stamps_, inspection.begin);
        inspection.typical_returns = median_of(returns_);
        inspection.most_changed = most_changed_;
        inspection.samples = std::move(sampler_).scans();
    }

  private:
    std::vector<double> stamps_;
    std::vector<double> returns_;
    Scan first_;
    double most_changed_ = 0.0;
    Sampler sampler_;
};

std::string at(const Gap& gap) {
    return fmt::format("{:.2f} s, {:.1f} s after the start", gap.seconds, gap.after);
}

/// Why no scan can be mapped.
std::string why_no_scans(const Inspection& inspection) {
    const LidarCounts& lidar = inspection.counts.lidar;
    if (inspection.lidar_bytes == 0) {
        return "the lidar sent nothing";
    }
    if (lidar.standby_scans > 0) {
        return "the scanner stood by all the time";
    }
    if (lidar.lockout_telegrams > 0) {
        return "the scanner was locked out all the time";
    }
    if (lidar.without_distances > 0) {
        return "the scanner sends telegrams without distances (see its continuous output)";
    }
    return "the lidar's bytes hold no telegram: most likely the baud rate is not the scanner's";
}

void judge_scans(const Inspection& inspection, std::vector<std::string>& obstacles) {
    const Cadence& scans = inspection.scans;
    if (scans.count < kFewestScans) {
        obstacles.push_back(fmt::format("only {}", counted(scans.count, "scan")));
    }
    if (scans.rate() < kLowestRate) {
        obstacles.push_back(
            fmt::format("{:.1f} scans a second, {:.0f} are needed", scans.rate(), kLowestRate));
    }
    if (const Gap gap = scans.longest_gap(); gap.seconds > kLongestGap) {
        obstacles.push_back("no scan for " + at(gap));
    }
    if (inspection.share_missed() > kMostMissed) {
        obstacles.push_back(
            fmt::format("{:.0f} % of the scans are lost", 100.0 * inspection.share_missed()));
    }
    if (inspection.typical_returns < kFewestReturns) {
        obstacles.push_back(fmt::format("too few beams return: {:.0f} % in the median scan",
                                        100.0 * inspection.typical_returns));
    }
    if (!inspection.moved()) {
        obstacles.emplace_back("the vehicle never moved");
    }
}

/// A lidar that came late or left early; maps of the rest can be made.
void warn_of_ends(const Inspection& inspection, std::vector<std::string>& warnings) {
    const Cadence& scans = inspection.scans;
    if (scans.first > kLongestGap) {
        warnings.push_back(fmt::format("no scan in the first {:.0f} s", scans.first));
    }
    if (inspection.duration - scans.last > kLongestGap) {
        warnings.push_back(
            fmt::format("no scan in the last {:.0f} s", inspection.duration - scans.last));
    }
}

/// A closed recording says how much there must be.
void warn_of_missing(std::uint64_t written, std::uint64_t there, const char* what,
                     std::vector<std::string>& warnings) {
    if (there < written) {
        warnings.push_back(fmt::format("{} of {} {} are missing: its files were cut or damaged",
                                       with_commas(written - there), with_commas(written), what));
    }
}

/// What happened before anything was written.
void warn_of_devices(const RecordingDevices& devices, std::vector<std::string>& warnings) {
    const std::pair<std::uint64_t, const char*> losses[] = {
        {devices.lidar_dropped, "pieces of the lidar's bytes dropped before they were written"},
        {devices.camera_dropped, "images dropped before they were written"},
        {devices.lidar_connects > 1 ? devices.lidar_connects - 1 : 0, "times the lidar came back"},
        {devices.camera_connects > 1 ? devices.camera_connects - 1 : 0,
         "times the camera came back"}};
    for (const auto& [count, what] : losses) {
        if (count > 0) {
            warnings.push_back(with_commas(count) + " " + what);
        }
    }
}

void warn_of_images(const Inspection& inspection, std::vector<std::string>& warnings) {
    if (const Gap gap = inspection.images.longest_gap(); gap.seconds > kLongestGap) {
        warnings.push_back("no image for " + at(gap));
    }
    const CameraModel& model = inspection.robot.camera.model;
    if (inspection.image_width > 0 &&
        (inspection.image_width != model.width || inspection.image_height != model.height)) {
        warnings.push_back(fmt::format("images of {} x {} pixels, but a camera model of {} x {}",
                                       inspection.image_width, inspection.image_height, model.width,
                                       model.height));
    }
    if (inspection.images.count > 0 && inspection.duration - inspection.images.last > kLongestGap) {
        warnings.push_back(fmt::format("no image in the last {:.0f} s",
                                       inspection.duration - inspection.images.last));
    }
    if (inspection.images.count == 0 && inspection.robot.camera.enabled) {
        warnings.emplace_back("no images although the robot has a camera");
    }
}

/// Of the manifest.
void warn_of_recorder(const Inspection& inspection, std::vector<std::string>& warnings) {
    if (!inspection.manifest.closed) {
        warnings.emplace_back("the recording was never closed: power cut or crash");
    }
    if (const auto& counts = inspection.manifest.counts) {
        warn_of_missing(counts->lidar_chunks, inspection.lidar_chunks,
                        "pieces of the lidar's bytes", warnings);
        warn_of_missing(counts->images, inspection.images.count, "images", warnings);
    }
    if (inspection.manifest.devices) {
        warn_of_devices(*inspection.manifest.devices, warnings);
    }
    if (inspection.damaged_bytes > 0) {
        warnings.push_back(with_commas(inspection.damaged_bytes) +
                           " bytes of its files are damaged");
    }
    if (inspection.manifest.counts && inspection.manifest.counts->dropped_images > 0) {
        const RecordingCounts& counts = *inspection.manifest.counts;
        warnings.push_back(fmt::format(
            "{} dropped by the recorder ({} because the disk was too slow, {} because it was full)",
            counted(counts.dropped_images, "image"), with_commas(counts.dropped_by_slowness),
            with_commas(counts.dropped_images - counts.dropped_by_slowness)));
    }
}

}  // namespace

Gap Cadence::longest_gap() const {
    const auto longest = std::max_element(
        gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.seconds < b.seconds; });
    return longest == gaps.end() ? Gap() : *longest;
}

Cadence cadence_of(const std::vector<double>& times, double begin) {
    Cadence cadence;
    cadence.count = times.size();
    cadence.first = times.empty() ? 0.0 : times.front() - begin;
    cadence.last = times.empty() ? 0.0 : times.back() - begin;
    std::vector<double> steps;
    for (std::size_t i = 1; i < times.size(); ++i) {
        steps.push_back(times[i] - times[i - 1]);
    }
    cadence.period = std::max(0.0, median_of(steps));
    for (std::size_t i = 0; i < steps.size(); ++i) {
        if (steps[i] > kLongGap * cadence.period) {
            cadence.gaps.push_back({times[i] - begin, steps[i]});
        }
    }
    return cadence;
}

bool Inspection::moved() const {
    return most_changed >= kMovedFrom;
}

double Inspection::share_of_returns() const {
    const auto beams = static_cast<double>(counts.lidar.beams);
    return beams > 0.0 ? 1.0 - static_cast<double>(counts.lidar.no_returns) / beams : 0.0;
}

double Inspection::share_missed() const {
    const auto missed = static_cast<double>(counts.lidar.missed_scans);
    return missed > 0.0 ? missed / (missed + static_cast<double>(counts.lidar.scans)) : 0.0;
}

Inspection inspect(const std::filesystem::path& recording, Progress& progress) {
    RecordingReader reader(recording);
    Tap tap(reader);
    SensorSource source(tap, reader.robot());
    ScanStatistics statistics;
    std::size_t scans = 0;
    while (const std::optional<Measurement> measurement = source.next()) {
        if (const auto* scan = std::get_if<Scan>(&*measurement)) {
            statistics.take(*scan);
            progress.update(source.progress(), ++scans, tap.last() - tap.first());
        }
    }
    Inspection inspection;
    inspection.manifest = reader.manifest();
    inspection.robot = reader.robot();
    inspection.begin = tap.first();
    inspection.duration = tap.last() - tap.first();
    inspection.counts = source.counts();
    inspection.lidar_bytes = tap.lidar_bytes();
    inspection.lidar_chunks = tap.lidar_chunks();
    inspection.image_bytes = tap.image_bytes();
    inspection.image_width = tap.image_width();
    inspection.image_height = tap.image_height();
    inspection.damaged_bytes = reader.damaged_bytes();
    inspection.torn_bytes = reader.torn_bytes();
    inspection.images = cadence_of(tap.images(), tap.first());
    std::move(statistics).tell(inspection);
    return inspection;
}

Verdict judge(const Inspection& inspection) {
    Verdict verdict;
    if (inspection.scans.count == 0) {
        verdict.obstacles.push_back(why_no_scans(inspection));
    } else {
        judge_scans(inspection, verdict.obstacles);
        warn_of_ends(inspection, verdict.warnings);
    }
    warn_of_recorder(inspection, verdict.warnings);
    warn_of_images(inspection, verdict.warnings);
    return verdict;
}

}  // namespace hybrid_slam::tools
