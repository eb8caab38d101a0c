// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "compare_page.hpp"
#include "comparison.hpp"
#include "comparison_pictures.hpp"
#include "comparison_table.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "interrupt.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr auto kFooter =
    R"(Runs the drive several times through the same pipeline, with other values of its options:
  plain ICP             to the previous scan, point to point, without a prior, without the graph
with images
  VO only, thesis       visual odometry alone, by the thesis's method
  VO only               visual odometry alone
  thesis pipeline       the thesis: its visual odometry, ICP to the previous scan, the graph
  VO-seeded ICP         as configured, without the graph
  VO-seeded ICP + graph as configured, with loop closures and graph
without images
  seeded ICP            as configured, without the graph
  seeded ICP + graph    as configured, with loop closures and graph
Held against --truth, --relations or the truth that a simulated recording brings along (anchored at its first
pose); without any, against the last variant. Images are decoded and looked at once. Files in the folder of --out:
  compare.html          everything on one page that needs no other file
  compare.png           all trajectories over the map         compare.txt   the table
  compare_maps.png      what each variant made of the drive   compare.json  the same for programs
  compare_errors.png    errors over time                      NAME.tum, NAME.yaml   trajectory and
                                                              configuration of each variant
Examples:
  hybrid-slam compare sim1/                       # against its own truth.tum
  hybrid-slam compare drive1/ --out compared      # a real drive
  hybrid-slam compare intel.clf.gz --relations intel.relations
  hybrid-slam compare hall.clf --truth hall.truth.tum --align first --json
)";

/// A simulated recording brings the truth along, and is anchored at its first pose: as a map that
/// starts there.
void take_own_truth(CompareOptions& options, bool align_given) {
    YardstickFiles& yardstick = options.yardstick;
    const std::filesystem::path own = options.drive / RecordingFiles::kTruth;
    if (!yardstick.truth.empty() || !yardstick.relations.empty() || !std::filesystem::exists(own)) {
        return;
    }
    yardstick.truth = own;
    if (!align_given) {
        yardstick.alignment = TruthAlignment::kFirstPose;
    }
}

std::filesystem::path make_folder(const CompareOptions& options) {
    const std::filesystem::path folder =
        options.out.empty() ? std::filesystem::path(stem_of(name_of(options.drive)) + "_compare")
                            : options.out;
    if (std::filesystem::exists(folder / "manifest.json")) {
        throw Error(folder.string() + ": holds a map or a recording; the comparison needs its own");
    }
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error || !std::filesystem::is_directory(folder)) {
        throw Error(folder.string() + ": cannot be made a folder");
    }
    return folder;
}

PagePicture write_picture(const std::filesystem::path& file, const Canvas& canvas,
                          const std::string& title, const std::string& caption) {
    constexpr std::size_t kMostBytes = 1U << 28U;
    canvas.write_png(file);
    return {title, caption, read_whole_file(file, kMostBytes)};
}

std::vector<PagePicture> write_pictures(const std::filesystem::path& folder,
                                        const Comparison& comparison) {
    std::vector<PagePicture> pictures;
    pictures.push_back(write_picture(
        folder / "compare.png", draw_paths(comparison), "Trajectories",
        "Each variant's way over the map of " + comparison.best().variant.name + "."));
    if (comparison.runs.front().evaluation) {
        const std::string noun = comparison.has_truth() ? "Errors" : "Differences";
        pictures.push_back(write_picture(folder / "compare_errors.png", draw_errors(comparison),
                                         noun + " over time",
                                         "On scales by powers of ten. Shaded: where the camera saw "
                                         "too little."));
    }
    pictures.push_back(write_picture(folder / "compare_maps.png", draw_maps(comparison),
                                     "Maps side by side",
                                     "The scans, drawn from the poses of each variant."));
    return pictures;
}

void write_files(const std::filesystem::path& folder, const Comparison& comparison,
                 const nlohmann::ordered_json& json) {
    const ComparisonTable table = table_of(comparison);
    const std::vector<PagePicture> pictures = write_pictures(folder, comparison);
    write_text(folder / "compare.html", page_of(comparison, table, pictures));
    write_text(folder / "compare.txt", comparison.title() + "\n" + text_of(table) + "\n");
    write_text(folder / "compare.json",
               json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    for (const VariantRun& run : comparison.runs) {
        const std::string name = file_name(run.variant.name);
        write_tum(folder / (name + ".tum"), run.session.map.trajectory);
        write_text(folder / (name + ".yaml"), to_yaml(run.settings));
    }
}

/// Leaves no empty folder behind when it fails.
Comparison compare_into(const std::filesystem::path& folder, const CompareOptions& options) {
    try {
        return compare(options);
    } catch (const Error&) {
        std::error_code ignored;
        std::filesystem::remove(folder, ignored);
        throw;
    }
}

int run_compare(const CompareOptions& options, bool print_as_json) {
    const std::filesystem::path folder = make_folder(options);
    catch_interrupts();
    const Comparison comparison = compare_into(folder, options);
    if (comparison.runs.empty()) {
        print_warning("interrupted before the first run was complete: nothing to compare");
        return kInterrupted;
    }
    if (comparison.interrupted) {
        print_warning("interrupted; the runs that were complete are compared");
    }
    for (const std::string& warning : comparison.runs.back().session.vision.warnings()) {
        print_warning(warning);
    }
    const nlohmann::ordered_json json = to_json(comparison);
    write_files(folder, comparison, json);
    if (print_as_json) {
        print_json(json);
    } else {
        print_result(comparison.title() + "\n" + text_of(table_of(comparison)) +
                     "\npage: " + (folder / "compare.html").string());
    }
    return comparison.interrupted ? kInterrupted : kOk;
}

}  // namespace

void add_compare_command(CLI::App& program, Action& action) {
    struct Choice {
        CommonOptions common;
        CompareOptions compare;
    };
    const auto choice = std::make_shared<Choice>();
    CompareOptions& options = choice->compare;
    CLI::App* command = program.add_subcommand(
        "compare", "Compare plain ICP, visual odometry, seeded ICP and the graph on one drive");
    command
        ->add_option("DRIVE", options.drive, "Folder of a recording, or CARMEN log (plain or .gz)")
        ->required()
        ->type_name("");
    add_yardstick_options(*command, options.yardstick, 0);
    command
        ->add_option("--robot", options.robot,
                     "Robot (YAML) in place of the one that was recorded, newly calibrated perhaps")
        ->type_name("FILE");
    command->add_option("-o,--out", options.out, "Folder for the results (DRIVE_compare)")
        ->type_name("DIR");
    add_config_option(*command, options.config, " of all variants");
    add_set_option(*command, options.overrides, "scan.range_max=20");
    add_common_options(*command, choice->common);
    command->footer(kFooter);
    command->callback([choice, command, &action] {
        take_own_truth(choice->compare, command->count("--align") > 0);
        choice->compare.quiet = choice->common.quiet;
        action = [choice] { return run_compare(choice->compare, choice->common.json); };
    });
}

}  // namespace hybrid_slam::tools
