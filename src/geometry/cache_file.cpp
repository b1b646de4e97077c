#include "geometry/cache_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <span>
#include <system_error>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/interrupt.h"
#include "json/cbor.h"

namespace pilesim {
namespace {

using nlohmann::json;

constexpr size_t kDigestLength = 32;

template <typename T>
json to_binary(const std::vector<T>& values) {
  std::vector<uint8_t> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) {
    std::memcpy(bytes.data(), static_cast<const void*>(values.data()), bytes.size());
  }
  return json::binary(std::move(bytes));
}

template <typename T>
std::vector<T> from_binary(const json& value) {
  const std::vector<uint8_t>& bytes = value.get_binary();
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty())
    std::memcpy(static_cast<void*>(values.data()), bytes.data(), values.size() * sizeof(T));
  return values;
}

}  // namespace

std::optional<std::filesystem::path> user_cache_directory() {
  const char* const cache_home = std::getenv("XDG_CACHE_HOME");
  const char* const home = std::getenv("HOME");
  std::filesystem::path directory;
  // The standard (XDG Base Directory) has relative ones ignored.
  if (cache_home != nullptr && std::filesystem::path(cache_home).is_absolute()) {
    directory = cache_home;
  } else if (home != nullptr && *home != '\0') {
    directory = std::filesystem::path(home) / ".cache";
  } else {
    return std::nullopt;
  }
  directory /= "pilesim";
  std::error_code failure;
  std::filesystem::create_directories(directory, failure);
  if (failure || access(directory.c_str(), W_OK) != 0) return std::nullopt;
  return directory;
}

CacheFile::CacheFile(const std::filesystem::path& directory, const std::string& kind,
                     const std::string& key)
    : file_(directory / (kind + '-' + key + ".cbor")) {}

// The digest of the rest, then CBOR.
bool CacheFile::load(const std::function<void(const json&)>& take) const {
  if (!std::filesystem::exists(file_)) return false;
  const std::string text = read_file(file_);
  if (text.size() <= kDigestLength) return false;
  const std::string content = text.substr(kDigestLength);
  if (content_hash(content) != text.substr(0, kDigestLength)) return false;
  try {
    take(parse_cbor(content));
    return true;
  } catch (const json::exception&) {
    return false;  // another program's, with a right digest
  } catch (const Error&) {
    return false;
  }
}

void CacheFile::store(const json& content) const {
  std::error_code fault;
  std::filesystem::create_directories(file_.parent_path(), fault);
  if (fault) throw io_error(file_.parent_path().string(), "cannot be created", fault.value());
  const std::vector<uint8_t> cbor = json::to_cbor(content);
  const std::string bytes(cbor.begin(), cbor.end());
  try {
    write_file_atomically(file_, content_hash(bytes) + bytes);
  } catch (const Error& error) {
    Problem problem = error.problems().front();
    problem.remedy = "Make room there, or name another place for the cache in XDG_CACHE_HOME";
    throw Error(error.kind(), std::move(problem));
  }
}

CacheLock::CacheLock(const CacheFile& file, const std::function<void()>& before_waiting)
    : path_(file.path().string() + ".lock") {
  constexpr useconds_t kPause = 20'000;
  for (bool waits = false;;) {
    if (descriptor_ < 0) descriptor_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor_ < 0) return;
    if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {
      struct stat status {};
      // The other has removed the file with its lock: the next one makes another.
      if (fstat(descriptor_, &status) == 0 && status.st_nlink == 0) {
        close(std::exchange(descriptor_, -1));
        continue;
      }
      return;
    }
    if (errno != EWOULDBLOCK) return;
    if (!std::exchange(waits, true)) before_waiting();
    if (interrupted()) {
      close(std::exchange(descriptor_, -1));
      throw Error(ErrorKind::interrupted, {.found = "interrupted while it waited"});
    }
    usleep(kPause);
  }
}

CacheLock::~CacheLock() {
  if (descriptor_ < 0) return;
  unlink(path_.c_str());
  close(descriptor_);
}

void add_mesh(Hasher& key, const TriangleMesh& mesh) {
  key.add_values(std::span(mesh.vertices));
  key.add_values(std::span(mesh.triangles));
  for (const MeshGroup& group : mesh.groups) {
    const std::array range{group.first_triangle, group.triangle_count};
    key.add_values(std::span<const uint32_t>(range));
  }
}

json to_cached(const TriangleMesh& mesh) {
  return {{"vertices", to_binary(mesh.vertices)}, {"triangles", to_binary(mesh.triangles)}};
}

TriangleMesh mesh_from_cached(const json& value) {
  TriangleMesh mesh;
  mesh.vertices = from_binary<Vec3>(value.at("vertices"));
  mesh.triangles = from_binary<Triangle>(value.at("triangles"));
  for (const Triangle& triangle : mesh.triangles) {
    if (std::ranges::max(triangle) >= mesh.vertices.size()) {
      throw Error(ErrorKind::input, {.found = "a triangle without its corners"});
    }
  }
  return mesh;
}

}  // namespace pilesim
