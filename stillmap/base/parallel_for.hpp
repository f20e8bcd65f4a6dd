// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace stillmap {

/// Returns the number of threads that this computer runs at once, at least 1.
inline int all_threads() {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Calls a worker for every index below `count`, on several threads. The order of the calls is
/// open, so a result must not depend on it. The calls must not throw.
/// @param threads     number of threads, the caller's included; less than 2: the caller's alone
/// @param make_worker called once per thread; its result is called with the indices, so that it can
///                    own buffers
template <typename MakeWorker>
void parallel_for(std::size_t count, int threads, const MakeWorker& make_worker) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    auto worker = make_worker();
    for (std::size_t i = next++; i < count; i = next++) worker(i);
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < std::min(threads, static_cast<int>(count)); ++i) helpers.emplace_back(work);
  work();
}

/// Calls `work(i)` for every index below `count`; a thread takes the indices of one remainder, the
/// same in every call, so that what it adds to again and again stays in the cache of its core.
template <typename Work>
void parallel_lanes(std::size_t count, int threads, const Work& work) {
  const auto lanes = static_cast<std::size_t>(std::max(1, threads));
  const auto take = [&](std::size_t lane) {
    for (std::size_t i = lane; i < count; i += lanes) work(i);
  };
  parallel_for(lanes, threads, [&] { return take; });
}

}  // namespace stillmap
