#include "optim/experiment/number_file.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>

#include "core/base/error.h"
#include "core/base/file.h"

namespace isochron {

std::vector<std::vector<double>> read_number_file(const std::string& file, int columns) {
  std::string problem;
  const std::optional<std::string> contents = read_regular_file(file, problem);
  if (!contents) throw InputError(fmt::format("{}: {}", file, problem));
  std::istringstream in(*contents);
  constexpr std::string_view kSeparators = " \t,\r";
  std::vector<std::vector<double>> rows;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::vector<double> row;
    const std::string_view text = std::string_view(line).substr(0, line.find('#'));
    for (std::size_t at = text.find_first_not_of(kSeparators); at != std::string_view::npos;) {
      const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
      const std::string_view word = text.substr(at, end - at);
      double value = 0;
      const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
      if (parsed.ec != std::errc() || parsed.ptr != word.data() + word.size() || !std::isfinite(value))
        throw InputError(fmt::format("{}:{}:{}: {} is not a finite number", file, number, at + 1, quote(word)));
      row.push_back(value);
      at = text.find_first_not_of(kSeparators, end);
    }
    if (row.empty()) continue;
    if (columns > 0 && static_cast<int>(row.size()) != columns)
      throw InputError(fmt::format("{}:{}:1: {} numbers in this row (allowed: {})", file, number, row.size(), columns));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace isochron
