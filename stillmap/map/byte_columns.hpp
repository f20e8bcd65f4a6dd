// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

/// Lists of structs as columns of bytes, since similar values compress better together.
namespace stillmap {

template <typename Items, typename Field>
void put_column(ByteWriter& out, const Items& items, Field&& field) {
  std::vector<std::decay_t<decltype(field(items.front()))>> column;
  column.reserve(items.size());
  for (const auto& item : items) column.push_back(field(item));
  out.put_planes(std::span<const typename decltype(column)::value_type>(column));
}

template <typename T, typename Item, typename Set>
void get_column(ByteReader& in, std::vector<Item>& items, Set&& set) {
  const auto column = in.get_planes<T>(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) set(items[i], column[i]);
}

/// Returns `count` items to be filled column by column. Fails if the remaining bytes cannot hold
/// them.
template <typename Item>
std::vector<Item> get_items(ByteReader& in, std::size_t bytes_each) {
  const auto count = in.get<std::uint32_t>();
  if (count > in.left() / bytes_each) in.fail("declares more items than it contains");
  return std::vector<Item>(count);
}

}  // namespace stillmap
