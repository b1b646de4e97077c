#include "core/temporary_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

constexpr std::string_view kPrefix = ".pilesim.";
constexpr std::string_view kSuffix = ".tmp";

// Unique among the threads and processes of this machine; processes of others may use it as well.
fs::path temporary_name_beside(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return path.parent_path() / (std::string(kPrefix) + std::to_string(getpid()) + "." +
                               std::to_string(counter++) + std::string(kSuffix));
}

bool is_temporary_name(std::string_view name) {
  if (name.size() <= kPrefix.size() + kSuffix.size() || !name.starts_with(kPrefix) ||
      !name.ends_with(kSuffix)) {
    return false;
  }
  name = name.substr(kPrefix.size(), name.size() - kPrefix.size() - kSuffix.size());
  return name.find_first_not_of("0123456789.") == name.npos;
}

// Held by this process from now on; also where the file system knows no locks, in which case
// nobody gets one to remove the file by.
bool lock(int descriptor) {
  return flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

void remove_if_abandoned(const fs::path& path) {
  constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  int descriptor = open(path.c_str(), O_RDWR | kFlags);  // NFS locks files open for writing
  if (descriptor < 0 && errno == EISDIR) descriptor = open(path.c_str(), O_RDONLY | kFlags);
  if (descriptor < 0) return;
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
    std::error_code ignored;  // tried again by the next process
    fs::remove_all(path, ignored);
  }
  close(descriptor);
}

// About once: a process that writes into a million directories does not remember them all.
void remove_abandoned_once(const fs::path& directory) {
  constexpr size_t kMostRemembered = 1000;
  static std::mutex mutex;
  static std::set<std::string> done;
  const std::lock_guard guard(mutex);
  if (done.size() >= kMostRemembered) done.clear();
  if (!done.insert(directory.string()).second) return;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(directory.empty() ? "." : directory, missing)) {
    if (is_temporary_name(entry.path().filename().native())) remove_if_abandoned(entry.path());
  }
}

}  // namespace

TemporaryFile::TemporaryFile(fs::path path) : path_(std::move(path)) {
  remove_abandoned_once(path_.parent_path());
  for (;;) {
    name_ = temporary_name_beside(path_);
    descriptor_ = open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    // Another machine's or container's process of the same number.
    if (descriptor_ < 0 && errno == EEXIST) continue;
    if (descriptor_ < 0) throw io_error(path_.string(), "cannot be created", errno);
    // Another process may have found it before it was locked.
    struct stat status {};
    if (lock(descriptor_) && fstat(descriptor_, &status) == 0 && status.st_nlink > 0) return;
    close(descriptor_);
  }
}

TemporaryFile::~TemporaryFile() {
  if (descriptor_ < 0) return;
  unlink(name_.c_str());
  close(descriptor_);
}

void TemporaryFile::take_place() {
  // A second descriptor keeps the lock: close() comes before the new name, since that is where some
  // file systems report a full disk.
  const int held = fcntl(descriptor_, F_DUPFD_CLOEXEC, 0);
  int fault = held < 0 ? errno : 0;
  if (close(std::exchange(descriptor_, -1)) != 0 && fault == 0) fault = errno;
  if (fault == 0 && rename(name_.c_str(), path_.c_str()) != 0) fault = errno;
  if (fault != 0) unlink(name_.c_str());
  if (held >= 0) close(held);
  if (fault != 0) throw io_error(path_.string(), "cannot be written", fault);
}

void remove_in_one_go(const fs::path& path) {
  std::error_code fault;
  if (fs::symlink_status(path, fault).type() != fs::file_type::directory) {
    fs::remove(path, fault);
    if (fault) throw io_error(path.string(), "cannot be removed", fault.value());
    return;
  }
  const int held = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (held >= 0) lock(held);
  const fs::path name = temporary_name_beside(path);
  fs::rename(path, name, fault);
  if (!fault) fs::remove_all(name, fault);
  if (held >= 0) close(held);
  if (fault) throw io_error(path.string(), "cannot be removed", fault.value());
}

}  // namespace pilesim
