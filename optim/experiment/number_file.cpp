#include "optim/experiment/number_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/text_lines.h"
#include "core/image/npy.h"

namespace isochron {
namespace {

std::vector<std::vector<double>> read_array(const std::string& file, std::size_t columns) {
  const NumberArray array = read_npy(file);
  if (columns > 0 && (array.shape.size() != 2 || array.shape[1] != columns))
    throw InputError(
        fmt::format("{}: an array of [{}] (allowed: [rows, {}])", file, fmt::join(array.shape, ", "), columns));
  const std::vector<double>& values = array.values;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i])) throw InputError(fmt::format("{}: value {} is not a finite number", file, i));
  if (columns == 0) return {values};
  std::vector<std::vector<double>> rows;
  for (auto row = values.begin(); row != values.end(); row += static_cast<std::ptrdiff_t>(columns))
    rows.emplace_back(row, row + static_cast<std::ptrdiff_t>(columns));
  return rows;
}

}  // namespace

std::vector<std::vector<double>> read_number_file(const std::string& file, const std::vector<std::string>& columns) {
  if (file.ends_with(".npy")) return read_array(file, columns.size());
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
