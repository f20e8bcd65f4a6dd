// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

namespace stillmap {

/// Permanent id of an element of a SlotMap. Slots are reused with a new generation, so the id of an
/// erased element never refers to another one. Ordered by slot.
template <typename Tag>
struct Id {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t slot = kNone;
  std::uint32_t generation = 0;

  bool valid() const { return slot != kNone; }
  auto operator<=>(const Id&) const = default;
};

/// Container with ids: constant-time access, stable addresses, memory bounded by the largest number
/// of simultaneous elements, iteration in slot order (the same in every run).
template <typename Tag, typename T>
class SlotMap {
 public:
  using Key = Id<Tag>;

  /// Adds the element that `make(id)` returns.
  template <typename Make>
  T& emplace(Make&& make) {
    std::uint32_t slot;
    if (free_.empty()) {
      slot = static_cast<std::uint32_t>(slots_.size());
      slots_.emplace_back();
    } else {
      slot = free_.back();
      free_.pop_back();
    }
    Slot& s = slots_[slot];
    s.value.emplace(make(Key{slot, s.generation}));
    ++size_;
    return *s.value;
  }

  void erase(Key id) {
    if (!contains(id)) return;
    slots_[id.slot].value.reset();
    ++slots_[id.slot].generation;
    free_.push_back(id.slot);
    --size_;
  }

  bool contains(Key id) const {
    return id.slot < slots_.size() && slots_[id.slot].generation == id.generation &&
           slots_[id.slot].value.has_value();
  }
  T* find(Key id) { return contains(id) ? &*slots_[id.slot].value : nullptr; }
  const T* find(Key id) const { return contains(id) ? &*slots_[id.slot].value : nullptr; }
  std::size_t size() const { return size_; }
  /// Returns one more than the largest slot ever used, for tables indexed by slot.
  std::size_t capacity() const { return slots_.size(); }

  template <typename F>
  void for_each(F&& f) {
    for (Slot& s : slots_)
      if (s.value) f(*s.value);
  }
  template <typename F>
  void for_each(F&& f) const {
    for (const Slot& s : slots_)
      if (s.value) f(*s.value);
  }

 private:
  struct Slot {
    std::optional<T> value;
    std::uint32_t generation = 0;
  };
  std::deque<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::size_t size_ = 0;
};

}  // namespace stillmap
