// What captures need of HDF5's C interface, so that no other file includes it. One thread at a time:
// HDF5 is not safe for more, so that all is done within use_hdf5.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace isochron {

using Hdf5Shape = std::vector<std::size_t>;

/// "512 x 64 x 64"
std::string to_text(const Hdf5Shape& shape);

/// Does what uses HDF5 while no other thread of the program does, and HDF5 prints none of its errors. Passes exceptions on.
void use_hdf5(const std::function<void()>& work);

/// Makes use_hdf5 run its work by `run`, for processes in which others use HDF5, too.
void run_hdf5_by(std::function<void(const std::function<void()>&)> run);

/// At exit HDF5 complains of files that were too damaged to be closed, though nothing is left to be written. Keeps it from
/// that. For programs, before they use HDF5; a library leaves a process's exit alone.
void end_without_hdf5();

/// A file to be read. All errors are InputErrors that begin with the file's name. HDF5 1.10 finds out that a file was cut
/// off, but may crash where bytes in its headers were overwritten.
class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::string& file);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  /// Whether there is a dataset of that name. One without a value, which is how a missing one may be written, is none.
  bool has(const char* name) const;
  /// Whether it has at least one value.
  bool has_values(const char* name) const;
  /// Of a dataset that there must be.
  Hdf5Shape shape(const char* name) const;
  /// All values of a small dataset of numbers (integers and enumerations too), the last dimension running fastest.
  std::vector<double> read(const char* name) const;
  /// The values of `count` indices of the first dimension, from `first`, into `values`.
  void read_slab(const char* name, std::size_t first, std::size_t count, double* values) const;
  /// Fails where a dataset declares more values than its stored bytes can hold, so that nothing is allocated for them.
  void require_stored(const char* name) const;
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string file_;
  std::int64_t id_ = -1;
};

/// A new file, made in memory: HDF5 cannot be relied on where a disk is full.
class Hdf5Writer {
 public:
  /// `bytes` is about how large the file will be.
  explicit Hdf5Writer(std::size_t bytes);
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  void write(const char* name, const Hdf5Shape& shape, const std::vector<double>& values);
  void write_number(const char* name, double value) { write(name, {}, {value}); }
  void write_bool(const char* name, bool value);
  void write_text(const char* name, std::string_view text);
  /// One value of an enumeration of integers.
  void write_enumeration(const char* name, std::initializer_list<std::pair<const char*, int>> members, int value);
  /// A dataset of 32-bit floats, to be filled by `write_slab`.
  void create_floats(const char* name, const Hdf5Shape& shape);
  void write_slab(const char* name, std::size_t first, std::size_t count, const float* values);
  /// Writes what it holds, see write_file_atomically().
  void save(const std::string& file) const;

 private:
  std::int64_t id_ = -1;
};

}  // namespace isochron
