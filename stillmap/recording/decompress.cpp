// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/decompress.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <bzlib.h>
#include <lz4frame.h>
#include <memory>
#include <zstd.h>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Output of a decompressor: a buffer that doubles until it has the declared size.
class Output {
 public:
  explicit Output(std::uint64_t declared) : declared_(declared) {}

  /// Returns free space behind the written bytes; empty when all declared bytes are written.
  std::span<std::uint8_t> space() {
    if (written_ == bytes_.size() && written_ < declared_) {
      constexpr std::size_t kFirst = 1 << 20;
      bytes_.resize(std::min<std::uint64_t>(declared_, std::max(kFirst, 2 * bytes_.size())));
    }
    return std::span(bytes_).subspan(written_);
  }
  void advance(std::size_t count) { written_ += count; }

  Decompressed take(bool at_end) {
    bytes_.resize(written_);
    return {std::move(bytes_), at_end && written_ == declared_};
  }

 private:
  std::uint64_t declared_;
  std::vector<std::uint8_t> bytes_;
  std::size_t written_ = 0;
};

Decompressed decompress_bzip2(ByteSpan data, Output output) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return {};
  stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(data.data()));
  stream.avail_in = static_cast<unsigned>(data.size());
  int state = BZ_OK;
  std::uint8_t beyond = 0;  // Receives a byte that exceeds the declared size.
  while (state == BZ_OK) {
    auto space = output.space();
    const bool full = space.empty();
    if (full) space = {&beyond, 1};
    stream.next_out = reinterpret_cast<char*>(space.data());
    stream.avail_out = static_cast<unsigned>(space.size());
    state = BZ2_bzDecompress(&stream);
    const std::size_t made = space.size() - stream.avail_out;
    if (full && made > 0) break;
    output.advance(made);
    if (state == BZ_OK && stream.avail_in == 0 && made == 0) break;
  }
  BZ2_bzDecompressEnd(&stream);
  return output.take(state == BZ_STREAM_END);
}

Decompressed decompress_lz4(ByteSpan data, Output output) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) return {};
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> owner(
      context, &LZ4F_freeDecompressionContext);
  bool at_end = false;
  while (!at_end) {
    const auto space = output.space();
    std::size_t made = space.size(), used = data.size();
    const std::size_t wanted =
        LZ4F_decompress(context, space.data(), &made, data.data(), &used, nullptr);
    if (LZ4F_isError(wanted)) break;
    output.advance(made);
    data = data.subspan(used);
    at_end = wanted == 0;
    if (made == 0 && used == 0) break;
  }
  return output.take(at_end);
}

Decompressed decompress_zstd(ByteSpan data, Output output) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  if (!stream) return {};
  ZSTD_inBuffer in{data.data(), data.size(), 0};
  bool at_end = false;
  while (!at_end) {
    const auto space = output.space();
    ZSTD_outBuffer out{space.data(), space.size(), 0};
    const std::size_t before = in.pos;
    const std::size_t hint = ZSTD_decompressStream(stream.get(), &out, &in);
    output.advance(out.pos);
    if (ZSTD_isError(hint)) break;
    at_end = hint == 0;
    if (out.pos == 0 && in.pos == before) break;
  }
  return output.take(at_end);
}

}  // namespace

std::optional<Compression> compression_of(std::string_view name) {
  if (name.empty() || name == "none") return Compression::kNone;
  if (name == "bz2") return Compression::kBzip2;
  if (name == "lz4") return Compression::kLz4;
  if (name == "zstd") return Compression::kZstd;
  return std::nullopt;
}

Decompressed decompress(Compression compression, ByteSpan data, std::uint64_t declared) {
  if (declared > kLargestChunk) {
    throw Error(fmt::format("a chunk declares {} decompressed bytes", declared), "",
                fmt::format("chunks of up to {} bytes are read", kLargestChunk));
  }
  switch (compression) {
    case Compression::kNone: {
      const auto bytes = data.first(std::min<std::uint64_t>(declared, data.size()));
      return {{bytes.begin(), bytes.end()}, declared == data.size()};
    }
    case Compression::kBzip2:
      return decompress_bzip2(data, Output(declared));
    case Compression::kLz4:
      return decompress_lz4(data, Output(declared));
    case Compression::kZstd:
      return decompress_zstd(data, Output(declared));
  }
  return {};
}

}  // namespace stillmap
