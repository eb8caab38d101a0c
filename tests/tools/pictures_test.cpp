// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <limits>

#include "drawings.hpp"
#include "error_curves.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using namespace tools;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Bounds square_of(double size) {
    Bounds bounds;
    bounds.include(Point2(0.0, 0.0));
    bounds.include(Point2(size, size));
    return bounds;
}

TEST(Pictures, ViewPutsNorthUpAndTheMiddleInTheMiddle) {
    const View view(square_of(10.0), {100, 50, 400, 200}, 1000.0);
    EXPECT_DOUBLE_EQ(view.pixels_per_metre(), 20.0);
    EXPECT_TRUE(view(Point2(5.0, 5.0)).isApprox(Pixel(300.0, 150.0)));
    EXPECT_TRUE(view(Point2(0.0, 10.0)).isApprox(Pixel(200.0, 50.0)));
    EXPECT_DOUBLE_EQ(View(square_of(10.0), {0, 0, 400, 400}, 7.0).pixels_per_metre(), 7.0);
}

TEST(Pictures, MarginIsAtLeastAMetre) {
    EXPECT_TRUE(square_of(10.0).with_margin(0.01).lower.isApprox(Point2(-1.0, -1.0)));
    EXPECT_TRUE(square_of(100.0).with_margin(0.1).upper.isApprox(Point2(110.0, 110.0)));
}

Figure figure_with(std::size_t panels, double width, double height) {
    Figure figure;
    figure.title = "Title";
    figure.legend = {{Mark::kLine, {}, "a line"}};
    for (std::size_t i = 0; i < panels; ++i) {
        Panel panel;
        panel.bounds.include(Point2(0.0, 0.0));
        panel.bounds.include(Point2(width, height));
        panel.draw = [](Canvas&, const View&) {};
        figure.panels.push_back(panel);
    }
    return figure;
}

TEST(Pictures, AreOfBearableSizeWhateverIsInThem) {
    for (const double width : {0.5, 30.0, 1e6}) {
        for (const double height : {0.5, 30.0, 1e6}) {
            for (const std::size_t panels : {1, 2, 3}) {
                const Canvas canvas = draw(figure_with(panels, width, height));
                EXPECT_GE(canvas.width(), 900);
                EXPECT_LE(canvas.width(), 2000);
                EXPECT_LE(canvas.height(), 2000);
            }
        }
    }
}

TEST(Pictures, WidePanelsAreStackedAndTallOnesStandSideBySide) {
    const Canvas wide = draw(figure_with(3, 100.0, 20.0));
    const Canvas tall = draw(figure_with(3, 20.0, 100.0));
    EXPECT_LT(static_cast<double>(wide.width()) / wide.height(), 2.5);
    EXPECT_GT(static_cast<double>(tall.width()) / tall.height(), 0.6);
}

TEST(Pictures, PngHasTheSizeOfTheCanvas) {
    const TempFolder folder;
    Canvas canvas(300, 200);
    canvas.text({10.0, 20.0}, "letters", {});
    canvas.write_png(folder / "small.png");
    const std::string bytes = bytes_of(folder / "small.png");
    ASSERT_GT(bytes.size(), 24U);
    EXPECT_THAT(bytes, StartsWith("\x89PNG\r\n"));
    EXPECT_EQ(static_cast<unsigned char>(bytes[18]) * 256 + static_cast<unsigned char>(bytes[19]),
              300);
    EXPECT_EQ(static_cast<unsigned char>(bytes[22]) * 256 + static_cast<unsigned char>(bytes[23]),
              200);
    EXPECT_THAT(error_of([&] { canvas.write_png(folder / "no/such.png"); }),
                HasSubstr("no/such.png"));
}

TEST(Pictures, DrawingBeyondTheEdgesIsHarmless) {
    Canvas canvas(50, 50);
    canvas.clip_to({10, 10, 200, 200});
    canvas.line({-1e12, 0.0}, {1e12, 1e12}, {});
    canvas.disc({-500.0, 1e9}, 5.0, {});
    canvas.speckle({{-1e9, 5.0}, {1e18, 5.0}, {20.0, 20.0}}, {});
    canvas.fill({-5, -5, 1000, 1000}, {1, 2, 3});
    StateGrid grid;
    grid.geometry = {0.1, {0.0, 0.0}, 3, 2};
    grid.states.assign(6, CellState::kFree);
    canvas.grid(grid, {-30.0, 45.0}, 20.0, {});
    canvas.grid(grid, {300.0, 45.0}, 0.01, {});
    EXPECT_EQ(canvas.width(), 50);
}

TEST(Pictures, SameInputGivesTheSameBytes) {
    const TempFolder folder;
    GraphPicture picture;
    picture.before = {Pose2d(), Pose2d(1.0, 0.0, 0.0), Pose2d(2.0, 1.0, 0.0)};
    picture.after = {Pose2d(), Pose2d(1.0, 0.0, 0.0), Pose2d(1.0, 1.0, 0.0)};
    picture.odometry = {{0, 1}, {1, 2}};
    Closure closure;
    closure.to = 2;
    closure.verdict = ClosureVerdict::kAccepted;
    Closure refused = closure;
    refused.verdict = ClosureVerdict::kOutlier;
    add_closures(picture, {closure, refused});
    EXPECT_EQ(picture.accepted.size(), 1U);
    EXPECT_EQ(picture.refused.size(), 1U);
    draw(picture).write_png(folder / "a.png");
    draw(picture).write_png(folder / "b.png");
    EXPECT_EQ(bytes_of(folder / "a.png"), bytes_of(folder / "b.png"));
    picture.accepted.clear();
    draw(picture).write_png(folder / "c.png");
    EXPECT_NE(bytes_of(folder / "a.png"), bytes_of(folder / "c.png"));
}

Trajectory line_to(double x) {
    return {{0.0, Pose2d()}, {1.0, Pose2d(0.5 * x, 1.0, 0.0)}, {2.0, Pose2d(x, 0.0, 0.0)}};
}

std::string bytes_as_png(const Canvas& canvas) {
    const TempFolder folder;
    canvas.write_png(folder / "canvas.png");
    return bytes_of(folder / "canvas.png");
}

TEST(Pictures, AWayThatLeavesDoesNotShrinkTheOthers) {
    PathsPicture picture;
    picture.title = "Ways";
    picture.truth = line_to(8.0);
    picture.points = {Point2(-1.0, -1.0), Point2(9.0, 3.0)};
    picture.paths = {{"right", {0, 0, 200}, line_to(8.0)}};
    const Canvas calm = draw(picture);
    picture.paths.push_back({"astray", {200, 0, 0}, line_to(1e7)});
    const Canvas wild = draw(picture);
    EXPECT_GE(wild.width(), calm.width());
    EXPECT_LE(wild.width(), 2000);
    EXPECT_NE(bytes_as_png(calm), bytes_as_png(wild));
    EXPECT_EQ(bytes_as_png(wild), bytes_as_png(draw(picture)));
    picture.truth.clear();
    picture.points.clear();
    picture.paths = {{"nothing", {}, {}}};
    EXPECT_LE(draw(picture).width(), 2000);
}

ErrorCurves curves_with(double error) {
    ErrorCurves picture;
    picture.title = "Errors";
    picture.curves = {{"small", {0, 0, 200}, {{0.0, 0.01, 0.01}, {9.0, 0.02, 0.0}}},
                      {"other", {200, 0, 0}, {{0.0, 0.0, 0.0}, {10.0, error, error}}}};
    picture.bands = {{-5.0, 2.0, "dark"}, {8.0, 99.0, "blurred"}};
    return picture;
}

TEST(Pictures, ErrorsOfAnySizeFitOntoTheirAxes) {
    for (const double error : {0.0, 1e-12, 0.3, 1e9, std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN()}) {
        const Canvas canvas = draw(curves_with(error));
        EXPECT_EQ(canvas.width(), 1500);
        EXPECT_LT(canvas.height(), 1300);
    }
    EXPECT_EQ(bytes_as_png(draw(curves_with(0.3))), bytes_as_png(draw(curves_with(0.3))));
    EXPECT_NE(bytes_as_png(draw(curves_with(0.3))), bytes_as_png(draw(curves_with(0.4))));
    ErrorCurves none;
    EXPECT_EQ(draw(none).width(), 1500);
}

}  // namespace
}  // namespace hybrid_slam::test
