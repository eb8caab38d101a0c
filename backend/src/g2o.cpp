// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/g2o.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "edge_cost.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

/// One apart; unsigned, since ids may be as far apart as a long can be.
bool successive(long a, long b) {
    const unsigned long gap = static_cast<unsigned long>(b) - static_cast<unsigned long>(a);
    return gap == 1 || gap + 1 == 0;
}

/// Reads record by record. Edges may come before their vertices, so ids are resolved at the end.
class Reader {
  public:
    explicit Reader(const std::filesystem::path& file) : name_(file.string()), text_(file) {}

    G2oFile read() {
        std::string line;
        while (text_.next(line)) {
            read_line(line);
        }
        if (text_.corrupt()) {
            refuse("the compressed file is torn or corrupt");
        }
        if (content_.graph.nodes.empty()) {
            throw Error(name_ + ": no VERTEX_SE2 in this file");
        }
        resolve();
        return std::move(content_);
    }

  private:
    struct PendingEdge {
        long from;
        long to;
        std::size_t line;
    };
    struct PendingNode {
        long id;
        std::size_t line;
    };

    [[noreturn]] void refuse(const std::string& why) const {
        throw Error(text_.where() + ": " + why);
    }

    void read_line(std::string_view line) {
        Tokens tokens(line);
        const std::string_view kind = tokens.next();
        if (kind.empty() || kind.front() == '#') {
            return;
        }
        if (kind == "VERTEX_SE2") {
            read_vertex(tokens);
        } else if (kind == "EDGE_SE2") {
            read_edge(tokens);
        } else if (kind == "EDGE_PRIOR_SE2") {
            read_prior(tokens);
        } else if (kind == "FIX") {
            read_fix(tokens);
        } else {
            ++content_.skipped_lines;
        }
    }

    void read_vertex(Tokens& tokens) {
        const long id = read_id(tokens);
        if (!index_of_id_.emplace(id, content_.ids.size()).second) {
            refuse(fmt::format("vertex {} is given twice", id));
        }
        content_.ids.push_back(id);
        content_.graph.nodes.push_back(read_pose(tokens));
        expect_end(tokens);
    }

    void read_edge(Tokens& tokens) {
        const long from = read_id(tokens);
        const long to = read_id(tokens);
        if (from == to) {
            refuse(fmt::format("an edge joins vertex {} to itself", from));
        }
        Edge edge;
        edge.from_from_to = read_pose(tokens);
        edge.information = read_information(tokens);
        edge.kind = successive(from, to) ? EdgeKind::kOdometry : EdgeKind::kClosure;
        expect_end(tokens);
        content_.graph.edges.push_back(edge);
        pending_edges_.push_back({from, to, text_.line_number()});
    }

    void read_prior(Tokens& tokens) {
        pending_priors_.push_back({read_id(tokens), text_.line_number()});
        Prior prior;
        prior.map_from_node = read_pose(tokens);
        prior.information = read_information(tokens);
        expect_end(tokens);
        content_.graph.priors.push_back(prior);
    }

    void read_fix(Tokens& tokens) {
        pending_fixed_.push_back({read_id(tokens), text_.line_number()});
        for (auto token = tokens.next(); !token.empty(); token = tokens.next()) {
            pending_fixed_.push_back({to_id(token), text_.line_number()});
        }
    }

    long read_id(Tokens& tokens) const { return to_id(tokens.next()); }

    long to_id(std::string_view token) const {
        long id = 0;
        if (!parse_long(token, id)) {
            refuse(fmt::format("'{}' is no id of a vertex", token));
        }
        return id;
    }

    double read_number(Tokens& tokens) const {
        const std::string_view token = tokens.next();
        double value = 0.0;
        if (!parse_double(token, value) || !std::isfinite(value)) {
            refuse(fmt::format("'{}' is no finite number", token));
        }
        return value;
    }

    Pose2d read_pose(Tokens& tokens) const {
        const double x = read_number(tokens);
        const double y = read_number(tokens);
        return {x, y, read_number(tokens)};
    }

    Eigen::Matrix3d read_information(Tokens& tokens) const {
        Eigen::Matrix3d information;
        for (int row = 0; row < 3; ++row) {
            for (int column = row; column < 3; ++column) {
                information(row, column) = information(column, row) = read_number(tokens);
            }
        }
        if (!is_semidefinite(information)) {
            refuse("the information matrix is not positive semidefinite");
        }
        return information;
    }

    void expect_end(Tokens& tokens) const {
        if (const std::string_view token = tokens.next(); !token.empty()) {
            refuse(fmt::format("'{}' is too much", token));
        }
    }

    std::size_t index_of(long id, std::size_t line) const {
        const auto found = index_of_id_.find(id);
        if (found == index_of_id_.end()) {
            throw Error(fmt::format("{}:{}: there is no vertex {}", name_, line, id));
        }
        return found->second;
    }

    void resolve() {
        for (std::size_t i = 0; i < pending_edges_.size(); ++i) {
            const PendingEdge& pending = pending_edges_[i];
            content_.graph.edges[i].from = index_of(pending.from, pending.line);
            content_.graph.edges[i].to = index_of(pending.to, pending.line);
        }
        for (std::size_t i = 0; i < pending_priors_.size(); ++i) {
            content_.graph.priors[i].node =
                index_of(pending_priors_[i].id, pending_priors_[i].line);
        }
        for (const PendingNode& pending : pending_fixed_) {
            content_.graph.fixed.push_back(index_of(pending.id, pending.line));
        }
    }

    std::string name_;
    TextFileReader text_;
    G2oFile content_;
    std::unordered_map<long, std::size_t> index_of_id_;
    std::vector<PendingEdge> pending_edges_;
    std::vector<PendingNode> pending_priors_;
    std::vector<PendingNode> pending_fixed_;
};

/// Formats records into one buffer; refuses what could not be read back.
class Writer {
  public:
    Writer(const std::filesystem::path& file, const PoseGraph& graph, const std::vector<long>& ids)
        : name_(file.string()), graph_(graph), ids_(ids) {
        if (!ids.empty() && ids.size() != graph.nodes.size()) {
            throw Error(
                fmt::format("{}: {} ids for {} nodes", name_, ids.size(), graph.nodes.size()));
        }
        if (std::unordered_set<long>(ids.begin(), ids.end()).size() != ids.size()) {
            throw Error(name_ + ": an id is given twice");
        }
    }

    fmt::memory_buffer text() {
        for (std::size_t node = 0; node < graph_.nodes.size(); ++node) {
            append("VERTEX_SE2 {}", id(node));
            append_pose(graph_.nodes[node]);
            append("\n");
        }
        for (const std::size_t node : graph_.fixed) {
            append("FIX {}\n", id(node));
        }
        for (const Prior& prior : graph_.priors) {
            append("EDGE_PRIOR_SE2 {}", id(prior.node));
            append_measurement(prior.map_from_node, prior.information);
        }
        for (const Edge& edge : graph_.edges) {
            append("EDGE_SE2 {} {}", id(edge.from), id(edge.to));
            append_measurement(edge.from_from_to, edge.information);
        }
        return std::move(buffer_);
    }

  private:
    long id(std::size_t node) const {
        if (node >= graph_.nodes.size()) {
            throw Error(
                fmt::format("{}: the graph names node {} of {}", name_, node, graph_.nodes.size()));
        }
        return ids_.empty() ? static_cast<long>(node) : ids_[node];
    }

    template <typename... Arguments>
    void append(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
        fmt::format_to(std::back_inserter(buffer_), format, std::forward<Arguments>(arguments)...);
    }

    void append_number(double number) {
        if (!std::isfinite(number)) {
            throw Error(name_ + ": the graph holds a number that is not finite");
        }
        append(" {}", number);  // the shortest decimal that reads back as the same double
    }

    void append_pose(const Pose2d& pose) {
        append_number(pose.x());
        append_number(pose.y());
        append_number(pose.heading);
    }

    void append_measurement(const Pose2d& pose, const Eigen::Matrix3d& information) {
        append_pose(pose);
        for (int row = 0; row < 3; ++row) {
            for (int column = row; column < 3; ++column) {
                append_number(information(row, column));
            }
        }
        append("\n");
    }

    std::string name_;
    const PoseGraph& graph_;
    const std::vector<long>& ids_;
    fmt::memory_buffer buffer_;
};

}  // namespace

G2oFile read_g2o(const std::filesystem::path& file) {
    return Reader(file).read();
}

void write_g2o(const std::filesystem::path& file, const PoseGraph& graph,
               const std::vector<long>& ids) {
    const fmt::memory_buffer text = Writer(file, graph, ids).text();
    TextFileWriter out(file);
    out.write({text.data(), text.size()});
    out.close();
}

}  // namespace hybrid_slam
