#include "geometry/mesh_file.h"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/IOSystem.hpp>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <string_view>
#include <utility>

#include "core/atomic_file.h"
#include "core/isolated.h"
#include "core/printable.h"
#include "geometry/base_colours.h"
#include "geometry/coordinate_rounding.h"
#include "geometry/exact_coordinates.h"
#include "geometry/mesh_bounds.h"

namespace pilesim {
namespace {

// Memory that assimp may take: compressed and text formats need many times their size.
constexpr uint64_t kBaseMemory = uint64_t{256} << 20, kMemoryPerByte = 64;
// Processor time; text is read at some 10 MB/s.
constexpr int kBaseSeconds = 6;
constexpr uint64_t kBytesPerSecond = 500'000;
constexpr int kMostDepth = 1000;  // of nodes

// Why a file is refused, where its name is not at hand.
struct Refusal {
  std::string found;
};

// The file was not read as it was given: vertices are none of its own.
struct Misread {};

Eigen::Affine3d transform_of(const aiMatrix4x4& m) {
  Eigen::Affine3d transform;
  transform.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4,
      m.d1, m.d2, m.d3, m.d4;
  return transform;
}

// Gathers the triangles of a node and its children; each node that has some becomes a group.
class Gatherer {
 public:
  // `exact`, which may be null: where the vertices are.
  Gatherer(const aiScene& scene, BaseColours& colours, const ExactCoordinates* exact)
      : scene_(scene), colours_(colours), exact_(exact) {}

  void add(const aiNode& node, const Eigen::Affine3d& parent, int depth = 0) {
    if (depth > kMostDepth) {
      throw Refusal{"nests its nodes deeper than " + std::to_string(kMostDepth) + " levels"};
    }
    const Eigen::Affine3d transform = parent * transform_of(node.mTransformation);
    const auto first = static_cast<uint32_t>(mesh_.triangles.size());
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      add_triangles(*scene_.mMeshes[node.mMeshes[i]], transform);
    }
    const auto count = static_cast<uint32_t>(mesh_.triangles.size()) - first;
    if (count > 0) mesh_.groups.push_back({printable(node.mName.C_Str()), first, count});
    for (unsigned i = 0; i < node.mNumChildren; ++i) add(*node.mChildren[i], transform, depth + 1);
  }

  TriangleMesh take() { return std::move(mesh_); }

 private:
  void add_triangles(const aiMesh& mesh, const Eigen::Affine3d& transform) {
    const auto offset = static_cast<uint32_t>(mesh_.vertices.size());
    make_room(mesh_.vertices, mesh.mNumVertices);
    make_room(mesh_.triangles, mesh.mNumFaces);
    make_room(mesh_.colours, mesh.mNumFaces);
    CoordinateRounding rounding(exact_ != nullptr);
    Bounds read;
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const Vec3 vertex = place_of(mesh.mVertices[i]);
      for (const double coordinate : vertex) rounding.add(coordinate);
      read.extend(vertex);
      mesh_.vertices.push_back(transform * vertex);
      if (!mesh_.vertices.back().allFinite()) {
        throw Refusal{"vertex " + std::to_string(i) + " of '" + mesh.mName.C_Str() +
                      "' has a coordinate that is not a finite number"};
      }
    }
    if (exact_ == nullptr) require_digits(read);
    const double stretch = transform.linear().norm() / std::sqrt(3.0);
    // Digits of a place far away say little of a mesh that is there: five of its own are assumed.
    constexpr double kCoarsest = 1e-4;
    double rounded = rounding.bound();
    if (exact_ != nullptr && !read.isEmpty()) {
      rounded = std::min(rounded, kCoarsest * read.sizes().maxCoeff());
    }
    mesh_.rounding_m = std::max(mesh_.rounding_m, stretch * rounded);
    const bool mirrors = transform.linear().determinant() < 0;
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;  // a point or a line
      Triangle triangle;
      for (unsigned corner = 0; corner < 3; ++corner) {
        if (face.mIndices[corner] >= mesh.mNumVertices) {
          throw Refusal{"face " + std::to_string(i) + " of '" + mesh.mName.C_Str() +
                        "' names a vertex that does not exist"};
        }
        triangle[corner] = offset + face.mIndices[corner];
      }
      if (mirrors) std::swap(triangle[1], triangle[2]);
      mesh_.triangles.push_back(triangle);
      mesh_.colours.push_back(colours_.of(mesh, face));
      colours_.place(mesh, face, mirrors);
    }
  }

  // At once, but not again and again for a file of many small parts.
  template <typename T>
  static void make_room(std::vector<T>& values, size_t more) {
    if (values.capacity() - values.size() < more) {
      values.reserve(values.size() + std::max(more, values.size()));
    }
  }

  Vec3 place_of(const aiVector3D& read) const {
    if (exact_ == nullptr) return {read.x, read.y, read.z};
    const Vec3* place = exact_->find(read.x, read.y, read.z);
    if (place == nullptr) throw Misread();
    return *place;
  }

  // That single precision has not moved the vertices by more than this share of their extent.
  static void require_digits(const Bounds& read) {
    constexpr double kMostLost = 1e-3;
    constexpr double kHalfUnit = 0x1p-24;
    if (read.isEmpty()) return;
    const double size = read.diagonal().norm();
    const double farthest =
        std::max(read.max().cwiseAbs().maxCoeff(), read.min().cwiseAbs().maxCoeff());
    if (!(size > 0) || kHalfUnit * farthest <= kMostLost * size) return;
    char text[200];
    std::snprintf(text, sizeof text,
                  "is %.2g across and %.2g from its origin: its coordinates, which this format is "
                  "read with in single precision, are off by %.1g of its size; move it near its "
                  "origin, or write it as OBJ",
                  size, farthest, kHalfUnit * farthest / size);
    throw Refusal{text};
  }

  const aiScene& scene_;
  BaseColours& colours_;
  const ExactCoordinates* exact_;
  TriangleMesh mesh_;
};

// The files that assimp asks for: the mesh, which is in memory, and the files that it names
// (buffers, materials), if they are regular ones.
class MeshFiles : public Assimp::IOSystem {
 public:
  MeshFiles(std::string main_name, const std::string& main_bytes)
      : main_name_(std::move(main_name)), main_bytes_(main_bytes) {}

  bool Exists(const char* name) const override { return bytes_of(name) != nullptr; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    const std::string* bytes = *mode == 'r' ? bytes_of(name) : nullptr;
    if (bytes == nullptr) return nullptr;
    return new Assimp::MemoryIOStream(reinterpret_cast<const uint8_t*>(bytes->data()),
                                      bytes->size());
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

  // Null where there is no such file. The bytes are kept, because formats ask again and again.
  const std::string* bytes_of(const std::string& name) const {
    if (name == main_name_) return &main_bytes_;
    const auto [place, is_new] = others_.try_emplace(name);
    if (is_new) {
      std::error_code fault;
      if (std::filesystem::is_regular_file(name, fault) && !is_below(name)) {
        outside_ = name;
        return nullptr;
      }
      const uint64_t size = std::filesystem::file_size(name, fault);
      try {
        if (!fault && size <= kMostFileBytes) {
          allow_isolated_memory((kMemoryPerByte + 1) * size);
          place->second = read_file(name);
        }
      } catch (const Error&) {
        // As if it were not there: the format says whether it can do without.
      }
    }
    return place->second ? &*place->second : nullptr;
  }

  // A regular file that lies neither beside the mesh nor below its directory; empty: none.
  const std::string& outside() const { return outside_; }

 private:
  // As links lead.
  bool is_below(const std::string& name) const {
    const std::filesystem::path main = std::filesystem::weakly_canonical(main_name_);
    const std::filesystem::path whole = std::filesystem::weakly_canonical(name);
    // A mesh that is a link itself stands where its author put the link, too.
    const auto here =
        std::filesystem::weakly_canonical(std::filesystem::absolute(main_name_).parent_path());
    const auto lies_in = [&](const std::filesystem::path& directory) {
      const auto way = whole.lexically_relative(directory);
      return !way.empty() && *way.begin() != "..";
    };
    return lies_in(main.parent_path()) || lies_in(here);
  }

  mutable std::string outside_;
  std::string main_name_;
  const std::string& main_bytes_;
  mutable std::map<std::string, std::optional<std::string>> others_;
};

// --- The mesh on its way out of the process that read it -----------------------------------------

constexpr char kMesh = 'm', kRefusal = 'r';

template <typename T>
void put(std::string& bytes, const T* values, size_t count) {
  const uint64_t number = count;
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

// Reads the output of put(), whose process may have been damaged by its input.
class Parcel {
 public:
  explicit Parcel(std::string_view bytes) : bytes_(bytes) {}

  template <typename Container>
  Container take() {
    using T = typename Container::value_type;
    uint64_t number = 0;
    std::memcpy(&number, cut(sizeof number).data(), sizeof number);
    if (number > bytes_.size() / sizeof(T)) throw Refusal{kBroken};
    Container values;
    values.resize(number);
    const std::string_view from = cut(number * sizeof(T));
    if (number > 0) std::memcpy(static_cast<void*>(values.data()), from.data(), from.size());
    return values;
  }
  static constexpr const char* kBroken = "breaks its reader";

 private:
  std::string_view cut(size_t size) {
    if (size > bytes_.size()) throw Refusal{kBroken};
    const std::string_view head = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return head;
  }

  std::string_view bytes_;
};

std::string pack(const TriangleMesh& mesh) {
  std::string bytes(1, kMesh);
  constexpr size_t kHeads = 256;
  bytes.reserve(kHeads + mesh.vertices.size() * sizeof(Vec3) +
                mesh.triangles.size() * (sizeof(Triangle) + sizeof(Colour)));
  put(bytes, &mesh.rounding_m, 1);
  put(bytes, mesh.vertices.data(), mesh.vertices.size());
  put(bytes, mesh.triangles.data(), mesh.triangles.size());
  put(bytes, mesh.colours.data(), mesh.colours.size());
  const TextureMap& map = mesh.texture_map;
  put(bytes, map.texture.data(), map.texture.size());
  put(bytes, map.corners.data(), map.corners.size());
  std::vector<int> widths;
  for (const auto& texture : map.textures) widths.push_back(texture->width);
  put(bytes, widths.data(), widths.size());
  for (const auto& texture : map.textures) {
    put(bytes, texture->pixels.data(), texture->pixels.size());
  }
  std::vector<uint32_t> counts;
  for (const MeshGroup& group : mesh.groups) counts.push_back(group.triangle_count);
  put(bytes, counts.data(), counts.size());
  for (const MeshGroup& group : mesh.groups) put(bytes, group.name.data(), group.name.size());
  const uint64_t lost = mesh.lost_textures.size();
  put(bytes, &lost, 1);
  for (const std::string& text : mesh.lost_textures) put(bytes, text.data(), text.size());
  return bytes;
}

TextureMap unpack_textures(Parcel& parcel) {
  TextureMap map;
  map.texture = parcel.take<std::vector<uint32_t>>();
  map.corners = parcel.take<std::vector<TextureCorners>>();
  for (const int width : parcel.take<std::vector<int>>()) {
    Texture texture{.width = width, .height = 0, .pixels = parcel.take<std::vector<Colour>>()};
    const auto pixels = static_cast<int>(
        std::min<size_t>(texture.pixels.size(), size_t{kLargestTexture} * kLargestTexture));
    if (width < 1 || width > kLargestTexture) throw Refusal{Parcel::kBroken};
    texture.height = pixels / width;
    if (texture.height < 1 || texture.height > kLargestTexture ||
        texture.pixels.size() != size_t{1} * texture.width * texture.height) {
      throw Refusal{Parcel::kBroken};
    }
    map.textures.push_back(std::make_shared<const Texture>(std::move(texture)));
  }
  return map;
}

TriangleMesh unpack(std::string_view bytes) {
  Parcel parcel(bytes);
  TriangleMesh mesh;
  const auto rounding = parcel.take<std::vector<double>>();
  if (rounding.size() != 1 || !std::isfinite(rounding[0])) throw Refusal{Parcel::kBroken};
  mesh.rounding_m = rounding[0];
  mesh.vertices = parcel.take<std::vector<Vec3>>();
  mesh.triangles = parcel.take<std::vector<Triangle>>();
  mesh.colours = parcel.take<std::vector<Colour>>();
  mesh.texture_map = unpack_textures(parcel);
  uint64_t first = 0;
  for (const uint32_t count : parcel.take<std::vector<uint32_t>>()) {
    mesh.groups.push_back({"", static_cast<uint32_t>(first), count});
    first += count;
  }
  for (MeshGroup& group : mesh.groups) group.name = parcel.take<std::string>();
  for (const uint64_t lost : parcel.take<std::vector<uint64_t>>()) {
    for (uint64_t i = 0; i < lost; ++i) mesh.lost_textures.push_back(parcel.take<std::string>());
  }
  const bool in_range = std::ranges::all_of(mesh.triangles, [&](const Triangle& triangle) {
    return std::ranges::max(triangle) < mesh.vertices.size();
  });
  const bool finite =
      std::ranges::all_of(mesh.vertices, [](const Vec3& v) { return v.allFinite(); });
  const bool coloured = mesh.colours.empty() || mesh.colours.size() == mesh.triangles.size();
  if (!in_range || !finite || !coloured || !is_sound(mesh.texture_map, mesh.triangles.size()) ||
      first != mesh.triangles.size()) {
    throw Refusal{Parcel::kBroken};
  }
  return mesh;
}

// Fault of the head of a PLY file that assimp would read for ever, or nearly so: no line ends it,
// or it has more elements than there are bytes. Empty for others.
std::string fault_of_ply_head(std::string_view bytes) {
  constexpr std::string_view kSpaces = " \t", kLineEnd = "\r\n";
  const auto is_magic = [](char letter, char magic) { return (letter | 0x20) == magic; };
  if (!std::ranges::equal(bytes.substr(0, 3), std::string_view("ply"), is_magic)) return {};
  for (size_t at = 0; at < bytes.size();) {
    const size_t end = std::min(bytes.size(), bytes.find_first_of(kLineEnd, at));
    std::string_view line = bytes.substr(at, end - at);
    at = end + 1;
    const auto next_word = [&] {
      line.remove_prefix(std::min(line.size(), line.find_first_not_of(kSpaces)));
      const std::string_view word = line.substr(0, line.find_first_of(kSpaces));
      line.remove_prefix(word.size());
      return word;
    };
    const std::string_view key = next_word();
    if (key == "end_header") return {};
    if (key != "element") continue;
    next_word();  // its name
    const std::string_view number = next_word();
    uint64_t count = 0;
    const auto parsed = std::from_chars(number.data(), number.data() + number.size(), count);
    if (parsed.ec == std::errc::result_out_of_range || count > bytes.size()) {
      return "is a PLY file with more elements than bytes";
    }
  }
  return "is a PLY file whose head has no end";
}

// glTF has numbers that are proportional to light.
bool has_linear_colours(const std::string& name) {
  std::string ending = std::filesystem::path(name).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".glb" || ending == ".gltf";
}

// One grey for all, as programs give to things without a colour.
bool is_plain(const std::vector<Colour>& colours) {
  return std::ranges::all_of(colours, [&](const Colour& colour) {
    return colour == colours.front() && colour[0] == colour[1] && colour[1] == colour[2];
  });
}

// Before they are cut into triangles.
void require_bounded_faces(const aiScene& scene) {
  FaceBudget budget;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const std::string fault = budget.take(mesh.mFaces[i].mNumIndices);
      if (!fault.empty()) throw Refusal{fault};
    }
  }
}

// Runs in the other process. `exact`, which may be null, has been made of `bytes`.
std::string parse(const std::string& name, const std::string& bytes, double scale,
                  const ExactCoordinates* exact) {
  Assimp::Importer importer;
  auto* const files = new MeshFiles(name, bytes);
  importer.SetIOHandler(files);  // which it owns
  const aiScene* scene = importer.ReadFile(name, 0);
  const auto require_inside = [&] {
    if (files->outside().empty()) return;
    throw Refusal{"names the file " + files->outside() +
                  ", which does not lie beside the mesh or below its directory"};
  };
  try {
    require_inside();
    if (scene == nullptr || scene->mRootNode == nullptr) {
      const std::string fault = importer.GetErrorString();
      if (fault.find("bad_alloc") != fault.npos) throw std::bad_alloc();
      throw Refusal{"cannot be read as a mesh (" + fault + ")"};
    }
    require_bounded_faces(*scene);
    scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
    if (scene == nullptr || scene->mRootNode == nullptr) throw Refusal{Parcel::kBroken};
    const std::filesystem::path directory = std::filesystem::path(name).parent_path();
    BaseColours colours(*scene, has_linear_colours(name), [&](std::string texture) {
      std::ranges::replace(texture, '\\', '/');  // as some write it on Windows
      return files->bytes_of((directory / texture).string());
    });
    Gatherer gatherer(*scene, colours, exact);
    gatherer.add(*scene->mRootNode, Eigen::Affine3d(Eigen::Scaling(scale)));
    TriangleMesh mesh = gatherer.take();
    require_inside();
    if (!colours.map().textures.empty()) {
      mesh.texture_map = std::move(colours.map());
    } else if (is_plain(mesh.colours)) {
      mesh.colours.clear();
    }
    mesh.lost_textures = colours.lost();
    return pack(mesh);
  } catch (const Refusal& refusal) {
    return kRefusal + refusal.found;
  }
}

// Runs in the other process.
std::string parse(const std::string& name, const std::string& bytes, double scale) {
  try {
    const std::optional<ExactCoordinates> exact = ExactCoordinates::of(name, bytes);
    if (exact) return parse(name, exact->text(), scale, &*exact);
  } catch (const Misread&) {
    // As it stands, then.
  }
  return parse(name, bytes, scale, nullptr);
}

}  // namespace

Error no_mesh(const std::filesystem::path& file, std::string found) {
  return {ErrorKind::input,
          Problem{.file = file.string(),
                  .found = std::move(found),
                  .expected = "a triangle mesh in a format assimp reads (obj, stl, ply, glb, ...)",
                  .remedy = "Export the mesh again as one of these"}};
}

TriangleMesh read_mesh_file(const std::filesystem::path& file, double scale) {
  const std::string bytes = read_file(file);
  if (std::string fault = fault_of_ply_head(bytes); !fault.empty()) throw no_mesh(file, fault);
  if (std::string fault = fault_of_faces(file, bytes); !fault.empty()) throw no_mesh(file, fault);
  const IsolationLimits limits{
      .memory_bytes = kBaseMemory + kMemoryPerByte * bytes.size(),
      .cpu_s = kBaseSeconds + static_cast<int>(bytes.size() / kBytesPerSecond)};
  const IsolatedResult result =
      run_isolated([&] { return parse(file.string(), bytes, scale); }, limits);
  try {
    if (!result.fault.empty()) {
      throw Refusal{"cannot be read as a mesh: the reader of its format " + result.fault};
    }
    if (result.bytes.empty()) throw Refusal{Parcel::kBroken};
    const auto content = std::string_view(result.bytes).substr(1);
    if (result.bytes[0] == kRefusal) throw Refusal{std::string(content)};
    return unpack(content);
  } catch (const Refusal& refusal) {
    throw no_mesh(file, refusal.found);
  }
}

}  // namespace pilesim
