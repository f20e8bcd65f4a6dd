// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/report/run_record.hpp"

namespace stillmap {

/// An output of a run that needs its single frames, such as a file that is written line by line or
/// a view. All calls come from the thread that pushes the frames.
class RunSink {
 public:
  virtual ~RunSink() = default;
  /// Called after each SlamSystem::push(), whose result is slam.newest().
  virtual void on_frame(SlamSystem& slam) = 0;
  /// Called when no more frames come, before SlamSystem::finish().
  virtual void on_last_frame(RunRecord& /*record*/) {}
  /// Called in place of on_last_frame() and on_results() if the run fails.
  virtual void on_failure() {}
  /// Called with the results, before the files of the record are written.
  virtual void on_results(RunRecord& /*record*/) {}
};

}  // namespace stillmap
