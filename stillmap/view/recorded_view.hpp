// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/view/topic_board.hpp"
#include "stillmap/warn/rules.hpp"

#include <filesystem>
#include <optional>

namespace stillmap {

/// Publishes the results of a finished run: cloud, path, keyframes, loops, tracks of the moving
/// objects, static objects, files for planners, and the summary, as far as the folder has them. The
/// images of the run are those of its recording.
/// @param run    folder of the results, of `stillmap dense` or `map changes`, or a saved map
///   (FILE.map), or a cloud (FILE.ply)
/// @param rules  whose zones, points and upward direction are shown; none: there are none
/// Throws Error if there is nothing to be shown, or if a file is damaged.
void publish_recorded_run(const std::filesystem::path& run,
                          const std::optional<WarningRules>& rules, TopicBoard& board);

}  // namespace stillmap
