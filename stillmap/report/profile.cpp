// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/profile.hpp"

#include "stillmap/base/json_text.hpp"
#include "stillmap/evaluate/statistics.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

double milliseconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-6; }

/// All calls of one function by one caller.
struct Called {
  std::string_view name;
  int depth = 0;
  std::vector<std::size_t> callees;
  std::vector<double> wall;              // wall time of each call [ms]
  std::int64_t cpu = 0, in_callees = 0;  // CPU time, and that of the callees [ns]
};

/// Tree of the calls on one track; the first node is the thread itself.
class CallTree {
 public:
  explicit CallTree(const TraceTrack& track) : nodes_(1), node_of_(track.spans().size()) {
    for (std::size_t i = 0; i < track.spans().size(); ++i) add(track.spans()[i], i);
  }

  std::vector<ProfileRow> rows() const {
    std::vector<ProfileRow> rows;
    for (const std::size_t node : nodes_.front().callees) append(node, rows);
    return rows;
  }

 private:
  void add(const TraceSpan& span, std::size_t index) {
    const std::size_t caller =
        span.parent < 0 ? 0 : node_of_[static_cast<std::size_t>(span.parent)];
    const std::size_t node = callee(caller, span.name);
    node_of_[index] = node;
    if (span.wall < 0) return;
    nodes_[node].wall.push_back(milliseconds(span.wall));
    nodes_[node].cpu += span.cpu;
    nodes_[caller].in_callees += span.cpu;
  }

  std::size_t callee(std::size_t caller, std::string_view name) {
    for (const std::size_t node : nodes_[caller].callees)
      if (nodes_[node].name == name) return node;
    Called& made = nodes_.emplace_back();
    made.name = name;
    made.depth = caller == 0 ? 0 : nodes_[caller].depth + 1;
    nodes_[caller].callees.push_back(nodes_.size() - 1);
    return nodes_.size() - 1;
  }

  void append(std::size_t node, std::vector<ProfileRow>& rows) const {
    const Called& called = nodes_[node];
    if (!called.wall.empty()) {
      rows.push_back(
          {.name = std::string(called.name),
           .depth = called.depth,
           .calls = called.wall.size(),
           .median = quantile(called.wall, 0.5),
           .p95 = quantile(called.wall, 0.95),
           .max = *std::max_element(called.wall.begin(), called.wall.end()),
           .total = std::accumulate(called.wall.begin(), called.wall.end(), 0.0),
           .cpu = milliseconds(called.cpu),
           .cpu_self = milliseconds(std::max<std::int64_t>(0, called.cpu - called.in_callees))});
    }
    for (const std::size_t callee : called.callees) append(callee, rows);
  }

  std::vector<Called> nodes_;
  std::vector<std::size_t> node_of_;  // node of each span
};

ThreadProfile profile_of(const TraceTrack& track) {
  ThreadProfile thread;
  thread.name = track.name();
  thread.left_out = track.left_out();
  thread.rows = CallTree(track).rows();
  for (const ProfileRow& row : thread.rows) thread.cpu += row.depth == 0 ? row.cpu : 0;
  return thread;
}

/// Returns the time from the first span to the end of the last one [s].
double duration_of(const Trace& trace) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max(), last = 0;
  for (const TraceTrack& track : trace.tracks()) {
    for (const TraceSpan& span : track.spans()) {
      first = std::min(first, span.begin);
      last = std::max(last, span.begin + span.wall);
    }
  }
  return std::max(0.0, 1e-9 * static_cast<double>(last - first));
}

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

std::string cpu_of_others(const Profile& profile) {
  return fmt::format("other threads and code outside of spans: {:.2f} s of {:.2f} s CPU\n",
                     (profile.process_cpu - profile.cpu()) / 1000, profile.process_cpu / 1000);
}

/// CPU time of one function without its callees, summed over all callers [ms].
struct SelfTime {
  std::string thread, name;
  double cpu = 0;
};

std::vector<SelfTime> by_self_time(const Profile& profile) {
  std::map<std::pair<std::string, std::string>, double> sums;
  for (const ThreadProfile& thread : profile.threads) {
    for (const ProfileRow& row : thread.rows) sums[{thread.name, row.name}] += row.cpu_self;
  }
  std::vector<SelfTime> sorted;
  for (const auto& [key, cpu] : sums) sorted.push_back({key.first, key.second, cpu});
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const SelfTime& a, const SelfTime& b) { return a.cpu > b.cpu; });
  return sorted;
}

}  // namespace

double Profile::cpu() const {
  double sum = 0;
  for (const ThreadProfile& thread : threads) sum += thread.cpu;
  return sum;
}

Profile make_profile(const Trace& trace, double process_cpu) {
  Profile profile;
  profile.seconds = duration_of(trace);
  profile.process_cpu = process_cpu;
  for (const TraceTrack& track : trace.tracks()) profile.threads.push_back(profile_of(track));
  return profile;
}

std::string profile_text(const Profile& profile) {
  std::size_t width = 8;
  for (const ThreadProfile& thread : profile.threads) {
    for (const ProfileRow& row : thread.rows)
      width = std::max(width, row.name.size() + 2 * static_cast<std::size_t>(row.depth));
  }
  std::string text = fmt::format(
      "{:.2f} s; wall and CPU times in ms; share of all threads' CPU\n\n"
      "{:<12}{:<{}}{:>8}{:>9}{:>9}{:>9}{:>11}{:>11}{:>11}{:>9}\n",
      profile.seconds, "thread", "function", width, "calls", "median", "p95", "max", "total", "CPU",
      "CPU self", "share");
  for (const ThreadProfile& thread : profile.threads) {
    text += fmt::format("{:<12}{:<{}}{:>8}{:>9}{:>9}{:>9}{:>11}{:>11.1f}{:>11}{:>7.1f} %\n",
                        thread.name, "", width, "", "", "", "", "", thread.cpu, "",
                        percent(thread.cpu, profile.cpu()));
    for (const ProfileRow& row : thread.rows) {
      const std::string name(2 * static_cast<std::size_t>(row.depth), ' ');
      text += fmt::format(
          "{:<12}{:<{}}{:>8}{:>9.3f}{:>9.3f}{:>9.2f}{:>11.1f}{:>11.1f}{:>11.1f}{:>7.1f} %\n", "",
          name + row.name, width, row.calls, row.median, row.p95, row.max, row.total, row.cpu,
          row.cpu_self, percent(row.cpu, profile.cpu()));
    }
    if (thread.left_out > 0) text += fmt::format("{:<12}{} more spans\n", "", thread.left_out);
  }
  return text + cpu_of_others(profile);
}

std::string profile_in_brief(const Profile& profile) {
  constexpr std::size_t kFunctions = 12;
  std::string text = "CPU time of the threads, relative to one core:";
  for (const ThreadProfile& thread : profile.threads) {
    text += fmt::format(" {} {:.0f} %,", thread.name, percent(thread.cpu / 1000, profile.seconds));
  }
  text.back() = '\n';
  text += cpu_of_others(profile) + "functions with the largest CPU time, without callees:\n";
  const std::vector<SelfTime> functions = by_self_time(profile);
  for (std::size_t i = 0; i < std::min(kFunctions, functions.size()); ++i) {
    const SelfTime& f = functions[i];
    text += fmt::format("{:>6.1f} %{:>10.1f} ms  {}: {}\n", percent(f.cpu, profile.cpu()), f.cpu,
                        f.thread, f.name);
  }
  return text;
}

std::string trace_json(const Trace& trace) {
  const auto quoted = [](std::string_view text) { return json_text(text); };
  const auto us = [](std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-3; };
  std::string json = R"({"displayTimeUnit":"ms","traceEvents":[)";
  json += R"({"name":"process_name","ph":"M","pid":1,"tid":0,"args":{"name":"stillmap"}})";
  int thread = 0;
  for (const TraceTrack& track : trace.tracks()) {
    ++thread;
    json += fmt::format(
        ",\n{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":{},\"args\":{{\"name\":{}}}}"
        "}",
        thread, quoted(track.name()));
    json += fmt::format(
        ",\n{{\"name\":\"thread_sort_index\",\"ph\":\"M\",\"pid\":1,\"tid\":{},\"args\":{{\"sort_"
        "index\":{}}}}}",
        thread, thread);
    for (const TraceSpan& span : track.spans()) {
      if (span.wall < 0) continue;
      json += fmt::format(
          ",\n{{\"name\":{},\"ph\":\"X\",\"pid\":1,\"tid\":{},\"ts\":{:.3f},\"dur\":{:.3f},"
          "\"tdur\":"
          "{:.3f}",
          quoted(span.name), thread, us(span.begin), us(span.wall), us(span.cpu));
      json += span.frame < 0 ? "}" : fmt::format(R"(,"args":{{"frame":{}}}}})", span.frame);
    }
    for (const TraceCount& count : track.counts()) {
      json += fmt::format(
          ",\n{{\"name\":{},\"ph\":\"C\",\"pid\":1,\"tid\":{},\"ts\":{:.3f},\"args\":{{\"waiting\":"
          "{}}}}}",
          quoted(fmt::format("queue: {}", count.name)), thread, us(count.at), count.value);
    }
  }
  return json + "\n]}\n";
}

}  // namespace stillmap
