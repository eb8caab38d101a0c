// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/link/link_client.hpp"
#include "hybrid_slam/link/link_server.hpp"

namespace hybrid_slam {
namespace {

constexpr int kMostLineBytes = 65536;

}  // namespace

void describe(ConfigSchema& schema, LinkServerConfig& config) {
    schema.add("listen", config.listen, "host:port; without a host only this computer can connect");
    schema.add("token", config.token, "secret that clients must show; empty: none");
    schema.add("most_clients", config.most_clients, 1, 1000, "at the same time");
    schema.add("line_bytes", config.line_bytes, 1024, kMostLineBytes, "of the longest line");
    schema.add("lines_per_second", config.lines_per_second, 1, 10000, "of one client");
    schema.add("refusals", config.refusals, 1, 1000, "lines refused before a client is closed");
    schema.add("hello_timeout", config.hello_timeout, 0.01, 60.0,
               "s that a connection may be silent at first");
}

void describe(ConfigSchema& schema, LinkClientConfig& config) {
    schema.add("server", config.server, "tcp://host:port");
    schema.add("token", config.token, "secret of the server; empty: none");
    schema.add("name", config.name, "shown at the server");
    schema.add("retry_least", config.retry_least, 0.01, 60.0, "s before a first new attempt");
    schema.add("retry_most", config.retry_most, 0.01, 600.0, "s between later ones");
    schema.add("patience", config.patience, 0.1, 60.0, "s for the connection and the welcome");
    schema.add("stale_after", config.stale_after, 0.01, 10.0,
               "s; a pose that waited longer is not sent");
}

}  // namespace hybrid_slam
