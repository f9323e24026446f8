#include "optim/experiment/number_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"

namespace isochron {
namespace {

/// Words of a row, what `#` begins left out.
std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kSeparators = " \t,\r";
  const std::string_view text = line.substr(0, line.find('#'));
  std::vector<std::string_view> words;
  for (std::size_t at = text.find_first_not_of(kSeparators); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(kSeparators, end);
  }
  return words;
}

}  // namespace

std::vector<std::vector<double>> read_number_file(const std::string& file, const std::vector<std::string>& columns) {
  std::string problem;
  const std::optional<std::string> contents = read_regular_file(file, problem);
  if (!contents) throw InputError(fmt::format("{}: {}", file, problem));
  std::istringstream in(*contents);
  std::vector<std::vector<double>> rows;
  std::string line;
  bool first = true;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::vector<std::string_view> words = words_of(line);
    if (words.empty()) continue;
    if (std::exchange(first, false) && std::equal(words.begin(), words.end(), columns.begin(), columns.end())) continue;
    std::vector<double> row;
    for (const std::string_view word : words) {
      double value = 0;
      const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
      if (parsed.ec != std::errc() || parsed.ptr != word.data() + word.size() || !std::isfinite(value))
        throw InputError(fmt::format("{}:{}:{}: {} is not a finite number", file, number, word.data() - line.data() + 1,
                                     quote(word)));
      row.push_back(value);
    }
    if (!columns.empty() && row.size() != columns.size())
      throw InputError(
          fmt::format("{}:{}:1: {} numbers in this row (allowed: {})", file, number, row.size(), columns.size()));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace isochron
