// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/page_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

namespace stillmap {

/// The open file; it exists until it is closed.
class Pages::File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() { ::close(descriptor_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  /// Returns whether all bytes were written; errno tells why not.
  bool write(std::string_view bytes, std::size_t begin) const {
    while (!bytes.empty()) {
      const ssize_t written =
          ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(begin));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(written));
      begin += static_cast<std::size_t>(written);
    }
    return true;
  }
  /// Returns the bytes as memory; MAP_FAILED with errno if that is impossible.
  void* map(std::size_t begin, std::size_t size, bool writable) const {
    const int access = writable ? PROT_READ | PROT_WRITE : PROT_READ;
    return ::mmap(nullptr, size, access, MAP_SHARED, descriptor_, static_cast<off_t>(begin));
  }
  /// Takes space on the disk, so that a later write to the memory cannot fail. Returns whether
  /// there is enough; errno tells why not.
  bool claim(std::size_t begin, std::size_t size) const {
    errno = ::posix_fallocate(descriptor_, static_cast<off_t>(begin), static_cast<off_t>(size));
    return errno == 0;
  }
  /// Frees the space of bytes on the disk, as far as the file system can.
  void discard(std::size_t begin, std::size_t size) const {
    ::fallocate(descriptor_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, static_cast<off_t>(begin),
                static_cast<off_t>(size));
  }

 private:
  int descriptor_;
};

namespace {

std::size_t up_to_whole_pages(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return (bytes + page - 1) / page * page;
}

std::filesystem::path or_temporary(const std::filesystem::path& folder) {
  if (!folder.empty()) return folder;
  const char* chosen = std::getenv("TMPDIR");
  return chosen != nullptr && *chosen != '\0' ? chosen : "/var/tmp";
}

/// Returns the descriptor of a new file without a name; -1 with errno if there is none.
int open_unnamed(const std::filesystem::path& folder) {
  const int unnamed = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (unnamed >= 0) return unnamed;
  std::string name = (folder / ".stillmap_pages_XXXXXX").string();  // not every file system can
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

[[noreturn]] void fail(const char* problem, const std::filesystem::path& folder) {
  throw Error(std::string("a temporary file ") + problem + " (" + std::strerror(errno) + ")",
              folder.string(), "check that the folder is writable, and that the disk is not full");
}

}  // namespace

Pages::~Pages() {
  ::munmap(data_, size_);
  file_->discard(begin_, up_to_whole_pages(size_));
}

void Pages::drop() const { ::madvise(data_, size_, MADV_DONTNEED); }

PageFile::PageFile(const std::filesystem::path& folder) : folder_(or_temporary(folder)) {
  std::error_code ignored;  // open() tells the reason
  std::filesystem::create_directories(folder_, ignored);
  const int descriptor = open_unnamed(folder_);
  if (descriptor < 0) fail("cannot be created", folder_);
  file_ = std::make_shared<const Pages::File>(descriptor);
}

std::shared_ptr<const Pages> PageFile::store(std::span<const std::string_view> parts) {
  std::size_t size = 0;
  for (const std::string_view part : parts) {
    if (!file_->write(part, end_ + size)) {
      const int reason = errno;
      file_->discard(end_, up_to_whole_pages(size + part.size()));
      errno = reason;
      fail("cannot be written", folder_);
    }
    size += part.size();
  }
  return next_pages(size, false);
}

std::shared_ptr<Pages> PageFile::reserve(std::size_t bytes) {
  if (!file_->claim(end_, bytes)) fail("cannot be written", folder_);
  return next_pages(bytes, true);
}

/// Returns the next bytes of the file, which exist.
std::shared_ptr<Pages> PageFile::next_pages(std::size_t size, bool writable) {
  void* data = file_->map(end_, size, writable);
  if (data == MAP_FAILED) fail("cannot be used", folder_);
  const std::size_t begin = end_;
  end_ += up_to_whole_pages(size);
  return std::shared_ptr<Pages>(new Pages(file_, begin, static_cast<std::byte*>(data), size));
}

bool SparePages::write(const std::function<void(PageFile&)>& write) {
  if (failed_) return false;
  try {
    if (!file_) file_.emplace(memory_.folder);
    write(*file_);
    return true;
  } catch (const Error& e) {
    failed_ = true;
    warn(content_ + " takes more memory than dense.memory from here on: " + e.what(),
         "make room there; the map itself is not affected");
    return false;
  }
}

}  // namespace stillmap
