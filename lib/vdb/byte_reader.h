#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace vdb_diffuse {

/// The bytes of a regular file, little-endian, in order. No step leads past the file's end: each count and
/// length is held against what is left before anything is read or allocated for it. Every error is an
/// InputError that begins with the path.
class ByteReader {
 public:
  /// Throws where there is no such file, or it is not a regular one; never waits for a pipe to be written.
  explicit ByteReader(const std::string& path);
  ~ByteReader();
  ByteReader(const ByteReader&) = delete;
  ByteReader& operator=(const ByteReader&) = delete;

  uint64_t size() const { return size_; }
  uint64_t position() const { return position_; }
  uint64_t remaining() const { return size_ - position_; }

  template <typename T>
  T read() {
    static_assert(std::is_arithmetic_v<T>, "bytes have no other meaning");
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  /// A length in 32 bits, then so many characters.
  std::string readText();
  /// A byte that is 0 or 1; C++ leaves open what a bool of another byte does.
  bool readBool();
  /// The next bytes; good until the reader's next step.
  const char* take(uint64_t bytes);
  void skip(uint64_t bytes);
  void seek(uint64_t position);

  /// What is being read, for the errors: "grid density", or empty.
  void setSubject(const std::string& subject) { subject_ = subject; }
  /// "file: grid density: damaged: what"
  [[noreturn]] void failDamaged(const std::string& what) const;
  /// The same without a judgement.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string path_, subject_;
  int file_ = -1;
  uint64_t size_ = 0, position_ = 0;
  uint64_t window_start_ = 0;  // where window_ lies in the file
  std::vector<char> window_;

  void require(uint64_t bytes) const;
};

}  // namespace vdb_diffuse
