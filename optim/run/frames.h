// Images of a run over its iterations, for reports: DIR/frames/NNNNNN.exr, a bounded number however long the run.
#pragma once
#include <string>

#include "core/image/image.h"

namespace isochron {

/// Keeps the images of every iteration that a stride divides. The stride is the least power of two under which the iterations
/// so far leave no more than `most`, so that it doubles as the run continues and every other frame is removed then. Which frames
/// there are depends only on the iteration: a resumed run has those of an uninterrupted one.
class Frames {
 public:
  /// Of `image`'s size fewer than `most` are kept where they would take more than 64 MB. 0: none.
  Frames(const std::string& folder, int most, const GatedImage& image, ExrNotes notes);

  /// Whether the iteration has a frame, at least for now.
  bool wants(int iteration) const;
  /// Writes the frame of an iteration that is wanted, and removes what no longer is.
  void write(int iteration, const GatedImage& image) const;

 private:
  int stride(int iteration) const;
  void remove_unwanted(int iteration) const;

  std::string folder_;
  int most_;
  ExrNotes notes_;
};

}  // namespace isochron
