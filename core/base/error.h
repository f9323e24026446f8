#pragma once
#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>

namespace isochron {

/// What the user gave cannot be used: one line that names file, line, column and key. Exit status 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The user's text fit for such a line: in quotes, without control characters, cut where it is long.
inline std::string quote(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string shown(text.substr(0, kLongest));
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return "'" + shown + (text.size() > kLongest ? "...'" : "'");
}

}  // namespace isochron
