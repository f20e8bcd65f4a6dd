// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <vector>

namespace stillmap::test {

/// Record and settings of the substitute for ONNX Runtime, which tests get from its function
/// fake_onnxruntime_state().
struct FakeOnnxRuntime {
  std::vector<std::string> calls;  ///< Calls and settings in their order, such as "append cuda".
  /// Messages of calls that fail, by the text of the call in `calls`.
  std::map<std::string, std::string> failures;
};

}  // namespace stillmap::test
