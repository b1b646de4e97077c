#include "geometry/base_colours.h"

#include <assimp/GltfMaterial.h>
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

constexpr int kMostPixels = 8192;                   // a side
constexpr int kLeastSamples = 2, kMostSamples = 8;  // along a triangle's side
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
      skins_(scene.mNumMaterials) {
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
    const Skin& skin = skin_of(mesh.mMaterialIndex);
    if (const aiVector3D* places = coordinates(mesh, skin); places != nullptr) {
      std::array<Eigen::Vector2d, 3> corners;
      for (unsigned k = 0; k < 3; ++k) {
        const aiVector3D& at = places[face.mIndices[k]];
        corners[k] = {at.x, at.y};
      }
      colour *= mean(*skin.picture, corners) * factor(mesh.mMaterialIndex);
    } else {
      colour *= material_colour(mesh.mMaterialIndex);
    }
  }
  return {srgb_from_linear(colour[0]), srgb_from_linear(colour[1]), srgb_from_linear(colour[2])};
}

void BaseColours::place(const aiMesh& mesh, const aiFace& face, bool mirrored) {
  uint32_t& texture = map_.texture.emplace_back(0);
  TextureCorners& corners = map_.corners.emplace_back();
  if (mesh.mMaterialIndex >= scene_.mNumMaterials) return;
  Skin& skin = skin_of(mesh.mMaterialIndex);
  const aiVector3D* places = coordinates(mesh, skin);
  if (places == nullptr) return;
  for (size_t k = 0; k < 3; ++k) {
    const unsigned vertex = face.mIndices[mirrored ? (3 - k) % 3 : k];
    if (mesh.mColors[0] != nullptr) {
      const aiColor4D& own = mesh.mColors[0][vertex];
      if (std::min({own.r, own.g, own.b}) < 1) return;
    }
    // Theirs are counted from the lower edge.
    const std::array<float, 2> at = {places[vertex].x, 1 - places[vertex].y};
    if (!std::isfinite(at[0]) || !std::isfinite(at[1])) return;
    corners[k] = at;
  }
  if (skin.texture == 0) skin.texture = keep(*skin.picture, factor(mesh.mMaterialIndex));
  texture = skin.texture;
}

const aiVector3D* BaseColours::coordinates(const aiMesh& mesh, const Skin& skin) const {
  return skin.picture && skin.channel < AI_MAX_NUMBER_OF_TEXTURECOORDS
             ? mesh.mTextureCoords[skin.channel]
             : nullptr;
}

// In OBJ and FBX files a texture replaces the colour.
BaseColours::Linear BaseColours::factor(unsigned material) const {
  return is_linear_ ? material_colour(material) : Linear(Linear::Ones());
}

uint32_t BaseColours::keep(const Picture& picture, const Linear& factor) {
  Linear sum = Linear::Zero();
  double weight = 0;
  for (size_t i = 0; i < picture.rgba.size(); i += 4) {
    const uint8_t* pixel = &picture.rgba[i];
    sum += pixel[3] * Linear(linear_[pixel[0]], linear_[pixel[1]], linear_[pixel[2]]);
    weight += pixel[3];
  }
  Texture texture{.width = picture.width, .height = picture.height, .pixels = {}};
  texture.pixels.reserve(picture.rgba.size() / 4);
  const bool is_plain = (factor == 1).all();
  for (size_t i = 0; i < picture.rgba.size(); i += 4) {
    const uint8_t* pixel = &picture.rgba[i];
    if (is_plain && (pixel[3] == 255 || weight == 0)) {
      texture.pixels.push_back({pixel[0], pixel[1], pixel[2]});
      continue;
    }
    Linear colour(linear_[pixel[0]], linear_[pixel[1]], linear_[pixel[2]]);
    if (weight > 0) {
      const double opaque = pixel[3] / 255.0;
      colour = opaque * colour + (1 - opaque) * sum / weight;
    }
    colour *= factor;
    texture.pixels.push_back({nearest_srgb(static_cast<float>(colour[0])),
                              nearest_srgb(static_cast<float>(colour[1])),
                              nearest_srgb(static_cast<float>(colour[2]))});
  }
  const int longest = std::max(texture.width, texture.height);
  if (longest > kLargestTexture) {
    const auto smaller = [&](int side) { return std::max(1, side * kLargestTexture / longest); };
    texture = shrunk(texture, smaller(texture.width), smaller(texture.height));
  }
  // Materials may share one.
  const auto same = std::ranges::find_if(
      map_.textures,
      [&](const std::shared_ptr<const Texture>& other) { return *other == texture; });
  const auto index = static_cast<uint32_t>(same - map_.textures.begin());
  if (same == map_.textures.end()) {
    map_.textures.push_back(std::make_shared<const Texture>(std::move(texture)));
  }
  return index + 1;
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

BaseColours::Skin& BaseColours::skin_of(unsigned index) {
  std::optional<Skin>& skin = skins_[index];
  if (skin) return *skin;
  skin.emplace();
  const aiMaterial& material = *scene_.mMaterials[index];
  aiString alpha;
  const bool is_opaque = material.Get(AI_MATKEY_GLTF_ALPHAMODE, alpha) == AI_SUCCESS &&
                         std::string_view(alpha.C_Str()) == "OPAQUE";
  std::string lost;
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString name;
    if (skin->picture ||
        material.GetTexture(type, 0, &name, nullptr, &skin->channel) != AI_SUCCESS) {
      continue;
    }
    try {
      skin->picture = load(name.C_Str());
    } catch (const Unreadable& fault) {
      lost = "texture \"" + std::string(name.C_Str()) + "\" of material \"" +
             material.GetName().C_Str() + "\" " + fault.why;
    }
  }
  if (!skin->picture && !lost.empty()) lost_.push_back(lost);
  if (skin->picture && is_opaque) {
    for (size_t i = 3; i < skin->picture->rgba.size(); i += 4) skin->picture->rgba[i] = 255;
  }
  return *skin;
}

BaseColours::Picture BaseColours::load(const std::string& name) const {
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
  Picture picture;
  int channels = 0;
  const auto size = static_cast<int>(length);
  if (stbi_info_from_memory(bytes, size, &picture.width, &picture.height, &channels) == 0) {
    throw Unreadable{"is no picture of a known format"};
  }
  if (std::max(picture.width, picture.height) > kMostPixels) {
    throw Unreadable{"has " + std::to_string(picture.width) + " x " +
                     std::to_string(picture.height) + " pixels"};
  }
  if (!may_be_decoded({reinterpret_cast<const char*>(bytes), length})) throw Unreadable{kBroken};
  const size_t count = 4 * static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height);
  allow_isolated_memory(8 * count);  // for the decoder and its result
  const std::unique_ptr<stbi_uc, FreePixels> pixels(
      stbi_load_from_memory(bytes, size, &picture.width, &picture.height, &channels, 4));
  if (pixels == nullptr) throw Unreadable{kBroken};
  picture.rgba.assign(pixels.get(), pixels.get() + count);
  return picture;
}

BaseColours::Linear BaseColours::mean(const Picture& picture,
                                      const std::array<Eigen::Vector2d, 3>& corners) const {
  const Eigen::Array2d size(picture.width, picture.height);
  double longest = 0;
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::Array2d side = (corners[(k + 1) % 3] - corners[k]).array() * size;
    longest = std::max(longest, side.matrix().norm());
  }
  if (!std::isfinite(longest)) return Linear::Ones();
  const int steps =
      std::clamp(static_cast<int>(longest / kPixelsAStep), kLeastSamples, kMostSamples);
  Linear sum = Linear::Zero(), all = Linear::Zero();
  double weight = 0;
  int count = 0;
  // The middles of equal parts: those that stand like the triangle, and those upside down.
  const auto add = [&](double u, double v) {
    const Eigen::Vector2d at = (1 - u - v) * corners[0] + u * corners[1] + v * corners[2];
    const int column = wrapped(at.x(), picture.width), row = wrapped(1 - at.y(), picture.height);
    const uint8_t* pixel =
        &picture.rgba[4 * (static_cast<size_t>(row) * static_cast<size_t>(picture.width) +
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
