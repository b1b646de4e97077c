#include "geometry/base_colours.h"

#include <assimp/material.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "core/isolated.h"
#include "geometry/png_chunks.h"

#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_ONLY_BMP
#define STBI_ONLY_TGA
#define STBI_NO_STDIO
#define STB_IMAGE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace pilesim {
namespace {

constexpr int kMostPixels = 8192;               // a side
constexpr int kLeastSteps = 2, kMostSteps = 8;  // along a triangle's side
constexpr double kPixelsAStep = 4;
constexpr char kBroken[] = "is broken";

struct FreePixels {
  void operator()(stbi_uc* pixels) const { stbi_image_free(pixels); }
};

// Row or column of a coordinate that repeats with 1.
int wrapped(double coordinate, int count) {
  const double share = coordinate - std::floor(coordinate);
  return std::min(static_cast<int>(share * count), count - 1);
}

}  // namespace

BaseColours::BaseColours(const aiScene& scene, bool colours_are_linear, FindFile find)
    : scene_(scene),
      is_linear_(colours_are_linear),
      find_(std::move(find)),
      textures_(scene.mNumMaterials) {
  for (size_t i = 0; i < linear_.size(); ++i) {
    linear_[i] = linear_from_srgb(static_cast<uint8_t>(i));
  }
}

Colour BaseColours::of(const aiMesh& mesh, const aiFace& face) {
  Linear colour = Linear::Ones();
  if (mesh.mColors[0] != nullptr) {
    colour.setZero();
    for (unsigned k = 0; k < 3; ++k) {
      const aiColor4D& c = mesh.mColors[0][face.mIndices[k]];
      colour += Linear(c.r, c.g, c.b) / 3;
    }
    if (!is_linear_) {
      for (double& c : colour) c = linear_[static_cast<size_t>(std::clamp(c, 0.0, 1.0) * 255)];
    }
  }
  if (mesh.mMaterialIndex < scene_.mNumMaterials) {
    const std::optional<Texture>& texture = texture_of(mesh.mMaterialIndex);
    if (texture && mesh.mTextureCoords[0] != nullptr) {
      std::array<Eigen::Vector2d, 3> corners;
      for (unsigned k = 0; k < 3; ++k) {
        const aiVector3D& at = mesh.mTextureCoords[0][face.mIndices[k]];
        corners[k] = {at.x, at.y};
      }
      colour *= mean(*texture, corners);
      // Of OBJ and FBX a texture stands in place of the colour.
      if (is_linear_) colour *= material_colour(mesh.mMaterialIndex);
    } else {
      colour *= material_colour(mesh.mMaterialIndex);
    }
  }
  return {srgb_from_linear(colour[0]), srgb_from_linear(colour[1]), srgb_from_linear(colour[2])};
}

BaseColours::Linear BaseColours::material_colour(unsigned index) const {
  const aiMaterial& material = *scene_.mMaterials[index];
  aiColor4D colour(1, 1, 1, 1);
  if (material.Get(AI_MATKEY_BASE_COLOR, colour) != AI_SUCCESS) {
    material.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
  }
  Linear linear(colour.r, colour.g, colour.b);
  // NaN among them becomes 0.
  for (double& c : linear) c = c > 0 ? std::min(c, 1.0) : 0;
  if (!is_linear_) {
    for (double& c : linear) c = linear_[static_cast<size_t>(std::lround(255 * c))];
  }
  return linear;
}

const std::optional<BaseColours::Texture>& BaseColours::texture_of(unsigned index) {
  std::optional<std::optional<Texture>>& texture = textures_[index];
  if (texture) return *texture;
  texture.emplace();
  const aiMaterial& material = *scene_.mMaterials[index];
  std::string lost;
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString name;
    if (*texture || material.GetTexture(type, 0, &name) != AI_SUCCESS) continue;
    try {
      *texture = load(name.C_Str());
    } catch (const Unreadable& fault) {
      lost = "texture \"" + std::string(name.C_Str()) + "\" of material \"" +
             material.GetName().C_Str() + "\" " + fault.why;
    }
  }
  if (!*texture && !lost.empty()) lost_.push_back(lost);
  return *texture;
}

BaseColours::Texture BaseColours::load(const std::string& name) const {
  const stbi_uc* bytes = nullptr;
  size_t length = 0;
  if (const aiTexture* inside = scene_.GetEmbeddedTexture(name.c_str()); inside != nullptr) {
    if (inside->mHeight != 0) throw Unreadable{"is not compressed"};  // of games long ago
    bytes = reinterpret_cast<const stbi_uc*>(inside->pcData);
    length = inside->mWidth;
  } else if (const std::string* file = find_(name); file != nullptr) {
    bytes = reinterpret_cast<const stbi_uc*>(file->data());
    length = file->size();
  }
  if (bytes == nullptr) throw Unreadable{"is not there"};
  if (length > INT32_MAX) throw Unreadable{"is larger than 2 GiB"};
  Texture texture;
  int channels = 0;
  const auto size = static_cast<int>(length);
  if (stbi_info_from_memory(bytes, size, &texture.width, &texture.height, &channels) == 0) {
    throw Unreadable{"is no picture of a known format"};
  }
  if (std::max(texture.width, texture.height) > kMostPixels) {
    throw Unreadable{"has " + std::to_string(texture.width) + " x " +
                     std::to_string(texture.height) + " pixels"};
  }
  if (!may_be_decoded({reinterpret_cast<const char*>(bytes), length})) throw Unreadable{kBroken};
  const size_t count = 4 * static_cast<size_t>(texture.width) * static_cast<size_t>(texture.height);
  allow_isolated_memory(4 * count);  // for the decoder, too
  const std::unique_ptr<stbi_uc, FreePixels> pixels(
      stbi_load_from_memory(bytes, size, &texture.width, &texture.height, &channels, 4));
  if (pixels == nullptr) throw Unreadable{kBroken};
  texture.rgba.assign(pixels.get(), pixels.get() + count);
  return texture;
}

BaseColours::Linear BaseColours::mean(const Texture& texture,
                                      const std::array<Eigen::Vector2d, 3>& corners) const {
  const Eigen::Array2d size(texture.width, texture.height);
  double longest = 0;
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::Array2d side = (corners[(k + 1) % 3] - corners[k]).array() * size;
    longest = std::max(longest, side.matrix().norm());
  }
  if (!std::isfinite(longest)) return Linear::Ones();
  const int steps = std::clamp(static_cast<int>(longest / kPixelsAStep), kLeastSteps, kMostSteps);
  Linear sum = Linear::Zero(), all = Linear::Zero();
  double weight = 0;
  int count = 0;
  // The middles of equal parts: those that stand like the triangle, and those upside down.
  const auto add = [&](double u, double v) {
    const Eigen::Vector2d at = (1 - u - v) * corners[0] + u * corners[1] + v * corners[2];
    const int column = wrapped(at.x(), texture.width), row = wrapped(1 - at.y(), texture.height);
    const uint8_t* pixel =
        &texture.rgba[4 * (static_cast<size_t>(row) * static_cast<size_t>(texture.width) +
                           static_cast<size_t>(column))];
    const Linear colour(linear_[pixel[0]], linear_[pixel[1]], linear_[pixel[2]]);
    sum += pixel[3] * colour;
    weight += pixel[3];
    all += colour;
    ++count;
  };
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; i + j < steps; ++j) {
      add((i + 1 / 3.0) / steps, (j + 1 / 3.0) / steps);
      if (i + j < steps - 1) add((i + 2 / 3.0) / steps, (j + 2 / 3.0) / steps);
    }
  }
  return weight > 0 ? sum / weight : all / count;
}

}  // namespace pilesim
