#include "optim/experiment/experiment_edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "core/base/error.h"
#include "core/base/ranks.h"
#include "optim/experiment/files.h"

namespace isochron {
namespace {

constexpr auto kNowhere = std::string::npos;

bool blank_or_comment(const std::string& line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first == kNowhere || line[first] == '#';
}

std::size_t indent_of(const std::string& line) {
  return line.find_first_not_of(' ');
}

/// Where the value of `key` starts in a line `  key: value`; nowhere when the line holds another key.
std::size_t value_at(const std::string& line, std::size_t indent, const std::string& key) {
  if (indent_of(line) != indent || line.compare(indent, key.size(), key) != 0) return kNowhere;
  const std::size_t colon = indent + key.size();
  if (colon >= line.size() || line[colon] != ':') return kNowhere;
  if (colon + 1 < line.size() && line[colon + 1] != ' ' && line[colon + 1] != '\r') return kNowhere;
  const std::size_t value = line.find_first_not_of(" \r", colon + 1);
  return value == kNowhere ? line.size() : value;
}

/// Replaces the plain scalar at `at`. A comment that follows two spaces or more stays in its column if it
/// can.
void replace_scalar(std::string& line, std::size_t at, std::size_t end, const std::string& value) {
  const std::size_t comment = line.find_first_not_of(' ', end);
  const bool aligned = comment != kNowhere && line[comment] == '#' && comment >= end + 2;
  const std::size_t width = aligned ? comment - at : 0;
  std::string text = value;
  if (aligned) {
    text.resize(std::max(width, value.size() + 1), ' ');
    end = comment;
  }
  line.replace(at, end - at, text);
}

/// Sets a key of the map in braces that starts at `open`; false when it does not end on this line.
bool set_in_braces(std::string& line, std::size_t open, const std::string& key, const std::string& value) {
  int depth = 0;
  std::size_t entry = open + 1;
  for (std::size_t i = open; i < line.size(); ++i) {
    if (line[i] == '{' || line[i] == '[') ++depth;
    const bool closes = line[i] == '}' || line[i] == ']';
    if (depth == 1 && (line[i] == ',' || closes)) {
      const std::size_t begin = line.find_first_not_of(' ', entry);
      if (line.compare(begin, key.size() + 1, key + ":") == 0) {
        const std::size_t at = line.find_first_not_of(' ', begin + key.size() + 1);
        line.replace(at, line.find_last_not_of(' ', i - 1) + 1 - at, value);
        return true;
      }
      entry = i + 1;
    }
    if (closes && --depth == 0) {
      const std::size_t last = line.find_last_not_of(' ', i - 1);
      line.insert(last + 1, fmt::format("{}{}: {}", last == open ? "" : ", ", key, value));
      return true;
    }
  }
  return false;
}

class Lines {
 public:
  explicit Lines(const std::string& text) {
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      lines_.push_back(text.substr(at, end - at));
      at = end + 1;
    }
  }
  std::string text() const {
    std::string all;
    for (const std::string& line : lines_) all += line + "\n";
    return all;
  }

  void set(const Edit& edit) {
    const std::string& top = edit.key[0];
    const auto found = find(0, lines_.size(), 0, top);
    if (edit.key.size() == 1) {
      if (found)
        set_scalar(found->line, found->value, edit.value);
      else
        lines_.push_back(fmt::format("{}: {}", top, edit.value));
      return;
    }
    const std::string& key = edit.key[1];
    if (!found) {
      lines_.push_back(top + ":");
      lines_.push_back(fmt::format("  {}: {}", key, edit.value));
      return;
    }
    std::string& line = lines_[found->line];
    if (found->value < line.size() && line[found->value] == '{') {
      set_in_braces(line, found->value, key, edit.value);
      return;
    }
    // A block: up to the next line that is not indented.
    std::size_t end = found->line + 1, last = found->line, indent = 0;
    for (; end < lines_.size() && (blank_or_comment(lines_[end]) || indent_of(lines_[end]) > 0); ++end)
      if (!blank_or_comment(lines_[end])) {
        if (last == found->line) indent = indent_of(lines_[end]);
        last = end;
      }
    if (indent == 0) return;
    if (const auto inner = find(found->line + 1, end, indent, key))
      set_scalar(inner->line, inner->value, edit.value);
    else
      lines_.insert(lines_.begin() + static_cast<std::ptrdiff_t>(last + 1),
                    fmt::format("{:{}}{}: {}", "", indent, key, edit.value));
  }

 private:
  struct Place {
    std::size_t line, value;
  };
  std::optional<Place> find(std::size_t begin, std::size_t end, std::size_t indent, const std::string& key) const {
    for (std::size_t i = begin; i < end; ++i)
      if (const std::size_t value = value_at(lines_[i], indent, key); value != kNowhere) return Place{i, value};
    return std::nullopt;
  }
  void set_scalar(std::size_t i, std::size_t at, const std::string& value) {
    const std::size_t end = std::min(lines_[i].find_first_of(" \t\r", at), lines_[i].size());
    replace_scalar(lines_[i], at, end, value);
  }
  std::vector<std::string> lines_;
};

}  // namespace

std::string edited(std::string text, std::span<const Edit> edits) {
  Lines lines(text);
  for (const Edit& edit : edits) lines.set(edit);
  return lines.text();
}

std::vector<Edit> changes(const Experiment& before, const Experiment& after) {
  const std::vector<WrittenKey> old = resolved_keys(before, ".");
  std::vector<Edit> edits;
  for (const WrittenKey& key : resolved_keys(after, ".")) {
    const bool stays = std::find(old.begin(), old.end(), key) != old.end();
    // Where the file does not give the target's, it follows max_bounces.
    const bool follows =
        key.path == "target.max_bounces" && before.estimator.max_bounces != after.estimator.max_bounces;
    if (stays && !follows) continue;
    const std::size_t dot = key.path.find('.');
    edits.push_back({{key.path.substr(0, dot)}, key.value});
    if (dot != kNowhere) edits.back().key.push_back(key.path.substr(dot + 1));
  }
  return edits;
}

void edit_experiment(const std::string& file, std::span<const Edit> edits, const Experiment& wanted) {
  namespace fs = std::filesystem;
  const auto text = read_file(file);
  if (!text) throw InputError(file + ": cannot be read");
  const std::string after = edited(*text, edits);
  const fs::path path(file), trial = path.parent_path() / fmt::format(".{}.edited", path.filename().string());
  write_file_atomically(trial.string(), after);  // beside the file: it names others relative to itself
  std::string problem;
  try {
    const std::string folder = fs::absolute(path).parent_path().string();
    if (resolved_yaml(load_experiment(trial.string()), folder) != resolved_yaml(wanted, folder))
      problem = "is written in a way that cannot be edited safely";
  } catch (const InputError& error) {
    problem = std::string("cannot be edited safely: ") + error.what();
  }
  on_first_rank([&] {
    std::error_code ignored;
    fs::remove(trial, ignored);
  });
  if (!problem.empty()) throw InputError(file + ": " + problem + " (allowed: to paste the advice by hand)");
  write_file_atomically(file, after);
}

}  // namespace isochron
