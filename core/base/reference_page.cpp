// Tables of keys for pages of reference.
#include <fmt/format.h>

#include <algorithm>

#include "core/base/description.h"
#include "core/base/error.h"

namespace isochron {
namespace {

struct Table {
  std::string title, rows;
};

class Page final : public Keys {
 public:
  explicit Page(std::vector<Table>& tables, std::size_t table = 0, std::string path = "")
      : tables_(tables), table_(table), path_(std::move(path)) {}

  bool value(const std::string& name, const Field& field, const std::string& meaning,
             const KeyOptions& options) override {
    row(name, field, field.names.empty() ? meaning : meaning + ". " + field.names, options);
    return false;
  }
  void map(const std::string& name, const Describe& describe, const std::string& meaning,
           const KeyOptions& options) override {
    nested(name, "map", describe, meaning, options);
  }
  void named(const std::string& name, const std::vector<std::string>&, const DescribeNamed& describe,
             const std::string& meaning, const KeyOptions& options) override {
    nested(
        name, "map of maps, by name", [&](Keys& keys) { describe(keys, "NAME"); }, meaning, options);
  }
  void kinds(const std::string& name, const std::vector<Kind>& kinds, const std::string& chosen,
             const std::function<void(const std::string&)>& choose, const DescribeNamed& describe,
             const std::string& meaning) override {
    value(name, field::kind(kinds, choose, chosen), meaning, {.required = true});
    // Keys of several kinds of which the page says the same have one row.
    std::vector<std::pair<std::string, std::vector<std::string>>> rows;
    for (const Kind& kind : kinds) {
      std::vector<Table> own{{"", ""}};
      Page page(own, 0, path_);
      page.of_kind_ = true;
      describe(page, kind.name);
      const std::string& text = own[0].rows;
      for (std::size_t begin = 0, end; begin < text.size(); begin = end) {
        end = text.find('\n', begin) + 1;
        const std::string line = text.substr(begin, end - begin);
        auto same = std::find_if(rows.begin(), rows.end(), [&](const auto& row) { return row.first == line; });
        if (same == rows.end()) same = rows.insert(rows.end(), {line, {}});
        same->second.push_back(kind.name);
      }
    }
    for (const auto& [line, names] : rows) {
      const std::size_t at = line.find(kKindMark);
      tables_[table_].rows += line.substr(0, at) + enumeration(names) + line.substr(at + 1);
    }
  }

 private:
  /// Stands in a row for the kinds that it is of.
  static constexpr char kKindMark = '\x01';

  void entries(const std::string& name, std::size_t, const DescribeEntry& describe, const std::string& meaning,
               const KeyOptions& options) override {
    nested(
        name, "list of maps", [&](Keys& keys) { describe(keys, 0); }, meaning, options);
  }
  /// Maps at the top have tables of their own.
  void nested(const std::string& name, const std::string& type, const Describe& describe, const std::string& meaning,
              const KeyOptions& options) {
    const bool own_table = table_ == 0;
    row(name, {type, "", {}, [] { return std::string(); }}, own_table ? meaning + "; see below" : meaning, options);
    if (own_table) tables_.push_back({"`" + name + "`", ""});
    Page inner(tables_, own_table ? tables_.size() - 1 : table_, own_table ? "" : path_ + name + ".");
    describe(inner);
  }
  void row(const std::string& name, const Field& field, std::string meaning, const KeyOptions& options) {
    std::string standard = options.otherwise;
    if (standard.empty() && options.required) standard = "required";
    if (standard.empty() && options.unset) standard = "none";
    if (standard.empty()) standard = code(field.write());
    const std::string to = of_kind_ ? std::string(1, kKindMark) : options.only.to;
    if (!to.empty()) meaning = fmt::format("*{}:* {}", to, meaning);
    tables_[table_].rows += fmt::format("| `{}{}` | {} | {} | {} | {} | {} |\n", path_, name, field.type, options.unit,
                                        standard, field.allowed, meaning);
  }
  static std::string code(const std::string& text) { return text.empty() ? "" : "`" + text + "`"; }

  std::vector<Table>& tables_;
  std::size_t table_;
  std::string path_;
  bool of_kind_ = false;
};

}  // namespace

std::string reference_tables(const Keys::Describe& describe) {
  std::vector<Table> tables{{"At the top", ""}};
  Page page(tables);
  describe(page);
  std::string text;
  for (const Table& table : tables)
    text +=
        fmt::format("{}### {}\n\n| Key | Type | Unit | Default | Allowed | Meaning |\n|---|---|---|---|---|---|\n{}",
                    text.empty() ? "" : "\n", table.title, table.rows);
  return text;
}

std::string with_tables(const std::string& page, const std::string& tables) {
  const std::string begin = "<!-- keys -->\n", end = "<!-- /keys -->\n";
  const std::size_t from = page.find(begin), to = page.find(end);
  if (from == std::string::npos || to == std::string::npos || to < from)
    throw InputError("there is no place for the tables (allowed: lines <!-- keys --> and <!-- /keys -->)");
  return page.substr(0, from + begin.size()) + "\n" + tables + "\n" + page.substr(to);
}

}  // namespace isochron
