// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::bytes_of;
using test::error_of;
using test::TempFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr CellState kFree = CellState::kFree;
constexpr CellState kOccupied = CellState::kOccupied;
constexpr CellState kUnknown = CellState::kUnknown;

const std::string kYaml =
    "image: map.pgm\nresolution: 0.05\norigin: [-1, 2.5, 0]\nnegate: 0\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.196\n";
const std::string kPixels("\x00\xcd\xfe\xfe\x00\xcd", 6);  // 3 x 2, from the top

StateGrid small_grid() {
    StateGrid grid;
    grid.geometry.resolution = 0.05;
    grid.geometry.origin = {-1.0, 2.5};
    grid.geometry.width = 3;
    grid.geometry.height = 2;
    grid.states = {kFree, kOccupied, kUnknown, kOccupied, kUnknown, kFree};
    return grid;
}

struct MapServer : ::testing::Test {
    StateGrid read(const std::string& yaml, const std::string& image) {
        folder.write("map.pgm", image);
        return read_map_server(folder.write("map.yaml", yaml));
    }
    std::string read_error(const std::string& yaml, const std::string& image) {
        return error_of([&] { read(yaml, image); });
    }
    static std::string with(std::string yaml, const std::string& from, const std::string& to) {
        const auto at = yaml.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        return yaml.replace(at, from.size(), to);
    }

    TempFolder folder;
    const std::string pgm = "P5\n3 2\n255\n" + kPixels;
};

TEST_F(MapServer, WritesTheExactBytes) {
    write_map_server(folder / "map.yaml", small_grid());
    EXPECT_EQ(bytes_of(folder / "map.yaml"), kYaml);
    EXPECT_EQ(bytes_of(folder / "map.pgm"),
              "P5\n# CREATOR: hybrid_slam 0.050 m/pix\n3 2\n255\n" + kPixels);
}

TEST_F(MapServer, RoundTripIsExact) {
    std::mt19937 random(16);
    StateGrid grid;
    grid.geometry.resolution = 0.1 / 3.0;
    grid.geometry.origin = {-12.3456789012345, 1.0 / 7.0};
    grid.geometry.width = 37;
    grid.geometry.height = 23;
    grid.origin_yaw = 0.1;
    for (int i = 0; i < 37 * 23; ++i) {
        grid.states.push_back(static_cast<CellState>(random() % 3));
    }
    write_map_server(folder / "a map: #1.yaml", grid);
    const StateGrid back = read_map_server(folder / "a map: #1.yaml");
    EXPECT_EQ(back.geometry.resolution, grid.geometry.resolution);
    EXPECT_EQ(back.geometry.origin, grid.geometry.origin);
    EXPECT_EQ(back.geometry.width, 37);
    EXPECT_EQ(back.geometry.height, 23);
    EXPECT_EQ(back.origin_yaw, 0.1);
    EXPECT_EQ(back.states, grid.states);
}

TEST_F(MapServer, TheTopRowOfTheImageIsTheTopOfTheMap) {
    const StateGrid grid = read(kYaml, pgm);
    EXPECT_THAT(grid.states, ElementsAre(kFree, kOccupied, kUnknown, kOccupied, kUnknown, kFree));
    EXPECT_EQ(grid.at({0, 1}), kOccupied);
    EXPECT_EQ(grid.geometry.origin, Point2(-1.0, 2.5));
}

TEST_F(MapServer, ReadsWhatNav2Writes) {
    const StateGrid grid = read(
        "image: map.pgm\nmode: trinary\nresolution: 0.05\norigin: [-1, 2.5, 0]\n"
        "negate: false\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        pgm);
    EXPECT_EQ(grid.states, small_grid().states);
    EXPECT_EQ(read(kYaml + "mode: Scale\n", pgm).states, small_grid().states);
}

TEST_F(MapServer, ReadsCommentsAndOddBlanksInTheHeader) {
    for (const char* header :
         {"P5\n# CREATOR: map_saver.cpp 0.050 m/pix\n3 2\n255\n", "P5 3 2 255 ",
          "P5\t3\r\n2\n255\n", "P5\n3 # wide\n2\n# c\n#\n255\n", "P5#c\n3 2 255\n"}) {
        EXPECT_EQ(read(kYaml, header + kPixels).states, small_grid().states) << header;
    }
}

TEST_F(MapServer, PixelsThatLookLikeBlanksOrCommentsArePixels) {
    const StateGrid grid = read(kYaml, "P5\n3 2\n255\n" + std::string("\n# \n#\t"));
    EXPECT_EQ(grid.states, std::vector<CellState>(6, kOccupied));
}

TEST_F(MapServer, NegateTurnsBlackAndWhiteRound) {
    for (const char* value : {"1", "true"}) {
        const StateGrid grid = read(with(kYaml, "negate: 0", std::string("negate: ") + value), pgm);
        // 254 is occupied, 0 free, and 205 is 0.80: occupied.
        EXPECT_THAT(grid.states,
                    ElementsAre(kOccupied, kFree, kOccupied, kFree, kOccupied, kOccupied));
    }
}

TEST_F(MapServer, ThresholdsAreStrict) {
    const std::string exact =
        with(with(kYaml, "0.65", "0.8"), "free_thresh: 0.196", "free_thresh: 0.2");
    // 51 is 0.8, 50 above; 204 is 0.2, 205 below.
    const std::string pixels("\x33\x32\xcc\xcd\x80\xff", 6);
    EXPECT_THAT(read(exact, "P5\n6 1\n255\n" + pixels).states,
                ElementsAre(kUnknown, kOccupied, kUnknown, kFree, kUnknown, kFree));
}

TEST_F(MapServer, ASmallerMaximumIsWhite) {
    const std::string pixels("\x00\x64\x32", 3);
    EXPECT_THAT(read(kYaml, "P5\n3 1\n100\n" + pixels).states,
                ElementsAre(kOccupied, kFree, kUnknown));
}

TEST_F(MapServer, TheImageIsBesideTheYamlUnlessAbsolute) {
    std::filesystem::create_directories(folder / "in");
    folder.write("in/deep.pgm", pgm);
    EXPECT_EQ(read_map_server(folder.write("a.yaml", with(kYaml, "map.pgm", "in/deep.pgm"))).states,
              small_grid().states);
    const std::string absolute = (folder / "in/deep.pgm").string();
    EXPECT_EQ(read_map_server(folder.write("in/b.yaml", with(kYaml, "map.pgm", absolute))).states,
              small_grid().states);
}

TEST_F(MapServer, NamesTheKeyThatIsMissing) {
    for (const std::string key :
         {"image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"}) {
        EXPECT_EQ(read_error(with(kYaml, key + ":", "x_" + key + ":"), pgm),
                  (folder / "map.yaml").string() + ": key '" + key + "' is missing");
    }
}

TEST_F(MapServer, NamesTheKeyThatIsWrong) {
    const auto error = [this](const std::string& from, const std::string& to) {
        return read_error(with(kYaml, from, to), pgm);
    };
    EXPECT_EQ(error("0.05", "wide"), (folder / "map.yaml").string() +
                                         ":2: key 'resolution': must be a number, not 'wide'");
    for (const char* value : {"0", "-0.05"}) {
        EXPECT_THAT(error("0.05", value), HasSubstr(":2: key 'resolution': must be above 0"));
    }
    EXPECT_THAT(error("0.05", "nan"), HasSubstr("key 'resolution': must be a number"));
    EXPECT_THAT(error("0.05", "[1]"), HasSubstr("key 'resolution': needs a single value"));
    EXPECT_THAT(error("[-1, 2.5, 0]", "[-1, 2.5]"), HasSubstr("key 'origin': must be a list of 3"));
    EXPECT_THAT(error("[-1, 2.5, 0]", "[-1, x, 0]"), HasSubstr("key 'origin': must be a number"));
    EXPECT_THAT(error("negate: 0", "negate: 2"), HasSubstr("key 'negate': must be 0 or 1"));
    EXPECT_THAT(error("0.65", "0.1"), HasSubstr("key 'free_thresh'"));
    EXPECT_THAT(error("0.65", "1.1"), HasSubstr("key 'free_thresh'"));
    EXPECT_THAT(error("0.196", "-0.1"), HasSubstr("key 'free_thresh'"));
    EXPECT_THAT(read_error(kYaml + "mode: raw\n", pgm), HasSubstr(":7: key 'mode': must be"));
    EXPECT_THAT(read_error("image: [", pgm), HasSubstr("map.yaml:"));
    EXPECT_THAT(read_error("words", pgm), HasSubstr("must hold lines like"));
    EXPECT_THAT(read_error("", pgm), HasSubstr("must hold lines like"));
}

TEST_F(MapServer, RefusesBrokenImages) {
    const std::vector<std::pair<std::string, std::string>> cases{
        {"", "is not a binary PGM"},
        {"P2\n1 1\n255\n0", "is not a binary PGM"},
        {"\x89PNG\r\n", "is not a binary PGM"},
        {"P5", "no width"},
        {"P5\n3", "no height"},
        {"P5\n3 2", "no maximum"},
        {"P5\n3 x\n255\n", "no height"},
        {"P5\n-3 2\n255\n", "no width"},
        {"P5\n99999999999999999999 2\n255\n", "no width"},
        {"P5 # a comment without an end", "no width"},
        {"P5\n0 2\n255\n", "has no pixels: it is 0 x 2"},
        {"P5\n3 0\n255\n", "has no pixels"},
        {"P5\n100000 100000\n255\n", "is too large: 100000 x 100000"},
        {"P5\n9223372036854775807 9223372036854775807\n255\n", "is too large"},
        {"P5\n3 2\n65535\n" + kPixels + kPixels, "pixels of one byte, its maximum is 65535"},
        {"P5\n3 2\n0\n" + kPixels, "pixels of one byte"},
        {"P5\n3 2\n255", "is truncated: holds 0 of 6 pixels"},
        {"P5\n3 2\n255\n12345", "is truncated: holds 5 of 6 pixels"},
        {"P5\n16384 16384\n255\n", "is truncated: holds 0 of 268435456"}};
    for (const auto& [bytes, what] : cases) {
        const std::string message = read_error(kYaml, bytes);
        EXPECT_THAT(message, HasSubstr((folder / "map.pgm").string())) << bytes;
        EXPECT_THAT(message, HasSubstr(what)) << bytes;
    }
}

TEST_F(MapServer, EveryTruncationIsRefused) {
    for (std::size_t length = 0; length < pgm.size(); ++length) {
        EXPECT_THROW(read(kYaml, pgm.substr(0, length)), Error) << length;
    }
    EXPECT_NO_THROW(read(kYaml, pgm + "more"));
}

TEST_F(MapServer, NamesTheFileThatIsMissing) {
    EXPECT_THAT(error_of([&] { read_map_server(folder / "no.yaml"); }),
                HasSubstr("no.yaml: No such file"));
    EXPECT_THAT(error_of([&] { read_map_server(folder.write("map.yaml", kYaml)); }),
                HasSubstr("map.pgm: No such file"));
    EXPECT_THAT(
        error_of([&] { read_map_server(folder.write("map.yaml", with(kYaml, "map.pgm", "''"))); }),
        HasSubstr("Is a directory"));
}

TEST_F(MapServer, RefusesToWriteWhatIsNoMap) {
    StateGrid grid = small_grid();
    grid.states.pop_back();
    EXPECT_THAT(error_of([&] { write_map_server(folder / "map.yaml", grid); }),
                HasSubstr("a map of 3 x 2 cells with 5 states"));
    EXPECT_THROW(write_map_server(folder / "map.yaml", StateGrid()), Error);
    EXPECT_THROW(write_map_server(folder / "no/map.yaml", small_grid()), Error);
    EXPECT_FALSE(std::filesystem::exists(folder / "map.yaml"));
}

}  // namespace
}  // namespace hybrid_slam
