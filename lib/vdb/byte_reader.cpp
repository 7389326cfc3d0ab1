#include "vdb/byte_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr uint64_t kLongestText = 1 << 16;  // of names; texts of metadata are skipped, not read
constexpr uint64_t kWindow = 1 << 18;       // bytes read at a time

}  // namespace

ByteReader::ByteReader(const std::string& path) : path_(path) {
  // Asked before it is opened, as opening a device may have effects, and after, as it may be another by then.
  struct stat status;
  if (::stat(path.c_str(), &status) != 0) fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) fail("is a directory, not a VDB file");
  if (S_ISREG(status.st_mode)) {
    file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (file_ < 0) fail(std::string("cannot be opened: ") + std::strerror(errno));
  }
  if (file_ < 0 || ::fstat(file_, &status) != 0 || !S_ISREG(status.st_mode))
    fail("is not a regular file (VDB needs one that can be searched)");
  size_ = static_cast<uint64_t>(status.st_size);
}

ByteReader::~ByteReader() {
  if (file_ >= 0) ::close(file_);
}

std::string ByteReader::readText() {
  const uint32_t length = read<uint32_t>();
  if (length > kLongestText) failDamaged("a name of " + std::to_string(length) + " bytes");
  return std::string(take(length), length);
}

bool ByteReader::readBool() {
  const uint8_t byte = read<uint8_t>();
  if (byte > 1) failDamaged("a yes or no that is " + std::to_string(byte));
  return byte == 1;
}

const char* ByteReader::take(uint64_t bytes) {
  require(bytes);
  if (position_ < window_start_ || position_ + bytes > window_start_ + window_.size()) {
    window_.resize(std::max(bytes, std::min(kWindow, remaining())));
    window_start_ = position_;
    for (uint64_t have = 0; have < window_.size();) {
      const ssize_t got = ::pread(file_, window_.data() + have, window_.size() - have,
                                  static_cast<off_t>(window_start_ + have));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) fail(std::string("cannot be read: ") + std::strerror(errno));
      if (got == 0) fail("became shorter while it was read; read it again when it is whole");
      have += static_cast<uint64_t>(got);
    }
  }
  const char* here = window_.data() + (position_ - window_start_);
  position_ += bytes;
  return here;
}

void ByteReader::skip(uint64_t bytes) {
  require(bytes);
  position_ += bytes;
}

void ByteReader::seek(uint64_t position) {
  position_ = 0;
  skip(position);
}

void ByteReader::require(uint64_t bytes) const {
  if (bytes <= remaining()) return;
  const uint64_t end = position_ + bytes;  // may wrap around, and then is past every end
  fail("truncated or damaged: it has " + std::to_string(size_) + " bytes and speaks of " +
       (end < bytes ? "more than 2^64" : "byte " + std::to_string(end)) + "; copy or write it again");
}

void ByteReader::failDamaged(const std::string& what) const {
  fail("damaged: " + what + " (before byte " + std::to_string(position_) + "); copy or write it again");
}

void ByteReader::fail(const std::string& what) const {
  throw InputError(path_ + ": " + (subject_.empty() ? "" : subject_ + ": ") + what);
}

}  // namespace vdb_diffuse
