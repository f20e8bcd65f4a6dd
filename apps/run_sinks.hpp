// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/result_folder.hpp"
#include "stillmap/report/run_sink.hpp"
#include "stillmap/view/view_server.hpp"

#include <memory>
#include <vector>

#include "run_session.hpp"

namespace stillmap {

using RunSinks = std::vector<std::unique_ptr<RunSink>>;

/// Returns the outputs of a session that need its single frames.
/// @param slam    must outlive them
/// @param folder  of the session's results, likewise
/// @param server  shows the run, likewise; null: it is not shown
/// @param has_network  whether there are masks to come
RunSinks sinks_of(const Session& session, SlamSystem& slam, ResultFolder& folder,
                  ViewServer* server, bool has_network);

}  // namespace stillmap
