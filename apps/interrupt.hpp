// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// Makes Ctrl-C (and SIGTERM) request a regular end with saved results. A second Ctrl-C ends the
/// program immediately.
void catch_interrupt();

/// Returns whether the user requested the end.
bool interrupted();

/// Lets the process go on when the reader of its output has gone or a file has the largest allowed
/// size, so that a run saves its results.
void survive_failed_outputs();

}  // namespace stillmap
