// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/decompressed_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/recording/input_file.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>
#include <zstd.h>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

// Recorded images compress by small factors; a file with a larger ratio is no recording.
constexpr std::uint64_t kLargestRatio = 1000, kSmallFile = 1 << 20;  // -, bytes

Error failure(const std::string& what, const fs::path& compressed) {
  return Error(what, compressed.string(),
               "decompress it first: unzstd FILE; or set TMPDIR to a folder with more space");
}

// A new file that is open for writing.
class OutputFile {
 public:
  explicit OutputFile(std::string name)
      : path_(std::move(name)), descriptor_(mkstemp(path_.data())) {}
  ~OutputFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::string& path() const { return path_; }
  bool is_open() const { return descriptor_ >= 0; }
  // Returns whether all bytes were written.
  bool write(ByteSpan bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return true;
  }

 private:
  std::string path_;
  int descriptor_;
};

void decompress(const InputFile& from, const OutputFile& to) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  std::vector<std::uint8_t> input(ZSTD_DStreamInSize()), output(ZSTD_DStreamOutSize());
  const std::uint64_t most = kSmallFile + kLargestRatio * from.size();
  std::uint64_t read = 0, written = 0;
  while (const std::size_t count = from.read(read, input)) {
    read += count;
    ZSTD_inBuffer in{input.data(), count, 0};
    bool full = true;  // The decompressor may hold more bytes.
    while (in.pos < in.size || full) {
      ZSTD_outBuffer out{output.data(), output.size(), 0};
      if (ZSTD_isError(ZSTD_decompressStream(stream.get(), &out, &in))) return;
      full = out.pos == out.size;
      written += out.pos;
      if (written > most)
        throw failure(fmt::format("decompresses to more than {} times its size", kLargestRatio),
                      from.path());
      if (!to.write(ByteSpan(output).first(out.pos))) {
        throw failure(
            fmt::format("cannot be decompressed to {} ({})", to.path(), std::strerror(errno)),
            from.path());
      }
    }
  }
}

}  // namespace

DecompressedFile::DecompressedFile(const fs::path& compressed) {
  const InputFile from(compressed);
  std::error_code ignored;
  const OutputFile to((fs::temp_directory_path(ignored) / "stillmap_XXXXXX").string());
  if (!to.is_open()) {
    throw failure(fmt::format("cannot be decompressed to {} ({})", to.path(), std::strerror(errno)),
                  compressed);
  }
  path_ = to.path();
  try {
    decompress(from, to);
  } catch (const Error&) {
    unlink(path_.c_str());
    throw;
  }
}

DecompressedFile::~DecompressedFile() { unlink(path_.c_str()); }

}  // namespace stillmap
