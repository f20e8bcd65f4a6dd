// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/canvas.hpp"
#include "stillmap/evaluate/chart_axes.hpp"
#include "stillmap/evaluate/profile.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include <fmt/format.h>

namespace stillmap {
namespace {

const cv::Scalar kPaper(255, 255, 255), kInk(35, 30, 28), kSoftInk(110, 102, 96),
    kGrid(232, 228, 224), kFrame(150, 140, 130), kWaiting(238, 236, 233), kLane(250, 249, 247);
constexpr int kWidth = 1800;
constexpr double kLeft = 150, kRight = 40, kRow = 17, kGap = 10, kCap = 8.5, kSmallCap = 7.5;
constexpr std::int64_t kSecond = 1'000'000'000, kCloseUp = kSecond / 8;

struct Window {
  std::int64_t begin = 0, end = 0;  // nanoseconds
  bool meets(const TraceSpan& s) const { return s.begin < end && s.begin + s.wall > begin; }
  std::int64_t size() const { return end - begin; }
};

/// A span, and how many are around it.
struct Box {
  TraceSpan span;
  int depth = 0;
};

struct Lane {
  std::string name;
  double busy = 0;  // of a core
  int rows = 1;
  std::vector<Box> boxes;
};

bool waits(const TraceSpan& span) { return span.name.starts_with("waiting"); }

/// Computing within the window, where each span's is spread evenly over it.
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
    if (span.wall < 0 || !window.meets(span)) continue;
    if (depth.back() == 0) cpu += cpu_within(span, window);
    if (depth.back() >= most_rows) continue;
    lane.boxes.push_back({span, depth.back()});
    lane.rows = std::max(lane.rows, depth.back() + 1);
  }
  lane.busy = cpu / static_cast<double>(std::max<std::int64_t>(1, window.size()));
  return lane;
}

/// Threads that did nothing then have none.
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

/// Pale enough for dark text; the same function has the same color everywhere.
cv::Scalar color_of(std::string_view name, int depth) {
  static const std::array<cv::Scalar, 9> kColors{
      cv::Scalar(240, 205, 160), cv::Scalar(150, 200, 250), cv::Scalar(175, 225, 180),
      cv::Scalar(150, 225, 245), cv::Scalar(225, 185, 225), cv::Scalar(180, 180, 240),
      cv::Scalar(225, 220, 150), cv::Scalar(200, 230, 215), cv::Scalar(215, 195, 245)};
  std::uint64_t hash = 14695981039346656037ULL + static_cast<std::uint64_t>(depth);  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return kColors[hash % kColors.size()];
}

/// One stretch of time: its lanes below one another.
class Panel {
 public:
  Panel(Canvas& canvas, const Window& window, double top)
      : canvas_(canvas), window_(window), top_(top), bottom_(top) {}

  void draw(const std::vector<Lane>& lanes, const std::vector<TraceSpan>& frames) {
    bottom_ = top_ + height(lanes);
    draw_axis();
    double y = top_;
    for (const Lane& lane : lanes) {
      draw(lane, y);
      y += lane.rows * kRow + kGap;
    }
    draw_frames(frames);
  }

  static double height(const std::vector<Lane>& lanes) {
    return std::accumulate(lanes.begin(), lanes.end(), 0.0, [](double sum, const Lane& lane) {
      return sum + lane.rows * kRow + kGap;
    });
  }

  /// Marks another panel's stretch of time.
  void mark(const Window& window) {
    const cv::Rect2d area(x(window.begin), top_ - 4, x(window.end) - x(window.begin),
                          bottom_ - top_);
    canvas_.rectangle(area, kInk, 1.5);
  }

 private:
  double x(std::int64_t at) const {
    const double share =
        static_cast<double>(at - window_.begin) / static_cast<double>(window_.size());
    return kLeft + share * (kWidth - kLeft - kRight);
  }

  void draw_axis() {
    const Range ms{0, 1e-6 * static_cast<double>(window_.size())};
    const auto ticks = nice_ticks(ms, 10);
    const auto labels = tick_labels(ticks);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      const double at = x(window_.begin + static_cast<std::int64_t>(ticks[i] * 1e6));
      canvas_.line({at, top_ - 4}, {at, bottom_ - kGap + 4}, kGrid, 1);
      canvas_.text(labels[i] + " ms", {at, bottom_ + 8}, kCap, kSoftInk, Anchor::kCenter);
    }
  }

  void draw(const Lane& lane, double y) {
    canvas_.text(lane.name, {kLeft - 12, y + 12}, kCap + 1.5, kInk, Anchor::kRight, true);
    if (lane.rows > 1) {
      canvas_.text(fmt::format("{:.0f} % of a core", 100 * lane.busy), {kLeft - 12, y + 28}, kCap,
                   kSoftInk, Anchor::kRight);
    }
    canvas_.clip({kLeft, y, kWidth - kLeft - kRight, lane.rows * kRow});
    for (const Box& box : lane.boxes) draw(box, y + box.depth * kRow);
    canvas_.clip({});
  }

  void draw(const Box& box, double y) {
    const double left = std::max(x(box.span.begin), kLeft);
    const double right = std::min(x(box.span.begin + box.span.wall), double{kWidth - kRight});
    const cv::Rect2d area(left, y, right - left, kRow - 2);
    canvas_.fill(area, waits(box.span) ? kWaiting : color_of(box.span.name, box.depth));
    if (area.width > 3) canvas_.rectangle(area, kPaper, 0.6);
    const std::string name(box.span.name);
    for (const double cap : {kCap, kSmallCap}) {
      if (Canvas::text_width(name, cap) + 5 > area.width) continue;
      canvas_.text(name, {left + 3, y + kRow / 2 + 0.3 * kCap}, cap,
                   waits(box.span) ? kSoftInk : kInk);
      break;
    }
  }

  void draw_frames(const std::vector<TraceSpan>& frames) {
    for (const TraceSpan& frame : frames) {
      if (frame.begin < window_.begin || frame.begin >= window_.end) continue;
      const double at = x(frame.begin);
      canvas_.line({at, top_ - 8}, {at, bottom_ - kGap}, kFrame, 0.8);
      const std::string label = fmt::format("frame {}", frame.frame);
      if (x(frame.begin + frame.wall) - at > Canvas::text_width(label, kCap))
        canvas_.text(label, {at + 2, top_ - 8}, kCap, kSoftInk);
    }
  }

  Canvas& canvas_;
  const Window window_;
  const double top_;
  double bottom_;
};

}  // namespace

cv::Mat draw_frame_budget(const Trace& trace, std::string_view frame_name) {
  const std::vector<TraceSpan> frames = frames_of(trace, frame_name);
  Window second{0, kSecond};
  if (!frames.empty()) {  // as much of it as there is
    const std::int64_t first = frames.front().begin,
                       last = frames.back().begin + frames.back().wall;
    second.begin = std::max(first, frames[frames.size() / 2].begin - kSecond / 2);
    second.end = std::min(second.begin + kSecond, std::max(last, second.begin + 1));
  }
  Window close_up{second.begin + second.size() / 2, second.end};
  for (const TraceSpan& frame : frames) {  // begins where a frame does
    if (frame.begin >= close_up.begin) {
      close_up.begin = frame.begin;
      break;
    }
  }
  close_up.end = std::min(close_up.begin + kCloseUp, second.end);

  constexpr double kTop = 92, kBetween = 90, kBottom = 30;
  const auto overview = lanes_of(trace, second, 2);
  const auto detail = lanes_of(trace, close_up, 6);
  const double below = kTop + Panel::height(overview) + kBetween;
  Canvas canvas(kWidth, cvRound(below + Panel::height(detail) + kBottom), kPaper, 2);
  canvas.text("The frame budget", {kLeft, 32}, 14, kInk, Anchor::kLeft, true);
  canvas.text(fmt::format("{} frames in {:.2f} s, out of the middle of the run. A box is what a "
                          "thread does, below it what that calls; gray: waiting",
                          std::count_if(frames.begin(), frames.end(),
                                        [&](const auto& f) {
                                          return f.begin >= second.begin && f.begin < second.end;
                                        }),
                          1e-9 * static_cast<double>(second.size())),
              {kLeft, 54}, kCap + 1.5, kSoftInk);
  Panel above(canvas, second, kTop);
  above.draw(overview, {});
  above.mark(close_up);
  canvas.text(
      fmt::format("The {:.0f} ms marked above", 1e-6 * static_cast<double>(close_up.size())),
      {kLeft, below - 34}, kCap + 2.5, kInk, Anchor::kLeft, true);
  Panel(canvas, close_up, below).draw(detail, frames);
  return canvas.finished();
}

}  // namespace stillmap
