// SPDX-License-Identifier: Apache-2.0
#include "compare_page.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <opencv2/core/version.hpp>
#include <utility>

#include "comparison_pictures.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr auto kStyle = R"(
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, "Liberation Sans", Arial, sans-serif; color: #23272e; background: #fff;
  max-width: 78rem; margin: 0 auto; padding: 1.5rem; }
h1 { font-size: 1.6rem; margin: 0 0 .3rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid #d8dce2; padding-bottom: .2rem; }
p.lead { color: #555c66; margin: 0; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .87rem; }
th, td { padding: .25rem .7rem; border-bottom: 1px solid #e6e9ed; text-align: right; white-space: nowrap;
  font-variant-numeric: tabular-nums; }
th { font-weight: 600; }
tbody th, table.left td, table.left th { text-align: left; font-weight: 400; white-space: pre-wrap; }
thead th { border-bottom: 2px solid #9aa1ab; vertical-align: bottom; }
tbody tr:nth-child(even) { background: #f7f8fa; }
.best { font-weight: 700; color: #0b5d3b; }
.swatch { display: inline-block; width: .8em; height: .8em; margin-right: .35em; border-radius: 2px; }
.note { color: #555c66; font-size: .85rem; margin: .4rem 0 0; }
.warning { background: #fff6dd; border-left: 4px solid #e6a800; padding: .4rem .8rem; margin: .4rem 0; }
figure { margin: 1rem 0; }
figure img { max-width: 100%; height: auto; border: 1px solid #e0e4e9; }
figcaption { color: #555c66; font-size: .87rem; }
code { font: .85em ui-monospace, "Liberation Mono", monospace; }
dt { font-weight: 600; } dd { margin: 0 0 .4rem 1.2rem; }
footer { margin-top: 2.5rem; color: #6a717c; font-size: .82rem; }
@media print {
  body { max-width: none; padding: 0; font-size: 10pt; }
  table { font-size: 7.5pt; } th, td { padding: .12rem .35rem; }
  .scroll { overflow: visible; }
  figure, tr { break-inside: avoid; } h2 { break-after: avoid; }
  * { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
}
)";

constexpr auto kGlossary = R"(<dl>
<dt>position, x, y, heading (RMSE)</dt><dd>Root mean square over all scans, along the axes of the truth; position is
the distance (thesis, equations 4.1 to 4.3 and Table 4.33).</dd>
<dt>ATE</dt><dd>The same of the position after the best rigid fit of the whole trajectory.</dd>
<dt>RPE</dt><dd>Error of the motion over a metre of the way: what neither a wrong start nor an old error counts in.</dd>
<dt>drift</dt><dd>The same over ten metres, as a share of them.</dd>
<dt>scans where ICP failed</dt><dd>The motion is that of the prior alone.</dd>
<dt>prior</dt><dd>Where the first guess of each scan's motion came from. A prior that is missing is replaced by the next
simpler one.</dd>
</dl>
)";

std::string css_color(const Color& color) {
    return fmt::format("#{:02x}{:02x}{:02x}", color.red, color.green, color.blue);
}

std::string header_html(const Comparison& comparison, const ComparisonTable& table) {
    std::string html = "<thead><tr><th></th>";
    const std::size_t others = table.columns.size() - comparison.runs.size();
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
        const std::string swatch =
            i < others ? ""
                       : fmt::format("<span class=\"swatch\" style=\"background:{}\"></span>",
                                     css_color(variant_color(comparison, i - others)));
        html += fmt::format("<th scope=\"col\">{}{}</th>", swatch, escaped(table.columns[i]));
    }
    return html + "</tr></thead>\n";
}

std::string table_html(const Comparison& comparison, const ComparisonTable& table,
                       const std::vector<ComparisonRow>& rows) {
    std::string html =
        "<div class=\"scroll\"><table>\n" + header_html(comparison, table) + "<tbody>\n";
    for (const ComparisonRow& row : rows) {
        html += fmt::format("<tr><th scope=\"row\">{}</th>", escaped(row.name));
        for (std::size_t i = 0; i < row.cells.size(); ++i) {
            html += fmt::format("<td{}>{}</td>", row.best[i] ? " class=\"best\"" : "",
                                escaped(row.cells[i]));
        }
        html += "</tr>\n";
    }
    return html + "</tbody></table></div>\n";
}

std::string warnings_html(const Comparison& comparison) {
    std::string html;
    const auto add = [&html](const std::string& text) {
        html += fmt::format("<p class=\"warning\">{}</p>\n", escaped(text));
    };
    if (comparison.interrupted) {
        add("Interrupted: only the runs that were complete are compared.");
    }
    for (const std::string& warning : comparison.warnings) {
        add(warning);
    }
    for (const std::string& warning : comparison.runs.back().session.vision.warnings()) {
        add(warning);
    }
    return html;
}

std::string picture_html(const PagePicture& picture) {
    return fmt::format(
        "<h2>{0}</h2>\n<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"/>\n"
        "<figcaption>{2}</figcaption></figure>\n",
        escaped(picture.title), base64(picture.png), escaped(picture.caption));
}

std::string code_list(const Overrides& overrides) {
    std::string html;
    for (const std::string& override : overrides) {
        html += fmt::format("{}<code>{}</code>", html.empty() ? "" : "<br/>", escaped(override));
    }
    return html.empty() ? "none" : html;
}

std::string settings_html(const Comparison& comparison) {
    std::string html = fmt::format(
        "<h2>Settings</h2>\n<p>One program, other values of its options. For all: configuration "
        "{}; "
        "overridden: {}.</p>\n<table class=\"left\"><thead><tr><th scope=\"col\">variant</th>"
        "<th scope=\"col\">options</th><th scope=\"col\">all of its values</th></tr></thead>\n"
        "<tbody>\n",
        comparison.config.empty() ? "by default" : escaped(comparison.config),
        code_list(comparison.overrides));
    for (const VariantRun& run : comparison.runs) {
        html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}.yaml</td></tr>\n",
                            escaped(run.variant.name), code_list(run.variant.overrides),
                            escaped(file_name(run.variant.name)));
    }
    return html + "</tbody></table>\n";
}

/// "lidar.scans" and so on.
void add_counts(const Json& json, const std::string& prefix, std::string& html) {
    for (const auto& [key, value] : json.items()) {
        if (value.is_object()) {
            add_counts(value, prefix + key + ".", html);
            continue;
        }
        const std::string text =
            value.is_number_integer() ? with_commas(value.get<std::size_t>()) : value.dump();
        html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n",
                            escaped(prefix + key), escaped(text));
    }
}

std::string input_html(const Comparison& comparison) {
    std::string html = "<h2>What was read</h2>\n<table><tbody>\n";
    add_counts(comparison.input, "", html);
    return html + "</tbody></table>\n";
}

std::string lead_of(const Comparison& comparison) {
    const Session& session = comparison.runs.back().session;
    return fmt::format(
        "{} in {}, {:.1f} m{}", counted(session.scans, "scan"), duration_text(session.recorded),
        session.path,
        session.vision.images > 0 ? ", " + counted(session.vision.images, "image") : "");
}

std::string notes_html(const std::vector<std::string>& notes) {
    std::string html;
    for (const std::string& note : notes) {
        html += fmt::format("<p class=\"note\">{}</p>\n", escaped(note));
    }
    return html;
}

}  // namespace

std::string escaped(std::string_view text) {
    std::string html;
    for (const char letter : text) {
        switch (letter) {
            case '&':
                html += "&amp;";
                break;
            case '<':
                html += "&lt;";
                break;
            case '>':
                html += "&gt;";
                break;
            case '"':
                html += "&quot;";
                break;
            case '\'':
                html += "&#39;";
                break;
            default:
                html += letter;
        }
    }
    return html;
}

std::string base64(std::string_view bytes) {
    constexpr std::string_view kLetters =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve(4 * ((bytes.size() + 2) / 3));
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t triple = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t byte =
                i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U;
            triple = (triple << 8U) | byte;
        }
        const std::size_t filled = std::min<std::size_t>(3, bytes.size() - i) + 1;
        for (std::size_t k = 0; k < 4; ++k) {
            text += k < filled ? kLetters[(triple >> (18U - 6U * k)) & 63U] : '=';
        }
    }
    return text;
}

std::string page_of(const Comparison& comparison, const ComparisonTable& table,
                    const std::vector<PagePicture>& pictures) {
    const std::string title = escaped(comparison.title());
    std::string html = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
        "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<h1>{}</h1>\n"
        "<p class=\"lead\">{}</p>\n",
        title, kStyle, title, escaped(lead_of(comparison)));
    html += warnings_html(comparison);
    html += "<h2>Results</h2>\n" + table_html(comparison, table, table.results);
    html += "<p class=\"note\">The best value of a row is bold.</p>\n" + notes_html(table.notes);
    for (const PagePicture& picture : pictures) {
        html += picture_html(picture);
    }
    html += "<section id=\"cost\">\n<h2>Time and memory</h2>\n" +
            table_html(comparison, table, table.cost) + notes_html(table.cost_notes) +
            "</section>\n";
    html += settings_html(comparison) + input_html(comparison);
    html += "<h2>What the figures mean</h2>\n" + std::string(kGlossary);
    html += fmt::format("<footer>hybrid-slam {}, OpenCV {}, Eigen {}.{}.{}</footer>\n",
                        HYBRID_SLAM_VERSION, CV_VERSION, EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
                        EIGEN_MINOR_VERSION);
    return html + "</body>\n</html>\n";
}

}  // namespace hybrid_slam::tools
