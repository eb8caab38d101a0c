// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hybrid_slam::tools {

/// From now on the first Ctrl-C (SIGINT), SIGTERM or SIGHUP only sets a flag; a second one of the
/// former two ends the process, unless it comes within `grace` whole seconds: shells and terminals
/// that close send theirs at once. SIGPIPE is an error of a write.
void catch_interrupts(int grace = 0);

/// Whether such a signal has come.
bool interrupted();

}  // namespace hybrid_slam::tools
