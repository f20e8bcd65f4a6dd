// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/journal_file.hpp"
#include "stillmap/pipeline/journal_entries.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/pipeline/stage.hpp"

#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <set>
#include <string>
#include <vector>

namespace stillmap {

/// What a journal tells of a run in addition to its results.
struct JournalHeading {
  std::string writer;    ///< Name and version of the program.
  std::string sequence;  ///< Name of the sequence.
  std::string machine;   ///< See machine_description().
  std::string options;   ///< All options as YAML: see options_yaml().
};

/// Keeps the results of a run in a file while it runs, so that a process that is killed loses at
/// most its last second: recovered_run() reads them. Twice per second each thread of the system is
/// asked for its changes, between two of its tasks; a thread compresses and writes them. The
/// results of the run do not depend on it.
class RunJournal {
 public:
  /// Creates the file. Throws Error.
  /// @param slam    must outlive the journal
  /// @param period  time between two records
  /// @param compact_at  size of the file from which outdated entries are removed [bytes]
  RunJournal(SlamSystem& slam, const std::filesystem::path& file, const JournalHeading& heading,
             std::chrono::milliseconds period = std::chrono::milliseconds(500),
             std::uint64_t compact_at = 64U << 20);

  ~RunJournal();
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;

  /// Called after each SlamSystem::push(). If the file cannot be written any more (disk full), this
  /// is told once as a warning, and the run goes on without a journal.
  void add_newest();

  /// Writes the state after the frame pushed last, and waits until it is written.
  void flush();

 private:
  using Clock = std::chrono::steady_clock;

  /// The part of the results that one thread of the system knows.
  struct Part {
    std::function<std::future<void>(JournalPart&)> ask;  // collects the changes on that thread
    JournalPart entries;                                 // used by that thread while it is asked
    std::future<void> answer;                            // valid while a request is pending
    Clock::time_point next;                              // time of the next request
  };

  void update(Part& part);
  std::size_t write_answer(Part& part);
  void put_frames(JournalPart& part);

  SlamSystem& slam_;
  const std::chrono::milliseconds period_;
  std::size_t settled_ = 0;  // number of frames whose records do not change any more
  // Index of the first frame whose samples of movers may be new; used by the movers' thread.
  std::size_t samples_from_ = 0;
  DepthErrorPtr depth_error_;           // see put_map(); used by the map's thread
  std::set<std::uint64_t> unfinished_;  // views that were not final when they were written
  std::array<Part, 4> parts_;
  Stage<std::string, int> writer_;  // last: its thread writes the records
};

}  // namespace stillmap
