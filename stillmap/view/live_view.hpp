// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/labeled_cloud.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/report/run_sink.hpp"
#include "stillmap/view/cloud_chunks.hpp"
#include "stillmap/view/view_messages.hpp"
#include "stillmap/view/view_server.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stillmap {

/// Shows a run in progress. Messages are made on a thread of its own, of lower priority than
/// tracking, and only while a page is connected. The thread that pushes frames hands over the
/// newest frame and never waits.
class LiveView final : public RunSink {
 public:
  /// @param slam    must outlive this object
  /// @param name    name of the sequence
  /// @param frames  length of the sequence, if known
  /// @param hints   what is known of the ground
  LiveView(SlamSystem& slam, ViewServer& server, const std::string& name, const Camera& camera,
           std::optional<std::size_t> frames, GroundHints hints);

  void on_frame(SlamSystem& slam) override;
  /// Shows the results. Nothing may be added after it.
  void on_results(RunRecord& record) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct Task {
    FrameRecord record;
    std::optional<Pose> T_world_camera;
    LoadShedding shedding;
    TrackedFramePtr tracked;  // null while the thread is behind: no image is shown
  };
  struct Nothing {};

  /// Calls a function that shows something. If it throws, the view ends, and the run goes on.
  void guarded(const std::function<void()>& show);
  void work(const Task& task);
  void show_frame(const Task& task);
  void show_image(const TrackedFrame& tracked);
  void show_map();
  void publish_results(const SlamResult& result);
  const Ground& ground_of(const Trajectory& trajectory, const Cloud& cloud);

  SlamSystem& slam_;
  ViewServer& server_;
  TopicBoard& board_;
  const GroundHints hints_;
  // Used by the stage's thread until show_results().
  std::vector<PathFrame> states_;              // without poses
  std::size_t tracked_ = 0;                    // number of frames with a pose
  std::shared_ptr<const LabeledCloud> cloud_;  // shown last; null before
  CloudChunks chunks_;
  std::optional<Ground> ground_;   // none before the first state of the map
  std::size_t ground_points_ = 0;  // number of points of the cloud that it was searched in
  bool failed_ = false;            // whether the view has ended
  std::size_t connected_ = 0;      // number of pages that had connected at the last frame
  Clock::time_point next_image_, next_map_;
  Stage<Task, Nothing> stage_;  // last: its thread uses the above
};

}  // namespace stillmap
