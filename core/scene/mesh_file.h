// What the readers of mesh files share. Text is read here and not by OpenMesh, whose readers turn NaN into
// zero, skip vertices they cannot read and pass on indices of vertices that do not exist.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/mesh.h"

namespace isochron {

/// Walks through the lines of a text file. Comments (from `comment` to the end of the line) and blank lines
/// are skipped. Errors name the file and the line, counted from one.
class LineReader {
 public:
  LineReader(const std::string& file, std::string_view text, char comment)
      : file_(file), text_(text), comment_(comment) {}

  bool next();              ///< goes to the next line that is not blank; false at the end
  void require_next();      ///< as `next`; throws at the end
  std::string_view word();  ///< the next word of the line; empty at its end
  double number();          ///< the next word, which must be a finite number
  long long integer();      ///< the next word, which must be an integer
  Vec3 point();             ///< the next three numbers
  int line() const { return line_; }
  [[noreturn]] void fail(const std::string& what) const;

 private:
  const std::string& file_;
  std::string_view text_, current_;
  char comment_;
  std::size_t at_ = 0;
  int line_ = 0;
};

/// Adds a polygon as a fan of triangles.
void add_polygon(const std::vector<int>& corners, Mesh& mesh);

/// A face of `corners` vertices read from the current line, each an index from 0 to `vertices` - 1.
void read_indexed_face(LineReader& lines, long long corners, std::size_t vertices, Mesh& mesh);

/// Text PLY is read from `contents`, binary PLY by OpenMesh.
Mesh read_ply(const std::string& file, const std::string& contents);

}  // namespace isochron
