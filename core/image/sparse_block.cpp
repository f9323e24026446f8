#include "core/image/sparse_block.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

namespace isochron {
namespace {

static_assert(std::endian::native == std::endian::little, "EXR files are little-endian");

/// Bits of deflate (RFC 1951), the first of them the lowest.
struct Bits {
  std::uint32_t bits = 0;
  int count = 0;
  void append(std::uint32_t more, int how_many) {
    bits |= more << count;
    count += how_many;
  }
};

/// Huffman codes begin with their highest bit.
std::uint32_t reversed(std::uint32_t code, int count) {
  std::uint32_t result = 0;
  for (int i = 0; i < count; ++i) result |= (code >> i & 1) << (count - 1 - i);
  return result;
}

/// The code of a literal, of the end, or of a class of lengths among deflate's fixed codes.
Bits fixed_code(int symbol) {
  const auto code = static_cast<std::uint32_t>(symbol);
  if (symbol < 144) return {reversed(0x30 + code, 8), 8};
  if (symbol < 256) return {reversed(0x190 + code - 144, 9), 9};
  if (symbol < 280) return {reversed(code - 256, 7), 7};
  return {reversed(0xc0 + code - 280, 8), 8};
}

constexpr int kEnd = 256, kLongest = 258, kShortest = 3;

/// "What is `length` bytes long": without the distance.
Bits length_code(int length) {
  constexpr int kFirst = 257, kLast = 285, kWithoutExtra = 8, kPerWidth = 4;
  if (length == kLongest) return fixed_code(kLast);
  int symbol = kFirst, begin = kShortest, extra = 0;
  for (;;) {
    const int width = 1 << extra;
    if (length < begin + width) break;
    begin += width;
    ++symbol;
    if (symbol - kFirst >= kWithoutExtra && (symbol - kFirst) % kPerWidth == 0) ++extra;
  }
  Bits code = fixed_code(symbol);
  code.append(static_cast<std::uint32_t>(length - begin), extra);
  return code;
}

/// Of all literals and lengths, once.
struct Codes {
  std::array<Bits, 256> literal;
  std::array<Bits, kLongest + 1> length;
  Codes() {
    for (int i = 0; i < 256; ++i) literal[i] = fixed_code(i);
    for (int i = kShortest; i <= kLongest; ++i) length[i] = length_code(i);
  }
};

/// A zlib stream (RFC 1950) of bytes of which most repeat the one before.
class RunStream {
 public:
  RunStream() {
    constexpr char kHeader[] = {0x78, 0x01};
    out_.append(kHeader, sizeof kHeader);
    put({0b011, 3});  // the last block, with fixed codes
  }
  void literal(std::uint8_t byte) {
    put(codes_.literal[byte]);
    a_ = (a_ + byte) % kModulus;
    b_ = (b_ + a_) % kModulus;
  }
  /// `count` bytes alike.
  void run(std::uint8_t byte, std::uint64_t count) {
    // Matches refer to bytes some way back, once there are as many: readers copy these faster than the last one again and again.
    constexpr std::uint64_t kWay = 32;
    constexpr Bits kLast{0, 5},
        kFurther{0b111'10010, 8};  // distance 1; distance 32: class 9, reversed, and three more bits
    if (count == 0) return;
    const std::uint64_t sum = count * (count + 1) / 2 % kModulus;
    b_ = (b_ + count % kModulus * a_ + sum * byte) % kModulus;
    a_ = (a_ + count % kModulus * byte) % kModulus;
    put(codes_.literal[byte]);
    for (std::uint64_t done = 1; done < count;) {
      const std::uint64_t left = count - done, most = done < kWay ? kWay : std::uint64_t{kLongest};
      const std::uint64_t length = std::min(left, most);
      if (length < kShortest) {
        put(codes_.literal[byte]);
        ++done;
        continue;
      }
      put(codes_.length[length]);
      put(done < kWay ? kLast : kFurther);
      done += length;
    }
  }
  std::string finish() {
    put(fixed_code(kEnd));
    while (count_ > 0) put_byte();
    for (const std::uint64_t half : {b_, a_}) {
      out_ += static_cast<char>(half >> 8);
      out_ += static_cast<char>(half);
    }
    return std::move(out_);
  }

 private:
  static constexpr std::uint64_t kModulus = 65521;

  void put(Bits code) {
    waiting_ |= std::uint64_t{code.bits} << count_;
    count_ += code.count;
    while (count_ >= 8) put_byte();
  }
  void put_byte() {
    out_ += static_cast<char>(waiting_);
    waiting_ >>= 8;
    count_ -= 8;
  }

  inline static const Codes codes_;
  std::string out_;
  std::uint64_t waiting_ = 0;
  int count_ = 0;                ///< bits that wait
  std::uint64_t a_ = 1, b_ = 0;  ///< Adler's checksum
};

/// OpenEXR stores each byte as its difference from the one before, plus 128.
class Differences {
 public:
  void add(std::uint8_t byte) {
    if (at_ == 0)
      stream_.literal(byte);
    else
      stream_.literal(static_cast<std::uint8_t>(byte - last_ + kZero));
    last_ = byte;
    ++at_;
  }
  /// Zeros up to a place.
  void add_zeros(std::uint64_t end) {
    if (at_ == end) return;
    if (at_ == 0 || last_ != 0) add(0);
    stream_.run(kZero, end - at_);
    at_ = end;
  }
  std::string finish() { return stream_.finish(); }

 private:
  static constexpr int kZero = 128;
  RunStream stream_;
  std::uint64_t at_ = 0;
  std::uint8_t last_ = 0;
};

}  // namespace

std::string compressed_block(std::size_t size, std::span<const SparseValue> values) {
  // First the bytes of even places, two of each value, then those of odd places.
  Differences bytes;
  for (const unsigned half : {0u, 1u}) {
    const std::uint64_t begin = 2 * half * std::uint64_t{size};
    for (const SparseValue& each : values) {
      const auto bits = std::bit_cast<std::uint32_t>(each.value) >> 8 * half;
      bytes.add_zeros(begin + 2 * std::uint64_t{each.place});
      bytes.add(static_cast<std::uint8_t>(bits));
      bytes.add(static_cast<std::uint8_t>(bits >> 16));
    }
    bytes.add_zeros(begin + 2 * std::uint64_t{size});
  }
  return bytes.finish();
}

std::string plain_block(std::size_t size, std::span<const SparseValue> values) {
  std::string block(size * sizeof(float), '\0');
  for (const SparseValue& each : values) std::memcpy(&block[each.place * sizeof(float)], &each.value, sizeof(float));
  return block;
}

}  // namespace isochron
