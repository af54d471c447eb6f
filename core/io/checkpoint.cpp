#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/io/hash.hpp>
#include <taut/core/io/hdf5.hpp>

namespace taut {
namespace {

namespace fs = std::filesystem;
using hdf5::Handle;

constexpr std::int64_t format_version = 3;

/// What follows the HDF5 image in the file: HDF5 itself trusts the sizes and addresses that it
/// reads, and damage there ends in a crash.
std::string trailer_of(std::string_view image) {
  return fmt::format("taut{:016x}", Hash().add(image).value());
}

/// Takes the trailer off. Throws Error if it does not fit.
std::string checked_image(std::string content) {
  std::size_t const length = trailer_of({}).size();
  if (content.size() > length) {
    std::string const trailer = content.substr(content.size() - length);
    content.resize(content.size() - length);
    if (trailer == trailer_of(content)) return content;
  }
  throw Error("its bytes are not those that were written");
}

/// The bytes of the checkpoint's file. It is composed in memory because a file that HDF5 writes
/// itself cannot be closed once the disk is full.
std::string compose(Checkpoint const& checkpoint) {
  const Handle file = hdf5::create_in_memory();
  const Handle root = hdf5::make_group(file, "taut");
  hdf5::write_attribute(root, "version", H5T_NATIVE_INT64, {}, &format_version);
  const Handle arrays = hdf5::make_group(root, "arrays");
  for (auto const& [name, array] : checkpoint.arrays) {
    std::visit(
        [&]<class T>(std::vector<T> const& values) {
          hdf5::write_dataset<T>(arrays, name, values, {values.size()});
        },
        array);
  }
  std::vector<std::string> names;
  std::vector<std::string> texts;
  for (auto const& [name, text] : checkpoint.texts) {
    names.push_back(name);
    texts.push_back(text);
  }
  hdf5::write_strings(root, "text_names", names);
  hdf5::write_strings(root, "texts", texts);
  std::string image = hdf5::image_of(file);
  return image + trailer_of(image);
}

Checkpoint::Array read_array(hid_t parent, std::string const& name) {
  const Handle dataset = hdf5::open_dataset(parent, name);
  const Handle type(H5Dget_type(dataset), H5Tclose, name + " has no type");
  const bool real = H5Tget_class(type) == H5T_FLOAT;
  if (H5Tget_size(type) == sizeof(double)) {
    if (real) return hdf5::read_dataset<double>(parent, name);
    return hdf5::read_dataset<std::int64_t>(parent, name);
  }
  if (real) return hdf5::read_dataset<float>(parent, name);
  return hdf5::read_dataset<std::int32_t>(parent, name);
}

herr_t keep_name(hid_t, char const* name, H5L_info_t const*, void* names) {
  static_cast<std::vector<std::string>*>(names)->emplace_back(name);
  return 0;
}

Checkpoint read_all(hid_t root) {
  Checkpoint checkpoint;
  const Handle arrays = hdf5::open_group(root, "arrays");
  std::vector<std::string> names;
  hdf5::check(H5Literate(arrays, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, keep_name, &names),
              "its arrays cannot be listed");
  for (std::string const& name : names) checkpoint.arrays[name] = read_array(arrays, name);
  names = hdf5::read_strings(root, "text_names");
  const std::vector<std::string> texts = hdf5::read_strings(root, "texts");
  if (texts.size() != names.size()) throw Error("its texts and their names differ in number");
  for (std::size_t i = 0; i < names.size(); ++i) checkpoint.texts[names[i]] = texts[i];
  return checkpoint;
}

}  // namespace

void write_checkpoint(fs::path const& path, Checkpoint const& checkpoint) {
  const hdf5::Quiet quiet;
  write_file_atomically(path, compose(checkpoint), Durability::machine);
}

Checkpoint read_checkpoint(fs::path const& path) {
  if (!fs::exists(path)) {
    throw Error("{}: there is no checkpoint to restart from (looked for {}); start the run again.",
                path.string(), fs::absolute(path).string());
  }
  const hdf5::Quiet quiet;
  std::int64_t version = 0;
  Checkpoint checkpoint;
  try {
    std::string image = checked_image(read_file(path));
    const Handle file = hdf5::open_image(image);
    const Handle root = hdf5::open_group(file, "taut");
    version = hdf5::read_attribute(root, "version");
    if (version == format_version) checkpoint = read_all(root);
  } catch (Error const& error) {
    throw Error("{}: this is no checkpoint that can be read, because {}; start the run again.",
                path.string(), error.what());
  }
  if (version != format_version) {
    throw Error(
        "{}: this checkpoint has format version {}, {} is what can be read; start the run "
        "again or use the program that wrote it.",
        path.string(), version, format_version);
  }
  return checkpoint;
}

}  // namespace taut
