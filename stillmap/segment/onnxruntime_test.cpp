// Tests of ONNX Runtime on the CPU, which are skipped where it is not installed, and of the
// messages about libraries and devices that are missing.
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/segment/accelerator.hpp"
#include "stillmap/segment/onnxruntime_engine.hpp"
#include "stillmap/segment/test_onnx.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

/// The network out = max(in, 0) of 1 x 3 x 2 x 2 values, in a file.
struct OnnxRuntime : testing::Test {
  const fs::path file = test::own_path("relu.onnx");
  EngineOptions options{.model = file.string(),
                        .input = "in",
                        .input_shape = {1, 3, 2, 2},
                        .dynamic_dimensions = {},
                        .outputs = {"out"}};
  const std::vector<float> input = {-1, 2, -3, 4, 5, -6, 7, -8, -9, 10, -11, 12};
  const std::vector<float> output = {0, 2, 0, 4, 5, 0, 7, 0, 0, 10, 0, 12};

  void write(const std::vector<std::int64_t>& shape) const {
    write_file(file, test::tiny_model("Relu", shape, shape));
  }
  void SetUp() override { write({1, 3, 2, 2}); }
  void TearDown() override { fs::remove(file); }
  /// Returns the message for a back end and a device.
  std::string error_of(const std::string& backend, const std::string& device) const {
    EngineOptions changed = options;
    changed.device = device;
    try {
      choose_engine(backend, changed);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }
  static bool missing() { return !OnnxRuntimeLibrary::instance().loaded(); }
};

TEST_F(OnnxRuntime, ComputesTheNetworkInEveryRun) {
  if (missing()) GTEST_SKIP() << "no ONNX Runtime";
  const auto engine = make_onnxruntime_engine(options);
  for (int run = 0; run < 3; ++run) {
    std::ranges::copy(input, engine->input().begin());
    const auto outputs = engine->run();
    ASSERT_EQ(outputs.size(), 1U);
    EXPECT_THAT(outputs[0].shape, ElementsAre(1, 3, 2, 2));
    EXPECT_EQ(std::vector<float>(outputs[0].values.begin(), outputs[0].values.end()), output);
  }
}

TEST_F(OnnxRuntime, FixesDynamicSizes) {
  if (missing()) GTEST_SKIP() << "no ONNX Runtime";
  write({1, 3, -1, -1});
  options.dynamic_dimensions = {{"open", 2}};
  EXPECT_THAT(make_onnxruntime_engine(options)->run()[0].shape, ElementsAre(1, 3, 2, 2));
  options.dynamic_dimensions = {{"open", 4}};
  EXPECT_THROW(make_onnxruntime_engine(options)->run(), std::runtime_error);
}

TEST_F(OnnxRuntime, AnErrorOfABackEndNamesDynamicSizes) {
  write_file(file, test::tiny_model("Unheard", {1, 3, -1, -1}, {1, 3, -1, -1}));
  options.dynamic_dimensions = {{"open", 2}};
  EXPECT_THAT(error_of("opencv", "cpu"), AllOf(HasSubstr("whose sizes are dynamic (open)"),
                                               HasSubstr("without dynamic=True")));
}

TEST_F(OnnxRuntime, NamesItsVersionAndTheDevice) {
  if (missing()) GTEST_SKIP() << "no ONNX Runtime";
  const ChosenEngine chosen = choose_engine("onnxruntime", options);
  EXPECT_EQ(chosen.device, "cpu");
  EXPECT_EQ(chosen.engine->name().text(),
            "ONNX Runtime " + OnnxRuntimeLibrary::instance().version() + " on the CPU");
}

/// The functions for GPUs stand far from those for the CPU in the library's table: a wrong place
/// would call another function.
TEST_F(OnnxRuntime, FunctionsForGpusStandAtTheirPlaces) {
  if (missing()) GTEST_SKIP() << "no ONNX Runtime";
  const ort::Api& api = OnnxRuntimeLibrary::instance().api();
  const auto expect = [&](ort::Status* status, const char* name) {
    if (status == nullptr) return;  // a library with CUDA
    EXPECT_THAT(api.message(status), AllOf(HasSubstr(name), HasSubstr("not enabled"))) << name;
    api.release_status(status);
  };
  ort::CudaOptions* cuda = nullptr;
  expect(api.create_cuda_options(&cuda), "CUDA");
  if (cuda != nullptr) api.release_cuda_options(cuda);
  ort::TensorRtOptions* tensorrt = nullptr;
  expect(api.create_tensorrt_options(&tensorrt), "TensorRT");
  if (tensorrt != nullptr) api.release_tensorrt_options(tensorrt);
}

TEST_F(OnnxRuntime, WithoutCudaNamesTheMissingProviderAndTheCommand) {
  if (missing()) GTEST_SKIP() << "no ONNX Runtime";
  const auto& library = OnnxRuntimeLibrary::instance();
  if (fs::exists(library.folder() / "libonnxruntime_providers_cuda.so")) GTEST_SKIP() << "has CUDA";
  options.device = "cuda";
  try {
    make_onnxruntime_engine(options);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.problem(), HasSubstr("libonnxruntime_providers_cuda.so"));
    EXPECT_THAT(e.fix(), HasSubstr("pip install \"onnxruntime-gpu[cuda,cudnn]\""));
  }
}

TEST_F(OnnxRuntime, AnUnusableLibraryIsAnErrorThatNamesIt) {
  const fs::path broken = test::own_path("libonnxruntime.so");
  write_file(broken, "hello");
  const std::vector<fs::path> libraries = {broken, "libm.so.6", "/nowhere/libonnxruntime.so"};
  const std::vector<std::string> problems = {broken.string(), "OrtGetApiBase", "/nowhere"};
  for (std::size_t i = 0; i < libraries.size(); ++i) {
    const OnnxRuntimeLibrary library({libraries[i]});
    EXPECT_FALSE(library.loaded());
    EXPECT_THAT(library.problem(), HasSubstr(problems[i]));
    try {
      make_onnxruntime_engine(options, library);
      ADD_FAILURE() << "no error";
    } catch (const Error& e) {
      EXPECT_THAT(e.problem(), HasSubstr(problems[i]));
      EXPECT_THAT(e.fix(), HasSubstr("pip install onnxruntime"));
    }
  }
  fs::remove(broken);
}

TEST_F(OnnxRuntime, AnIncompleteLibraryIsNotOpened) {
  const fs::path cut = test::own_path("libonnxruntime_cut.so");
  std::vector<char> start(4096);
  std::ifstream("/proc/self/exe", std::ios::binary).read(start.data(), std::ssize(start));
  write_file(cut, std::string(start.begin(), start.end()));
  const OnnxRuntimeLibrary library({cut});
  EXPECT_FALSE(library.loaded());
  EXPECT_THAT(library.problem(), HasSubstr("is incomplete: it has 4096 of"));
  fs::remove(cut);
}

/// Returns the problem of a copy of this program's start, marked as one for another processor.
std::string problem_of_library_for(unsigned char elf_class, unsigned char machine) {
  constexpr std::size_t kClass = 4, kMachine = 18;  // e_ident[EI_CLASS], e_machine
  const fs::path file = test::own_path("libonnxruntime_other.so");
  std::string start(4096, '\0');
  std::ifstream("/proc/self/exe", std::ios::binary).read(start.data(), std::ssize(start));
  start[kClass] = static_cast<char>(elf_class);
  start[kMachine] = static_cast<char>(machine);
  write_file(file, start);
  const OnnxRuntimeLibrary library({file});
  EXPECT_FALSE(library.loaded());
  fs::remove(file);
  return library.problem();
}

TEST_F(OnnxRuntime, ALibraryForAnotherProcessorIsAnErrorThatNamesBoth) {
#if defined(__x86_64__)
  EXPECT_THAT(problem_of_library_for(2, 183), HasSubstr("for 64-bit ARM (aarch64) processors; "
                                                        "this program runs on x86-64"));
  EXPECT_THAT(problem_of_library_for(1, 3), HasSubstr("for 32-bit x86 processors"));
  EXPECT_THAT(problem_of_library_for(1, 40), HasSubstr("for 32-bit ARM processors"));
#else
  EXPECT_THAT(problem_of_library_for(2, 62), HasSubstr("for x86-64 processors"));
#endif
}

TEST_F(OnnxRuntime, AnEnvironmentVariableThatIsTheCauseIsInTheFix) {
  const OnnxRuntimeLibrary library({"/nowhere/libonnxruntime.so"});
  setenv("STILLMAP_ONNXRUNTIME", "/nowhere", 1);
  try {
    make_onnxruntime_engine(options, library);
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.fix(), HasSubstr("correct or unset the environment variable "
                                   "STILLMAP_ONNXRUNTIME, which is '/nowhere'"));
  }
  unsetenv("STILLMAP_ONNXRUNTIME");
}

TEST_F(OnnxRuntime, TheEnvironmentVariableMayNameAPackageOrAnEnvironment) {
  const fs::path environment = test::own_path("environment");
  const fs::path package = environment / "lib/python3.11/site-packages/onnxruntime";
  fs::create_directories(package / "capi");
  const fs::path library = package / "capi" / "libonnxruntime.so.1.2.3";
  write_file(library, "");
  for (const fs::path& given : {package, environment}) {
    setenv("STILLMAP_ONNXRUNTIME", given.c_str(), 1);
    EXPECT_THAT(onnxruntime_files(), ElementsAre(library)) << given;
  }
  unsetenv("STILLMAP_ONNXRUNTIME");
  fs::remove_all(environment);
}

TEST_F(OnnxRuntime, TheEnvironmentVariableNamesAFileOrAFolder) {
  const fs::path folder = test::own_path("libraries");
  fs::create_directories(folder);
  const fs::path library = folder / "libonnxruntime.so.1.2.3";
  write_file(library, "");
  for (const fs::path& given : {folder, library}) {
    setenv("STILLMAP_ONNXRUNTIME", given.c_str(), 1);
    EXPECT_THAT(onnxruntime_files(), ElementsAre(library));
  }
  setenv("STILLMAP_ONNXRUNTIME", folder.c_str(), 1);
  fs::remove(library);
  EXPECT_THAT(onnxruntime_files(), ElementsAre(folder / "libonnxruntime.so.1"));
  unsetenv("STILLMAP_ONNXRUNTIME");
  fs::remove_all(folder);
}

TEST_F(OnnxRuntime, ThePackageOfTheActiveEnvironmentComesFirstAndOneWithCudaBeforeIt) {
  const fs::path prefix = test::own_path("environment");
  const auto package = [&](const char* python) {
    const fs::path made = prefix / "lib" / python / "site-packages/onnxruntime/capi";
    fs::create_directories(made);
    write_file(made / "libonnxruntime.so.1.2.3", "");
    return made;
  };
  const fs::path first = package("python3.11"), second = package("python3.12");
  setenv("VIRTUAL_ENV", prefix.c_str(), 1);
  EXPECT_EQ(onnxruntime_files().at(0), first / "libonnxruntime.so.1.2.3");
  write_file(second / "libonnxruntime_providers_cuda.so", "");
  EXPECT_EQ(onnxruntime_files().at(0), second / "libonnxruntime.so.1.2.3");
  unsetenv("VIRTUAL_ENV");
  fs::remove_all(prefix);
}

TEST_F(OnnxRuntime, ADeviceThatIsMissingIsAnErrorThatNamesThePartAndTheCommand) {
  const std::vector<std::array<std::string, 3>> cases = {
      {"cuda", "NVIDIA", "install nvidia-driver"},
      {"tensorrt", "NVIDIA", "install nvidia-driver"},
      {"intel-gpu", "Intel GPU", "apt-get install intel-opencl-icd"},
      {"npu", "NPU", "linux-npu-driver"}};
  for (const auto& [device, part, command] : cases) {
    if (missing_hardware(device).empty()) continue;
    EXPECT_THAT(error_of("auto", device), AllOf(HasSubstr("the device " + device + " is missing"),
                                                HasSubstr(part), HasSubstr(command)));
  }
}

TEST_F(OnnxRuntime, ABackEndThatDoesNotKnowTheDeviceIsAnError) {
  EXPECT_THAT(error_of("opencv", "cuda"), HasSubstr("take the back end auto or onnxruntime"));
  EXPECT_THAT(error_of("openvino", "tensorrt"), HasSubstr("auto or onnxruntime"));
  EXPECT_THAT(error_of("onnxruntime", "npu"), HasSubstr("auto or openvino"));
}

TEST_F(OnnxRuntime, WithoutAnyAcceleratorAutoTakesTheCpuAndSaysWhy) {
  for (const char* device : {"cuda", "intel-gpu", "npu"}) {
    if (missing_hardware(device).empty()) GTEST_SKIP() << "there may be a " << device;
  }
  options.device = "auto";
  const ChosenEngine chosen = choose_engine("auto", options);
  EXPECT_EQ(chosen.device, "cpu");
  EXPECT_THAT(chosen.reason, AllOf(HasSubstr("NVIDIA"), HasSubstr("Intel GPU"), HasSubstr("NPU")));
}

}  // namespace
}  // namespace stillmap
