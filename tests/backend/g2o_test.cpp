// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/g2o.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "graph_support.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::bytes_of;
using test::error_of;
using test::Random;
using test::TempFolder;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

const std::string kTwoVertices = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n";

G2oFile read_text(const std::string& text) {
    const TempFolder folder;
    return read_g2o(folder.write("graph.g2o", text));
}

std::string refusal_of(const std::string& text) {
    return error_of([&] { read_text(text); });
}

TEST(ReadG2o, TakesEveryKindOfRecord) {
    const G2oFile file = read_text(
        "# a comment\n"
        "VERTEX_SE2 10 1.5 -2 0.25\n"
        "\n"
        "VERTEX_SE2 11 2 3 4\r\n"
        "VERTEX_SE2 -7 0 0 0\n"
        "VERTEX_XY 20 1 2\n"
        "FIX 11 -7\n"
        "EDGE_SE2 10 11 1 2 3 11 12 13 22 23 33000\n"
        "EDGE_SE2 11 10 1 2 3 1 0 0 1 0 1\n"
        "EDGE_SE2 -7 11 1 2 3 1 0 0 1 0 1\n"
        "EDGE_PRIOR_SE2 11 7 8 9 1 0 0 2 0 3\n");
    EXPECT_THAT(file.ids, ElementsAre(10, 11, -7));
    EXPECT_EQ(file.skipped_lines, 1U);
    const PoseGraph& graph = file.graph;
    EXPECT_EQ(graph.nodes[0].vector(), Eigen::Vector3d(1.5, -2.0, 0.25));
    EXPECT_EQ(graph.nodes[1].heading, 4.0);  // as it is in the file
    EXPECT_THAT(graph.fixed, ElementsAre(1, 2));
    ASSERT_EQ(graph.edges.size(), 3U);
    Eigen::Matrix3d information;
    information << 11, 12, 13, 12, 22, 23, 13, 23, 33000;
    EXPECT_EQ(graph.edges[0].information, information);
    EXPECT_EQ(graph.edges[0].from_from_to.vector(), Eigen::Vector3d(1.0, 2.0, 3.0));
    EXPECT_EQ(graph.edges[2].from, 2U);
    EXPECT_EQ(graph.edges[2].to, 1U);
    EXPECT_EQ(graph.edges[0].kind, EdgeKind::kOdometry);
    EXPECT_EQ(graph.edges[1].kind, EdgeKind::kOdometry);
    EXPECT_EQ(graph.edges[2].kind, EdgeKind::kClosure);
    ASSERT_EQ(graph.priors.size(), 1U);
    EXPECT_EQ(graph.priors[0].node, 1U);
    EXPECT_EQ(graph.priors[0].map_from_node.vector(), Eigen::Vector3d(7.0, 8.0, 9.0));
    EXPECT_EQ(graph.priors[0].information.diagonal(), Eigen::Vector3d(1.0, 2.0, 3.0));
}

TEST(ReadG2o, TakesEdgesBeforeTheirVerticesAndTwice) {
    const std::string edge = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
    const G2oFile file = read_text("FIX 1\n" + edge + edge + kTwoVertices);
    ASSERT_EQ(file.graph.edges.size(), 2U);
    EXPECT_EQ(file.graph.edges[1].to, 1U);
    EXPECT_THAT(file.graph.fixed, ElementsAre(1));
}

TEST(ReadG2o, NamesTheLineOfABrokenRecord) {
    const std::string edge = kTwoVertices + "EDGE_SE2 0 1 1 0 0 ";
    EXPECT_THAT(refusal_of(kTwoVertices + "VERTEX_SE2 2 0 zero 0\n"),
                EndsWith("graph.g2o:3: 'zero' is no finite number"));
    EXPECT_THAT(refusal_of(kTwoVertices + "VERTEX_SE2 2 0 inf 0\n"), HasSubstr(":3: 'inf'"));
    EXPECT_THAT(refusal_of(kTwoVertices + "VERTEX_SE2 2 0 0\n"), HasSubstr(":3: ''"));
    EXPECT_THAT(refusal_of("VERTEX_SE2 2.5 0 0 0\n"), HasSubstr(":1: '2.5' is no id"));
    EXPECT_THAT(refusal_of(kTwoVertices + "VERTEX_SE2 1 0 0 0\n"),
                HasSubstr(":3: vertex 1 is given twice"));
    EXPECT_THAT(refusal_of(edge + "1 0 0 1 0\n"), HasSubstr(":3: ''"));
    EXPECT_THAT(refusal_of(edge + "1 0 0 1 0 1 1\n"), HasSubstr(":3: '1' is too much"));
    EXPECT_THAT(refusal_of(edge + "1 0 0 1 0 nan\n"), HasSubstr(":3: 'nan'"));
    EXPECT_THAT(refusal_of(edge + "1 2 0 1 0 1\n"), HasSubstr(":3: the information matrix"));
    EXPECT_THAT(refusal_of(kTwoVertices + "EDGE_SE2 1 1 1 0 0 1 0 0 1 0 1\n"),
                HasSubstr(":3: an edge joins vertex 1 to itself"));
}

TEST(ReadG2o, NamesTheLineThatNamesAnUnknownVertex) {
    EXPECT_THAT(refusal_of("EDGE_SE2 0 7 1 0 0 1 0 0 1 0 1\n" + kTwoVertices),
                EndsWith("graph.g2o:1: there is no vertex 7"));
    EXPECT_THAT(refusal_of(kTwoVertices + "\nEDGE_PRIOR_SE2 9 1 0 0 1 0 0 1 0 1\n"),
                HasSubstr(":4: there is no vertex 9"));
    EXPECT_THAT(refusal_of(kTwoVertices + "FIX 0 5\n"), HasSubstr(":3: there is no vertex 5"));
}

TEST(ReadG2o, RefusesAFileWithoutVertices) {
    EXPECT_THAT(refusal_of(""), HasSubstr("graph.g2o: no VERTEX_SE2"));
    EXPECT_THAT(refusal_of("VERTEX_XY 0 1 2\n"), HasSubstr("no VERTEX_SE2"));
    EXPECT_THAT(error_of([] { read_g2o("/nowhere/graph.g2o"); }), HasSubstr("/nowhere/graph.g2o"));
}

TEST(ReadG2o, RefusesATornGzip) {
    const TempFolder folder;
    write_g2o(folder / "whole.g2o.gz", test::random_graph(1, 200, 50));
    const std::string bytes = bytes_of(folder / "whole.g2o.gz");
    const auto torn = folder.write("torn.g2o.gz", bytes.substr(0, bytes.size() / 2));
    EXPECT_THAT(error_of([&] { read_g2o(torn); }), HasSubstr("torn.g2o.gz:"));
}

/// Doubles that a fixed number of digits would not bring back.
PoseGraph awkward_graph() {
    Random random(2);
    PoseGraph graph = test::random_graph(3, 50, 20);
    graph.nodes[1] = {1.0 / 3.0, -0.0, 7.0};
    graph.nodes[2] = {std::numeric_limits<double>::min(), 1e300, -kPi};
    graph.nodes[3] = {std::numeric_limits<double>::denorm_min(), 0.1 + 0.2, kPi};
    graph.fixed = {0, 17};
    for (const std::size_t node : {std::size_t{4}, std::size_t{4}, std::size_t{49}}) {
        graph.priors.push_back({node, random.pose(10.0), random.information()});
    }
    return graph;
}

void expect_same_bits(double found, double expected) {
    EXPECT_EQ(found, expected);
    EXPECT_EQ(std::signbit(found), std::signbit(expected));
}

void expect_same_bits(const Pose2d& found, const Pose2d& expected) {
    expect_same_bits(found.x(), expected.x());
    expect_same_bits(found.y(), expected.y());
    expect_same_bits(found.heading, expected.heading);
}

class G2oRoundTrip : public ::testing::TestWithParam<const char*> {};

TEST_P(G2oRoundTrip, GivesTheSameBitsBack) {
    const TempFolder folder;
    const PoseGraph graph = awkward_graph();
    write_g2o(folder / GetParam(), graph);
    const PoseGraph found = read_g2o(folder / GetParam()).graph;
    ASSERT_EQ(found.nodes.size(), graph.nodes.size());
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
        expect_same_bits(found.nodes[i], graph.nodes[i]);
    }
    ASSERT_EQ(found.edges.size(), graph.edges.size());
    for (std::size_t i = 0; i < graph.edges.size(); ++i) {
        EXPECT_EQ(found.edges[i].from, graph.edges[i].from);
        EXPECT_EQ(found.edges[i].to, graph.edges[i].to);
        EXPECT_EQ(found.edges[i].information, graph.edges[i].information);
        expect_same_bits(found.edges[i].from_from_to, graph.edges[i].from_from_to);
    }
    ASSERT_EQ(found.priors.size(), graph.priors.size());
    for (std::size_t i = 0; i < graph.priors.size(); ++i) {
        EXPECT_EQ(found.priors[i].node, graph.priors[i].node);
        EXPECT_EQ(found.priors[i].information, graph.priors[i].information);
        expect_same_bits(found.priors[i].map_from_node, graph.priors[i].map_from_node);
    }
    EXPECT_EQ(found.fixed, graph.fixed);
}

INSTANTIATE_TEST_SUITE_P(PlainAndGzip, G2oRoundTrip,
                         ::testing::Values("graph.g2o", "graph.g2o.gz"));

TEST(WriteG2o, KeepsTheIdsGiven) {
    const TempFolder folder;
    const std::string text = kTwoVertices + "VERTEX_SE2 40 -0.5 2 0.125\nFIX 40\n" +
                             "EDGE_PRIOR_SE2 1 1 2 3 4 0 0 5 0 6\n" +
                             "EDGE_SE2 40 0 1 0 0.5 1 0 0 1 0 1\n";
    const G2oFile file = read_g2o(folder.write("in.g2o", text));
    write_g2o(folder / "out.g2o", file.graph, file.ids);
    EXPECT_EQ(bytes_of(folder / "out.g2o"), text);
}

TEST(WriteG2o, RefusesWhatCouldNotBeReadBack) {
    const TempFolder folder;
    const auto refusal = [&](const PoseGraph& graph, const std::vector<long>& ids) {
        const std::string message = error_of([&] { write_g2o(folder / "bad.g2o", graph, ids); });
        EXPECT_FALSE(std::filesystem::exists(folder / "bad.g2o"));
        return message;
    };
    PoseGraph graph = test::random_graph(4, 4, 1);
    EXPECT_THAT(refusal(graph, {1, 2, 3}), HasSubstr("3 ids for 4 nodes"));
    EXPECT_THAT(refusal(graph, {1, 2, 3, 1}), HasSubstr("an id is given twice"));
    graph.edges[0].to = 4;
    EXPECT_THAT(refusal(graph, {}), HasSubstr("bad.g2o: the graph names node 4 of 4"));
    graph.edges[0].to = 1;
    graph.nodes[2].heading = std::nan("");
    EXPECT_THAT(refusal(graph, {}), HasSubstr("not finite"));
}

}  // namespace
}  // namespace hybrid_slam
