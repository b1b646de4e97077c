// Files that come with pilesim.
#pragma once

#include <filesystem>
#include <string>

namespace pilesim {

// The directory "presets" or "reproduce" that belongs to this program: as it is installed, or in
// the tree that it was built in. Throws Error(io) where there is none.
std::filesystem::path installed_directory(const std::string& name);

}  // namespace pilesim
