#include "io/whole_file.h"

#include "io/expect_error.h"
#include "io/temporary_folder.h"

namespace vdb_diffuse {
namespace {

TEST(WholeFiles, TakeTheirPlacesTogetherOrNotAtAll) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a"), b = folder.file("b");
  writeText(a, "old");
  expectError(ExitStatus::kOutputNotWritten, {"no/c"}, [&] {
    writeWholeFiles({{a, "new"}, {b, "new"}, {folder.file("no/c"), "new"}});
  });
  EXPECT_EQ(contentsOf(a), "old");
  EXPECT_EQ(folder.fileCount(), 1u);
  writeWholeFiles({{a, "new"}, {b, std::string("\0b", 2)}});
  EXPECT_EQ(contentsOf(a), "new");
  EXPECT_EQ(contentsOf(b), std::string("\0b", 2));
  EXPECT_EQ(folder.fileCount(), 2u);
}

}  // namespace
}  // namespace vdb_diffuse
