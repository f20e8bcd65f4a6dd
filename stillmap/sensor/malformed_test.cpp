// Tests of malformed input as listed in docs/bad_input.md: each row must give an Error with the
// cause and a fix, or a skipped frame that is counted with a reason. Nothing may crash, and nothing
// may be silent.
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <functional>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// ---- one damaged file among valid ones: a skip ------------------------------------------------

struct DamagedFile {
  const char* name;
  std::function<void(const TestSequence&)> spoil;
  const char* reason;  // Required text of the skip's reason.
  friend void PrintTo(const DamagedFile& row, std::ostream* out) { *out << row.name; }
};

class OneDamagedFile : public ::testing::TestWithParam<DamagedFile> {};

TEST_P(OneDamagedFile, IsSkippedCountedAndExplained) {
  const TestSequence sequence(3);
  GetParam().spoil(sequence);
  ::testing::internal::CaptureStderr();
  TumFolder source = sequence.open();
  const auto frames = all_frames(source);
  const std::string printed = ::testing::internal::GetCapturedStderr();
  ASSERT_EQ(source.skipped().size(), 1u);
  EXPECT_THAT(source.skipped()[0].reason, HasSubstr(GetParam().reason));
  // A frame is lost with its color image; without its depth image it has depth 0.
  const bool lost = std::string_view(GetParam().reason).starts_with("rgb/");
  EXPECT_EQ(source.skipped()[0].frame_lost, lost);
  ASSERT_EQ(frames.size(), lost ? 2u : 3u);
  if (!lost) {
    EXPECT_EQ(cv::countNonZero(frames[1]->depth), 0);
    EXPECT_EQ(frames[1]->depth_delay, 0);
  }
  EXPECT_EQ(printed, "") << "a library printed to the terminal";
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i]->index, i);
}

// Changes bytes in the middle of a file.
void flip_bytes(const TestSequence& sequence, const std::string& name) {
  std::string bytes = read_file(sequence.path(name));
  for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 8; ++i)
    bytes[i] = static_cast<char>(~bytes[i]);
  sequence.write(name, bytes);
}

// Changes the size in a file's header, but nothing else (not even the checksum).
void claim_size(const TestSequence& sequence, const std::string& name,
                const std::string& four_bytes) {
  std::string bytes = read_file(sequence.path(name));
  bytes.replace(16, 4, four_bytes);
  sequence.write(name, bytes);
}

void write_tiff(const TestSequence& sequence, const cv::Mat& image) {
  sequence.write_image("depth/1.tiff", image);
  fs::rename(sequence.path("depth/1.tiff"), sequence.path("depth/1.png"));
}

const DamagedFile kDamagedFiles[] = {
    {"ColorMissing", [](const auto& s) { fs::remove(s.path("rgb/1.png")); },
     "rgb/1.png is missing"},
    {"DepthMissing", [](const auto& s) { fs::remove(s.path("depth/1.png")); },
     "depth/1.png is missing"},
    {"ColorEmpty", [](const auto& s) { s.write("rgb/1.png", ""); }, "rgb/1.png is empty"},
    {"DepthEmpty", [](const auto& s) { s.write("depth/1.png", ""); }, "depth/1.png is empty"},
    {"ColorZeroBytes", [](const auto& s) { s.write("rgb/1.png", std::string(5000, '\0')); },
     "rgb/1.png is not a PNG, JPEG, TIFF, NPY or EXR image"},
    {"ColorIsText", [](const auto& s) { s.write("rgb/1.png", "404 not found\n"); },
     "rgb/1.png is not a PNG, JPEG, TIFF, NPY or EXR image"},
    {"ColorIsAFolder",
     [](const auto& s) {
       fs::remove(s.path("rgb/1.png"));
       fs::create_directories(s.path("rgb/1.png"));
     },
     "rgb/1.png is not a file"},
    {"ColorIsABitmap",
     [](const auto& s) {
       s.write_image("rgb/1.bmp", TestSequence::color_image());
       fs::rename(s.path("rgb/1.bmp"), s.path("rgb/1.png"));
     },
     "rgb/1.png is not a PNG, JPEG, TIFF, NPY or EXR image"},
    {"ColorCutShort", [](const auto& s) { s.truncate("rgb/1.png", 0.6); },
     "rgb/1.png is truncated"},
    {"ColorCutInItsHeader", [](const auto& s) { s.truncate("rgb/1.png", 0.05); },
     "rgb/1.png is truncated"},
    {"DepthCutShort", [](const auto& s) { s.truncate("depth/1.png", 0.6); },
     "depth/1.png is truncated"},
    {"JpegCutShort",
     [](const auto& s) {
       s.write_image("rgb/1.jpg", TestSequence::color_image());
       s.truncate("rgb/1.jpg", 0.8);
       fs::rename(s.path("rgb/1.jpg"), s.path("rgb/1.png"));
     },
     "rgb/1.png is truncated"},
    {"ColorDamaged", [](const auto& s) { flip_bytes(s, "rgb/1.png"); }, "rgb/1.png is damaged"},
    {"DepthDamaged", [](const auto& s) { flip_bytes(s, "depth/1.png"); }, "depth/1.png is damaged"},
    {"ColorOf16Bits",
     [](const auto& s) {
       s.write_image("rgb/1.png", TestSequence::color_image({64, 48}, CV_16UC3));
     },
     "rgb/1.png has 16 bits per channel where a color image has 8"},
    {"DepthOf8Bits",
     [](const auto& s) { s.write_image("depth/1.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(9))); },
     "depth/1.png has 1 channel of 8 bits where a depth image has one of 16"},
    {"DepthInColor",
     [](const auto& s) {
       s.write_image("depth/1.png", cv::Mat(48, 64, CV_16UC3, cv::Scalar::all(9)));
     },
     "depth/1.png has 3 channels of 16 bits"},
    {"DepthIsAJpeg",
     [](const auto& s) {
       s.write_image("depth/1.jpg", TestSequence::color_image());
       fs::rename(s.path("depth/1.jpg"), s.path("depth/1.png"));
     },
     "depth/1.png has 3 channels of 8 bits"},
    {"DepthIsATiffOfDoubles",
     [](const auto& s) { write_tiff(s, cv::Mat(48, 64, CV_64FC1, cv::Scalar(2))); },
     "depth/1.png has 1 channel of 64 bits (floats) where a depth image has one of 16 or, as TIFF, "
     "of 32-bit floats"},
    {"DepthIsATiffInColorAsLogarithms",
     [](const auto& s) { write_tiff(s, cv::Mat(48, 64, CV_32FC3, cv::Scalar::all(2))); },
     "depth/1.png has 3 channels of 16 bits (signed)"},
    {"DepthIsATiffCutShort",
     [](const auto& s) {
       write_tiff(s, cv::Mat(48, 64, CV_32FC1, cv::Scalar(2)));
       s.truncate("depth/1.png", 0.6);
     },
     "depth/1.png is truncated"},
    {"DepthIsATiffCutInItsHeader",
     [](const auto& s) { s.write("depth/1.png", std::string("II\x2a\0\x08\0\0\0\x09", 9)); },
     "depth/1.png is truncated"},
    {"DepthIsATiffOfAnotherSize",
     [](const auto& s) { write_tiff(s, cv::Mat(24, 32, CV_32FC1, cv::Scalar(2))); },
     "depth/1.png is 32 x 24 pixels where the camera has 64 x 48"},
    {"ColorOfAnotherSize",
     [](const auto& s) {
       s.write_image("rgb/1.png", TestSequence::color_image({32, 24}));
     },
     "rgb/1.png is 32 x 24 pixels where the camera has 64 x 48"},
    {"DepthOfAnotherSize",
     [](const auto& s) {
       s.write_image("depth/1.png", TestSequence::depth_image(2, {48, 64}));
     },
     "depth/1.png is 48 x 64 pixels where the camera has 64 x 48"},
    {"AnImageThatClaimsToBeHuge",
     [](const auto& s) {
       claim_size(s, "rgb/1.png", {'\x7f', '\xff', '\xff', '\xff'});
     },
     "rgb/1.png is 2147483647 x 48 pixels where"},
    {"AnImageWithoutPixels",
     [](const auto& s) { claim_size(s, "rgb/1.png", std::string(4, '\0')); },
     "rgb/1.png is damaged: its header says 0 pixels"},
};

INSTANTIATE_TEST_SUITE_P(Images, OneDamagedFile, ::testing::ValuesIn(kDamagedFiles),
                         [](const auto& row) { return row.param.name; });

// ---- lists: number of frames and skips -------------------------------------------------------

struct DamagedList {
  const char* name;
  std::function<void(const TestSequence&)> spoil;
  std::size_t frames;
  std::size_t skipped;
  const char* reason;  // Required text of one skip's reason; "" for no skip.
  friend void PrintTo(const DamagedList& row, std::ostream* out) { *out << row.name; }
};

class OneDamagedList : public ::testing::TestWithParam<DamagedList> {};

TEST_P(OneDamagedList, KeepsValidLinesAndReportsTheRest) {
  const TestSequence sequence(3);
  GetParam().spoil(sequence);
  TumFolder source = sequence.open();
  const auto frames = all_frames(source);
  EXPECT_EQ(frames.size(), GetParam().frames);
  EXPECT_EQ(source.skipped().size(), GetParam().skipped);
  std::string reasons;
  for (const auto& skipped : source.skipped()) reasons += skipped.reason + "\n";
  EXPECT_THAT(reasons, HasSubstr(GetParam().reason));
  for (std::size_t i = 1; i < frames.size(); ++i) {
    EXPECT_LT(frames[i - 1]->timestamp, frames[i]->timestamp);
  }
}

constexpr const char* kFirst = "100.000000 rgb/0.png\n";
constexpr const char* kSecond = "100.033333 rgb/1.png\n";
constexpr const char* kThird = "100.066667 rgb/2.png\n";

std::string lines(std::initializer_list<const char*> parts) {
  std::string text;
  for (const char* part : parts) text += part;
  return text;
}

const DamagedList kDamagedLists[] = {
    {"GarbageLine",
     [](const auto& s) {
       s.write("rgb.txt", lines({kFirst, "lorem ipsum\n", kSecond, kThird}));
     },
     3, 1, "rgb.txt:2: 'lorem' is not a timestamp"},
    {"StampWithoutFile",
     [](const auto& s) {
       s.write("rgb.txt", lines({kFirst, "100.033333\n", kThird}));
     },
     2, 1, "rgb.txt:2: expected 'timestamp file'"},
    {"StampWithALetter",
     [](const auto& s) {
       s.write("rgb.txt", lines({kFirst, "100.03x rgb/1.png\n", kThird}));
     },
     2, 1, "rgb.txt:2: '100.03x' is not a timestamp"},
    {"StampNotANumber",
     [](const auto& s) {
       s.write("rgb.txt", lines({kFirst, "nan rgb/1.png\n", kThird}));
     },
     2, 1, "rgb.txt:2: the timestamp 'nan' is not finite"},
    {"StampInfinite",
     [](const auto& s) {
       s.write("rgb.txt", lines({kFirst, "1e999 rgb/1.png\n", kThird}));
     },
     2, 1, "not finite"},
    {"StampRepeats",
     [](const auto& s) {
       s.write("rgb.txt", lines({kFirst, kSecond, kSecond, kThird}));
     },
     3, 1, "rgb.txt: the timestamp 100.033333 repeats"},
    {"StampsRunBackwards",
     [](const auto& s) {
       s.write("rgb.txt", lines({kThird, kFirst, kSecond}));
     },
     2, 1, "rgb.txt: the timestamp 100.066667 is out of order"},
    {"StampFarAhead",
     [](const auto& s) {
       s.write("rgb.txt", lines({kFirst, "9e9 rgb/1.png\n", kSecond, kThird}));
     },
     3, 1, "is out of order"},
    {"DepthStampRepeats",
     [](const auto& s) {
       s.write("depth.txt", "100.005 depth/0.png\n100.005 depth/1.png\n100.071 depth/2.png\n");
     },
     3, 1, "depth.txt: the timestamp 100.005000 repeats"},
    {"NoDepthNearOneImage",
     [](const auto& s) { s.write("depth.txt", "100.005 depth/0.png\n100.071 depth/2.png\n"); }, 3,
     0, ""},
    {"NoDepthNearTheFirstImage",
     [](const auto& s) { s.write("depth.txt", "100.038 depth/1.png\n100.071 depth/2.png\n"); }, 2,
     1, "0.png: no depth image within 0.02 s, and none before"},
    {"SeparatedByCommas",
     [](const auto& s) {
       s.write("rgb.txt", "100.000000,rgb/0.png\n100.033333, rgb/1.png\n100.066667 ,rgb/2.png\n");
     },
     3, 0, ""},
    {"WindowsLineEndings",
     [](const auto& s) {
       s.write("rgb.txt",
               "# t f\r\n100.000000 rgb/0.png\r\n\r\n100.033333 rgb/1.png\r\n100.066667 rgb/2.png");
     },
     3, 0, ""},
    {"BinaryInTheList",
     [](const auto& s) {
       s.write("rgb.txt", std::string("\x01\x02\0\xff\n", 5) + kFirst + kSecond + kThird);
     },
     3, 1, "rgb.txt:1:"},
    {"AssociationWithTwoFields",
     [](const auto& s) {
       fs::remove(s.path("rgb.txt"));
       s.write("associations.txt", "100 rgb/0.png 100 depth/0.png\n100.1 rgb/1.png\n");
     },
     1, 1, "associations.txt:2: expected 'timestamp rgb_file timestamp depth_file'"},
    {"AssociationOfAnotherTime",
     [](const auto& s) {
       fs::remove(s.path("rgb.txt"));
       s.write("associations.txt",
               "100 rgb/0.png 100.01 depth/0.png\n100.1 rgb/1.png 200.1 depth/1.png\n");
     },
     1, 1, "1.png: its depth image was taken 100.000 s later"},
    {"AllDepthUnknown",  // A valid frame: tracking needs color only.
     [](const auto& s) { s.write_image("depth/1.png", TestSequence::depth_image(0)); }, 3, 0, ""},
};

INSTANTIATE_TEST_SUITE_P(Lists, OneDamagedList, ::testing::ValuesIn(kDamagedLists),
                         [](const auto& row) { return row.param.name; });

// ---- nothing usable left: an error ------------------------------------------------------------

struct SpoiltSequence {
  const char* name;
  std::function<void(const TestSequence&)> spoil;
  const char* problem;  // Required text of the error.
  const char* fix;
  friend void PrintTo(const SpoiltSequence& row, std::ostream* out) { *out << row.name; }
};

class UnusableSequence : public ::testing::TestWithParam<SpoiltSequence> {};

TEST_P(UnusableSequence, IsAnErrorWithFileAndFix) {
  const TestSequence sequence(2);
  GetParam().spoil(sequence);
  const std::string error = error_of([&] { sequence.open(); });
  EXPECT_THAT(error, HasSubstr(sequence.folder().string()));
  EXPECT_THAT(error, HasSubstr(GetParam().problem));
  EXPECT_THAT(error, HasSubstr("fix: "));
  EXPECT_THAT(error, HasSubstr(GetParam().fix));
}

const SpoiltSequence kUnusableSequences[] = {
    {"FolderMissing", [](const auto& s) { fs::remove_all(s.folder()); }, "there is no such folder",
     "give the folder of a sequence"},
    {"FolderIsAFile",
     [](const auto& s) {
       fs::remove_all(s.folder());
       std::ofstream(s.folder()) << "#ROSBAG V2.0\n";
     },
     "is a file, not a folder", "unpack or convert it"},
    {"FolderEmpty",
     [](const auto& s) {
       fs::remove_all(s.folder());
       fs::create_directories(s.folder());
     },
     "is not a sequence", "rgb.txt and depth.txt"},
    {"ColorListMissing", [](const auto& s) { fs::remove(s.path("rgb.txt")); },
     "contains depth.txt but no rgb.txt", "add rgb.txt"},
    {"DepthListMissing", [](const auto& s) { fs::remove(s.path("depth.txt")); },
     "contains rgb.txt but no depth.txt", "add depth.txt"},
    {"ColorListEmpty", [](const auto& s) { s.write("rgb.txt", ""); }, "rgb.txt: contains no image",
     "timestamp file"},
    {"ListOfComments", [](const auto& s) { s.write("depth.txt", "# none\n# at all\n"); },
     "depth.txt: contains no image", "timestamp file"},
    {"ListIsAnImage",
     [](const auto& s) {
       fs::copy_file(s.path("rgb/0.png"), s.path("rgb.txt"), fs::copy_options::overwrite_existing);
     },
     "rgb.txt: contains no line", "timestamp file"},
    {"NoPairWithinReach",
     [](const auto& s) { s.write("depth.txt", "500 depth/0.png\n501 depth/1.png\n"); },
     "no color image has a depth image within 0.02 s: color images run from 100.000",
     "one recording"},
    {"PairsExactlyAtTheBound",
     [](const auto& s) {
       s.write("rgb.txt", "0 rgb/0.png\n");
       s.write("depth.txt", "0.02 depth/0.png\n");
     },
     "no color image has a depth image", "associations"},
    {"AssociationsEmpty",
     [](const auto& s) {
       fs::remove(s.path("rgb.txt"));
       s.write("associations.txt", "\n");
     },
     "associations.txt: contains no pair", "timestamp rgb_file timestamp depth_file"},
    {"AllImagesMissing", [](const auto& s) { fs::remove_all(s.path("rgb")); },
     "none of the 2 frames can be used; the first: rgb/0.png is missing",
     "copy the images to where the lists name them"},
    {"AllOfAnotherSize",
     [](const auto& s) {
       for (const char* name : {"rgb/0.png", "rgb/1.png"}) {
         s.write_image(name, TestSequence::color_image({320, 200}));
       }
     },
     "rgb/0.png is 320 x 200 pixels where the camera has 64 x 48", "--camera"},
    {"AllDepthOf8Bits",
     [](const auto& s) {
       for (const char* name : {"depth/0.png", "depth/1.png"}) {
         s.write_image(name, cv::Mat(48, 64, CV_8UC1, cv::Scalar(9)));
       }
     },
     "depth/0.png has 1 channel of 8 bits", "16-bit PNG"},
};

INSTANTIATE_TEST_SUITE_P(Sequences, UnusableSequence, ::testing::ValuesIn(kUnusableSequences),
                         [](const auto& row) { return row.param.name; });

TEST(MalformedArguments, AMissingAssociationsFile) {
  const TestSequence sequence(1);
  const std::string error =
      error_of([&] { find_sequence(sequence.folder(), sequence.path("nowhere.txt")); });
  EXPECT_THAT(error, HasSubstr("nowhere.txt: is not a file"));
  EXPECT_THAT(error, HasSubstr("fix: "));
}

// ---- cameras ----------------------------------------------------------------------------------

struct SpoiltCamera {
  const char* name;
  std::string text;
  const char* problem;
  const char* fix;
  friend void PrintTo(const SpoiltCamera& row, std::ostream* out) { *out << row.name; }
};

class OneInvalidCamera : public ::testing::TestWithParam<SpoiltCamera> {};

TEST_P(OneInvalidCamera, IsAnErrorWithFileKeyAndFix) {
  const TestSequence sequence(0);
  sequence.write("camera.yaml", GetParam().text);
  const std::string error = error_of([&] { read_camera(sequence.path("camera.yaml").string()); });
  EXPECT_THAT(error, HasSubstr(sequence.path("camera.yaml").string()));
  EXPECT_THAT(error, HasSubstr(GetParam().problem));
  EXPECT_THAT(error, HasSubstr("fix: "));
  EXPECT_THAT(error, HasSubstr(GetParam().fix));
}

// Returns a valid camera file with the line of `key` replaced by `line`.
std::string ours(const std::string& key, const std::string& line) {
  std::string text;
  for (const char* good :
       {"width: 640\n", "height: 480\n", "fx: 535.4\n", "fy: 539.2\n", "cx: 320.1\n", "cy: 247.6\n",
        "depth_factor: 5000\n", "fps: 30\n", "baseline: 0.08\n", "sensor: kinect_v1\n"}) {
    text += std::string(good).starts_with(key + ":") ? line : good;
  }
  return text;
}

std::string settings(const std::string& key, const std::string& line) {
  std::string text = "%YAML:1.0\n";
  for (const char* good : {"Camera.type: PinHole\n", "Camera.width: 640\n", "Camera.height: 480\n",
                           "Camera.fx: 535.4\n", "Camera.fy: 539.2\n", "Camera.cx: 320.1\n",
                           "Camera.cy: 247.6\n", "DepthMapFactor: 5000.0\n"}) {
    text += std::string(good).starts_with(key + ":") ? line : good;
  }
  return text;
}

const SpoiltCamera kInvalidCameras[] = {
    {"Empty", "", "is not a camera file", "width, height, fx"},
    {"PlainText", "a camera, of sorts", "is not a camera file", "width, height, fx"},
    {"AList", "- 535.4\n- 539.2\n", "is not a camera file", "width, height, fx"},
    {"NotYaml", "fx: [1, 2\nfy: }\n", "is not YAML", "key: value"},
    {"Binary", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16), "is no", "fix: "},
    {"DeepNesting", std::string(100000, '['), "is not YAML", "key: value"},
    {"TooLarge", std::string(5 << 20, '#'), "too large", "preset"},
    {"KeyMissing", ours("cy", ""), "the key 'cy' is missing", "cy: VALUE"},
    {"DepthFactorMissing", ours("depth_factor", ""), "the key 'depth_factor' is missing",
     "depth_factor"},
    {"KeyMisspelled", ours("fy", "fY: 539.2\n"), "key 'fY'", "did you mean 'f"},
    {"KeyTwice", ours("fx", "fx: 500\nfx: 600\n"), "key 'fx': is given twice", "keep only"},
    {"WordForANumber", ours("fx", "fx: wide\n"), "key 'fx': expected a number, found 'wide'",
     "decimal"},
    {"ListForANumber", ours("fx", "fx: [535.4]\n"), "key 'fx': expected a number", "decimal"},
    {"NumberNotFinite", ours("cx", "cx: .nan\n"), "'.nan' is not finite", "write a number"},
    {"FractionOfAPixel", ours("width", "width: 640.5\n"), "key 'width': expected a whole number",
     "pixels"},
    {"FocalLengthZero", ours("fx", "fx: 0\n"), "fx or fy is 0", "pixels"},
    {"FocalLengthNegative", ours("fy", "fy: -539.2\n"), "fx or fy is -539.2", "pixels"},
    {"FocalLengthInMillimeters", ours("fx", "fx: 3.6\n"), "fx or fy is 3.6", "not millimeters"},
    {"PrincipalPointOutside", ours("cx", "cx: 700\n"), "cx is 700", "a pixel of the image"},
    {"PrincipalPointNegative", ours("cy", "cy: -1\n"), "cy is -1", "a pixel of the image"},
    {"WidthNegative", ours("width", "width: -640\n"), "width or height is -640", "pixels"},
    {"DepthFactorZero", ours("depth_factor", "depth_factor: 0\n"), "the depth factor is 0",
     "5000 for TUM"},
    {"DepthFactorNegative", ours("depth_factor", "depth_factor: -5000\n"),
     "the depth factor is -5000", "raw units per meter"},
    {"DepthFactorUpsideDown", ours("depth_factor", "depth_factor: 0.001\n"),
     "the depth factor is 0.001", "not meters per unit"},
    {"FrameRateZero", ours("fps", "fps: 0\n"), "fps is 0", "30"},
    {"SensorUnknown", ours("sensor", "sensor: realsense_d435\n"), "is no known depth sensor",
     "realsense_d435i"},
    {"BaselineZero", ours("baseline", "baseline: 0\n"), "the baseline is 0", "0.075"},
    {"DistortionAWord", ours("baseline", "distortion: none\n"), "key 'distortion': expected a list",
     "[k1, k2, p1, p2, k3]"},
    {"DistortionTooLong", ours("baseline", "distortion: [1, 2, 3, 4, 5, 6, 7, 8]\n"),
     "the lens has a rational model, from which Brown's", "rectify"},
    {"DistortionNotFinite", ours("baseline", "distortion: [0.1, .inf]\n"), "'.inf' is not finite",
     "number"},
    {"SettingsKeyMissing", settings("Camera.cx", ""), "the key 'Camera.cx' is missing",
     "Camera1.cx: VALUE"},
    {"SettingsWithoutDepthFactor", settings("DepthMapFactor", ""),
     "the key 'DepthMapFactor' is missing", "RGBD.DepthMapFactor: VALUE"},
    {"SettingsFocalLengthNegative", settings("Camera.fx", "Camera.fx: -535.4\n"),
     "fx or fy is -535.4", "pixels"},
    {"SettingsOfAFisheye", settings("Camera.type", "Camera.type: \"KannalaBrandt8\"\n"),
     "the key 'Camera.k1' is missing", "Camera.k1: VALUE"},
    {"SettingsOfAPanorama", settings("Camera.type", "Camera.model: equirectangular\n"),
     "the camera model 'equirectangular' is not supported", "rectify"},
};

INSTANTIATE_TEST_SUITE_P(Cameras, OneInvalidCamera, ::testing::ValuesIn(kInvalidCameras),
                         [](const auto& row) { return row.param.name; });

TEST(MalformedArguments, AnUnknownCameraNameSuggestsTheNearest) {
  const std::string error = error_of([] { read_camera("tum_fr4"); });
  EXPECT_THAT(error, HasSubstr("camera 'tum_fr4': is neither a known camera nor a file"));
  EXPECT_THAT(error, HasSubstr("did you mean 'tum_fr1'? Known: tum_fr1, tum_fr2, tum_fr3, kitchen, "
                               "bonn, icl_nuim, seven_scenes, realsense_d435i"));
}

TEST(MalformedArguments, AFolderInsteadOfACamera) {
  const TestSequence sequence(0);
  const std::string error = error_of([&] { read_camera(sequence.folder().string()); });
  EXPECT_THAT(error, HasSubstr("is a folder, not a camera"));
  EXPECT_THAT(error, HasSubstr("camera.yaml"));
}

}  // namespace
}  // namespace stillmap
