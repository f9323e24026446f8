#include "core/base/text_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/base/error.h"

namespace isochron {
namespace {

constexpr std::string_view kMark = "\xEF\xBB\xBF";

/// std::from_chars knows no sign of positive numbers.
std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return text;
}

template <class T>
std::errc parse_all(std::string_view text, T& value) {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  return error == std::errc() && end != last ? std::errc::invalid_argument : error;
}

/// Takes a backslash at the end, and blanks behind it, off the line.
bool take_continuation(std::string_view& line, std::string_view separators) {
  const std::size_t last = line.find_last_not_of(separators);
  if (last == std::string_view::npos || line[last] != '\\') return false;
  line = line.substr(0, last);
  return true;
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  text = without_plus(text);
  double value = 0;
  const std::errc error = parse_all(text, value);
  if (error == std::errc::result_out_of_range) {
    long double wide = 0;  // whose range tells what is tiny from what is huge
    if (parse_all(text, wide) != std::errc() || std::abs(wide) > 1) return std::nullopt;
    value = 0;
  } else if (error != std::errc()) {
    return std::nullopt;
  }
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<long long> parse_integer(std::string_view text) {
  long long value = 0;
  if (parse_all(without_plus(text), value) != std::errc()) return std::nullopt;
  return value;
}

bool same_word(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

TextLines::TextLines(const std::string& file, const std::string& contents, const TextRules& rules)
    : file_(file), contents_(contents), rules_(rules) {
  if (contents.starts_with("\xFF\xFE") || contents.starts_with("\xFE\xFF"))
    throw InputError(file + ": is text in UTF-16 (allowed: UTF-8)");
  const std::size_t end = contents.find_first_of("\r\n");
  ends_in_cr_ = end != std::string::npos && contents[end] == '\r' && contents.compare(end, 2, "\r\n") != 0;
}

std::string_view TextLines::take_line() {
  const std::string_view all = contents_;
  if (line_feed_ < at_ || at_ == 0) line_feed_ = std::min(all.find('\n', at_), all.size());
  std::string_view line = all.substr(at_, line_feed_ - at_);
  line = line.substr(0, line.find('\r'));
  at_ += line.size();
  if (at_ < all.size()) at_ += !ends_in_cr_ && all.substr(at_, 2) == "\r\n" ? 2 : 1;
  ++lines_;
  while (line.starts_with(kMark)) line.remove_prefix(kMark.size());
  return rules_.comment == '\0' ? line : line.substr(0, line.find(rules_.comment));
}

bool TextLines::next() {
  while (at_ < contents_.size()) {
    current_ = take_line();
    line_ = lines_;
    if (rules_.continued && take_continuation(current_, rules_.separators)) {
      joined_ = current_;
      for (bool goes_on = true; goes_on && at_ < contents_.size();) {
        std::string_view more = take_line();
        goes_on = take_continuation(more, rules_.separators);
        joined_.append(1, ' ').append(more);
      }
      current_ = joined_;
    }
    line_text_ = current_;
    if (current_.find_first_not_of(rules_.separators) != std::string_view::npos) return true;
  }
  current_ = line_text_ = {};
  return false;
}

void TextLines::require_next() {
  if (!next()) fail("the file ends too early");
}

std::string_view TextLines::word() {
  current_.remove_prefix(std::min(current_.find_first_not_of(rules_.separators), current_.size()));
  const std::string_view word = current_.substr(0, current_.find_first_of(rules_.separators));
  current_.remove_prefix(word.size());
  return word;
}

void TextLines::skip_line() {
  current_ = {};
}

std::size_t TextLines::column_of(std::string_view word) const {
  return static_cast<std::size_t>(word.data() - line_text_.data()) + 1;
}

void TextLines::fail(const std::string& what) const {
  throw InputError(fmt::format("{}:{}: {}", file_, line_, what));
}

}  // namespace isochron
