// Checked reading of YAML files. Every error is an InputError of one line,
//   FILE:LINE:COLUMN: KEY: what is wrong (what is allowed)
// with line and column counted from one and KEY the dotted path, such as `shapes[1].material`.
#pragma once
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/vec.h"

namespace YAML {
class Node;
}

namespace isochron {

/// Values a number may take; an open end excludes the bound itself. Numbers are always finite.
struct NumberRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;

  static NumberRange positive() { return {.low = 0, .low_open = true}; }
  static NumberRange non_negative() { return {.low = 0}; }
  static NumberRange closed(double low, double high) { return {.low = low, .high = high}; }
  bool contains(double value) const;
  std::string describe() const;  ///< such as "above 0", "at least 0, below 180"
};

class YamlMap;

/// One value of a document with the place and path it was found at. Cheap to copy. The document lives as long
/// as any of its values.
class YamlValue {
 public:
  const std::string& key() const { return key_; }  ///< dotted path; empty at the top of the document
  const std::string& file() const;                 ///< as given to `open_yaml`
  bool is_map() const;
  bool is_list() const;
  bool is_scalar() const;
  bool is_number() const;  ///< a plain (unquoted) scalar that is a finite number

  /// Throws the one-line InputError at this value.
  [[noreturn]] void fail(const std::string& wrong, const std::string& allowed = "") const;

  double number(const NumberRange& range = {}) const;
  long long integer(long long low, long long high) const;
  bool boolean() const;      ///< true or false
  std::string text() const;  ///< a scalar that is not empty
  /// Index into `options` of the value, which must be one of them.
  int choice(const std::vector<std::string>& options) const;
  Vec3 vec3() const;  ///< [x, y, z]
  /// [x, y, z] of which at least one is not zero; returned as given, not normalised.
  Vec3 direction() const;
  /// A number or [r, g, b], each within the range. `grey` becomes false unless it is a single number.
  Rgb color(const NumberRange& range, bool& grey) const;
  /// Entries of a list.
  std::vector<YamlValue> list() const;
  std::vector<double> numbers(const NumberRange& range = {}) const;
  /// The keys and values of a map; throws when it is none or when a key stands in it twice.
  YamlMap map() const;

 private:
  friend class YamlMap;
  friend YamlValue open_yaml(const std::string&, const std::vector<std::string>&);
  struct Document;
  YamlValue(std::shared_ptr<const Document> document, const YAML::Node& node, std::string key);

  std::shared_ptr<const Document> document_;
  std::shared_ptr<const YAML::Node> node_;
  std::string key_;
};

/// A map that remembers which keys were asked for, whether present or not: those are the allowed ones.
class YamlMap {
 public:
  /// Throws when the key is missing; `allowed`: what belongs there.
  YamlValue require(const std::string& key, const std::string& allowed = "");
  std::optional<YamlValue> find(const std::string& key);  ///< empty when the key is missing
  /// What reject_unknown says of this key where it was not asked for, such as "belongs to gaussian, not to boxcar".
  void explain(const std::string& key, const std::string& why) { explained_.emplace_back(key, why); }
  /// Throws at the first key that was never asked for. To be called when all keys have been read.
  void reject_unknown() const;
  /// Keys and values in the order of the file; they count as asked for.
  std::vector<std::pair<std::string, YamlValue>> entries();
  [[noreturn]] void fail(const std::string& wrong, const std::string& allowed = "") const;

 private:
  friend class YamlValue;
  explicit YamlMap(YamlValue value) : value_(std::move(value)) {}
  struct Entry {
    std::string name;
    YamlValue key, value;  ///< `key` is placed at the key itself, for errors about it
    bool asked = false;
  };

  YamlValue value_;
  std::vector<Entry> entries_;
  std::vector<std::string> asked_;
  std::vector<std::pair<std::string, std::string>> explained_;
};

/// Reads a file of one YAML document. Each override is `KEY.PATH=VALUE` (list entries as `KEY[INDEX]`), with
/// VALUE in YAML; it replaces the file's value or adds a key to a map. An empty VALUE removes the key, or the entry of a list.
/// Errors in overridden values name
/// `--set KEY.PATH` in place of the file. Throws InputError when the file cannot be read or is not YAML.
YamlValue open_yaml(const std::string& file, const std::vector<std::string>& overrides = {});

/// The candidate that `word` is probably a misspelling of, or empty.
std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace isochron
