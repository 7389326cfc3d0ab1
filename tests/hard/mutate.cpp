// Damages sound files in thousands of ways and runs the program on each under limits of time and memory.
// Prints what became of them; anything but accepted and cleanly refused is a fault, and its file is kept, as
// is one that the solve does not come to rest on. The sound files come first, and must all be accepted; they
// are left in FOLDER/sound.
//
//   mutate PROGRAM FOLDER KIND [MUTATIONS [SEED]]        KIND: vdb, obj, gltf, glb, exr, json
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <iostream>
#include <map>
#include <mutex>
#include <thread>

#include "hard/limited_run.h"
#include "hard/mutations.h"
#include "hard/specimens.h"
#include "io/temporary_folder.h"

namespace vdb_diffuse {
namespace {

// One damaged bit can make a sound tile of 128^3 voxels, and baking many of them takes its time.
constexpr uint64_t kMostVoxels = 300000;

/// Active voxels of the grid that would be baked, as `info` prints them: the density, or what may stand for
/// it.
uint64_t densityVoxels(const std::string& info) {
  const std::string label = "active voxels  ";
  const size_t density = info.find("grid density:");
  uint64_t most = 0;
  for (size_t at = info.find(label, density == std::string::npos ? 0 : density); at != std::string::npos;
       at = info.find(label, at + 1)) {
    most = std::max<uint64_t>(most, std::strtoull(info.c_str() + at + label.size(), nullptr, 10));
    if (density != std::string::npos) break;
  }
  return most;
}

bool isGood(const std::string& verdict) {
  for (const char* good :
       {"accepted, not converged", "not run, large volume", "accepted", "refused", "sound file accepted"})
    if (verdict == good) return true;
  return false;
}

/// Runs the program on one file after another, and counts what became of them.
class Campaign {
 public:
  Campaign(const std::string& program, const std::string& kept, const SpecimenKind& kind, uint64_t mutations,
           uint64_t first_seed)
      : program_(program), kept_(kept), kind_(kind), mutations_(mutations), first_seed_(first_seed) {
    std::filesystem::create_directories(kept + "/sound");
    for (size_t n = 0; n < kind.sound.size(); ++n)
      writeText(kept + "/sound/" + std::to_string(n) + "_" + kind.file_name, kind.sound[n]);
  }

  /// Takes files until none is left; of several threads at a time.
  void work();
  /// Prints the counts; whether all are good.
  bool summary() const;

 private:
  void tryFile(uint64_t n, const TemporaryFolder& folder);
  void count(const std::string& command, const std::string& what);

  const std::string program_, kept_;
  const SpecimenKind& kind_;
  const uint64_t mutations_, first_seed_;
  std::atomic<uint64_t> next_{0};
  std::mutex mutex_;
  std::map<std::string, std::map<std::string, uint64_t>> counts_;
  long peak_ = 0;
};

void Campaign::work() {
  const TemporaryFolder folder;
  for (const auto& [name, bytes] : kind_.beside) writeText(folder.file(name), bytes);
  for (uint64_t n = next_++; n < kind_.sound.size() + mutations_; n = next_++) tryFile(n, folder);
}

void Campaign::tryFile(uint64_t n, const TemporaryFolder& folder) {
  const bool is_sound = n < kind_.sound.size();
  const uint64_t seed = is_sound ? 0 : first_seed_ + n - kind_.sound.size();
  const std::string& sound = kind_.sound[(is_sound ? n : seed) % kind_.sound.size()];
  const std::string file = folder.file(kind_.file_name), out = folder.file("out.vdb");
  writeText(file, is_sound ? sound : kind_.is_text ? mutatedText(seed, sound) : mutatedBytes(seed, sound));
  std::filesystem::remove(out);

  std::vector<std::vector<std::string>> commands;
  if (kind_.name == "vdb") commands.push_back({program_, "info", file});
  commands.push_back({program_, "bake", "-o", out, "--threads", "1"});
  for (const std::string& word : kind_.bake)
    commands.back().push_back(word == "FILE" ? file : word == "VOLUME" ? folder.file("volume.vdb") : word);
  uint64_t voxels = 0;
  for (const std::vector<std::string>& words : commands) {
    if (voxels > kMostVoxels) return count(words[1], "not run, large volume");
    const LimitedRun run = runLimited(words, folder.file(""));
    voxels = densityVoxels(run.out);
    // What a scene refers to may be at fault: a mesh, or a grid of the volume.
    std::string what = verdictOf(run, kind_.name == "json" ? folder.file("") : file, out);
    if (is_sound)
      what = what == "accepted" ? "sound file accepted" : "sound file " + std::to_string(n) + " " + what;
    count(words[1], what);
    const std::lock_guard<std::mutex> lock(mutex_);
    peak_ = std::max(peak_, run.peak_kilobytes);
    if (isGood(what) && what != "accepted, not converged") continue;
    const std::string name = kept_ + "/" + words[1] + "_" + std::to_string(seed) + "_" + kind_.file_name;
    std::filesystem::copy_file(file, name, std::filesystem::copy_options::overwrite_existing);
    std::cout << name << ": " << what << ": " << run.error.substr(0, 300) << std::endl;
  }
}

void Campaign::count(const std::string& command, const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_[command][what];
}

bool Campaign::summary() const {
  std::cout << mutations_ << " files of kind " << kind_.name << ", seeds from " << first_seed_ << "\n";
  bool good = true;
  for (const auto& [command, of_command] : counts_)
    for (const auto& [what, count] : of_command) {
      std::cout << command << ": " << what << ": " << count << "\n";
      good = good && isGood(what);
    }
  std::cout << "largest resident size " << peak_ / 1024 << " MB\n";
  return good;
}

}  // namespace
}  // namespace vdb_diffuse

int main(int argc, char** argv) {
  if (argc < 4) {
    std::cerr << "mutate PROGRAM FOLDER KIND [MUTATIONS [SEED]]\n";
    return 2;
  }
  const auto kind = vdb_diffuse::specimenKind(argv[3]);
  vdb_diffuse::Campaign campaign(argv[1], argv[2], kind,
                                 argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1000,
                                 argc > 5 ? std::strtoull(argv[5], nullptr, 10) : 1);
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); ++t)
    threads.emplace_back([&] { campaign.work(); });
  for (std::thread& thread : threads) thread.join();
  return campaign.summary() ? 0 : 1;
}
