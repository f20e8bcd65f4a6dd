// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/deflate.hpp"

#include <libdeflate.h>
#include <memory>
#include <new>

namespace stillmap {

namespace {

constexpr int kStored = 0;  // libdeflate's level without compression

/// @param bound_of, compress  libdeflate's functions for a format
template <typename BoundOf, typename Compress>
std::string compressed(std::string_view plain, int level, BoundOf bound_of, Compress compress) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(level), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  // Memory that is never written is never allocated, so the bound may exceed the data size.
  const std::size_t bound = bound_of(compressor.get(), plain.size());
  const auto packed = std::make_unique_for_overwrite<char[]>(bound);
  return {packed.get(),
          compress(compressor.get(), plain.data(), plain.size(), packed.get(), bound)};
}

std::string raw_deflate(std::string_view plain, int level) {
  return compressed(plain, level, libdeflate_deflate_compress_bound, libdeflate_deflate_compress);
}

}  // namespace

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  return libdeflate_crc32(before, bytes.data(), bytes.size());
}

std::string deflated(std::string_view plain, int level) {
  std::string packed = raw_deflate(plain, level);
  return plain.size() <= largest_inflated(packed.size()) ? packed : raw_deflate(plain, kStored);
}

std::string zlib_stream(std::string_view plain, int level) {
  return compressed(plain, level, libdeflate_zlib_compress_bound, libdeflate_zlib_compress);
}

std::optional<std::string> inflated(std::string_view packed, std::uint64_t size) {
  if (size > largest_inflated(packed.size())) return std::nullopt;
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>
      decompressor(libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  if (!decompressor) throw std::bad_alloc();
  std::string plain(size, '\0');
  if (libdeflate_deflate_decompress(decompressor.get(), packed.data(), packed.size(), plain.data(),
                                    plain.size(), nullptr) != LIBDEFLATE_SUCCESS) {
    return std::nullopt;
  }
  return plain;
}

}  // namespace stillmap
