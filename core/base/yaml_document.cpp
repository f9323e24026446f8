#include "core/base/yaml_document.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>

#include "core/base/error.h"
#include "core/base/file.h"

namespace isochron {
namespace {

/// Follows a document for the place where it begins.
struct DocumentStart final : YAML::EventHandler {
  YAML::Mark mark;
  void OnDocumentStart(const YAML::Mark& at) override { mark = at; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// One step of an override's path: a key, or an index into a list.
struct Step {
  std::string key;
  std::optional<std::size_t> index;
};

std::vector<Step> split_path(const std::string& path, const std::string& text) {
  std::vector<Step> steps;
  const auto malformed = [&] { return InputError("--set " + text + ": must be KEY.PATH=VALUE"); };
  for (std::size_t at = 0; at < path.size();) {
    if (path[at] == '[') {
      const std::size_t close = path.find(']', at);
      std::size_t index = 0;
      if (close == std::string::npos) throw malformed();
      const auto [end, error] = std::from_chars(path.data() + at + 1, path.data() + close, index);
      if (error != std::errc() || end != path.data() + close) throw malformed();
      steps.push_back({{}, index});
      at = close + 1;
    } else {
      if (path[at] == '.' && !steps.empty()) ++at;
      const std::size_t end = std::min(path.find_first_of(".[", at), path.size());
      if (end == at) throw malformed();
      steps.push_back({path.substr(at, end - at), {}});
      at = end;
    }
  }
  if (steps.empty() || path.back() == '.') throw malformed();
  return steps;
}

void remove_entry(YAML::Node& list, std::size_t index) {
  YAML::Node shorter(YAML::NodeType::Sequence);
  for (std::size_t i = 0; i < list.size(); ++i)
    if (i != index) shorter.push_back(list[i]);
  list = shorter;
}

/// The entry of a list of maps that has this name.
std::size_t named_entry(const YAML::Node& list, const std::string& name, const std::string& source) {
  std::string names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const YAML::Node found = list[i].IsMap() ? list[i]["name"] : YAML::Node();
    if (!found.IsDefined() || !found.IsScalar()) continue;
    if (found.Scalar() == name) return i;
    names += (names.empty() ? "" : ", ") + found.Scalar();
  }
  throw InputError(fmt::format("{}: there is no entry of the name '{}' (allowed: {})", source, name,
                               names.empty() ? "a number in brackets, as in [0]" : names + ", or a number as in [0]"));
}

}  // namespace

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text;
}

std::string place(const std::string& source, const YAML::Mark& mark) {
  return fmt::format("{}:{}:{}", source, std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1);
}

std::string describe(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Map:
      return "a map";
    case YAML::NodeType::Sequence:
      return fmt::format("a list of {}", node.size());
    case YAML::NodeType::Scalar:
      return quote(node.Scalar());
    default:
      return "nothing";
  }
}

YAML::Node parse_document(const std::string& source, const std::string& text) {
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    DocumentStart document;
    if (!parser.HandleNextDocument(document)) throw InputError(source + ":1:1: syntax: is empty");
    if (parser.HandleNextDocument(document))
      throw InputError(place(source, document.mark) + ": syntax: a second document begins (one per file is allowed)");
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(place(source, error.mark) + ": syntax: " + one_line(error.msg));
  }
}

std::string read_yaml_text(const std::string& file) {
  std::string problem;
  const std::optional<std::string> text = read_regular_file(file, problem);
  if (!text) throw InputError(file + ":1:1: file: " + problem + (problem.starts_with("is ") ? " (a YAML file)" : ""));
  return *text;
}

void apply_override(YAML::Node node, const std::string& text, std::vector<std::string>& overridden) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw InputError("--set " + text + ": must be KEY.PATH=VALUE");
  const std::string path = text.substr(0, equals), source = "--set " + path;
  const std::vector<Step> steps = split_path(path, text);
  const std::string value_text = text.substr(equals + 1);
  const bool removes = value_text.find_first_not_of(" \t") == std::string::npos;
  const YAML::Node value = removes ? YAML::Node() : parse_document(source, value_text);
  std::string here;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const bool last = i + 1 == steps.size();
    const std::optional<std::size_t> index =
        !step.index && node.IsSequence() ? std::optional(named_entry(node, step.key, source)) : step.index;
    here += index ? fmt::format("[{}]", *index) : (i > 0 ? "." : "") + step.key;
    YAML::Node next;
    if (index) {
      if (!node.IsSequence() || *index >= node.size())
        throw InputError(fmt::format("{}: there is no entry {} (the list has {})", source, *index,
                                     node.IsSequence() ? node.size() : 0));
      if (last && removes) {
        remove_entry(node, *index);
        return;
      }
      if (last) node[*index] = value;
      next.reset(node[*index]);
    } else {
      if (!node.IsMap())
        throw InputError(fmt::format("{}: '{}' is looked for in {}, not in a map", source, step.key, describe(node)));
      if (last && removes) {
        if (!node.remove(step.key))
          throw InputError(fmt::format("{}: there is no key '{}' to remove", source, step.key));
        return;
      }
      if (last) {
        node[step.key] = value;
      } else if (!std::as_const(node)[step.key].IsDefined() && !steps[i + 1].index) {
        node[step.key] = YAML::Node(YAML::NodeType::Map);
        overridden.push_back(here);
      }
      const YAML::Node found = std::as_const(node)[step.key];
      if (!found.IsDefined()) throw InputError(fmt::format("{}: there is no key '{}'", source, step.key));
      next.reset(found);
    }
    node.reset(next);
  }
  overridden.push_back(here);
}

}  // namespace isochron
