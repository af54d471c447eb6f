// FNV-1a in 64 bits (http://www.isthe.com/chongo/tech/comp/fnv): finds damage and change, not
// malice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace taut {

class Hash {
public:
  Hash& add(void const* data, std::size_t size) {
    auto const* const bytes = static_cast<unsigned char const*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3U;
    return *this;
  }
  Hash& add(std::string_view text) { return add(text.data(), text.size()); }
  /// The bytes of numbers, or of arrays of numbers; T must have no padding.
  template <class T>
  Hash& add(std::span<T const> values) {
    return add(values.data(), values.size_bytes());
  }
  std::uint64_t value() const { return value_; }

private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

}  // namespace taut
