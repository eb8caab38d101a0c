// SPDX-License-Identifier: Apache-2.0
#include "comparison.hpp"

#include <algorithm>
#include <cctype>
#include <memory>
#include <utility>

#include "hybrid_slam/backend/map_folder.hpp"
#include "interrupt.hpp"
#include "tape.hpp"

namespace hybrid_slam::tools {
namespace {

std::string yaml_of(VisionConfig config) {
    ConfigSchema schema;
    describe(schema, config);
    return schema.to_yaml();
}

/// The ways to look at images that the variants have, each once.
class Ways {
  public:
    Ways(const Settings& base, const std::vector<Variant>& variants) {
        for (const Variant& variant : variants) {
            const Settings settings = with_overrides(base, variant.overrides);
            if (uses_images(settings) && !of(settings)) {
                configs_.push_back(settings.vision);
            }
        }
    }

    const std::vector<VisionConfig>& configs() const { return configs_; }

    std::optional<std::size_t> of(const Settings& settings) const {
        const auto found =
            std::find_if(configs_.begin(), configs_.end(), [&](const VisionConfig& config) {
                return yaml_of(config) == yaml_of(settings.vision);
            });
        return uses_images(settings) && found != configs_.end()
                   ? std::optional<std::size_t>(found - configs_.begin())
                   : std::nullopt;
    }

  private:
    std::vector<VisionConfig> configs_;
};

class Comparer {
  public:
    explicit Comparer(const CompareOptions& options)
        : options_(options),
          base_(load_settings(options.config, options.overrides)),
          ways_(base_, comparison_variants(true)) {
        comparison_.drive = name_of(options.drive);
        comparison_.config = options.config.filename().string();
        comparison_.overrides = options.overrides;
    }

    Comparison run() {
        const YardstickFiles& files = options_.yardstick;
        if (!files.truth.empty() || !files.relations.empty()) {
            comparison_.yardstick = Yardstick(files);
        }
        const Tape tape = read();
        comparison_.input = tape.input_counts();
        comparison_.warnings = tape.warnings();
        comparison_.interrupted = tape.interrupted();
        for (const Variant& variant : comparison_variants(tape.images() > 0)) {
            if (comparison_.interrupted) {
                break;
            }
            add(run(variant, tape));
        }
        if (!comparison_.runs.empty()) {
            hold_against_the_last();
            measure_wheels();
        }
        return std::move(comparison_);
    }

  private:
    Tape read() const {
        const std::unique_ptr<Input> input =
            open_input(options_.drive, base_.log, options_.robot, true);
        Progress progress("reading", options_.quiet);
        return Tape(*input, ways_.configs(), progress);
    }

    VariantRun run(const Variant& variant, const Tape& tape) const {
        reset_peak_memory();
        VariantRun run;
        run.variant = variant;
        run.settings = with_overrides(base_, variant.overrides);
        const std::optional<std::size_t> way =
            tape.images() > 0 ? ways_.of(run.settings) : std::nullopt;
        if (way) {
            run.vision = VisionCost{tape.counts(*way).images, tape.counts(*way).seconds};
        }
        const std::unique_ptr<Input> input = tape.replay(way);
        {
            Progress progress(variant.name, options_.quiet);
            run.session = run_session(*input, comparison_.drive, run.settings, progress);
        }
        run.peak_mb = peak_memory_mb();
        SlamMap& map = run.session.map;
        run.points = draw_points(map.keyframes, map.graph, run.settings.map.resolution);
        map.keyframes = Keyframes{};
        return run;
    }

    void add(VariantRun run) {
        if (run.session.interrupted) {
            comparison_.interrupted = true;  // part of a drive compares with nothing
            return;
        }
        if (comparison_.yardstick) {
            run.evaluation = comparison_.yardstick->measure(run.session.map.trajectory);
        }
        comparison_.runs.push_back(std::move(run));
    }

    void hold_against_the_last() {
        if (comparison_.yardstick) {
            return;
        }
        std::vector<VariantRun>& runs = comparison_.runs;
        comparison_.yardstick =
            Yardstick(runs.back().variant.name, runs.back().session.map.trajectory);
        for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
            if (runs[i].session.map.trajectory.size() > 1) {
                runs[i].evaluation = comparison_.yardstick->measure(runs[i].session.map.trajectory);
            }
        }
    }

    void measure_wheels() {
        comparison_.wheels = std::move(comparison_.runs.front().session.wheels);
        // Fewer than two poses have no error.
        if (comparison_.wheels.size() > 1) {
            comparison_.odometry = comparison_.yardstick->measure(comparison_.wheels);
        }
    }

    const CompareOptions& options_;
    Settings base_;
    Ways ways_;
    Comparison comparison_;
};

}  // namespace

double VisionCost::milliseconds_per_image() const {
    return images == 0 ? 0.0 : 1e3 * seconds / static_cast<double>(images);
}

Pose2d VariantRun::truth_from_map() const {
    return evaluation && evaluation->truth ? evaluation->truth->truth_from_estimate : Pose2d();
}

std::string Comparison::title() const {
    return has_truth() ? drive + " against " + yardstick->description()
                       : drive + ": differences from " + yardstick->name() + " (there is no truth)";
}

const VariantRun& Comparison::best() const {
    const auto error = [](const VariantRun& run) {
        return run.evaluation->figures().front().value;
    };
    return has_truth() ? *std::min_element(runs.begin(), runs.end(),
                                           [&](const VariantRun& a, const VariantRun& b) {
                                               return error(a) < error(b);
                                           })
                       : runs.back();
}

Comparison compare(const CompareOptions& options) {
    return Comparer(options).run();
}

std::string file_name(const std::string& variant) {
    std::string name;
    for (const char letter : variant) {
        if (std::isalnum(static_cast<unsigned char>(letter)) != 0) {
            name += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
        } else if (!name.empty() && name.back() != '_') {
            name += '_';
        }
    }
    return name;
}

}  // namespace hybrid_slam::tools
