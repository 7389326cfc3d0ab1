#include "check/cases_file.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "grid/error.h"
#include "io/expect_error.h"
#include "io/temporary_folder.h"

namespace vdb_diffuse {
namespace {

std::vector<CheckCase> casesIn(const TemporaryFolder& folder, const std::string& text) {
  writeText(folder.file("cases.json"), text);
  return readCases(folder.file("cases.json"));
}

TEST(CasesFile, DefaultsPathsAndLimits) {
  const TemporaryFolder folder;
  ::setenv("VDB_DIFFUSE_TEST_SHOW", "/show", 1);
  const auto cases =
      casesIn(folder, R"({"defaults": {"max_rms": 0.01, "block": 4, "bake": "--env 1"}, "cases": [
      {"name": "a", "volume": "sub/a.vdb"},
      {"name": "b.2", "volume": "$VDB_DIFFUSE_TEST_SHOW/b.vdb", "bake": "--sun 0,0,-1", "grids": ["flux"],
       "max_abs": 0.5, "stored": "../b.vdb", "block": 1}]})");
  ASSERT_EQ(cases.size(), 2u);
  EXPECT_EQ(cases[0].volume, folder.file("sub/a.vdb"));
  EXPECT_EQ(cases[0].stored, folder.file("a.vdb"));
  EXPECT_EQ(cases[0].bake, "--env 1");
  EXPECT_EQ(cases[0].grids, (std::vector<std::string>{"diffuse", "direct"}));
  EXPECT_EQ(cases[0].max_rms, 0.01);
  EXPECT_FALSE(cases[0].max_abs);
  EXPECT_EQ(cases[0].block, 4);
  EXPECT_EQ(cases[1].volume, "/show/b.vdb");
  EXPECT_EQ(cases[1].stored, folder.file("../b.vdb"));
  EXPECT_EQ(cases[1].bake, "--sun 0,0,-1");
  EXPECT_EQ(cases[1].max_abs, 0.5);
  EXPECT_EQ(cases[1].block, 1);
}

TEST(CasesFile, FaultsAreToldByPlaceAndName) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text) {
    try {
      casesIn(folder, text);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto inCase = [&](const std::string& more) {
    return refused(R"({"cases": [{"name": "a", "volume": "a.vdb", "max_rms": 1)" + more + "}]}");
  };
  const auto expectWords = [](const std::string& text, std::initializer_list<std::string> words) {
    for (const std::string& word : words)
      EXPECT_NE(text.find(word), std::string::npos) << word << " in " << text;
  };
  expectWords(inCase(R"(, "tolerance": 1)"), {"cases[0]", "unknown key 'tolerance'"});
  expectWords(inCase(R"(, "max_abs": -1)"), {"cases[0].max_abs", "-1"});
  expectWords(inCase(R"(, "block": 1.5)"), {"cases[0].block", "whole"});
  expectWords(inCase(R"(, "block": 0)"), {"cases[0].block", "0"});
  expectWords(inCase(R"(, "grids": ["difuse"])"), {"cases[0].grids[0]", "did you mean 'diffuse'?"});
  expectWords(inCase(R"(, "grids": [])"), {"cases[0].grids"});
  expectWords(refused(R"({"cases": [{"name": "../a", "volume": "a.vdb", "max_rms": 1}]})"),
              {"cases[0].name"});
  expectWords(refused(R"({"cases": [{"name": "a", "volume": "$VDB_DIFFUSE_NONE/a.vdb", "max_rms": 1}]})"),
              {"cases[0].volume", "VDB_DIFFUSE_NONE"});
  expectWords(refused(R"({"cases": [{"name": "a", "volume": "a"}]})"), {"cases[0]", "max_rms"});
  expectWords(refused(R"({"cases": [{"name": "a", "volume": "a", "max_rms": 1},
                                    {"name": "a", "volume": "a", "max_rms": 1}]})"),
              {"cases[1].name", "another"});
  expectWords(refused(R"({"cases": []})"), {"cases"});
  expectWords(refused(R"({"default": {}, "cases": []})"), {"default", "did you mean 'defaults'?"});
}

}  // namespace
}  // namespace vdb_diffuse
