#include "app/man_pages.h"

#include <fmt/format.h>

#include <sstream>
#include <string>
#include <vector>

#include "core/base/file.h"

namespace isochron {
namespace {

/// Text as roff reads it: hyphens that are typed, and no line that begins as a request does.
std::string plain(const std::string& text) {
  std::string out = !text.empty() && (text[0] == '.' || text[0] == '\'') ? "\\&" : "";
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

std::string bold(const std::string& text) {
  return "\\fB" + plain(text) + "\\fR";
}

std::string italic(const std::string& text) {
  return "\\fI" + plain(text) + "\\fR";
}

bool shown(const CLI::Option* option) {
  return !option->get_group().empty();
}

/// The name of an option's value, and behind a colon what CLI11 checks it for.
std::pair<std::string, std::string> value_and_check(const CLI::Option& option) {
  const std::string type = option.get_type_size() == 0 ? "" : option.get_type_name();
  const std::size_t colon = type.find(':');
  return {type.substr(0, colon), colon == std::string::npos ? "" : type.substr(colon + 1)};
}

/// An option or argument as an item of a list.
std::string item(const CLI::Option& option) {
  const auto [value, check] = value_and_check(option);
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back(bold("-" + name));
  for (const std::string& name : option.get_lnames()) names.push_back(bold("--" + name));
  std::string line = fmt::to_string(fmt::join(names, ", "));
  if (!value.empty()) line += (names.empty() ? "" : " ") + italic(value);
  std::string limits = check;
  if (value.size() && !option.get_default_str().empty())
    limits += (check.empty() ? "" : ", ") + ("default " + option.get_default_str());
  if (!limits.empty()) line += " (" + plain(limits) + ")";
  return ".TP\n" + line + "\n" + plain(option.get_description()) + "\n";
}

/// What is below the options in --help: paragraphs, and indented lines that are kept as they are.
std::string footer(const CLI::App& app) {
  std::istringstream lines(app.get_footer());
  std::string out, line;
  bool kept = false;
  while (std::getline(lines, line)) {
    if (line == "Examples:") {
      out += ".SH EXAMPLES\n";
      continue;
    }
    if (out.empty()) out = ".SH NOTES\n";
    const bool indented = line.starts_with("  ");
    if (indented != kept) out += indented ? ".nf\n" : ".fi\n";
    kept = indented;
    out += plain(indented ? line.substr(2) : line) + "\n";
  }
  return out + (kept ? ".fi\n" : "");
}

std::string top(const std::string& name, const std::string& version, const std::string& description) {
  return fmt::format(".TH {} 1 \"\" \"{}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n", plain(name), version, plain(name),
                     plain(description));
}

std::string options_of(const CLI::App& app) {
  std::string arguments, options;
  for (const CLI::Option* option : app.get_options(shown))
    (option->get_positional() ? arguments : options) += item(*option);
  return (arguments.empty() ? "" : ".SH ARGUMENTS\n" + arguments) + ".SH OPTIONS\n" + options;
}

std::string command_page(const CLI::App& command, const std::string& version) {
  const std::string name = "isochron-" + command.get_name();
  std::string arguments;
  for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string value = italic(value_and_check(*option).first);
    arguments += option->get_required() ? " " + value : " [" + value + "]";
  }
  return top(name, version, command.get_description()) + ".SH SYNOPSIS\n" + bold("isochron " + command.get_name()) +
         " [" + italic("OPTIONS") + "]" + arguments + "\n" + options_of(command) + footer(command) +
         ".SH SEE ALSO\n.BR isochron (1)\n";
}

std::string program_page(const CLI::App& app, const std::vector<const CLI::App*>& commands,
                         const std::string& version) {
  std::string list;
  for (const CLI::App* command : commands)
    list += ".TP\n" + bold("isochron " + command->get_name()) + "\n" + plain(command->get_description()) +
            "; see\n.BR " + plain("isochron-" + command->get_name()) + " (1)\n";
  return top("isochron", version, app.get_description()) + ".SH SYNOPSIS\n" + bold("isochron") + " " +
         italic("COMMAND") + " [" + italic("OPTIONS") + "]\n.SH COMMANDS\n" + list + options_of(app) +
         ".SH EXIT STATUS\n0 when the work was done, 1 when it failed, 2 when the input cannot be used.\n" +
         footer(app);
}

void write_man_pages(const CLI::App& app, const std::string& folder) {
  const auto commands = app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
  write_file_atomically(folder + "/isochron.1", program_page(app, commands, app.version()));
  for (const CLI::App* command : commands)
    write_file_atomically(folder + "/isochron-" + command->get_name() + ".1", command_page(*command, app.version()));
}

}  // namespace

void add_man_pages_option(CLI::App& app) {
  const auto write = [&app](const std::string& folder) {
    write_man_pages(app, folder);
    throw CLI::Success();
  };
  app.add_option_function<std::string>("--man-pages", write)->group("");
}

}  // namespace isochron
