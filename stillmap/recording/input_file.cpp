// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/input_file.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace stillmap {
namespace fs = std::filesystem;

InputFile::InputFile(const fs::path& path) : path_(path) {
  std::error_code failed;
  const auto status = fs::status(path, failed);
  if (!fs::exists(status)) throw Error("there is no such file", path.string(), "check the name");
  if (!fs::is_regular_file(status)) {
    throw Error("is not a regular file", path.string(), "give a recorded file");
  }
  size_ = fs::file_size(path, failed);
  descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (failed || descriptor_ < 0) {
    throw Error(std::string("cannot be read (") + std::strerror(errno) + ")", path.string(),
                "check its permissions");
  }
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::size_t InputFile::read(std::uint64_t offset, std::span<std::uint8_t> buffer) const {
  std::size_t done = 0;
  while (done < buffer.size()) {
    const ssize_t count = pread(descriptor_, buffer.data() + done, buffer.size() - done,
                                static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

ByteSpan ByteSource::at(std::uint64_t position, std::size_t count) {
  if (position >= end_) return {};
  count = std::min<std::uint64_t>(count, end_ - position);
  if (file_ == nullptr) return memory_.subspan(position, count);
  const bool buffered =
      position >= buffer_begin_ && position + count <= buffer_begin_ + buffer_.size();
  if (!buffered) {
    constexpr std::size_t kReadAhead = 4096;  // Record headers are small; messages are skipped.
    buffer_.resize(std::min<std::uint64_t>(std::max(count, kReadAhead), end_ - position));
    buffer_.resize(file_->read(position, buffer_));
    buffer_begin_ = position;
  }
  const ByteSpan bytes = ByteSpan(buffer_).subspan(position - buffer_begin_);
  return bytes.first(std::min(count, bytes.size()));
}

}  // namespace stillmap
