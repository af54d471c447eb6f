#include <algorithm>
#include <taut/core/io/hdf5.hpp>

namespace taut::hdf5 {
namespace {

herr_t keep_description(unsigned, H5E_error2_t const* error, void* text) {
  // Walking inwards, the last description is the one nearest to the cause.
  if (error->desc) *static_cast<std::string*>(text) = error->desc;
  return 0;
}

Handle access_list() {
  Handle list(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "HDF5 cannot make a property list");
  check(H5Pset_file_locking(list, false, true), "HDF5's file locks cannot be turned off");
  // Groups that keep their links in their header, which a step commits in one write.
  check(H5Pset_libver_bounds(list, H5F_LIBVER_V18, H5F_LIBVER_V110), "HDF5's version is too old");
  // Rows go to the file when they are written, so that a full disk shows at that call.
  check(H5Pset_sieve_buf_size(list, 0), "HDF5 cannot turn its buffer off");
  return list;
}

Handle simple_space(Shape const& shape) {
  return {H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose,
          "HDF5 cannot make a data space"};
}

/// The file's data space of `dataset`, with rows [first, first + rows) selected, and one in memory.
std::pair<Handle, Handle> select_rows(hid_t dataset, hsize_t first, hsize_t rows,
                                      std::string const& what) {
  Shape count = shape_of(dataset);
  Shape start(count.size(), 0);
  start[0] = first;
  count[0] = rows;
  Handle file(H5Dget_space(dataset), H5Sclose, what);
  check(H5Sselect_hyperslab(file, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr),
        what);
  return {std::move(file), simple_space(count)};
}

Handle string_type(std::size_t length) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "HDF5 cannot make a type");
  check(H5Tset_size(type, length), "HDF5 cannot size a type");
  check(H5Tset_cset(type, H5T_CSET_UTF8), "HDF5 cannot mark a type");
  return type;
}

}  // namespace

std::string reason() {
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, keep_description, &text);
  constexpr std::string_view quote = "error message = '";
  if (const std::size_t begin = text.find(quote); begin != std::string::npos) {
    text.erase(0, begin + quote.size());
    text.resize(std::min(text.find('\''), text.size()));
  }
  return text.empty() ? "no reason given" : text;
}

void leave_files_at_exit() { check(H5dont_atexit(), "HDF5 is in use already"); }

Handle::Handle(hid_t id, Close close, std::string const& what) : id_(id), close_(close) {
  if (id_ < 0) throw Error("{} ({})", what, reason());
}

void check(herr_t status, std::string const& what) {
  if (status < 0) throw Error("{} ({})", what, reason());
}

Handle open_file(std::filesystem::path const& path, unsigned flags) {
  const Handle list = access_list();
  return {H5Fopen(path.c_str(), flags, list), H5Fclose,
          path.string() + ": cannot be opened as an HDF5 file"};
}

Handle create_file(std::filesystem::path const& path) {
  const Handle list = access_list(), creation = creation_list(H5P_FILE_CREATE);
  return {H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, list), H5Fclose,
          path.string() + ": cannot be created"};
}

Handle create_in_memory() {
  constexpr std::size_t growth = 1 << 20;
  // The oldest format: an image of the newer ones fails its own checksum in HDF5 1.10, because the
  // mark of an open file is taken out of it afterwards.
  const Handle list(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "HDF5 cannot make a property list");
  check(H5Pset_fapl_core(list, growth, false), "HDF5 cannot work in memory");
  return {H5Fcreate("in memory", H5F_ACC_TRUNC, H5P_DEFAULT, list), H5Fclose,
          "a file in memory cannot be created"};
}

std::string image_of(hid_t file) {
  check(H5Fflush(file, H5F_SCOPE_LOCAL), "a file in memory cannot be completed");
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  std::string image(static_cast<std::size_t>(std::max<ssize_t>(size, 0)), '\0');
  if (size <= 0 || H5Fget_file_image(file, image.data(), image.size()) != size) {
    throw Error("a file in memory cannot be copied ({})", reason());
  }
  return image;
}

Handle open_image(std::string& image) {
  const Handle list(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "HDF5 cannot make a property list");
  check(H5Pset_fapl_core(list, 1 << 20, false), "HDF5 cannot work in memory");
  check(H5Pset_file_image(list, image.data(), image.size()), "HDF5 cannot take a file from memory");
  return {H5Fopen("in memory", H5F_ACC_RDONLY, list), H5Fclose, "it is not an HDF5 file"};
}

Handle creation_list(hid_t list_class) {
  Handle list(H5Pcreate(list_class), H5Pclose, "HDF5 cannot make a property list");
  check(H5Pset_obj_track_times(list, false), "HDF5 cannot turn time stamps off");
  return list;
}

Handle make_group(hid_t parent, std::string const& name) {
  const Handle list = creation_list(H5P_GROUP_CREATE);
  // Room for all links and attributes in the header itself, which then never moves or grows.
  check(H5Pset_link_phase_change(list, 64, 32), "HDF5 cannot lay a group out");
  check(H5Pset_est_link_info(list, 24, 32), "HDF5 cannot lay a group out");
  return {H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, list, H5P_DEFAULT), H5Gclose,
          "the group " + name + " cannot be created"};
}

Handle open_group(hid_t parent, std::string const& name) {
  return {H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose, "it has no group " + name};
}

Handle make_dataset(hid_t parent, std::string const& name, hid_t type, Shape const& shape,
                    bool reserve_only) {
  const Handle list = creation_list(H5P_DATASET_CREATE);
  if (reserve_only) {
    check(H5Pset_alloc_time(list, H5D_ALLOC_TIME_EARLY), name);
    check(H5Pset_fill_time(list, H5D_FILL_TIME_NEVER), name);
  }
  const Handle space = simple_space(shape);
  return {H5Dcreate2(parent, name.c_str(), type, space, H5P_DEFAULT, list, H5P_DEFAULT), H5Dclose,
          "the dataset " + name + " cannot be created"};
}

Handle open_dataset(hid_t parent, std::string const& name) {
  return {H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, "it has no dataset " + name};
}

Shape shape_of(hid_t dataset) {
  const Handle space(H5Dget_space(dataset), H5Sclose, "a dataset has no shape");
  Shape shape(static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space), 0)));
  H5Sget_simple_extent_dims(space, shape.data(), nullptr);
  return shape;
}

hsize_t stored_values(hid_t dataset, std::string const& name) {
  const Handle type(H5Dget_type(dataset), H5Tclose, name + " has no type");
  const Handle file(H5Iget_file_id(dataset), H5Fclose, name + " is in no file");
  hsize_t file_size = 0;
  check(H5Fget_filesize(file, &file_size), "the file has no size");
  const hsize_t bytes = std::min(H5Dget_storage_size(dataset), file_size);
  const hsize_t room = bytes / std::max<hsize_t>(1, H5Tget_size(type));
  hsize_t values = 1;
  for (const hsize_t n : shape_of(dataset)) {
    if (n == 0) return 0;
    if (values > room / n) throw Error("{} has more values than the file", name);
    values *= n;
  }
  return values;
}

void write_rows(hid_t dataset, hid_t type, hsize_t first, hsize_t rows, void const* data,
                std::string const& what) {
  if (rows == 0) return;
  const auto [file, memory] = select_rows(dataset, first, rows, what);
  check(H5Dwrite(dataset, type, memory, file, H5P_DEFAULT, data), what);
}

void read_rows(hid_t dataset, hid_t type, hsize_t first, hsize_t rows, void* data,
               std::string const& what) {
  if (rows == 0) return;
  const auto [file, memory] = select_rows(dataset, first, rows, what);
  check(H5Dread(dataset, type, memory, file, H5P_DEFAULT, data), what);
}

void write_attribute(hid_t object, std::string const& name, hid_t type, Shape const& shape,
                     void const* data) {
  const Handle space =
      shape.empty() ? Handle(H5Screate(H5S_SCALAR), H5Sclose, name) : simple_space(shape);
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose, "the attribute " + name + " cannot be created");
  check(H5Awrite(attribute, type, data), "the attribute " + name + " cannot be written");
}

void change_attribute(hid_t object, std::string const& name, std::int64_t value) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose,
                         "it has no attribute " + name);
  check(H5Awrite(attribute, H5T_NATIVE_INT64, &value),
        "the attribute " + name + " cannot be written");
}

std::int64_t read_attribute(hid_t object, std::string const& name) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose,
                         "it has no attribute " + name);
  const Handle space(H5Aget_space(attribute), H5Sclose, "the attribute " + name + " has no shape");
  if (H5Sget_simple_extent_npoints(space) != 1) throw Error("the attribute {} is no number", name);
  std::int64_t value = 0;
  check(H5Aread(attribute, H5T_NATIVE_INT64, &value), "the attribute " + name + " cannot be read");
  return value;
}

void write_strings(hid_t parent, std::string const& name, std::vector<std::string> const& strings) {
  std::size_t length = 1;
  for (std::string const& s : strings) length = std::max(length, s.size() + 1);
  std::string padded(length * strings.size(), '\0');
  for (std::size_t i = 0; i < strings.size(); ++i) {
    std::copy(strings[i].begin(), strings[i].end(),
              padded.begin() + static_cast<std::ptrdiff_t>(i * length));
  }
  const Handle type = string_type(length);
  const Handle dataset = make_dataset(parent, name, type, {strings.size()});
  if (!strings.empty()) write_rows(dataset, type, 0, strings.size(), padded.data(), name);
}

std::vector<std::string> read_strings(hid_t parent, std::string const& name) {
  const Handle dataset = open_dataset(parent, name);
  const Handle stored(H5Dget_type(dataset), H5Tclose, name + " has no type");
  const Shape shape = shape_of(dataset);
  if (H5Tget_class(stored) != H5T_STRING || H5Tis_variable_str(stored) || shape.size() != 1) {
    throw Error("{} is no list of strings", name);
  }
  stored_values(dataset, name);
  const std::size_t length = H5Tget_size(stored);
  const Handle type = string_type(length);
  std::string padded(length * shape[0], '\0');
  check(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()),
        name + " cannot be read");
  std::vector<std::string> strings(shape[0]);
  for (std::size_t i = 0; i < strings.size(); ++i) {
    const std::string cell = padded.substr(i * length, length);
    strings[i] = cell.substr(0, cell.find('\0'));
  }
  return strings;
}

}  // namespace taut::hdf5
