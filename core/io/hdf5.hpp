// The little of HDF5's C interface that results and checkpoints need, with owned handles and errors
// as exceptions. Internal to core/io: public headers do not include it.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <taut/core/report/error.hpp>
#include <utility>
#include <vector>

namespace taut::hdf5 {

/// While it lives, HDF5 does not print its error stack; it is read by `reason()` instead.
class Quiet {
public:
  Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  Quiet(Quiet const&) = delete;
  Quiet& operator=(Quiet const&) = delete;

private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// The innermost message of the error stack, or the operating system's if it quotes one.
std::string reason();

/// For a program, before anything else of HDF5: at its end, files that HDF5 could not close because
/// their disk is full are left as they are. HDF5 crashes in trying again.
void leave_files_at_exit();

/// Owns one HDF5 identifier.
class Handle {
public:
  using Close = herr_t (*)(hid_t);

  Handle() = default;
  /// Throws Error "<what> (<reason>)" when `id` is HDF5's failure value.
  Handle(hid_t id, Close close, std::string const& what);
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() { reset(); }

  operator hid_t() const { return id_; }
  /// Closes now; false when that failed, as it does when buffered bytes cannot be written.
  bool reset() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// Throws Error "<what> (<reason>)" when `status` is HDF5's failure value.
void check(herr_t status, std::string const& what);

/// Opens for reading or in-place writing. HDF5's file locks are off: a viewer may hold the file
/// open while a run appends to it, which the order of writes in vtkhdf_writer.cpp makes safe.
Handle open_file(std::filesystem::path const& path, unsigned flags);
Handle create_file(std::filesystem::path const& path);
/// A file that exists in memory only, and its bytes, to be written by other means.
Handle create_in_memory();
std::string image_of(hid_t file);
/// Opens such bytes for reading; HDF5 copies them.
Handle open_image(std::string& image);

template <class T>
hid_t memory_type();
template <>
inline hid_t memory_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
inline hid_t memory_type<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
inline hid_t memory_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
inline hid_t memory_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
inline hid_t memory_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}

using Shape = std::vector<hsize_t>;

Handle make_group(hid_t parent, std::string const& name);
/// Creation properties without time stamps, so that equal results are equal files.
Handle creation_list(hid_t list_class);
Handle open_group(hid_t parent, std::string const& name);
/// `reserve_only`: gives the values a fixed place in the file but writes none; they read as zero.
Handle make_dataset(hid_t parent, std::string const& name, hid_t type, Shape const& shape,
                    bool reserve_only = false);
Handle open_dataset(hid_t parent, std::string const& name);
Shape shape_of(hid_t dataset);
/// The number of values in a dataset. Throws Error when the file does not hold as many, as in a
/// damaged one: what follows allocates room for them.
hsize_t stored_values(hid_t dataset, std::string const& name);

/// Writes or reads rows [first, first + rows) of a one- or two-dimensional dataset.
void write_rows(hid_t dataset, hid_t type, hsize_t first, hsize_t rows, void const* data,
                std::string const& what);
void read_rows(hid_t dataset, hid_t type, hsize_t first, hsize_t rows, void* data,
               std::string const& what);

void write_attribute(hid_t object, std::string const& name, hid_t type, Shape const& shape,
                     void const* data);
/// Overwrites the value of an existing attribute.
void change_attribute(hid_t object, std::string const& name, std::int64_t value);
std::int64_t read_attribute(hid_t object, std::string const& name);

template <class T>
void write_dataset(hid_t parent, std::string const& name, std::span<T const> values,
                   Shape const& shape) {
  const Handle dataset = make_dataset(parent, name, memory_type<T>(), shape);
  if (!values.empty()) write_rows(dataset, memory_type<T>(), 0, shape[0], values.data(), name);
}

/// All values of a dataset of any shape. Throws Error when it is missing or not readable as T.
template <class T>
std::vector<T> read_dataset(hid_t parent, std::string const& name) {
  const Handle dataset = open_dataset(parent, name);
  std::vector<T> values(stored_values(dataset, name));
  check(H5Dread(dataset, memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
        name + " cannot be read");
  return values;
}

/// Strings of any length, stored padded to the longest one.
void write_strings(hid_t parent, std::string const& name, std::vector<std::string> const& strings);
std::vector<std::string> read_strings(hid_t parent, std::string const& name);

}  // namespace taut::hdf5
