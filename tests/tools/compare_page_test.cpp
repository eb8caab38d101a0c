// SPDX-License-Identifier: Apache-2.0
#include "compare_page.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <utility>

#include "comparison_table.hpp"
#include "support/markup.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using namespace tools;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Trajectory straight(double scale) {
    Trajectory trajectory;
    for (int i = 0; i <= 200; ++i) {
        trajectory.push_back({0.1 * i, Pose2d(scale * 0.1 * i, 0.0, 0.0)});
    }
    return trajectory;
}

VariantRun run_of(const Variant& variant, double scale, const Yardstick& yardstick) {
    VariantRun run;
    run.variant = variant;
    run.settings = with_overrides(Settings{}, variant.overrides);
    run.session.scans = 201;
    run.session.map.trajectory = straight(scale);
    run.session.timings.total = 1.0;
    run.evaluation = yardstick.measure(run.session.map.trajectory);
    return run;
}

/// Scales by which each variant errs, the last one right.
Comparison comparison_of(const std::vector<double>& scales, Yardstick yardstick) {
    Comparison comparison;
    comparison.drive = R"(<b>"R&D" 'hall'</b>)";
    const std::vector<Variant> variants = comparison_variants(false);
    for (std::size_t i = 0; i < scales.size(); ++i) {
        comparison.runs.push_back(run_of(variants[i], scales[i], yardstick));
    }
    comparison.input = {{"scans", 1201}, {"losses", {{"torn", 3}}}};
    comparison.warnings = {"lines <torn>: 3"};
    comparison.overrides = {"map.resolution=0.1"};
    comparison.yardstick = std::move(yardstick);
    return comparison;
}

class ComparePage : public ::testing::Test {
  protected:
    TempFolder folder_;
    Yardstick truth() {
        write_tum(folder_ / "truth.tum", straight(1.0));
        return Yardstick(YardstickFiles{{}, folder_ / "truth.tum", TruthAlignment::kFirstPose});
    }
};

std::string page(const Comparison& comparison) {
    return page_of(comparison, table_of(comparison), {{"A & B", "<caption>", "\x89PNG"}});
}

const ComparisonRow& row(const std::vector<ComparisonRow>& rows, const std::string& name) {
    const auto found = std::find_if(rows.begin(), rows.end(),
                                    [&](const ComparisonRow& one) { return one.name == name; });
    EXPECT_NE(found, rows.end()) << name;
    return found == rows.end() ? rows.front() : *found;
}

TEST(Html, EscapesWhatHasAMeaning) {
    EXPECT_EQ(escaped(R"(a<b>&"c"'d')"), "a&lt;b&gt;&amp;&quot;c&quot;&#39;d&#39;");
}

TEST(Html, Base64IsThatOfTheStandard) {
    const std::pair<const char*, const char*> examples[] = {{"", ""},
                                                            {"f", "Zg=="},
                                                            {"fo", "Zm8="},
                                                            {"foo", "Zm9v"},
                                                            {"foob", "Zm9vYg=="},
                                                            {"fooba", "Zm9vYmE="},
                                                            {"foobar", "Zm9vYmFy"}};
    for (const auto& [bytes, text] : examples) {
        EXPECT_EQ(base64(bytes), text);
    }
    EXPECT_EQ(base64(std::string("\x00\xff\xfe", 3)), "AP/+");
}

TEST_F(ComparePage, IsWellFormedAndNeedsNothingElse) {
    const std::string html = page(comparison_of({1.1, 0.98, 1.0}, truth()));
    EXPECT_EQ(markup_fault(html), "");
    EXPECT_THAT(html,
                AllOf(Not(HasSubstr("http:")), Not(HasSubstr("https:")), Not(HasSubstr("<script")),
                      Not(HasSubstr("url(")), Not(HasSubstr("<link"))));
    for (std::size_t at = html.find("src="); at != std::string::npos;
         at = html.find("src=", at + 1)) {
        EXPECT_EQ(html.substr(at, 26), "src=\"data:image/png;base64");
    }
    EXPECT_THAT(html, HasSubstr("base64," + base64("\x89PNG") + "\""));
}

TEST_F(ComparePage, EscapesEveryName) {
    const std::string html = page(comparison_of({1.1, 0.98, 1.0}, truth()));
    EXPECT_THAT(html, AllOf(HasSubstr("&lt;b&gt;&quot;R&amp;D&quot; &#39;hall&#39;&lt;/b&gt;"),
                            Not(HasSubstr("<b>")), HasSubstr("lines &lt;torn&gt;: 3"),
                            HasSubstr("A &amp; B"), HasSubstr("&lt;caption&gt;")));
}

TEST_F(ComparePage, HasEveryValueOfTheTable) {
    const Comparison comparison = comparison_of({1.1, 0.98, 1.0}, truth());
    const ComparisonTable table = table_of(comparison);
    const std::string html = page(comparison);
    for (const auto* rows : {&table.results, &table.cost}) {
        for (const ComparisonRow& one : *rows) {
            std::string cells = "<th scope=\"row\">" + escaped(one.name) + "</th>";
            ASSERT_EQ(one.cells.size(), 3U);
            for (std::size_t i = 0; i < one.cells.size(); ++i) {
                cells += std::string(one.best[i] ? "<td class=\"best\">" : "<td>") +
                         escaped(one.cells[i]) + "</td>";
            }
            EXPECT_THAT(html, HasSubstr(cells));
        }
    }
    EXPECT_THAT(html, AllOf(HasSubstr("<code>map.resolution=0.1</code>"), HasSubstr("losses.torn"),
                            HasSubstr("1,201"), HasSubstr("seeded_icp_graph.yaml"),
                            HasSubstr("hybrid-slam " HYBRID_SLAM_VERSION)));
    for (const VariantRun& run : comparison.runs) {
        for (const std::string& override : run.variant.overrides) {
            EXPECT_THAT(html, HasSubstr("<code>" + override + "</code>"));
        }
    }
}

TEST_F(ComparePage, TimesAreInOnePlaceOnly) {
    Comparison comparison = comparison_of({1.1, 0.98, 1.0}, truth());
    const std::string before = page(comparison);
    for (VariantRun& run : comparison.runs) {
        run.session.timings.total = 2.0;
        run.session.timings.cpu = 3.0;
        run.session.timings.scan.longest = 4.0;
        run.peak_mb = 5.0;
    }
    const std::string after = page(comparison);
    const auto without_cost = [](std::string html) {
        const std::size_t begin = html.find("<section id=\"cost\">");
        return html.erase(begin, html.find("</section>") - begin);
    };
    EXPECT_NE(before, after);
    EXPECT_EQ(without_cost(before), without_cost(after));
}

/// 20 m straight on, by 10 % and by 2 % wrong: all figures can be told by hand.
TEST_F(ComparePage, FiguresAreThoseWorkedByHand) {
    const ComparisonTable table = table_of(comparison_of({1.1, 0.98, 1.0}, truth()));
    // RMS of 0.1 * (0, 0.1, ..., 20) m.
    EXPECT_THAT(row(table.results, "position (RMSE), m").cells,
                ElementsAre("1.1561", "0.2312", "0.0000"));
    EXPECT_THAT(row(table.results, "x (RMSE), m").cells, ElementsAre("1.1561", "0.2312", "0.0000"));
    EXPECT_THAT(row(table.results, "y (RMSE), m").cells, ElementsAre("0.0000", "0.0000", "0.0000"));
    EXPECT_THAT(row(table.results, "final position error, m").cells,
                ElementsAre("2.000", "0.400", "0.000"));
    EXPECT_THAT(row(table.results, "  of the way, %").cells, ElementsAre("10.00", "2.00", "0.00"));
    EXPECT_THAT(row(table.results, "drift over 10 m, %").cells,
                ElementsAre("10.00", "2.00", "0.00"));
    EXPECT_THAT(row(table.results, "drift, deg per 10 m").cells,
                ElementsAre("0.00", "0.00", "0.00"));
    // The best fit puts the middles onto each other: as well as uniform over 2 m.
    EXPECT_THAT(row(table.results, "ATE (RMSE after best fit), m").cells,
                ElementsAre("0.5802", "0.1160", "0.0000"));
}

TEST_F(ComparePage, TheBestOfARowIsBoldUnlessAllAreAlike) {
    const ComparisonTable table = table_of(comparison_of({1.0, 0.98, 1.0}, truth()));
    EXPECT_THAT(row(table.results, "position (RMSE), m").best, ElementsAre(true, false, true));
    EXPECT_THAT(row(table.results, "y (RMSE), m").best, ElementsAre(false, false, false));
    EXPECT_THAT(row(table.results, "closures accepted / tried").best,
                ElementsAre(false, false, false));
}

TEST_F(ComparePage, DifferencesAreMarkedAndNoneIsTheBest) {
    Comparison comparison =
        comparison_of({1.1, 0.98, 1.0}, Yardstick("seeded ICP + graph", straight(1.0)));
    comparison.runs.back().evaluation.reset();
    const ComparisonTable table = table_of(comparison);
    const ComparisonRow& position = row(table.results, "position (RMSE), m *");
    EXPECT_THAT(position.cells, ElementsAre("1.1561", "0.2312", "-"));
    EXPECT_THAT(position.best, ElementsAre(false, false, false));
    EXPECT_THAT(text_of(table), HasSubstr("* difference from seeded ICP + graph"));
    EXPECT_THAT(page(comparison), HasSubstr("* difference from seeded ICP + graph"));
    EXPECT_THAT(comparison.title(), HasSubstr("there is no truth"));
    EXPECT_EQ(&comparison.best(), &comparison.runs.back());
    EXPECT_TRUE(to_json(comparison)["variants"][2]["error"].is_null());
}

}  // namespace
}  // namespace hybrid_slam::test
