// How programs keep large arrays, images above all. Whoever links this has such memory from `new` in huge pages.
#pragma once

namespace isochron {

/// From now on, memory that one pass frees stays with the process for the next: fresh pages can cost more than what they
/// are filled with. For programs to call first.
void keep_freed_memory();

}  // namespace isochron
