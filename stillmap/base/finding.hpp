// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// Severity of a finding, from low to high.
enum class Severity {
  kOk,         ///< Examined and right; only `stillmap doctor` reports it.
  kNote,       ///< Worth knowing; the results are not affected.
  kWarning,    ///< The recording can be mapped, but parts may be missing or less accurate.
  kUntrusted,  ///< The result is probably wrong: exit code 3.
  kError,      ///< The recording cannot be mapped: exit code 1.
};

/// Returns "ok", "note", "warning", "untrusted" or "error".
const char* name_of(Severity severity);

/// Returns the severity of a name. Throws Error for an unknown one.
Severity severity_named(const std::string& name);

/// A kind of finding.
struct FindingKind {
  std::string_view code;  ///< Stays the same in later versions.
  Severity severity = Severity::kOk;
  std::string_view meaning;  ///< One line for the table of the documentation.
};

/// All kinds of findings, in the order of the documentation.
inline constexpr std::array kFindingKinds = {
    // of a run as a whole
    FindingKind{"low-coverage", Severity::kUntrusted, "fewer than half of the frames have a pose"},
    FindingKind{"path-gap", Severity::kUntrusted, "a long series of frames has no pose"},
    FindingKind{"unusable-frames", Severity::kUntrusted,
                "more than a fifth of the frames could not be read"},
    FindingKind{"uncertain-poses", Severity::kUntrusted,
                "more than a fifth of the poses contradict the motion of the camera"},
    FindingKind{"unconnected-maps", Severity::kUntrusted,
                "the run has several maps whose relative pose is unknown"},
    FindingKind{"another-place", Severity::kUntrusted,
                "the loaded map is of another place that looks similar"},
    FindingKind{"carried-parts", Severity::kUntrusted,
                "poses follow parts of the image that move along with the camera"},
    FindingKind{"empty-dense-map", Severity::kUntrusted, "the dense map has next to no points"},
    FindingKind{"damaged-map", Severity::kUntrusted, "a saved map is incomplete"},
    FindingKind{"floor-unknown", Severity::kUntrusted,
                "files for planners were written without a floor; the trajectory is not affected"},
    FindingKind{"zones-tilted", Severity::kUntrusted,
                "the rules of --zones assume another upward direction than the floor's"},
    FindingKind{"events-lost", Severity::kUntrusted, "warnings did not reach their receiver"},
    FindingKind{"late-frames", Severity::kNote,
                "more than a fifth of the frames came while the computer was busy"},
    // of network and masks
    FindingKind{"no-detector", Severity::kUntrusted,
                "a preset that needs a network or masks has neither"},
    FindingKind{"boxes-only", Severity::kUntrusted,
                "a preset that needs masks has a network that gives boxes"},
    FindingKind{"no-moving-class", Severity::kUntrusted,
                "the network knows none of the classes that move"},
    FindingKind{"masks-missing", Severity::kUntrusted,
                "more than half of the frames have no usable mask"},
    FindingKind{"masks-unrelated", Severity::kUntrusted, "the masks do not fit the depth images"},
    FindingKind{"masks-inverted", Severity::kUntrusted, "masks mark what is static"},
    FindingKind{"only-class", Severity::kNote,
                "the only class of a network is taken as a moving class"},
    FindingKind{"unused-setting", Severity::kNote, "a setting has no effect"},
    // of the camera
    FindingKind{"focal-length", Severity::kUntrusted,
                "the map fits another focal length than the given one"},
    FindingKind{"principal-point", Severity::kUntrusted,
                "the map fits another principal point, or cx and cy are exchanged"},
    FindingKind{"depth-is-distance", Severity::kUntrusted,
                "depth images hold distances from the camera"},
    FindingKind{"unlikely-camera", Severity::kUntrusted, "hardly any camera has such intrinsics"},
    FindingKind{"calibration", Severity::kWarning,
                "the recording fits other values than those of the camera file"},
    FindingKind{"gyroscope-unlike", Severity::kWarning,
                "the gyroscope contradicts the images and is left out"},
    FindingKind{"accelerometer-unlike", Severity::kWarning,
                "the accelerometer contradicts the images and is left out"},
    FindingKind{"odometry-unlike", Severity::kWarning,
                "the odometry of the wheels contradicts the images and is left out"},
    FindingKind{"motion-samples", Severity::kWarning,
                "unit or gaps of the samples of the IMU or the wheels"},
    FindingKind{"late-samples", Severity::kWarning,
                "samples of the IMU or the wheels come after their frames"},
    FindingKind{"camera-rate", Severity::kWarning,
                "the camera file has another frame rate than the recording"},
    FindingKind{"no-camera", Severity::kError, "the recording has no camera file"},
    // of the recorded images
    FindingKind{"depth-factor", Severity::kUntrusted,
                "depths are not plausible with the given depth factor"},
    FindingKind{"no-depth", Severity::kUntrusted, "no depth within the range of the sensor"},
    FindingKind{"depth-gap", Severity::kWarning, "a long series of frames has no depth"},
    FindingKind{"depth-constant", Severity::kUntrusted,
                "depth images have the same value everywhere"},
    FindingKind{"depth-frozen", Severity::kUntrusted,
                "depth images repeat while the color images change"},
    FindingKind{"depth-bytes", Severity::kUntrusted, "the bytes of 16-bit depths are exchanged"},
    FindingKind{"depth-coarse", Severity::kUntrusted, "depths have steps of 15 mm or more"},
    FindingKind{"depth-turned", Severity::kUntrusted,
                "depth images are mirrored or turned relative to the color images"},
    FindingKind{"depth-late", Severity::kUntrusted,
                "depth images show another moment than their color images"},
    FindingKind{"depth-unregistered", Severity::kUntrusted,
                "depth images are not registered to the color camera"},
    FindingKind{"depth-unrelated", Severity::kUntrusted,
                "depth images are of another recording than the color images"},
    FindingKind{"sparse-depth", Severity::kWarning, "few pixels or images have depth"},
    FindingKind{"frozen-images", Severity::kUntrusted,
                "a long series of color images repeats the one before"},
    FindingKind{"repeated-images", Severity::kWarning, "many color images are listed twice"},
    FindingKind{"alternating-cameras", Severity::kUntrusted, "frames are of two cameras in turn"},
    FindingKind{"image-order", Severity::kUntrusted,
                "frames are not in the order of the numbers of their images"},
    FindingKind{"timestamp-unit", Severity::kUntrusted, "timestamps are not in seconds"},
    FindingKind{"timestamp-gaps", Severity::kWarning, "frames are missing between timestamps"},
    FindingKind{"depth-offset", Severity::kWarning,
                "depth images are taken 10 ms or more before or after color"},
    FindingKind{"bad-files", Severity::kWarning, "image files are missing or cannot be used"},
    FindingKind{"bad-list", Severity::kWarning, "lines of the lists give no frame"},
    FindingKind{"no-frames", Severity::kError, "the recording has no frames"},
    FindingKind{"poor-images", Severity::kWarning, "images are dark, overexposed or blurred"},
    FindingKind{"mask-files", Severity::kWarning, "frames of a folder have no mask"},
    FindingKind{"source", Severity::kWarning, "a note of a recorded file that affects the map"},
    FindingKind{"unreadable", Severity::kError, "a file of the recording cannot be read"},
    // of the ground truth; they do not concern the result
    FindingKind{"truth-reading", Severity::kNote,
                "truth and estimate agree if a file is read in another way"},
    FindingKind{"truth-body", Severity::kNote, "the truth is the pose of another body"},
    FindingKind{"truth-unrelated", Severity::kNote,
                "truth and estimate have hardly anything in common"},
    FindingKind{"truth-unit", Severity::kNote, "truth and estimate have other units of length"},
    FindingKind{"truth-times", Severity::kNote, "timestamps of a trajectory were rounded"},
    FindingKind{"truth-quality", Severity::kWarning, "the truth has jumps, repeats or gaps"},
    FindingKind{"not-evaluated", Severity::kUntrusted, "a run of a comparison has no errors"},
};

/// The code of a kind of finding. A code without a kind does not compile.
class FindingCode {
 public:
  consteval FindingCode(const char* code) {
    for (const FindingKind& kind : kFindingKinds) {
      if (kind.code == code) kind_ = &kind;
    }
    if (kind_ == nullptr) there_is_no_such_code();
  }
  const FindingKind& kind() const { return *kind_; }

 private:
  static void there_is_no_such_code() {}  // not constexpr, so calling it does not compile

  const FindingKind* kind_ = nullptr;
};

/// Something about a recording or a result that its user should know.
struct Finding {
  std::string code = {};  ///< Of FindingKind; empty: examined and right.
  Severity severity = Severity::kOk;
  std::string message = {};  ///< One sentence.
  std::string fix = {};      ///< What to do about it; empty: nothing.
  /// Numbers that it follows from, by name; the unit is the end of the name.
  std::map<std::string, double> evidence = {};

  std::string text() const;  ///< "MESSAGE; FIX".
  bool operator==(const Finding&) const = default;
};

/// Returns a finding with the severity of its kind.
Finding make_finding(FindingCode code, std::string message, std::string fix = {},
                     std::map<std::string, double> evidence = {});

/// Returns the finding with another severity than that of its kind.
Finding with_severity(Severity severity, Finding finding);

/// Returns the highest severity; kOk without findings.
Severity worst(std::span<const Finding> findings);

/// Returns the findings of a severity.
std::vector<Finding> findings_with(Severity severity, std::span<const Finding> findings);

/// Returns the reasons not to trust the trajectory: all of the severity kUntrusted but those about
/// the files for planners and about warnings.
std::vector<Finding> findings_on_trajectory(std::span<const Finding> findings);

/// Returns the texts of findings.
std::vector<std::string> texts_of(std::span<const Finding> findings);

/// Appends findings to others.
void append(std::vector<Finding> more, std::vector<Finding>& findings);

/// Returns all kinds of findings as a table in Markdown.
std::string finding_kinds_markdown();

}  // namespace stillmap
