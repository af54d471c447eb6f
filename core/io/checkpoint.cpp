#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/io/hdf5.hpp>

namespace taut {
namespace {

namespace fs = std::filesystem;
using hdf5::Handle;

constexpr std::int64_t format_version = 1;

/// FNV-1a in 64 bits (http://www.isthe.com/chongo/tech/comp/fnv).
class Hash {
public:
  void add(void const* data, std::size_t size) {
    auto const* const bytes = static_cast<unsigned char const*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3U;
  }
  std::int64_t value() const { return static_cast<std::int64_t>(value_); }

private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

std::int64_t hash_of(std::string_view text) {
  Hash hash;
  hash.add(text.data(), text.size());
  return hash.value();
}

/// Of all names and values: finds damage that leaves the file's structure whole.
std::int64_t hash_of(Checkpoint const& checkpoint) {
  Hash hash;
  for (auto const& [name, array] : checkpoint.arrays) {
    hash.add(name.data(), name.size());
    std::visit(
        [&](auto const& values) { hash.add(values.data(), values.size() * sizeof(values[0])); },
        array);
  }
  for (auto const& [name, text] : checkpoint.texts) {
    hash.add(name.data(), name.size());
    hash.add(text.data(), text.size());
  }
  return hash.value();
}

/// The bytes of the checkpoint's file. It is composed in memory because a file that HDF5 writes
/// itself cannot be closed once the disk is full.
std::string compose(Checkpoint const& checkpoint, std::int64_t scene) {
  const Handle file = hdf5::create_in_memory();
  const Handle root = hdf5::make_group(file, "taut");
  const auto write_number = [&](std::string const& name, std::int64_t value) {
    hdf5::write_attribute(root, name, H5T_NATIVE_INT64, {}, &value);
  };
  write_number("version", format_version);
  write_number("scene", scene);
  write_number("content", hash_of(checkpoint));
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
  return hdf5::image_of(file);
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
  if (hash_of(checkpoint) != hdf5::read_attribute(root, "content")) {
    throw Error("its values are not those that were written");
  }
  return checkpoint;
}

}  // namespace

void write_checkpoint(fs::path const& path, Checkpoint const& checkpoint,
                      std::string_view scene_text) {
  const hdf5::Quiet quiet;
  write_file_atomically(path, compose(checkpoint, hash_of(scene_text)), Durability::machine);
}

Checkpoint read_checkpoint(fs::path const& path, std::string_view scene_text) {
  if (!fs::exists(path)) {
    throw Error("{}: there is no checkpoint to restart from (looked for {}); start the run again.",
                path.string(), fs::absolute(path).string());
  }
  const hdf5::Quiet quiet;
  std::int64_t version = 0;
  std::int64_t scene = 0;
  Checkpoint checkpoint;
  try {
    const Handle file = hdf5::open_file(path, H5F_ACC_RDONLY);
    const Handle root = hdf5::open_group(file, "taut");
    version = hdf5::read_attribute(root, "version");
    scene = hdf5::read_attribute(root, "scene");
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
  if (scene != hash_of(scene_text)) {
    throw Error(
        "{}: this checkpoint was written for a scene that has changed since; undo the "
        "change or start the run again.",
        path.string());
  }
  return checkpoint;
}

}  // namespace taut
