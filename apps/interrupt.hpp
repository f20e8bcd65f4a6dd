// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// From here on Ctrl-C (and a polite kill) only asks to end: the work in hand is saved. A second
/// Ctrl-C ends the program at once.
void catch_interrupt();

/// Whether the user has asked to end.
bool interrupted();

}  // namespace stillmap
