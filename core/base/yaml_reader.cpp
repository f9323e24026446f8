#include "core/base/yaml_reader.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/error.h"
#include "core/base/text_lines.h"
#include "core/base/yaml_document.h"

namespace isochron {

struct YamlValue::Document {
  std::string file;
  std::vector<std::string> overridden;  ///< paths whose values come from the command line

  /// The file, or the override that the value at `key` belongs to.
  std::string source(const std::string& key) const {
    for (auto path = overridden.rbegin(); path != overridden.rend(); ++path) {
      const bool below = key.size() > path->size() && (key[path->size()] == '.' || key[path->size()] == '[');
      if (key.compare(0, path->size(), *path) == 0 && (key.size() == path->size() || below)) return "--set " + *path;
    }
    return file;
  }
};

namespace {

std::string join(const std::vector<std::string>& words) {
  return std::accumulate(words.begin(), words.end(), std::string(),
                         [](const std::string& a, const std::string& b) { return a.empty() ? b : a + ", " + b; });
}

/// yaml-cpp tags quoted scalars with "!".
bool is_plain(const YAML::Node& node) {
  return node.IsScalar() && node.Tag() != "!";
}

std::optional<double> number_of(const YAML::Node& node) {
  return is_plain(node) ? parse_number(node.Scalar()) : std::nullopt;
}

std::string child(const std::string& parent, const std::string& name) {
  return parent.empty() ? name : parent + "." + name;
}

}  // namespace

bool NumberRange::contains(double value) const {
  return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
}

std::string NumberRange::describe() const {
  std::string text;
  if (std::isfinite(low)) text = fmt::format("{} {}", low_open ? "above" : "at least", low);
  if (std::isfinite(high))
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", high_open ? "below" : "at most", high);
  return text;
}

YamlValue::YamlValue(std::shared_ptr<const Document> document, const YAML::Node& node, std::string key)
    : document_(std::move(document)), node_(std::make_shared<const YAML::Node>(node)), key_(std::move(key)) {}

const std::string& YamlValue::file() const {
  return document_->file;
}
bool YamlValue::is_map() const {
  return node_->IsMap();
}
bool YamlValue::is_list() const {
  return node_->IsSequence();
}
bool YamlValue::is_scalar() const {
  return node_->IsScalar();
}
bool YamlValue::is_number() const {
  return number_of(*node_).has_value();
}

void YamlValue::fail(const std::string& wrong, const std::string& allowed) const {
  std::string message = place(document_->source(key_), node_->Mark()) + ": ";
  if (!key_.empty()) message += key_ + ": ";
  message += wrong;
  if (!allowed.empty()) message += " (" + allowed + ")";
  throw InputError(one_line(message));
}

double YamlValue::number(const NumberRange& range) const {
  const std::optional<double> value = number_of(*node_);
  const std::string bounds = range.describe();
  const std::string allowed = bounds.empty() ? "a finite number" : "a number " + bounds;
  if (!value) fail(describe(*node_) + " is not a finite number", allowed);
  if (!range.contains(*value)) fail(fmt::format("{} is out of range", node_->Scalar()), allowed);
  return *value;
}

long long YamlValue::integer(long long low, long long high) const {
  constexpr long long kHighest = std::numeric_limits<long long>::max();
  const std::string allowed = high == kHighest ? fmt::format("an integer, at least {}", low)
                                               : fmt::format("an integer from {} to {}", low, high);
  const std::optional<long long> value = is_plain(*node_) ? parse_integer(node_->Scalar()) : std::nullopt;
  if (!value) fail(describe(*node_) + " is not an integer that fits", allowed);
  if (*value < low || *value > high) fail(fmt::format("{} is out of range", *value), allowed);
  return *value;
}

bool YamlValue::boolean() const {
  if (is_plain(*node_)) {
    if (node_->Scalar() == "true") return true;
    if (node_->Scalar() == "false") return false;
  }
  fail(describe(*node_) + " is neither", "true or false");
}

std::string YamlValue::text() const {
  if (!node_->IsScalar()) fail(describe(*node_) + " is not a word", "a text");
  if (node_->Scalar().empty()) fail("is empty", "a text");
  return node_->Scalar();
}

int YamlValue::choice(const std::vector<std::string>& options) const {
  const std::string allowed = "allowed: " + join(options);
  if (!node_->IsScalar()) fail(describe(*node_) + " is not a word", allowed);
  const auto found = std::find(options.begin(), options.end(), node_->Scalar());
  if (found != options.end()) return static_cast<int>(found - options.begin());
  const std::string near = nearest_word(node_->Scalar(), options);
  fail(describe(*node_) + " is not known" + (near.empty() ? "" : ", did you mean '" + near + "'?"), allowed);
}

std::vector<YamlValue> YamlValue::list() const {
  if (!node_->IsSequence()) fail(describe(*node_) + " is not a list", "[entry, ...]");
  std::vector<YamlValue> values;
  for (const auto& entry : *node_)
    values.push_back(YamlValue(document_, entry, fmt::format("{}[{}]", key_, values.size())));
  return values;
}

std::vector<double> YamlValue::numbers(const NumberRange& range) const {
  std::vector<double> values;
  for (const YamlValue& entry : list()) values.push_back(entry.number(range));
  return values;
}

Vec3 YamlValue::vec3() const {
  if (!node_->IsSequence() || node_->size() != 3) fail(describe(*node_) + " is not a vector", "[x, y, z]");
  const std::vector<double> v = numbers();
  return {v[0], v[1], v[2]};
}

Vec3 YamlValue::direction() const {
  const Vec3 v = vec3();
  if (v == Vec3{}) fail("the zero vector has no direction", "[x, y, z], not all zero");
  return v;
}

Rgb YamlValue::color(const NumberRange& range, bool& grey) const {
  if (!node_->IsSequence()) {
    if (!node_->IsScalar()) fail(describe(*node_) + " is not a colour", "a number or [r, g, b]");
    return Rgb(number(range));
  }
  if (node_->size() != 3) fail(describe(*node_) + " is not a colour", "a number or [r, g, b]");
  grey = false;
  const std::vector<double> v = numbers(range);
  return {v[0], v[1], v[2]};
}

YamlMap YamlValue::map() const {
  if (!node_->IsMap()) fail(describe(*node_) + " is not a map", "keys and values");
  YamlMap map(*this);
  for (const auto& pair : *node_) {
    if (!pair.first.IsScalar())
      YamlValue(document_, pair.first, key_).fail(describe(pair.first) + " is used as a key", "a word");
    const std::string name = pair.first.Scalar();
    const std::string path = child(key_, name);
    YamlMap::Entry entry{name, YamlValue(document_, pair.first, path), YamlValue(document_, pair.second, path)};
    for (const YamlMap::Entry& earlier : map.entries_) {
      if (earlier.name == name)
        entry.key.fail(fmt::format("is given twice, first on line {}", earlier.key.node_->Mark().line + 1));
    }
    map.entries_.push_back(std::move(entry));
  }
  return map;
}

std::optional<YamlValue> YamlMap::find(const std::string& key) {
  if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) asked_.push_back(key);
  for (Entry& entry : entries_) {
    if (entry.name == key) {
      entry.asked = true;
      return entry.value;
    }
  }
  return {};
}

YamlValue YamlMap::require(const std::string& key, const std::string& allowed) {
  if (std::optional<YamlValue> value = find(key)) return *value;
  std::vector<std::string> unread;
  for (const Entry& entry : entries_) {
    if (!entry.asked) unread.push_back(entry.name);
  }
  const std::string near = nearest_word(key, unread);
  YamlValue missing = value_;
  missing.key_ = child(value_.key_, key);
  missing.fail("is missing" + (near.empty() ? "" : ", is '" + near + "' a misspelling of it?"), allowed);
}

std::vector<std::pair<std::string, YamlValue>> YamlMap::entries() {
  std::vector<std::pair<std::string, YamlValue>> all;
  for (Entry& entry : entries_) {
    entry.asked = true;
    all.emplace_back(entry.name, entry.value);
  }
  return all;
}

void YamlMap::reject_unknown() const {
  for (const Entry& entry : entries_) {
    if (entry.asked) continue;
    for (const auto& [key, why] : explained_)
      if (key == entry.name) entry.key.fail(why, "allowed: " + join(asked_));
    const std::string near = nearest_word(entry.name, asked_);
    entry.key.fail("is not a known key" + (near.empty() ? "" : ", did you mean '" + near + "'?"),
                   "allowed: " + join(asked_));
  }
}

void YamlMap::fail(const std::string& wrong, const std::string& allowed) const {
  value_.fail(wrong, allowed);
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates) {
  // Edit distance in which swapping two neighbours is one step; a misspelling takes one step in three
  // letters.
  std::string best;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& other : candidates) {
    std::vector<std::vector<std::size_t>> d(word.size() + 1, std::vector<std::size_t>(other.size() + 1));
    for (std::size_t i = 0; i <= word.size(); ++i) {
      for (std::size_t j = 0; j <= other.size(); ++j) {
        if (i == 0 || j == 0) {
          d[i][j] = i + j;
          continue;
        }
        const std::size_t differs = word[i - 1] == other[j - 1] ? 0 : 1;
        d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + differs});
        if (i > 1 && j > 1 && word[i - 1] == other[j - 2] && word[i - 2] == other[j - 1])
          d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
    if (d[word.size()][other.size()] < least) {
      least = d[word.size()][other.size()];
      best = other;
    }
  }
  return best;
}

YamlValue open_yaml(const std::string& file, const std::vector<std::string>& overrides) {
  const YAML::Node root = parse_document(file, read_yaml_text(file));
  auto document = std::make_shared<YamlValue::Document>();
  document->file = file;
  for (const std::string& text : overrides) apply_override(root, text, document->overridden);
  return YamlValue(document, root, "");
}

}  // namespace isochron
