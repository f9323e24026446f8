#include "optim/experiment/number_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/text_lines.h"

namespace isochron {

std::vector<std::vector<double>> read_number_file(const std::string& file, const std::vector<std::string>& columns) {
  std::string problem;
  const std::optional<std::string> contents = read_regular_file(file, problem);
  if (!contents) throw InputError(fmt::format("{}: {}", file, problem));
  TextLines lines(file, *contents, {.comment = '#', .separators = " \t,\f\v"});
  std::vector<std::vector<double>> rows;
  bool first = true;
  while (lines.next()) {
    std::vector<std::string_view> words;
    for (std::string_view word = lines.word(); !word.empty(); word = lines.word()) words.push_back(word);
    if (std::exchange(first, false) && std::equal(words.begin(), words.end(), columns.begin(), columns.end())) continue;
    std::vector<double> row;
    for (const std::string_view word : words) {
      const std::optional<double> value = parse_number(word);
      if (!value)
        throw InputError(
            fmt::format("{}:{}:{}: {} is not a finite number", file, lines.line(), lines.column_of(word), quote(word)));
      row.push_back(*value);
    }
    if (!columns.empty() && row.size() != columns.size())
      throw InputError(
          fmt::format("{}:{}:1: {} numbers in this row (allowed: {})", file, lines.line(), row.size(), columns.size()));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace isochron
