// SPDX-License-Identifier: Apache-2.0
/// The vocabulary's file, all numbers little-endian:
///
///     offset  size       content
///     0       8          "STILLVOC"
///     8       4          version, 1
///     12      4          nodes N, the root among them
///     16      4          words W, the number of leaves
///     20      8          FNV-1a (64 bits) of all that follows
///     28      N          number of children of each node, level by level, the root first
///     28 + N  32 (N-1)   descriptor of each node but the root
///     ...     4 W        inverse document frequency of each leaf, IEEE single precision
#include "stillmap/base/error.hpp"
#include "stillmap/base/fnv1a.hpp"
#include "stillmap/feature/vocabulary.hpp"

#include <bit>
#include <cstring>

#include <fmt/format.h>

// NOLINTBEGIN(readability-identifier-naming): the assembler defines the names
extern "C" {
extern const char stillmap_vocabulary_begin[];  // Defined in vocabulary_data.cpp.
extern const char stillmap_vocabulary_end[];
}
// NOLINTEND(readability-identifier-naming)

namespace stillmap {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied without conversion");

constexpr std::string_view kMagic = "STILLVOC";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeader = 28;
constexpr const char* kFix = "train one with: stillmap_lab vocabulary IMAGES... --out FILE";

template <typename T>
void append(std::string& out, const T* values, std::size_t count) {
  const std::size_t at = out.size();
  out.resize(at + sizeof(T) * count);
  if (count > 0) std::memcpy(out.data() + at, values, sizeof(T) * count);
}

template <typename T>
T number_at(std::string_view bytes, std::size_t offset) {
  T value;
  bytes.copy(reinterpret_cast<char*>(&value), sizeof value, offset);
  return value;
}

/// Reads `count` values from the front.
template <typename T>
std::vector<T> take(std::string_view& bytes, std::size_t count) {
  std::vector<T> values(count);
  if (count > 0) bytes.copy(reinterpret_cast<char*>(values.data()), sizeof(T) * count);
  bytes.remove_prefix(sizeof(T) * count);
  return values;
}

}  // namespace

std::string Vocabulary::bytes() const {
  std::string payload;
  for (const Node& node : nodes_) payload.push_back(static_cast<char>(node.children));
  append(payload, descriptors_.data() + 1, descriptors_.size() - 1);
  append(payload, idf_.data(), idf_.size());
  std::string out(kMagic);
  const std::uint32_t header[] = {kVersion, static_cast<std::uint32_t>(nodes_.size()),
                                  static_cast<std::uint32_t>(idf_.size())};
  append(out, header, 3);
  const std::uint64_t checksum = fnv1a(payload);
  append(out, &checksum, 1);
  return out + payload;
}

Vocabulary Vocabulary::from_bytes(std::string_view bytes, const std::string& where) {
  if (bytes.size() < kHeader || !bytes.starts_with(kMagic)) {
    throw Error("is not a vocabulary of this program", where, kFix);
  }
  const auto version = number_at<std::uint32_t>(bytes, 8);
  if (version != kVersion) {
    throw Error(fmt::format("is a vocabulary of version {}, and this program reads version {}",
                            version, kVersion),
                where, kFix);
  }
  const std::uint64_t nodes = number_at<std::uint32_t>(bytes, 12);
  const std::uint64_t words = number_at<std::uint32_t>(bytes, 16);
  const std::uint64_t expected = kHeader + nodes * (1 + sizeof(Descriptor)) + 4 * words;
  if (nodes == 0 || bytes.size() + sizeof(Descriptor) != expected) {
    throw Error(fmt::format("contains {} bytes, but its header declares {}", bytes.size(),
                            expected - sizeof(Descriptor)),
                where, "copy it again, or " + std::string(kFix));
  }
  std::string_view rest = bytes.substr(kHeader);
  if (fnv1a(rest) != number_at<std::uint64_t>(bytes, 20)) {
    throw Error("is corrupt: its checksum is wrong", where,
                "copy it again, or " + std::string(kFix));
  }
  auto children = take<std::uint8_t>(rest, nodes);
  auto descriptors = take<Descriptor>(rest, nodes - 1);
  auto idf = take<float>(rest, words);
  return {std::move(children), std::move(descriptors), std::move(idf)};
}

Vocabulary Vocabulary::built_in() {
  const std::string_view bytes(
      stillmap_vocabulary_begin,
      static_cast<std::size_t>(stillmap_vocabulary_end - stillmap_vocabulary_begin));
  return from_bytes(bytes, "the built-in vocabulary");
}

}  // namespace stillmap
