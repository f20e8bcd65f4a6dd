// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// Makes Ctrl-C (and SIGTERM) request a regular end with saved results. A second Ctrl-C ends the
/// program immediately.
void catch_interrupt();

/// Returns whether the user requested the end.
bool interrupted();

/// Lets the process go on when the reader of its output has gone, so that a run saves its results.
void survive_closed_outputs();

}  // namespace stillmap
