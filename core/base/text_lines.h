// Text files, line by line and word by word, as programs of every system write them; and the numbers in them.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace isochron {

/// A finite number, with a point in every locale; what is nearer to 0 than a double can be is 0. Empty where the text
/// is another, or goes on behind it.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);  ///< decimal, likewise

/// The same word, whether in capitals or not.
bool same_word(std::string_view a, std::string_view b);

struct TextRules {
  char comment = '\0';     ///< begins what is left out up to the line's end; '\0': nothing does
  bool continued = false;  ///< a line that ends in a backslash goes on in the next one; a comment does not
  std::string_view separators = " \t\f\v";  ///< of words
};

/// The lines of a text that hold a word. They end in LF, CR or CRLF, as the first one does or otherwise. Byte-order marks at
/// their beginning are passed over, in the middle of the text too, where files were joined.
class TextLines {
 public:
  /// Both strings must outlive this. Throws InputError for a text in UTF-16.
  TextLines(const std::string& file, const std::string& contents, const TextRules& rules);

  bool next();              ///< goes to the next line; false at the end
  void require_next();      ///< throws InputError there
  std::string_view word();  ///< the line's next word; empty at its end
  void skip_line();         ///< the words that are left
  /// What is behind the line; of the first byte of binary data behind a text, a line that ends in CR alone takes nothing if
  /// the first line of all does.
  std::string_view rest() const { return std::string_view(contents_).substr(at_); }
  int line() const { return line_; }                      ///< in the file, from 1; of a line that goes on, the first
  std::size_t column_of(std::string_view word) const;     ///< from 1, of a word of this line
  [[noreturn]] void fail(const std::string& what) const;  ///< throws InputError `FILE:LINE: what`

 private:
  std::string_view take_line();

  const std::string& file_;
  const std::string& contents_;
  TextRules rules_;
  bool ends_in_cr_ = false;    ///< the first line does, without LF
  std::size_t at_ = 0;         ///< behind the line
  std::size_t line_feed_ = 0;  ///< the next one, from at_ on, once it is looked for
  std::string joined_;         ///< a line that goes on, with what it goes on with
  std::string_view line_text_, current_;
  int lines_ = 0, line_ = 0;
};

}  // namespace isochron
