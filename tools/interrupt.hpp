// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hybrid_slam::tools {

/// From now on the first Ctrl-C (SIGINT), SIGTERM or SIGHUP only sets a flag; a second one ends the
/// process.
void catch_interrupts();

/// Whether such a signal has come.
bool interrupted();

}  // namespace hybrid_slam::tools
