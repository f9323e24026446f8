#include "core/image/hdf5_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hdf5.h>

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/ranks.h"

namespace isochron {
namespace {

static_assert(std::is_same_v<hid_t, std::int64_t>);

/// An identifier of HDF5's that is closed with its scope; negative where its making failed.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }
  bool failed() const { return id_ < 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// The root of the last failure, in HDF5's words and in one line.
std::string last_error() {
  std::string text;
  const auto visit = [](unsigned, const H5E_error2_t* error, void* data) -> herr_t {
    if (error->desc != nullptr) *static_cast<std::string*>(data) = error->desc;
    return 1;  // the first is the innermost
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, visit, &text);
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text.empty() ? "unknown error" : text;
}

// Every call of HDF5's forgets the last error: this one comes directly behind what failed.
[[noreturn]] void fail_to_write() {
  throw std::runtime_error("HDF5: " + last_error());
}

Handle open_dataset(hid_t file, const char* name) {
  // Chunks that slabs share are kept: decompressed once rather than for each of them.
  constexpr std::size_t kSlots = 12421, kBytes = std::size_t{64} << 20;
  const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  H5Pset_chunk_cache(access, kSlots, kBytes, H5D_CHUNK_CACHE_W0_DEFAULT);
  return Handle(H5Dopen2(file, name, access), H5Dclose);
}

std::vector<hsize_t> to_hdf5(const Hdf5Shape& shape) {
  return {shape.begin(), shape.end()};
}

Handle make_space(const Hdf5Shape& shape) {
  const std::vector<hsize_t> sizes = to_hdf5(shape);
  if (sizes.empty()) return Handle(H5Screate(H5S_SCALAR), H5Sclose);
  return Handle(H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr), H5Sclose);
}

Hdf5Shape shape_of(hid_t space) {
  std::vector<hsize_t> sizes(std::max(H5Sget_simple_extent_ndims(space), 0));
  H5Sget_simple_extent_dims(space, sizes.data(), nullptr);
  return {sizes.begin(), sizes.end()};
}

Handle create_dataset(hid_t id, const char* name, hid_t type, const Hdf5Shape& shape) {
  const Handle space = make_space(shape);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties, false);  // equal contents make equal files
  const hid_t dataset = H5Dcreate2(id, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
  if (dataset < 0) fail_to_write();
  return Handle(dataset, H5Dclose);
}

/// The part of a dataset's space that a slab is.
bool select_slab(hid_t space, std::size_t first, std::size_t count, Hdf5Shape& shape) {
  shape = shape_of(space);
  if (shape.empty()) return false;
  std::vector<hsize_t> start(shape.size(), 0);
  start[0] = first;
  shape[0] = count;
  return H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, to_hdf5(shape).data(), nullptr) >= 0;
}

bool is_number(hid_t dataset) {
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type);
  return kind == H5T_INTEGER || kind == H5T_FLOAT || kind == H5T_ENUM;
}

/// Keeps HDF5 from printing its errors while it lives.
class QuietHdf5 {
 public:
  QuietHdf5() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietHdf5() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

void work_quietly(const std::function<void()>& work) {
  static std::mutex one;
  const std::scoped_lock lock(one);
  const QuietHdf5 quiet;
  work();
}

std::function<void(const std::function<void()>&)>& runner() {
  static std::function<void(const std::function<void()>&)> run;
  return run;
}

}  // namespace

std::string to_text(const Hdf5Shape& shape) {
  return fmt::format("{}", fmt::join(shape, " x "));
}

void use_hdf5(const std::function<void()>& work) {
  const std::function<void(const std::function<void()>&)>& run = runner();
  run ? run([&] { work_quietly(work); }) : work_quietly(work);
}

void run_hdf5_by(std::function<void(const std::function<void()>&)> run) {
  runner() = std::move(run);
}

void end_without_hdf5() {
  H5dont_atexit();
}

Hdf5Reader::Hdf5Reader(const std::string& file) : file_(file) {
  std::string problem;
  if (std::error_code ignored; !std::filesystem::exists(file, ignored))
    fail(
        "does not exist (a measurement has to be had first, and scripts/import_capture.py makes such files of it; see "
        "\"Captures\" in experiments/README.md)");
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  std::string name = file;
  if (rank_count() == 1) {
    if (!is_regular_file(file, problem)) fail(problem);
    H5Pset_file_locking(access, false, true);  // locks fail on read-only and on some network file systems
  } else {
    auto contents = read_regular_file(file, problem);
    if (!contents) fail(problem);
    H5Pset_fapl_core(access, contents->size(), false);
    H5Pset_file_image(access, contents->data(), contents->size());
    name += ":in memory";  // images of files that exist are refused
  }
  id_ = H5Fopen(name.c_str(), H5F_ACC_RDONLY, access);
  if (id_ < 0) fail("cannot be read as HDF5: " + last_error());
}

Hdf5Reader::~Hdf5Reader() {
  H5Fclose(id_);
}

void Hdf5Reader::fail(const std::string& what) const {
  throw InputError(file_ + ": " + what);
}

bool Hdf5Reader::has(const char* name) const {
  if (H5Lexists(id_, name, H5P_DEFAULT) <= 0) return false;
  const Handle dataset = open_dataset(id_, name);
  if (dataset.failed()) return false;  // a group
  const Handle space(H5Dget_space(dataset), H5Sclose);
  return H5Sget_simple_extent_type(space) != H5S_NULL;
}

bool Hdf5Reader::has_values(const char* name) const {
  if (!has(name)) return false;
  const Handle dataset = open_dataset(id_, name);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  return H5Sget_simple_extent_npoints(space) > 0;
}

Hdf5Shape Hdf5Reader::shape(const char* name) const {
  if (!has(name)) fail(fmt::format("{} is missing", name));
  const Handle dataset = open_dataset(id_, name);
  if (!is_number(dataset)) fail(fmt::format("{} holds no numbers", name));
  const Handle space(H5Dget_space(dataset), H5Sclose);
  return shape_of(space);
}

void Hdf5Reader::require_stored(const char* name) const {
  constexpr double kStrongestCompression = 1100;  // of gzip, of a row of equal bytes
  const Handle dataset = open_dataset(id_, name);
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  hsize_t file_size = 0;
  H5Fget_filesize(id_, &file_size);
  const double stored = static_cast<double>(std::min(H5Dget_storage_size(dataset), file_size));
  double declared = static_cast<double>(H5Tget_size(type));
  const Hdf5Shape sizes = shape(name);
  for (const std::size_t size : sizes) declared *= static_cast<double>(size);
  if (declared > stored * (H5Pget_nfilters(properties) > 0 ? kStrongestCompression : 1))
    fail(fmt::format("{} of {} values holds {} bytes only", name, to_text(sizes), stored));
}

std::vector<double> Hdf5Reader::read(const char* name) const {
  const Hdf5Shape sizes = shape(name);
  require_stored(name);
  std::size_t count = 1;
  for (const std::size_t size : sizes) count *= size;
  std::vector<double> values(count);
  const Handle dataset = open_dataset(id_, name);
  if (H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    fail(fmt::format("{} cannot be read: {}", name, last_error()));
  return values;
}

void Hdf5Reader::read_slab(const char* name, std::size_t first, std::size_t count, double* values) const {
  const Handle dataset = open_dataset(id_, name);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  Hdf5Shape shape;
  const bool selected = select_slab(space, first, count, shape);
  const Handle memory = make_space(shape);
  if (!selected || H5Dread(dataset, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, values) < 0)
    fail(fmt::format("{} cannot be read: {}", name, last_error()));
}

Hdf5Writer::Hdf5Writer(std::size_t bytes) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, bytes, false);
  id_ = H5Fcreate("capture", H5F_ACC_TRUNC, H5P_DEFAULT, access);
  if (id_ < 0) fail_to_write();
}

Hdf5Writer::~Hdf5Writer() {
  H5Fclose(id_);
}

void Hdf5Writer::save(const std::string& file) const {
  if (H5Fflush(id_, H5F_SCOPE_GLOBAL) < 0) fail_to_write();
  const ssize_t size = H5Fget_file_image(id_, nullptr, 0);
  void** memory = nullptr;
  if (size < 0 || H5Fget_vfd_handle(id_, H5P_DEFAULT, reinterpret_cast<void**>(&memory)) < 0) fail_to_write();
  const std::string_view contents(static_cast<const char*>(*memory), static_cast<std::size_t>(size));
  on_first_rank([&] {
    NewFile out(file);
    out.write(contents);
    out.finish();
  });
}

void Hdf5Writer::write(const char* name, const Hdf5Shape& shape, const std::vector<double>& values) {
  const Handle dataset = create_dataset(id_, name, H5T_IEEE_F64LE, shape);
  if (H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) fail_to_write();
}

void Hdf5Writer::write_bool(const char* name, bool value) {
  // As h5py writes NumPy's bool.
  const Handle type(H5Tenum_create(H5T_STD_I8LE), H5Tclose);
  for (const signed char member : {0, 1}) H5Tenum_insert(type, member == 0 ? "FALSE" : "TRUE", &member);
  const Handle dataset = create_dataset(id_, name, type, {});
  const signed char number = value ? 1 : 0;
  if (H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &number) < 0) fail_to_write();
}

void Hdf5Writer::write_text(const char* name, std::string_view text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const Handle dataset = create_dataset(id_, name, type, {});
  const std::string copy(text);
  const char* value = copy.c_str();
  if (H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) < 0) fail_to_write();
}

void Hdf5Writer::write_enumeration(const char* name, std::initializer_list<std::pair<const char*, int>> members,
                                   int value) {
  const Handle type(H5Tenum_create(H5T_NATIVE_INT), H5Tclose);
  for (const auto& [member, number] : members) H5Tenum_insert(type, member, &number);
  const Handle dataset = create_dataset(id_, name, type, {1});
  if (H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) < 0) fail_to_write();
}

void Hdf5Writer::create_floats(const char* name, const Hdf5Shape& shape) {
  create_dataset(id_, name, H5T_IEEE_F32LE, shape);
}

void Hdf5Writer::write_slab(const char* name, std::size_t first, std::size_t count, const float* values) {
  const Handle dataset = open_dataset(id_, name);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  Hdf5Shape shape;
  const bool selected = select_slab(space, first, count, shape);
  const Handle memory = make_space(shape);
  if (!selected || H5Dwrite(dataset, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, values) < 0) fail_to_write();
}

}  // namespace isochron
