#include "core/base/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/base/error.h"

namespace isochron {
namespace field {

std::string allowed_integers(long long low, long long high) {
  return high >= std::numeric_limits<int>::max() - 2 ? fmt::format("at least {}", low)
                                                     : fmt::format("{} to {}", low, high);
}

Field number(double& variable, const NumberRange& range) {
  return {"number", range.describe(), [&variable, range](const YamlValue& value) { variable = value.number(range); },
          [&variable] { return fmt::format("{}", variable); }};
}

Field positive(double& variable) {
  return number(variable, NumberRange::positive());
}

Field non_negative(double& variable) {
  return number(variable, NumberRange::non_negative());
}

Field boolean(bool& variable) {
  return {"boolean", "`true`, `false`", [&variable](const YamlValue& value) { variable = value.boolean(); },
          [&variable] { return variable ? "true" : "false"; }};
}

Field text(std::string& variable) {
  return {"text", "", [&variable](const YamlValue& value) { variable = value.text(); },
          [&variable] { return yaml_text(variable); }};
}

Field vec3(Vec3& variable) {
  return {"[x, y, z]", "", [&variable](const YamlValue& value) { variable = value.vec3(); },
          [&variable] { return yaml_vector(variable); }};
}

Field direction(Vec3& variable) {
  Field field = vec3(variable);
  field.allowed = "not all zero";
  field.read = [&variable](const YamlValue& value) { variable = value.direction(); };
  return field;
}

Field numbers(std::vector<double>& variable) {
  return {"list of numbers", "", [&variable](const YamlValue& value) { variable = value.numbers(); },
          [&variable] { return yaml_list(variable); }};
}

Field names(std::vector<std::string>& variable) {
  const auto read = [&variable](const YamlValue& value) {
    variable.clear();
    for (const YamlValue& each : value.list()) variable.push_back(each.text());
    if (variable.empty()) value.fail("holds no name", "at least one");
  };
  const auto write = [&variable] {
    std::vector<std::string> quoted;
    for (const std::string& each : variable) quoted.push_back(yaml_text(each));
    return fmt::format("[{}]", fmt::join(quoted, ", "));
  };
  return {"list of names", "", read, write};
}

Field color(Rgb& variable, const NumberRange& range, bool& grey) {
  const auto read = [&variable, &grey, range](const YamlValue& value) { variable = value.color(range, grey); };
  const auto write = [&variable] {
    return variable == Rgb(variable.r) ? fmt::format("{}", variable.r)
                                       : yaml_vector({variable.r, variable.g, variable.b});
  };
  return {"number or [r, g, b]", range.describe(), read, write};
}

Field choice(const std::vector<std::pair<std::string, std::string>>& names_and_meanings, std::function<void(int)> set,
             std::function<std::string()> write) {
  std::vector<std::string> names;
  std::string allowed, meanings;
  for (const auto& [name, meaning] : names_and_meanings) {
    allowed += fmt::format("{}`{}`", names.empty() ? "" : ", ", name);
    if (!meaning.empty()) meanings += fmt::format("{}`{}`: {}", meanings.empty() ? "" : "; ", name, meaning);
    names.push_back(name);
  }
  return {"word", allowed, [names, set = std::move(set)](const YamlValue& value) { set(value.choice(names)); },
          std::move(write), meanings};
}

Field checked(Field field, std::function<void(const YamlValue&)> check) {
  field.read = [read = std::move(field.read), check = std::move(check)](const YamlValue& value) {
    read(value);
    check(value);
  };
  return field;
}

Field kind(const std::vector<KindName>& kinds, std::function<void(const std::string&)> choose,
           const std::string& chosen) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const KindName& each : kinds) names.emplace_back(each.name, each.meaning);
  return choice(
      names, [names, choose = std::move(choose)](int i) { choose(names[i].first); }, [chosen] { return chosen; });
}

}  // namespace field

std::string yaml_text(const std::string& text) {
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string yaml_vector(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

std::string yaml_list(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string enumeration(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return text;
}

namespace {

/// Names of keys.
class NameList final : public Keys {
 public:
  bool value(const std::string& name, const Field&, const std::string&, const KeyOptions&) override {
    names.push_back(name);
    return false;
  }
  void map(const std::string& name, const Describe&, const std::string&, const KeyOptions&) override {
    names.push_back(name);
  }
  void named(const std::string& name, const std::vector<std::string>&, const DescribeNamed&, const std::string&,
             const KeyOptions&) override {
    names.push_back(name);
  }
  void kinds(const std::string& name, const std::vector<Kind>&, const std::string&,
             const std::function<void(const std::string&)>&, const DescribeNamed&, const std::string&) override {
    names.push_back(name);
  }
  std::vector<std::string> names;

 private:
  void entries(const std::string& name, std::size_t, const DescribeEntry&, const std::string&,
               const KeyOptions&) override {
    names.push_back(name);
  }
};

class Reader final : public Keys {
 public:
  explicit Reader(const YamlValue& value) : value_(value), map_(value.map()) {}

  bool value(const std::string& name, const Field& field, const std::string&, const KeyOptions& options) override {
    const auto found = find(name, options);
    if (found) field.read(*found);
    return found.has_value();
  }
  void map(const std::string& name, const Describe& describe, const std::string&, const KeyOptions& options) override {
    if (const auto found = find(name, options, &describe)) read_map(*found, describe);
  }
  void named(const std::string& name, const std::vector<std::string>&, const DescribeNamed& describe,
             const std::string&, const KeyOptions& options) override {
    const auto found = find(name, options);
    if (!found) return;
    YamlMap all = found->map();
    for (const auto& [key, entry] : all.entries())
      read_keys(entry, [&, &own = key](Keys& keys) { describe(keys, own); });
  }
  void kinds(const std::string& name, const std::vector<Kind>& kinds, const std::string&,
             const std::function<void(const std::string&)>& choose, const DescribeNamed& describe,
             const std::string&) override {
    std::string chosen;
    const auto set = [&](const std::string& kind) { choose(chosen = kind); };
    value(name, field::kind(kinds, set, chosen), "", {.required = true});
    describe(*this, chosen);
    std::map<std::string, std::vector<std::string>> owners;
    for (const Kind& kind : kinds) {
      NameList list;
      describe(list, kind.name);
      for (const std::string& key : list.names) owners[key].push_back(kind.name);
    }
    for (const auto& [key, names] : owners)
      if (std::find(names.begin(), names.end(), chosen) == names.end())
        map_.explain(key, "belongs to " + enumeration(names) + ", not to " + chosen);
  }
  void remember(Places& places) override {
    places_ = &places;
    places.emplace("", value_);
  }
  void check(const std::function<void(const YamlValue&)>& check) override {
    reject_unknown();
    check(value_);
  }
  void reject_unknown() const { map_.reject_unknown(); }

 private:
  void entries(const std::string& name, std::size_t, const DescribeEntry& describe, const std::string&,
               const KeyOptions& options) override {
    const auto found = find(name, options);
    if (!found) return;
    std::size_t i = 0;
    for (const YamlValue& entry : found->list()) read_map(entry, [&](Keys& keys) { describe(keys, i); }), ++i;
  }
  static std::string names_of(const Describe& describe) {
    NameList list;
    describe(list);
    return fmt::format("{}", fmt::join(list.names, ", "));
  }
  static void read_map(const YamlValue& value, const Describe& describe) {
    if (!value.is_map()) value.fail("is not a map", "keys and values; its keys: " + names_of(describe));
    read_keys(value, describe);
  }
  /// `inner`: what describes the map of this name.
  std::optional<YamlValue> find(const std::string& name, const KeyOptions& options, const Describe* inner = nullptr) {
    const Only& only = options.only;
    if (!only.here) {
      map_.explain(name, "belongs to " + only.to + (only.not_to.empty() ? "" : ", not to " + only.not_to));
      return {};
    }
    auto found = map_.find(name);
    if (!found && options.required) found = map_.require(name, inner ? "a map with the keys " + names_of(*inner) : "");
    if (found && places_) places_->emplace(name, *found);
    return found;
  }

  YamlValue value_;
  YamlMap map_;
  Places* places_ = nullptr;
};

class Writer final : public Keys {
 public:
  Writer(std::vector<WrittenKey>& keys, std::string path, std::string lead)
      : keys_(keys), path_(std::move(path)), lead_(std::move(lead)) {}

  bool value(const std::string& name, const Field& field, const std::string&, const KeyOptions& options) override {
    if (options.only.here && !options.unset) add(name, field.write());
    return false;
  }
  void map(const std::string& name, const Describe& describe, const std::string&, const KeyOptions& options) override {
    if (!options.only.here || options.unset) return;
    add(name, "");
    Writer inner(keys_, path_ + name + ".", lead_ + "  ");
    describe(inner);
  }
  void named(const std::string& name, const std::vector<std::string>& names, const DescribeNamed& describe,
             const std::string& meaning, const KeyOptions& options) override {
    const auto all = [&](Keys& keys) {
      for (const std::string& own : names)
        keys.map(
            own, [&](Keys& inner) { describe(inner, own); }, "");
    };
    map(name, all, meaning, options);
  }
  void kinds(const std::string& name, const std::vector<Kind>& kinds, const std::string& chosen,
             const std::function<void(const std::string&)>& choose, const DescribeNamed& describe,
             const std::string&) override {
    value(name, field::kind(kinds, choose, chosen), "", {});
    describe(*this, chosen);
  }

 private:
  void entries(const std::string& name, std::size_t count, const DescribeEntry& describe, const std::string&,
               const KeyOptions& options) override {
    if (!options.only.here || options.unset) return;
    add(name, count == 0 ? "[]" : "");
    for (std::size_t i = 0; i < count; ++i) {
      Writer entry(keys_, fmt::format("{}{}[{}].", path_, name, i), lead_ + "  - ");
      describe(entry, i);
    }
  }
  void add(const std::string& name, const std::string& value) {
    keys_.push_back({path_ + name, lead_, name, value});
    lead_.assign(lead_.size(), ' ');
  }

  std::vector<WrittenKey>& keys_;
  std::string path_, lead_;
};

bool is_in(const std::string& path, const std::string& outer) {
  return path == outer || (path.starts_with(outer) && (path[outer.size()] == '.' || path[outer.size()] == '['));
}

}  // namespace

void read_keys(const YamlValue& value, const Keys::Describe& describe) {
  Reader reader(value);
  describe(reader);
  reader.reject_unknown();
}

std::vector<WrittenKey> written_keys(const Keys::Describe& describe) {
  std::vector<WrittenKey> keys;
  Writer writer(keys, "", "");
  describe(writer);
  return keys;
}

std::vector<WrittenKey> selected(const std::vector<WrittenKey>& keys, const std::vector<std::string>& paths) {
  std::vector<WrittenKey> result;
  const auto wanted = [&](const WrittenKey& key) {
    return std::any_of(paths.begin(), paths.end(),
                       [&](const std::string& path) { return is_in(key.path, path) || is_in(path, key.path); });
  };
  std::copy_if(keys.begin(), keys.end(), std::back_inserter(result), wanted);
  return result;
}

std::string yaml(const std::vector<WrittenKey>& keys) {
  std::string text;
  for (const WrittenKey& key : keys)
    text += fmt::format("{}{}:{}{}\n", key.lead, key.name, key.value.empty() ? "" : " ", key.value);
  return text;
}

}  // namespace isochron
