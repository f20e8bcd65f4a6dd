// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/parallel_for.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(ParallelFor, CallsEveryIndexOnce) {
  for (const int threads : {0, 1, 2, 7}) {
    for (const std::size_t count : {0U, 1U, 5U, 1000U}) {
      std::vector<int> calls(count, 0);
      parallel_for(count, threads, [&] { return [&](std::size_t i) { ++calls[i]; }; });
      EXPECT_EQ(std::count(calls.begin(), calls.end(), 1), static_cast<std::ptrdiff_t>(count))
          << threads;
    }
  }
}

TEST(ParallelLanes, CallEveryIndexOnce) {
  for (const int threads : {0, 1, 2, 7}) {
    std::vector<int> calls(100, 0);
    parallel_lanes(calls.size(), threads, [&](std::size_t i) { ++calls[i]; });
    EXPECT_EQ(std::count(calls.begin(), calls.end(), 1), 100) << threads;
  }
}

TEST(ParallelFor, MakesNoMoreWorkersThanThreads) {
  std::atomic<int> workers{0};
  parallel_for(100, 3, [&] {
    ++workers;
    return [](std::size_t) {};
  });
  EXPECT_LE(workers, 3);
}

}  // namespace
}  // namespace stillmap
