// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/stage.hpp"

#include <algorithm>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#ifdef __linux__
#include <sched.h>
#include <sys/resource.h>
#endif

namespace stillmap {
namespace {

using IntStage = Stage<int, int>;

TEST(Stage, WorksInOrderAndPublishesAnyNumberOfOutputs) {
  IntStage stage(4, WhenFull::kBlock, [](int n, const auto& publish) {
    for (int i = 0; i < n; ++i) publish(10 * n + i);
  });
  for (const int n : {1, 0, 3}) stage.push(n);
  std::vector<int> outputs;
  while (const auto output = stage.pop()) outputs.push_back(*output);
  EXPECT_EQ(outputs, (std::vector<int>{10, 30, 31, 32}));
}

TEST(Stage, BlocksWhenFullAndLosesNothing) {
  IntStage stage(1, WhenFull::kBlock, [](int n, const auto& publish) { publish(n); });
  for (int n = 0; n < 500; ++n) EXPECT_TRUE(stage.push(n));
  stage.drain();
  for (int n = 0; n < 500; ++n) EXPECT_EQ(stage.pop(), n);
  EXPECT_EQ(stage.pop(), std::nullopt);
  EXPECT_EQ(stage.dropped(), 0U);
}

TEST(Stage, DropsWhenFullAndCounts) {
  std::promise<void> open;
  auto gate = open.get_future().share();
  std::promise<void> begun;
  IntStage stage(1, WhenFull::kDrop, [&](int n, const auto& publish) {
    if (n == 0) begun.set_value();
    gate.wait();
    publish(n);
  });
  EXPECT_TRUE(stage.push(0));
  begun.get_future().wait();  // 0 is being worked on, the queue is empty
  EXPECT_TRUE(stage.push(1));
  EXPECT_FALSE(stage.push(2));
  EXPECT_EQ(stage.dropped(), 1U);
  EXPECT_EQ(stage.try_pop(), std::nullopt);
  open.set_value();
  EXPECT_EQ(stage.pop(), 0);
  EXPECT_EQ(stage.pop(), 1);
  EXPECT_EQ(stage.pop(), std::nullopt);
}

/// Other threads query a number that only the stage's thread changes; the thread sanitizer would
/// report a race.
TEST(Stage, AnswersQuestionsOnItsThreadBetweenTwoInputs) {
  int sum = 0;
  bool working = false;
  IntStage stage(4, WhenFull::kBlock, [&](int n, const auto&) {
    working = true;
    sum += n;
    working = false;
  });
  std::vector<int> answers;
  bool between = true;
  std::thread asker([&] {
    for (int i = 0; i < 100; ++i) {
      answers.push_back(stage
                            .ask([&] {
                              between &= !working;
                              return sum;
                            })
                            .get());
    }
  });
  for (int n = 1; n <= 100; ++n) stage.push(n);
  asker.join();
  stage.drain();
  EXPECT_TRUE(between);
  EXPECT_TRUE(std::is_sorted(answers.begin(), answers.end()));
  EXPECT_EQ(stage.ask([&] { return sum; }).get(), 5050);
}

TEST(Stage, AQuestionsErrorComesWithItsAnswerAndTheStageGoesOn) {
  IntStage stage(4, WhenFull::kBlock, [](int n, const auto& publish) { publish(n); });
  auto answer = stage.ask([]() -> int { throw std::runtime_error("no answer"); });
  EXPECT_THROW(answer.get(), std::runtime_error);
  stage.push(1);
  EXPECT_EQ(stage.pop(), 1);
}

TEST(Stage, IsTracedWhereItsMakerIs) {
  Trace trace;
  const TraceBinding binding(&trace.add_track("camera"));
  std::promise<void> begun;
  IntStage stage(
      4, WhenFull::kBlock,
      [&](int n, const auto& publish) {
        begun.get_future().wait();
        const TraceScope scope("work");
        publish(n);
      },
      "doubling");
  stage.push(1);
  std::thread starter([&] {  // once the caller waits
    while (trace.tracks().front().spans().empty()) std::this_thread::yield();
    begun.set_value();
  });
  stage.drain();
  starter.join();
  ASSERT_EQ(trace.tracks().size(), 2U);
  const TraceTrack &camera = trace.tracks()[0], &own = trace.tracks()[1];
  EXPECT_EQ(own.name(), "doubling");
  ASSERT_EQ(own.spans().size(), 1U);
  EXPECT_EQ(own.spans()[0].name, "work");
  ASSERT_EQ(camera.spans().size(), 1U);
  EXPECT_EQ(camera.spans()[0].name, "waiting for doubling");
  ASSERT_EQ(own.counts().size() + camera.counts().size(), 2U);
  EXPECT_EQ(camera.counts()[0].value, 1) << "pushed";
  EXPECT_EQ(own.counts()[0].value, 0) << "taken";
}

TEST(Stage, AnExceptionOfTheWorkReachesTheCallerAndTheStageContinues) {
  IntStage stage(4, WhenFull::kBlock, [](int n, const auto& publish) {
    if (n < 0) throw std::runtime_error("negative");
    publish(n);
  });
  stage.push(-1);
  EXPECT_THROW(stage.drain(), std::runtime_error);
  stage.push(5);
  EXPECT_EQ(stage.pop(), 5);
}

TEST(Stage, EndsWithoutWorkingOffTheQueue) {
  int worked = 0;
  {
    std::promise<void> begun;
    Stage<int, int> stage(8, WhenFull::kBlock, [&](int n, const auto&) {
      if (n == 0) begun.set_value();
      ++worked;
    });
    stage.push(0);
    begun.get_future().wait();
  }
  EXPECT_EQ(worked, 1);
}

#ifdef __linux__
/// Returns the nice value and the scheduling policy of the calling thread.
std::pair<int, int> priority_and_policy() {
  return {getpriority(PRIO_PROCESS, 0), sched_getscheduler(0)};
}

TEST(Stage, RunsWithItsPriority) {
  const auto before = priority_and_policy();
  const auto inside = [](ThreadPriority priority) {
    std::pair<int, int> seen;
    IntStage stage(
        1, WhenFull::kBlock, [&](int, const auto&) { seen = priority_and_policy(); }, "stage",
        priority);
    stage.push(0);
    stage.drain();
    return seen;
  };
  const auto nice = [&](int more) { return std::min(before.first + more, 19); };
  EXPECT_EQ(inside(ThreadPriority::kNone), before);
  EXPECT_EQ(inside(ThreadPriority::kMap).first, nice(5));
  EXPECT_EQ(inside(ThreadPriority::kBackground).first, nice(10));
  EXPECT_EQ(inside(ThreadPriority::kIdle).second, SCHED_IDLE);
  EXPECT_EQ(priority_and_policy(), before) << "the caller's thread stays as it was";
}
#endif

}  // namespace
}  // namespace stillmap
