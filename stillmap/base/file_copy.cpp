// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/file_copy.hpp"

#include "stillmap/base/file.hpp"

#include <fstream>
#include <vector>

namespace stillmap {

void write_copy(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream in = open_file(from);
  write_file(to, [&](std::ostream& out) {
    std::vector<char> part(1 << 20);
    // Unlike operator<<, write() sets the state of `out` when only a part fits on the disk.
    while (out &&
           (in.read(part.data(), static_cast<std::streamsize>(part.size())) || in.gcount() > 0))
      out.write(part.data(), in.gcount());
  });
}

}  // namespace stillmap
