#pragma once

#include <string>

namespace vdb_diffuse {

/// An output that appears whole or not at all: it is written to a temporary file beside its place, which
/// takes the place when it is complete. Whatever stood there before stays untouched until then.
///
///     AtomicFile file("out.vdb");
///     write(file.temporary());   // by any means
///     file.commit();
///
/// All errors are OutputErrors that begin with the target's path.
class AtomicFile {
 public:
  /// Creates the temporary file, empty, so that a folder one may not write to is found before the work is
  /// done. A target that is a folder or a device is refused; a link is followed, and an existing file's
  /// permissions are kept.
  explicit AtomicFile(const std::string& target);
  ~AtomicFile();  ///< removes the temporary file
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::string& temporary() const { return temporary_; }
  /// Flushes to the disk, renames, flushes the folder. To be called once, after the file has been closed.
  void commit();

 private:
  std::string shown_, target_, folder_, temporary_;
  int slot_ = -1;

  [[noreturn]] void fail(const std::string& what) const;
};

/// A folder that is removed again if nothing lies in it when the object ends, or the process by a signal.
class RemovesEmptyFolder {
 public:
  explicit RemovesEmptyFolder(const std::string& path);
  ~RemovesEmptyFolder();
  RemovesEmptyFolder(const RemovesEmptyFolder&) = delete;
  RemovesEmptyFolder& operator=(const RemovesEmptyFolder&) = delete;

 private:
  std::string path_;
  int slot_;
};

/// Removes the temporary files of all AtomicFiles alive, and the folders left empty. Safe to call from a
/// signal handler, and meant for one that is about to end the process.
void removeTemporaryFiles() noexcept;

/// Both paths lead to one file (device and inode agree). False where either does not exist.
bool sameFile(const std::string& a, const std::string& b);

}  // namespace vdb_diffuse
