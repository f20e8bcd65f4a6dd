// Tests of the devices cuda and tensorrt with substitutes for ONNX Runtime and NVIDIA's driver
// (fake/): settings, messages, memory, and TensorRT's cache. They need no GPU.
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/segment/fake/fake_onnxruntime.hpp"
#include "stillmap/segment/onnxruntime_engine.hpp"
#include "stillmap/segment/tensorrt_cache.hpp"
#include "stillmap/segment/test_onnx.hpp"

#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <iostream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// Returns the names of the entries of a folder by name.
std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

/// Returns what `work` prints to standard error.
template <typename Work>
std::string printed_by(const Work& work) {
  testing::internal::CaptureStderr();
  work();
  return testing::internal::GetCapturedStderr();
}

/// A copy of the substitute with the execution providers that it claims to have, and a network.
struct NvidiaGpu : testing::Test {
  const fs::path folder = test::own_path("nvidia");
  const fs::path network = folder / "relu.onnx";
  const fs::path cache = folder / "relu.onnx.tensorrt";
  EngineOptions options{.model = network.string(),
                        .input = "in",
                        .input_shape = {1, 3, 2, 2},
                        .dynamic_dimensions = {},
                        .outputs = {"out"},
                        .device = "cuda"};
  std::unique_ptr<OnnxRuntimeLibrary> library;

  void SetUp() override {
    fs::create_directories(folder);
    fs::copy_file(STILLMAP_FAKE_ONNXRUNTIME, folder / "libonnxruntime.so",
                  fs::copy_options::overwrite_existing);  // of a killed test with the same number
    for (const char* provider : {"cuda", "tensorrt"})
      write_file(folder / ("libonnxruntime_providers_" + std::string(provider) + ".so"), "");
    write_network("");
    library =
        std::make_unique<OnnxRuntimeLibrary>(std::vector<fs::path>{folder / "libonnxruntime.so"});
    ASSERT_TRUE(library->loaded()) << library->problem();
  }
  void TearDown() override {
    fake().calls.clear();
    fake().failures.clear();
    fs::remove_all(folder);
  }
  void write_network(const std::string& version) const {
    write_file(network, test::tiny_model("Relu", {1, 3, 2, 2}, {1, 3, 2, 2}, {{"v", version}}));
  }
  test::FakeOnnxRuntime& fake() const {
    void* opened = dlopen((folder / "libonnxruntime.so").c_str(), RTLD_NOW);
    return *reinterpret_cast<test::FakeOnnxRuntime* (*)()>(
        dlsym(opened, "fake_onnxruntime_state"))();
  }
  std::unique_ptr<InferenceEngine> start(const std::string& device) {
    options.device = device;
    return make_onnxruntime_engine(options, *library);
  }
  /// Starts an engine and runs it once, as before the first frame.
  void run(const std::string& device) { start(device)->run(); }
  Error error_of(const std::string& device) {
    try {
      start(device);
    } catch (const Error& e) {
      return e;
    }
    return {"no error", "", ""};
  }
  std::size_t engines_built() const {
    return static_cast<std::size_t>(std::ranges::count(fake().calls, "build engine"));
  }
  /// Returns the folder of the engine, the only one besides the file for the lock.
  fs::path engine_folder() const {
    const auto names = names_in(cache);
    EXPECT_THAT(names, ElementsAre(testing::_, "lock"));
    return cache / names.front();
  }
};

TEST_F(NvidiaGpu, CudaRunsInPinnedMemoryWithAlgorithmsChosenByRules) {
  const auto engine = start("cuda");
  EXPECT_THAT(fake().calls, ElementsAre("cuda cudnn_conv_algo_search=HEURISTIC", "append cuda",
                                        "create session", "memory CudaPinned"));
  std::ranges::fill(engine->input(), -2.0F);
  engine->input().front() = 3;
  const auto outputs = engine->run();
  ASSERT_EQ(outputs.size(), 1U);
  EXPECT_THAT(outputs[0].shape, ElementsAre(1, 3, 2, 2));
  EXPECT_EQ(outputs[0].values[0], 3);
  EXPECT_EQ(outputs[0].values[11], 0);
}

TEST_F(NvidiaGpu, WithoutPinnedMemoryOrdinaryMemoryIsUsed) {
  fake().failures["memory CudaPinned"] = "unknown memory";
  const std::string printed = printed_by([&] { run("cuda"); });
  EXPECT_EQ(printed, "");
  EXPECT_THAT(fake().calls, Contains("memory Cpu"));
}

TEST_F(NvidiaGpu, TensorRtRunsIn16BitFloatsAndCudaRunsTheRest) {
  (void)printed_by([&] { run("tensorrt"); });
  EXPECT_THAT(
      fake().calls,
      AllOf(Contains("tensorrt trt_fp16_enable=1"), Contains("tensorrt trt_engine_cache_enable=1"),
            Contains("tensorrt trt_timing_cache_enable=1"),
            Contains(StartsWith("tensorrt trt_timing_cache_path=" + cache.string()))));
  const auto at = [&](const char* call) { return std::ranges::find(fake().calls, call); };
  EXPECT_LT(at("append tensorrt"), at("append cuda"));
  EXPECT_LT(at("append cuda"), at("create session"));
}

TEST_F(NvidiaGpu, TheEngineIsBuiltOnceForEachContentOfTheNetwork) {
  EXPECT_THAT(printed_by([&] { run("tensorrt"); }), HasSubstr("which takes minutes, once"));
  EXPECT_EQ(printed_by([&] { run("tensorrt"); }), "");
  EXPECT_EQ(engines_built(), 1U);
  EXPECT_THAT(names_in(engine_folder()), ElementsAre("fake.engine"));
  write_network("trained again");
  EXPECT_THAT(printed_by([&] { run("tensorrt"); }), HasSubstr("which takes minutes, once"));
  EXPECT_EQ(engines_built(), 2U);
}

TEST_F(NvidiaGpu, AnEngineThatNeverRanIsNotKept) {
  (void)printed_by([&] { (void)start("tensorrt"); });
  EXPECT_THAT(names_in(cache), ElementsAre("lock"));
}

TEST_F(NvidiaGpu, WhatAKilledProcessLeftIsBuiltAgain) {
  (void)printed_by([&] { run("tensorrt"); });
  const fs::path engine = engine_folder();
  fs::rename(engine, engine.string() + ".building");
  write_file(engine.string() + ".building/fake.engine", "eng");
  (void)printed_by([&] { run("tensorrt"); });
  EXPECT_EQ(engine_folder(), engine);
  EXPECT_EQ(read_file(engine / "fake.engine"), "engine");
}

TEST_F(NvidiaGpu, ADamagedEngineIsBuiltAgainWithAWarning) {
  (void)printed_by([&] { run("tensorrt"); });
  write_file(engine_folder() / "fake.engine", "");
  EXPECT_THAT(printed_by([&] { run("tensorrt"); }),
              AllOf(HasSubstr("cannot read the engine of an earlier run"), HasSubstr("deserialize"),
                    HasSubstr("it is built again")));
  EXPECT_EQ(read_file(engine_folder() / "fake.engine"), "engine");
}

TEST_F(NvidiaGpu, AnotherFailureKeepsTheEngine) {
  (void)printed_by([&] { run("tensorrt"); });
  fake().failures["create session"] = "CUDA failure 2: out of memory ; GPU=0";
  EXPECT_THAT(error_of("tensorrt").problem(), HasSubstr("CUDA failure 2: out of memory"));
  EXPECT_THAT(names_in(engine_folder()), ElementsAre("fake.engine"));
}

TEST_F(NvidiaGpu, WithoutAWritableFolderTheEngineIsNotKept) {
  write_file(cache, "a file where the folder would be");
  EXPECT_THAT(printed_by([&] { run("tensorrt"); }),
              AllOf(HasSubstr("builds its engine in every run"), HasSubstr(cache.string())));
  EXPECT_THAT(fake().calls, Not(Contains(HasSubstr("cache_path"))));
  EXPECT_EQ(read_file(cache), "a file where the folder would be");
}

/// The second process gets the engine of the first, whichever of them comes to the lock earlier.
TEST_F(NvidiaGpu, ASecondProcessWaitsForTheEngineOfTheFirst) {
  testing::internal::CaptureStderr();
  auto first = std::make_unique<TensorRtCache>(network, "GPU");
  ASSERT_FALSE(first->complete());
  bool complete = false;
  fs::path found;
  std::thread other([&] {
    const TensorRtCache second(network, "GPU");
    complete = second.complete();
    found = second.folder();
  });
  write_file(first->folder() / "fake.engine", "engine");
  first->commit();
  other.join();
  (void)testing::internal::GetCapturedStderr();
  EXPECT_TRUE(complete);
  EXPECT_EQ(found, first->folder());
  EXPECT_EQ(read_file(found / "fake.engine"), "engine");
}

TEST_F(NvidiaGpu, OtherVersionsOfTheLibrariesGetAnotherEngine) {
  (void)printed_by([&] {
    TensorRtCache one(network, "GPU, TensorRT 10.1");
    one.commit();
    EXPECT_TRUE(TensorRtCache(network, "GPU, TensorRT 10.1").complete());
    EXPECT_FALSE(TensorRtCache(network, "GPU, TensorRT 10.2").complete());
  });
}

TEST_F(NvidiaGpu, AMissingLibraryIsAnErrorThatNamesItAndTheCommand) {
  const std::string loader = "/lib/a.so with error: libcudnn.so.9: cannot open shared object file";
  fake().failures["append cuda"] = loader;
  fake().failures["create tensorrt"] = "x with error: libnvinfer.so.10: cannot open shared object";
  const Error cuda = error_of("cuda"), tensorrt = error_of("tensorrt");
  EXPECT_THAT(cuda.problem(), HasSubstr("the device cuda: libcudnn.so.9: cannot open"));
  EXPECT_THAT(cuda.fix(), HasSubstr("pip install \"onnxruntime-gpu[cuda,cudnn]\""));
  EXPECT_THAT(tensorrt.problem(), HasSubstr("libnvinfer.so.10"));
  EXPECT_THAT(tensorrt.fix(), HasSubstr("\"tensorrt-cu13<11\""));
  EXPECT_FALSE(fs::exists(cache));  // no folder for an engine that cannot be built
  setenv("STILLMAP_ONNXRUNTIME", "/opt/gpu", 1);
  EXPECT_THAT(error_of("cuda").fix(), HasSubstr("in the environment of '/opt/gpu'"));
  unsetenv("STILLMAP_ONNXRUNTIME");
}

TEST_F(NvidiaGpu, AMissingProviderIsAnErrorThatNamesIt) {
  fs::remove(folder / "libonnxruntime_providers_tensorrt.so");
  EXPECT_THAT(error_of("tensorrt").problem(),
              HasSubstr("version 9.9.9 has no libonnxruntime_providers_tensorrt.so"));
  EXPECT_EQ(error_of("cuda").problem(), "no error");
}

TEST_F(NvidiaGpu, AFailureOfTheDriverGetsTheAdviceForDrivers) {
  fake().failures["create session"] =
      "CUDA failure 35: CUDA driver version is insufficient for CUDA runtime version ; GPU=-1";
  const Error error = error_of("cuda");
  EXPECT_THAT(error.problem(), HasSubstr("CUDA failure 35: CUDA driver version is insufficient"));
  EXPECT_THAT(error.fix(), HasSubstr("nvidia-smi"));
}

// The choice of the device, in a process of its own, since drivers and libraries are looked for
// once.

/// Lets this process find the substitutes, then prints device, name and reason of the engine.
[[noreturn]] void print_choice(const NvidiaGpu& test, const std::string& device) {
  setenv("STILLMAP_ONNXRUNTIME", test.folder.c_str(), 1);
  dlopen(STILLMAP_FAKE_CUDA, RTLD_NOW);
  EngineOptions options = test.options;
  options.device = device;
  try {
    const ChosenEngine chosen = choose_engine("auto", options);
    std::cerr << "[" << chosen.device << "] [" << chosen.engine->name().text() << "] ["
              << chosen.reason << "]\n";
  } catch (const Error& e) {
    std::cerr << "[error: " << e.what() << "]\n";
  }
  std::_Exit(0);
}

using NvidiaGpuDeathTest = NvidiaGpu;

TEST_F(NvidiaGpuDeathTest, AutoTakesTensorRtThenCudaThenTheCpu) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto exits = testing::ExitedWithCode(0);
  EXPECT_EXIT(print_choice(*this, "auto"), exits,
              "\\[tensorrt\\] \\[ONNX Runtime 9.9.9 with TensorRT on Fake GPU\\] \\[\\]");
  EXPECT_EXIT(
      {
        fs::remove(folder / "libonnxruntime_providers_tensorrt.so");
        print_choice(*this, "auto");
      },
      exits,
      "\\[cuda\\] \\[ONNX Runtime 9.9.9 with CUDA on Fake GPU\\] \\[.*has no "
      "libonnxruntime_providers_tensorrt.so\\]");
  EXPECT_EXIT(
      {
        fs::remove(folder / "libonnxruntime_providers_cuda.so");
        print_choice(*this, "auto");
      },
      exits, "warning: .*libonnxruntime_providers_cuda.so; the network runs elsewhere");
  EXPECT_EXIT(
      {
        fs::remove(folder / "libonnxruntime_providers_cuda.so");
        print_choice(*this, "cuda");
      },
      exits, "error: network.device: .*no libonnxruntime_providers_cuda.so");
}

}  // namespace
}  // namespace stillmap
