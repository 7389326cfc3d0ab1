#include "io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

// A signal handler can neither lock nor allocate, so the names stand in fixed places. A file that finds no
// free place is removed by its destructor alone.
enum SlotState { kFree, kChanging, kHoldsFile, kHoldsFolder };
struct Slot {
  std::atomic<int> state{kFree};  // a SlotState
  char path[PATH_MAX];
};
Slot slots[16];

int remember(const std::string& path, SlotState as) {
  if (path.size() >= PATH_MAX) return -1;
  for (size_t s = 0; s < sizeof slots / sizeof slots[0]; ++s) {
    int free = kFree;
    if (!slots[s].state.compare_exchange_strong(free, kChanging)) continue;
    std::memcpy(slots[s].path, path.c_str(), path.size() + 1);
    slots[s].state = as;
    return static_cast<int>(s);
  }
  return -1;
}

void forget(int slot) {
  if (slot >= 0) slots[slot].state = kFree;
}

/// The file that a path means: links followed, even one to a file that is not there yet.
std::string resolved(std::string path) {
  for (int links = 0; links < 40; ++links) {
    struct stat status;
    if (::lstat(path.c_str(), &status) != 0 || !S_ISLNK(status.st_mode)) break;
    char text[PATH_MAX];
    const ssize_t length = ::readlink(path.c_str(), text, sizeof text);
    if (length < 0) break;
    const std::string to(text, static_cast<size_t>(length));
    const size_t slash = path.rfind('/');
    path = to[0] == '/' || slash == std::string::npos ? to : path.substr(0, slash + 1) + to;
  }
  return path;
}

/// Flushes a file or a folder to the disk; 0 or an error number. A full disk may only show here.
int flushToDisk(const std::string& path, int flags) {
  const int file = ::open(path.c_str(), flags | O_CLOEXEC);
  if (file < 0) return errno;
  const int error = ::fsync(file) != 0 ? errno : 0;
  const int closing = ::close(file) != 0 ? errno : 0;
  return error ? error : closing;
}

}  // namespace

AtomicFile::AtomicFile(const std::string& target) : shown_(target), target_(resolved(target)) {
  struct stat status;
  const bool exists = ::stat(target_.c_str(), &status) == 0;
  if (target.empty() || target.back() == '/') fail("names a folder; name a file");
  if (exists && S_ISDIR(status.st_mode)) fail("is a directory; name a file in it");
  if (exists && !S_ISREG(status.st_mode)) fail("is not a regular file, and would be replaced by one");
  if (exists && ::access(target_.c_str(), W_OK) != 0)
    fail(std::string("may not be replaced: ") + std::strerror(errno));

  const size_t slash = target_.rfind('/');
  folder_ = slash == std::string::npos ? "." : slash == 0 ? "/" : target_.substr(0, slash);
  const std::string name = slash == std::string::npos ? target_ : target_.substr(slash + 1);
  static std::atomic<unsigned> counter{0};
  int file = -1;
  do {
    // Names end at 255 bytes; a long one is cut to leave room.
    temporary_ = (slash == std::string::npos ? "" : target_.substr(0, slash + 1)) + "." +
                 name.substr(0, 200) + "." + std::to_string(::getpid()) + "-" + std::to_string(counter++) +
                 ".tmp";
    slot_ = remember(temporary_, kHoldsFile);
    file = ::open(temporary_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    if (file < 0) forget(slot_);
  } while (file < 0 && errno == EEXIST);
  if (file < 0) {
    const int error = errno;
    fail("cannot be written, folder " + folder_ + ": " + std::strerror(error));
  }
  if (exists) (void)!::fchmod(file, status.st_mode & 07777);
  ::close(file);
}

AtomicFile::~AtomicFile() {
  if (temporary_.empty()) return;
  ::unlink(temporary_.c_str());
  forget(slot_);
}

void AtomicFile::commit() {
  if (const int error = flushToDisk(temporary_, O_RDONLY))
    fail(std::string("cannot be written: ") + std::strerror(error));
  if (::rename(temporary_.c_str(), target_.c_str()) != 0)
    fail(std::string("cannot be put in place: ") + std::strerror(errno));
  temporary_.clear();
  forget(slot_);
  slot_ = -1;
  // The file is whole and in place; some file systems know no flush of folders, which is no failure.
  flushToDisk(folder_, O_RDONLY | O_DIRECTORY);
}

void AtomicFile::fail(const std::string& what) const {
  throw OutputError(shown_ + ": " + what);
}

RemovesEmptyFolder::RemovesEmptyFolder(const std::string& path)
    : path_(path), slot_(remember(path, kHoldsFolder)) {}

RemovesEmptyFolder::~RemovesEmptyFolder() {
  ::rmdir(path_.c_str());
  forget(slot_);
}

void removeTemporaryFiles() noexcept {
  for (Slot& slot : slots)
    if (slot.state == kHoldsFile) ::unlink(slot.path);
  for (Slot& slot : slots)
    if (slot.state == kHoldsFolder) ::rmdir(slot.path);
}

bool sameFile(const std::string& a, const std::string& b) {
  struct stat of_a, of_b;
  return ::stat(a.c_str(), &of_a) == 0 && ::stat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

}  // namespace vdb_diffuse
