// One description of the keys of a map, from which follow its reader (with defaults and messages), its writer and its tables
// in a page of reference. A description is a function that names every key, whatever the variables' values are:
//   void describe(Keys& keys, SampleSpec& s) {
//     keys.value("primal", field::integer(s.primal, 1, 1000), "of the images");
//     keys.value("path_length", field::integer(s.path_length, 0, 1000), "of jumps", {.only = only(s.kind, {Kind::boxcar})});
//   }
// Defaults are the values that the variables have beforehand.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/base/yaml_reader.h"

namespace isochron {

/// A value of an enumeration and its name in files.
template <class E>
struct Choice {
  E value;
  const char* name;
  const char* meaning;
};

/// The table of an enumeration that files hold: an array of Choice<E>, by specialisation; others have none.
template <class E>
struct NoTable;
template <class E>
inline constexpr NoTable<E> kChoices{};

/// The name of a value in files.
template <class E>
const char* name_of(E value) {
  for (const Choice<E>& choice : kChoices<E>)
    if (choice.value == value) return choice.name;
  throw std::logic_error("a value without a name");
}

/// How a variable is read and written, and what the page says of its values.
struct Field {
  std::string type, allowed;
  std::function<void(const YamlValue&)> read;
  std::function<std::string()> write;  ///< YAML on one line
  std::string names = {};              ///< of a choice: what each name means
};

/// A kind that a map can be of.
struct KindName {
  std::string name, meaning;
};

/// Fields of variables, which must outlive what is made of them.
namespace field {

/// What the page says of a range of integers.
std::string allowed_integers(long long low, long long high);
template <class T>
Field integer(T& variable, long long low, long long high = std::numeric_limits<T>::max()) {
  return {"integer", allowed_integers(low, high),
          [&variable, low, high](const YamlValue& value) { variable = static_cast<T>(value.integer(low, high)); },
          [&variable] { return std::to_string(variable); }};
}
/// Half of what an unsigned integer can be: all that YamlValue reads.
inline Field seed(std::uint64_t& variable) {
  return integer(variable, 0, std::numeric_limits<long long>::max());
}
Field number(double& variable, const NumberRange& range = {});
Field positive(double& variable);
Field non_negative(double& variable);
Field boolean(bool& variable);
Field text(std::string& variable);
Field vec3(Vec3& variable);
Field direction(Vec3& variable);  ///< see YamlValue::direction
Field numbers(std::vector<double>& variable);
Field names(std::vector<std::string>& variable);                   ///< a list of at least one
Field color(Rgb& variable, const NumberRange& range, bool& grey);  ///< see YamlValue::color
/// One of some words; `set` receives which.
Field choice(const std::vector<std::pair<std::string, std::string>>& names_and_meanings, std::function<void(int)> set,
             std::function<std::string()> write);
/// One of an enumeration's names.
template <class E>
Field choice(E& variable) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const Choice<E>& each : kChoices<E>) names.emplace_back(each.name, each.meaning);
  return choice(
      names, [&variable](int i) { variable = kChoices<E>[i].value; }, [&variable] { return name_of(variable); });
}
/// The key that names the kind of a map. choose(kind) receives it when read; `chosen` is what is written.
Field kind(const std::vector<KindName>& kinds, std::function<void(const std::string&)> choose,
           const std::string& chosen);
/// The field with a check, or another action, after it was read.
Field checked(Field field, std::function<void(const YamlValue&)> check);

}  // namespace field

/// Text in quotes, as YAML reads it back.
std::string yaml_text(const std::string& text);
/// [x, y, z].
std::string yaml_vector(const Vec3& v);
std::string yaml_list(const std::vector<double>& values);

/// What a key belongs to where that depends on other keys. Elsewhere it is refused: "belongs to ..., not to ...".
struct Only {
  bool here = true;
  std::string to = {};      ///< such as "gaussian and truncated_gaussian"; empty: to everything
  std::string not_to = {};  ///< what there is instead; empty: goes without saying
};

/// "a, b and c"
std::string enumeration(const std::vector<std::string>& words);

/// A key that belongs to some of the kinds.
template <class E>
Only only(E present, std::initializer_list<E> kinds) {
  Only result{false, "", name_of(present)};
  std::vector<std::string> names;
  for (E kind : kinds) {
    names.push_back(name_of(kind));
    if (kind == present) result.here = true;
  }
  result.to = enumeration(names);
  return result;
}

/// What else there is to say of a key.
struct KeyOptions {
  bool required = false;
  Only only = {};
  std::string unit = {};
  /// The variable stands for a key that was not given: it is not written.
  bool unset = false;
  /// What the page gives as the default, where that is neither the variable's value nor "none".
  std::string otherwise = {};
};

/// What a description names its keys to.
class Keys {
 public:
  using Describe = std::function<void(Keys&)>;
  using DescribeNamed = std::function<void(Keys&, const std::string& name)>;
  using Places = std::map<std::string, YamlValue>;
  virtual ~Keys() = default;

  /// Returns whether the file that is read has the key.
  virtual bool value(const std::string& name, const Field& field, const std::string& meaning,
                     const KeyOptions& options = {}) = 0;
  /// A map inside the map.
  virtual void map(const std::string& name, const Describe& describe, const std::string& meaning,
                   const KeyOptions& options = {}) = 0;
  /// A list of maps, each of one item: describe(Keys&, T&).
  template <class T, class DescribeItem>
  void list(const std::string& name, std::vector<T>& items, const DescribeItem& describe, const std::string& meaning,
            const KeyOptions& options = {}) {
    const auto entry = [&](Keys& keys, std::size_t i) {
      if (i == items.size()) items.emplace_back();
      describe(keys, items[i]);
    };
    entries(name, items.size(), entry, meaning, options);
  }
  /// A map of maps, each under a name of the user's; `names` are those to be written.
  virtual void named(const std::string& name, const std::vector<std::string>& names, const DescribeNamed& describe,
                     const std::string& meaning, const KeyOptions& options = {}) = 0;
  using Kind = KindName;
  /// A tag that selects the map's variant, and the variant's keys: describe(keys, kind) names those of any variant.
  /// `chosen` is the present one, choose(kind) sets another.
  virtual void kinds(const std::string& name, const std::vector<Kind>& kinds, const std::string& chosen,
                     const std::function<void(const std::string&)>& choose, const DescribeNamed& describe,
                     const std::string& meaning) = 0;
  /// From here on, where each key stands that the file has; under "", the map.
  virtual void remember(Places&) {}
  /// Checks of several keys together, on the map that they stand in. To be called when all its keys have been named.
  virtual void check(const std::function<void(const YamlValue&)>&) {}

 protected:
  using DescribeEntry = std::function<void(Keys&, std::size_t)>;
  virtual void entries(const std::string& name, std::size_t count, const DescribeEntry& describe,
                       const std::string& meaning, const KeyOptions& options) = 0;
};

/// Reads what is described from a map. Throws InputError.
void read_keys(const YamlValue& value, const Keys::Describe& describe);

/// A line of what is described. A map or list has a line of its own, without a value, before its entries.
struct WrittenKey {
  std::string path;  ///< such as "parameters[0].name"
  std::string lead;  ///< what the line begins with: blanks, and a dash where an entry of a list begins
  std::string name, value;
  bool operator==(const WrittenKey&) const = default;
};
/// What is described, line by line.
std::vector<WrittenKey> written_keys(const Keys::Describe& describe);
/// Those of the paths, with what is in them and what they are in.
std::vector<WrittenKey> selected(const std::vector<WrittenKey>& keys, const std::vector<std::string>& paths);
/// The lines as text.
std::string yaml(const std::vector<WrittenKey>& keys);

/// Tables of the keys, in Markdown: those at the top, then those of each map or list there.
std::string reference_tables(const Keys::Describe& describe);
/// The page with the tables between its lines `<!-- keys -->` and `<!-- /keys -->` replaced. Throws InputError where it has
/// no such lines.
std::string with_tables(const std::string& page, const std::string& tables);

}  // namespace isochron
