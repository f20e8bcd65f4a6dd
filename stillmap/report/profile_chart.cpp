// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/chart.hpp"
#include "stillmap/report/profile.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kWidth = 1800, kLeft = 150, kRight = 40, kRow = 17, kGap = 10;  // pixels
constexpr double kCharacter = 6.2;  // mean width of a character of a span's name [pixels]
constexpr double kNarrowest = 0.3;  // spans narrower than this are not drawn [pixels]
constexpr std::int64_t kSecond = 1'000'000'000, kCloseUp = kSecond / 8;  // nanoseconds

struct Window {
  std::int64_t begin = 0, end = 0;  // nanoseconds
  bool overlaps(const TraceSpan& s) const { return s.begin < end && s.begin + s.wall > begin; }
  std::int64_t size() const { return end - begin; }
};

/// A span with its depth in the call tree.
struct Box {
  TraceSpan span;
  int depth = 0;
};

struct Lane {
  std::string name;
  double busy = 0;  // share of a core [0..1]
  int rows = 1;
  std::vector<Box> boxes;
};

bool is_waiting(const TraceSpan& span) { return span.name.starts_with("waiting"); }

/// Returns the CPU time of the span inside the window [ns], assuming a constant rate.
double cpu_within(const TraceSpan& span, const Window& window) {
  const std::int64_t inside =
      std::min(span.begin + span.wall, window.end) - std::max(span.begin, window.begin);
  const auto share =
      static_cast<double>(inside) / static_cast<double>(std::max<std::int64_t>(1, span.wall));
  return share * static_cast<double>(span.cpu);
}

Lane lane_of(const TraceTrack& track, const Window& window, int most_rows) {
  Lane lane;
  lane.name = track.name();
  std::vector<int> depth;
  double cpu = 0;
  for (const TraceSpan& span : track.spans()) {
    depth.push_back(span.parent < 0 ? 0 : depth[static_cast<std::size_t>(span.parent)] + 1);
    if (span.wall < 0 || !window.overlaps(span)) continue;
    if (depth.back() == 0) cpu += cpu_within(span, window);
    if (depth.back() >= most_rows) continue;
    lane.boxes.push_back({span, depth.back()});
    lane.rows = std::max(lane.rows, depth.back() + 1);
  }
  lane.busy = cpu / static_cast<double>(std::max<std::int64_t>(1, window.size()));
  return lane;
}

/// Returns the lanes of the threads that have a span in the window.
std::vector<Lane> lanes_of(const Trace& trace, const Window& window, int most_rows) {
  std::vector<Lane> lanes;
  for (const TraceTrack& track : trace.tracks()) {
    lanes.push_back(lane_of(track, window, most_rows));
    if (lanes.back().boxes.empty()) lanes.pop_back();
  }
  return lanes;
}

std::vector<TraceSpan> frames_of(const Trace& trace, std::string_view name) {
  std::vector<TraceSpan> frames;
  for (const TraceTrack& track : trace.tracks()) {
    for (const TraceSpan& span : track.spans())
      if (span.name == name && span.wall >= 0) frames.push_back(span);
  }
  return frames;
}

/// Returns the fill color of a span, light enough for dark text; a function has the same color
/// everywhere.
const char* color_of(const Box& box) {
  static constexpr std::array kColors{"#a0cdf0", "#fac896", "#b4e1af", "#f5e196", "#e1b9e1",
                                      "#f0b4b4", "#96dce1", "#d7e6c8", "#f5c3d7"};
  if (is_waiting(box.span)) return "#e9ecee";
  std::uint64_t hash = 14695981039346656037ULL + static_cast<std::uint64_t>(box.depth);  // FNV-1a
  for (const char c : box.span.name)
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return kColors[hash % kColors.size()];
}

double height_of(const std::vector<Lane>& lanes) {
  return std::accumulate(lanes.begin(), lanes.end(), 0.0, [](double sum, const Lane& lane) {
    return sum + lane.rows * kRow + kGap;
  });
}

/// Panel of one time window, with its lanes below each other.
class Panel {
 public:
  Panel(Svg& svg, const Window& window, double top, const std::vector<Lane>& lanes)
      : svg_(svg), window_(window), area_{kLeft, top,   kWidth - kLeft - kRight, height_of(lanes),
                                          {},    {0, 1}} {
    area_.x = {0, 1e-6 * static_cast<double>(window.size())};
    draw_x_axis(svg_, area_, 10, "time [ms]");
    double y = top;
    for (const Lane& lane : lanes) {
      draw(lane, y);
      y += lane.rows * kRow + kGap;
    }
  }

  /// Draws lines at the beginnings of frames, with their numbers.
  void draw_frames(const std::vector<TraceSpan>& frames) {
    for (const TraceSpan& frame : frames) {
      if (frame.begin < window_.begin || frame.begin >= window_.end) continue;
      const double at = x(frame.begin);
      svg_.line({at, area_.top - 8}, {at, area_.bottom() - kGap}, "frame-start");
      const std::string label = fmt::format("frame {}", frame.frame);
      if (x(frame.begin + frame.wall) - at > kCharacter * static_cast<double>(label.size()))
        svg_.text({at + 2, area_.top - 8}, label, "start", "tick");
    }
  }

  /// Marks the window of another panel.
  void mark(const Window& window) {
    svg_.rectangle(x(window.begin), area_.top - 4, x(window.end) - x(window.begin), area_.height,
                   "marked");
  }

 private:
  double x(std::int64_t at) const {
    return area_.px(1e-6 * static_cast<double>(at - window_.begin));
  }

  void draw(const Lane& lane, double y) {
    svg_.text({kLeft - 12, y + 12}, lane.name, "end", "strong");
    if (lane.rows > 1) {
      svg_.text({kLeft - 12, y + 28}, fmt::format("{:.0f} % of a core", 100 * lane.busy), "end",
                "tick");
    }
    for (const Box& box : lane.boxes) draw(box, y + box.depth * kRow);
  }

  void draw(const Box& box, double y) {
    const double left = std::max(x(box.span.begin), area_.left);
    const double width = std::min(x(box.span.begin + box.span.wall), area_.right()) - left;
    if (width < kNarrowest) return;
    svg_.rectangle(left, y, width, kRow - 2, "span",
                   fmt::format("{}: {:.3f} ms, CPU {:.3f} ms", box.span.name,
                               1e-6 * static_cast<double>(box.span.wall),
                               1e-6 * static_cast<double>(box.span.cpu)),
                   fmt::format("fill:{}", color_of(box)));
    if (kCharacter * static_cast<double>(box.span.name.size()) + 5 < width)
      svg_.text({left + 3, y + 11.5}, box.span.name, "start", "span-name");
  }

  Svg& svg_;
  const Window window_;
  ChartArea area_;
};

/// Returns one second in the middle of the run, or the whole run if it is shorter.
Window middle_second(const std::vector<TraceSpan>& frames) {
  Window second{0, kSecond};
  if (frames.empty()) return second;
  const std::int64_t first = frames.front().begin, last = frames.back().begin + frames.back().wall;
  second.begin = std::max(first, frames[frames.size() / 2].begin - kSecond / 2);
  second.end = std::min(second.begin + kSecond, std::max(last, second.begin + 1));
  return second;
}

/// Returns an eighth of a second of the window that begins with a frame.
Window close_up_of(const Window& second, const std::vector<TraceSpan>& frames) {
  Window close_up{second.begin + second.size() / 2, second.end};
  const auto frame = std::find_if(frames.begin(), frames.end(), [&](const TraceSpan& f) {
    return f.begin >= close_up.begin && f.begin < second.end;
  });
  if (frame != frames.end()) close_up.begin = frame->begin;
  close_up.end = std::min(close_up.begin + kCloseUp, second.end);
  return close_up;
}

}  // namespace

Svg profile_chart(const Trace& trace, std::string_view frame_name) {
  constexpr double kTop = 92, kBetween = 110, kBottom = 60;
  const std::vector<TraceSpan> frames = frames_of(trace, frame_name);
  const Window second = middle_second(frames), close_up = close_up_of(second, frames);
  const auto overview = lanes_of(trace, second, 2), detail = lanes_of(trace, close_up, 6);
  const double below = kTop + height_of(overview) + kBetween;
  Svg svg(kWidth, below + height_of(detail) + kBottom, "time line of all threads");
  const auto count = std::count_if(frames.begin(), frames.end(), [&](const TraceSpan& f) {
    return f.begin >= second.begin && f.begin < second.end;
  });
  svg.text({kLeft, 32}, "Frame budget", "start", "heading");
  svg.text({kLeft, 56},
           fmt::format("{} frames in {:.2f} s from the middle of the run. Each box is a function "
                       "call, with its callees below; gray: waiting",
                       count, 1e-9 * static_cast<double>(second.size())),
           "start");
  Panel(svg, second, kTop, overview).mark(close_up);
  svg.text({kLeft, below - 34},
           fmt::format("The marked {:.0f} ms", 1e-6 * static_cast<double>(close_up.size())),
           "start", "heading");
  Panel(svg, close_up, below, detail).draw_frames(frames);
  return svg;
}

}  // namespace stillmap
