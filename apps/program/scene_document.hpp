// The scene as text and tables, before its keys are checked: reading TOML and laying changes over
// it.
//
// A change is itself a table of keys: the file itself over its `base`, the [small] table, and each
// `--set key=value`. Tables are merged key by key; everything else is replaced, and so is what an
// inline table { ... } stands for. Where a change meets an array of tables ([[object]], [[pin]],
// ...) with a table, the entry whose `name` or index it names is changed; a key that names no entry
// goes to all of them.
#pragma once

#include <taut/apps/program/scene_value.hpp>

#include <filesystem>

namespace taut {

/// Reads a scene file over the file that its `base` key names, if any (and so on), without checking
/// keys. Throws Error for a missing file, text that is not TOML, and a circle of bases.
SceneValue read_document(std::filesystem::path const& file);

/// Lays the [small] table over the document and removes it.
void apply_small(SceneValue& document);

/// Lays "key.path=value" over the document. The value is TOML; a word that is not TOML is text, so
/// that solver.method=newton needs no quotes. Throws Error if the assignment has no key or no '='.
void apply_override(SceneValue& document, std::string const& assignment);

}  // namespace taut
