// Sound files for the fuzzers to begin with: FOLDER/KIND/0.., and the words in those that are text as
// FOLDER/KIND.dict.
//
//   fuzz_seeds FOLDER
#include <cctype>
#include <filesystem>
#include <iostream>
#include <set>

#include "hard/specimens.h"
#include "io/temporary_folder.h"

namespace vdb_diffuse {
namespace {

std::set<std::string> wordsOf(const std::string& text) {
  std::set<std::string> words;
  for (size_t at = 0; at < text.size(); ++at) {
    const size_t begin = at;
    while (at < text.size() && (std::isalnum(static_cast<unsigned char>(text[at])) || text[at] == '_')) ++at;
    if (at > begin && at - begin < 40) words.insert(text.substr(begin, at - begin));
  }
  return words;
}

void writeSeeds(const std::string& folder, const std::string& kind_name) {
  const SpecimenKind kind = specimenKind(kind_name);
  const std::string seeds = folder + "/" + kind_name;
  std::filesystem::create_directories(seeds);
  std::string dictionary;
  std::set<std::string> words;
  for (size_t n = 0; n < kind.sound.size(); ++n) {
    writeText(seeds + "/" + std::to_string(n), kind.sound[n]);
    if (kind.is_text) words.merge(wordsOf(kind.sound[n]));
  }
  for (const std::string& word : words) dictionary += '"' + word + "\"\n";
  writeText(seeds + ".dict", dictionary);
  std::cout << seeds << ": " << kind.sound.size() << " files, " << words.size() << " words\n";
}

}  // namespace
}  // namespace vdb_diffuse

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "fuzz_seeds FOLDER\n";
    return 2;
  }
  for (const char* kind : {"vdb", "obj", "gltf", "glb", "exr", "json"})
    vdb_diffuse::writeSeeds(argv[1], kind);
}
