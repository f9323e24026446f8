#include "optim/experiment/key_hints.h"

#include <fmt/format.h>

#include "core/base/error.h"

namespace isochron {
namespace {

/// Names of the keys of a map: all that there are, or those that its other keys leave.
class Names final : public Keys {
 public:
  explicit Names(bool all) : all_(all) {}
  bool value(const std::string& name, const Field&, const std::string&, const KeyOptions& options) override {
    add(name, options);
    return false;
  }
  void map(const std::string& name, const Describe&, const std::string&, const KeyOptions& options) override {
    add(name, options);
  }
  void named(const std::string& name, const std::vector<std::string>&, const DescribeNamed&, const std::string&,
             const KeyOptions& options) override {
    add(name, options);
  }
  void kinds(const std::string& name, const std::vector<Kind>&, const std::string&,
             const std::function<void(const std::string&)>&, const DescribeNamed&, const std::string&) override {
    add(name, {});
  }
  const std::string& text() const { return text_; }

 private:
  void entries(const std::string& name, std::size_t, const DescribeEntry&, const std::string&,
               const KeyOptions& options) override {
    add(name, options);
  }
  void add(const std::string& name, const KeyOptions& options) {
    if (all_ || options.only.here) text_ += (text_.empty() ? "" : ", ") + name;
  }
  bool all_;
  std::string text_;
};

std::string names(const Keys::Describe& describe, bool all) {
  Names names(all);
  describe(names);
  return names.text();
}

/// Passes all on to a reader. What is wrong with a map is looked for before the reader comes to it.
class Hinted final : public Keys {
 public:
  /// `describe`: what describes the map, nothing at the top, where keys that are missing speak for themselves.
  Hinted(Keys& reader, const YamlValue& map, const Describe& describe)
      : reader_(reader), map_(map), describe_(describe) {}

  bool value(const std::string& name, const Field& field, const std::string& meaning,
             const KeyOptions& options) override {
    if (!describe_ || !is_missing(name, options)) return reader_.value(name, field, meaning, options);
    // A word says which other keys there are: without it that is all of them.
    return with_hint([&] { return reader_.value(name, field, meaning, options); },
                     "keys here: " + names(describe_, field.type == "word"));
  }
  void map(const std::string& name, const Describe& describe, const std::string& meaning,
           const KeyOptions& options) override {
    const auto read = [&] {
      reader_.map(
          name, [&](Keys& inner) { read_inner(inner, *map_.map().find(name), describe); }, meaning, options);
    };
    if (is_missing(name, options)) return with_hint(read, "a map with the keys " + names(describe, true));
    require_map(name, options, describe);
    read();
  }
  void named(const std::string& name, const std::vector<std::string>& all, const DescribeNamed& describe,
             const std::string& meaning, const KeyOptions& options) override {
    reader_.named(name, all, describe, meaning, options);
  }
  void kinds(const std::string& name, const std::vector<Kind>& kinds, const std::string& chosen,
             const std::function<void(const std::string&)>& choose, const DescribeNamed& describe,
             const std::string& meaning) override {
    reader_.kinds(name, kinds, chosen, choose, describe, meaning);
  }
  void remember(Places& places) override { reader_.remember(places); }
  void check(const std::function<void(const YamlValue&)>& check) override { reader_.check(check); }

 private:
  void entries(const std::string& name, std::size_t, const DescribeEntry& describe, const std::string& meaning,
               const KeyOptions& options) override {
    const auto found = map_.map().find(name);
    std::vector<YamlValue> values;
    if (found && found->is_list() && options.only.here) values = found->list();
    std::vector<char> places(values.size());  // list() counts entries by items of its own
    const auto entry = [&](Keys& inner, char& item) {
      const auto i = static_cast<std::size_t>(&item - places.data());
      read_inner(inner, values[i], [&](Keys& keys) { describe(keys, i); });
    };
    for (const YamlValue& each : values) fail_unless_map(each, [&](Keys& keys) { describe(keys, 0); });
    reader_.list(name, places, entry, meaning, options);
  }
  bool is_missing(const std::string& name, const KeyOptions& options) const {
    return options.required && options.only.here && !map_.map().find(name);
  }
  void require_map(const std::string& name, const KeyOptions& options, const Describe& describe) const {
    const auto found = map_.map().find(name);
    if (found && options.only.here) fail_unless_map(*found, describe);
  }
  static void fail_unless_map(const YamlValue& value, const Describe& describe) {
    if (!value.is_map()) value.fail("is not a map", "keys and values; its keys: " + names(describe, true));
  }
  static void read_inner(Keys& reader, const YamlValue& value, const Describe& describe) {
    Hinted inner(reader, value, describe);
    describe(inner);
  }
  template <class Read>
  static auto with_hint(const Read& read, const std::string& hint) -> decltype(read()) {
    try {
      return read();
    } catch (const InputError& error) {
      throw InputError(fmt::format("{} ({})", error.what(), hint));
    }
  }

  Keys& reader_;
  const YamlValue& map_;
  const Describe& describe_;
};

}  // namespace

void read_keys_with_hints(const YamlValue& value, const Keys::Describe& describe) {
  const Keys::Describe none;
  read_keys(value, [&](Keys& reader) {
    Hinted hinted(reader, value, none);
    describe(hinted);
  });
}

}  // namespace isochron
