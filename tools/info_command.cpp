// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/localization/reference_map.hpp"
#include "input.hpp"
#include "inspection_report.hpp"
#include "messages.hpp"
#include "thumbnails.hpp"

namespace hybrid_slam::tools {
namespace {

struct InfoOptions {
    CommonOptions common;
    std::filesystem::path folder;
    std::filesystem::path picture;
    bool no_picture = false;
};

constexpr std::size_t kThumbnails = 8;

constexpr auto kFooter =
    R"(A recording is read from end to end through the decoder that mapping uses. It is fit for mapping when it has
at least 10 scans at 5 Hz or more, no gap over 1 s between two, at most 5 % of them lost, returns in 10 % of the
beams of the median scan, and when the vehicle moved. Warnings do not prevent that.
The picture shows 8 images and 8 scans spread over the drive; it goes to DIR/info.png unless told otherwise.
Examples:
  hybrid-slam info drive1
  hybrid-slam info drive1 --json | jq '.fit, .obstacles'
  hybrid-slam info hall_map
  hybrid-slam info hall_map --json | jq '.free_m2, .file_bytes'
  hybrid-slam info theirs.yaml
Exit codes: 0 fit for mapping, or a map that is whole; 4 a recording that is not fit; 1 cannot be read, or a
damaged map.
)";

/// Where the picture goes; empty for nowhere.
std::filesystem::path picture_of(const InfoOptions& options) {
    if (!options.picture.empty() || options.no_picture) {
        return options.no_picture ? "" : options.picture;
    }
    const bool writable = ::access(options.folder.c_str(), W_OK) == 0;
    return writable ? options.folder / "info.png" : "";
}

bool draw_picture(const InfoOptions& options, const Inspection& inspection) {
    const std::filesystem::path file = picture_of(options);
    const std::vector<Image> images =
        file.empty() ? std::vector<Image>() : read_thumbnails(options.folder, kThumbnails);
    if (file.empty() || (images.empty() && inspection.samples.empty())) {
        return false;
    }
    try {
        draw_strip(name_of(options.folder), inspection, images).write_png(file);
    } catch (const Error& error) {
        if (!options.picture.empty()) {
            throw;
        }
        print_warning(error.what());  // nobody asked for it: the verdict is what counts
        return false;
    }
    return true;
}

int show_recording(const InfoOptions& options) {
    Inspection inspection;
    {
        Progress progress(name_of(options.folder), options.common.quiet);
        inspection = inspect(options.folder, progress);
    }
    const Verdict verdict = judge(inspection);
    const std::string picture =
        draw_picture(options, inspection) ? picture_of(options).string() : "";
    if (options.common.json) {
        nlohmann::ordered_json json = report_json(inspection, verdict);
        json["picture"] = picture;
        print_json(json);
    } else {
        print_result((picture.empty() ? "" : "picture    " + picture + "\n") +
                     report_text(inspection, verdict));
    }
    return verdict.fit() ? kOk : kNotFit;
}

int show_map(const InfoOptions& options) {
    const MapReport report(options.folder);
    if (options.common.json) {
        print_json(report.json());
    } else {
        print_result(report.text());
    }
    return kOk;
}

int show_grid(const InfoOptions& options) {
    const GridReport report(options.folder);
    if (options.common.json) {
        print_json(report.json());
    } else {
        print_result(report.text());
    }
    return kOk;
}

int run_info(const InfoOptions& options) {
    if (is_map_server_file(options.folder)) {
        return show_grid(options);
    }
    if (!std::filesystem::is_directory(options.folder)) {
        throw Error(options.folder.string() + ": there is no such folder");
    }
    if (is_recording(options.folder)) {
        return show_recording(options);
    }
    if (!std::filesystem::exists(options.folder / "manifest.json")) {
        throw Error(options.folder.string() + ": is neither a recording nor a map");
    }
    return show_map(options);
}

}  // namespace

void add_info_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App* command = program.add_subcommand(
        "info", "Tell what is in a recording or a map, and whether a map can be made of it");
    command
        ->add_option("DIR", options->folder,
                     "Folder of a recording or of a map, or the .yaml file of a map_server map")
        ->required()
        ->type_name("");
    CLI::Option* picture =
        command
            ->add_option("--picture", options->picture, "Where to put the picture of a recording")
            ->type_name("FILE");
    command->add_flag("--no-picture", options->no_picture, "Write no picture")->excludes(picture);
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] { action = [options] { return run_info(*options); }; });
}

}  // namespace hybrid_slam::tools
