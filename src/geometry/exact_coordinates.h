// Coordinates of mesh files in double precision, though importers read them in single.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/types.h"

namespace pilesim {

// A text file whose vertices are replaced by whole numbers that single precision holds, one triple
// for each place, with about the same shape. Who reads it finds the place by the numbers.
class ExactCoordinates {
 public:
  // For OBJ, and STL and PLY as text, by the ending of `name`. None: it is another format, or is
  // written in a way that is not understood here.
  static std::optional<ExactCoordinates> of(const std::string& name, const std::string& bytes);

  const std::string& text() const { return text_; }  // to be read in place of the file
  // Where the vertex is that was read as these numbers; null: it is none of the file's.
  const Vec3* find(float x, float y, float z) const;

 private:
  using Whole = std::array<int32_t, 3>;
  struct Hash {
    size_t operator()(const Whole& whole) const;
  };

  std::string text_;
  std::unordered_map<Whole, Vec3, Hash> places_;
};

}  // namespace pilesim
