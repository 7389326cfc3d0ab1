// Damages sound VDB files in thousands of ways and runs the program on each under limits of time and memory.
// Prints what became of them; anything but accepted and cleanly refused is a fault, and its file is kept. The
// sound files come first, and must all be accepted; they are left in FOLDER/sound.
//
//   mutate_vdb PROGRAM FOLDER [MUTATIONS [SEED]]
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "io/temporary_folder.h"
#include "vdb/corpus.h"

namespace vdb_diffuse {
namespace {

constexpr double kSeconds = 10;
// One damaged bit can make a sound tile of 128^3 voxels, and baking many of them takes its time.
constexpr uint64_t kMostVoxels = 300000;
constexpr uint64_t kMemory = uint64_t(2) << 30;  // bytes of address space

using Random = std::mt19937_64;
uint64_t below(Random& random, uint64_t end) {
  return random() % std::max<uint64_t>(end, 1);
}

/// A place to damage: half of the time where the file's frame, masks and counts lie.
size_t place(Random& random, const std::string& bytes) {
  return below(random, random() % 2 ? std::min<size_t>(bytes.size(), 2000) : bytes.size());
}

template <typename T>
void put(std::string& bytes, size_t at, T value) {
  if (at + sizeof value <= bytes.size()) std::memcpy(&bytes[at], &value, sizeof value);
}

void setField(Random& random, std::string& bytes) {
  constexpr int64_t kTelling[] = {0,         1,          -1,         2,          6,
                                  7,         255,        -128,       4096,       65535,
                                  0x100000,  0x7fffffff, 0x80000000, 0xffffffff, 0x10000000000,
                                  INT64_MAX, INT64_MIN};
  const int64_t value = kTelling[below(random, std::size(kTelling))];
  const size_t at = place(random, bytes);
  switch (below(random, 4)) {
    case 0:
      return put(bytes, at, static_cast<int32_t>(value));
    case 1:
      return put(bytes, at, value);
    case 2:
      return put(bytes, at, random() % 2 ? NAN : -1e38f);
    case 3:
      return put(bytes, at, random() % 2 ? double(INFINITY) : 1e-300);
  }
}

/// A small number, as counts and lengths are, somewhat larger or smaller.
void nudgeCount(Random& random, std::string& bytes) {
  for (int tries = 0; tries < 200; ++tries) {
    const size_t at = place(random, bytes);
    uint32_t value = 0;
    if (at + sizeof value > bytes.size()) continue;
    std::memcpy(&value, &bytes[at], sizeof value);
    if (value == 0 || value > 100000) continue;
    return put(bytes, at, static_cast<uint32_t>(value + below(random, 9) - 4));
  }
}

void mutateOnce(Random& random, std::string& bytes) {
  const size_t at = place(random, bytes), from = place(random, bytes);
  const size_t length = std::min<size_t>(1 + below(random, 64), bytes.size() - std::max(at, from));
  switch (below(random, 9)) {
    case 0:
      bytes[at] = static_cast<char>(random());
      break;
    case 1:
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
      break;
    case 2:
      bytes.resize(below(random, bytes.size()));
      break;
    case 3:
      bytes.replace(at, length, std::string(bytes, from, length));
      break;
    case 4:
      bytes.insert(at, bytes, from, length);
      break;
    case 5:
      bytes.erase(at, length);
      break;
    case 6:
      setField(random, bytes);
      break;
    case 7:
      nudgeCount(random, bytes);
      break;
    case 8:
      std::fill_n(&bytes[at], length, random() % 2 ? '\0' : '\xff');
      break;
  }
}

std::string mutated(uint64_t seed, std::string bytes) {
  Random random(seed);
  const int times = 1 + static_cast<int>(below(random, 3));
  for (int n = 0; n < times && bytes.size() > 100; ++n) mutateOnce(random, bytes);
  return bytes;
}

struct Run {
  int status = 0;  // as waitpid tells
  bool hung = false;
  long peak_kilobytes = 0;
  std::string out, error;
};

Run run(const std::vector<std::string>& words, const TemporaryFolder& folder) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const std::string out = folder.file("out"), error = folder.file("error");
  const pid_t child = ::fork();
  if (child == 0) {  // only what is safe in a copy of one thread of several
    const rlimit memory{kMemory, kMemory}, none{0, 0};
    ::setrlimit(RLIMIT_AS, &memory);
    ::setrlimit(RLIMIT_CORE, &none);
    ::dup2(::open("/dev/null", O_RDONLY), 0);
    ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 1);
    ::dup2(::open(error.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 2);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  Run result;
  const auto start = std::chrono::steady_clock::now();
  rusage usage{};
  while (::wait4(child, &result.status, WNOHANG, &usage) == 0) {
    ::usleep(500);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (elapsed.count() < kSeconds || result.hung) continue;
    result.hung = true;
    ::kill(child, SIGKILL);
  }
  result.peak_kilobytes = usage.ru_maxrss;
  result.out = contentsOf(out);
  result.error = contentsOf(error);
  return result;
}

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

std::string verdict(const Run& run, const std::string& file) {
  if (run.hung) return "hung";
  if (!WIFEXITED(run.status)) return "crashed";
  const int status = WEXITSTATUS(run.status);
  if (run.error.find("memory") != std::string::npos && status == 5) return "out of memory";
  const bool one_line = std::count(run.error.begin(), run.error.end(), '\n') == 1;
  if (status == 3)
    return one_line && run.error.find(file) != std::string::npos ? "refused" : "refused unclearly";
  if (status == 4) return "accepted, not converged";
  if (status != 0) return "status " + std::to_string(status);
  for (const char* number : {" nan", " -nan", " inf"})  // of the residual or the energy balance
    if (run.out.find(std::string(number) + ",") != std::string::npos) return "not finite";
  return "accepted";
}

bool isGood(const std::string& verdict) {
  return verdict == "accepted, not converged" || verdict == "not run, large volume" ||
         verdict == "accepted" || verdict == "refused" || verdict == "sound file accepted";
}

int main(const std::string& program, const std::string& kept, uint64_t mutations, uint64_t first_seed) {
  std::filesystem::create_directories(kept + "/sound");
  std::vector<std::string> corpus;
  for (const VdbSpecimen& specimen : vdbCorpus()) {
    const std::string path = kept + "/sound/" + specimen.name + ".vdb";
    specimen.write(path);
    corpus.push_back(contentsOf(path));
  }
  std::map<std::string, std::map<std::string, uint64_t>> counts;
  long peak = 0;
  std::mutex mutex;
  std::atomic<uint64_t> next{0};
  const auto work = [&] {
    const TemporaryFolder folder;
    const std::string file = folder.file("in.vdb");
    for (uint64_t n = next++; n < corpus.size() + mutations; n = next++) {
      const bool is_sound = n < corpus.size();
      const uint64_t seed = is_sound ? 0 : first_seed + n - corpus.size();
      writeText(file, is_sound ? corpus[n] : mutated(seed, corpus[seed % corpus.size()]));
      uint64_t voxels = 0;
      for (const std::string command : {"info", "bake"}) {
        if (command == "bake" && voxels > kMostVoxels) {
          const std::lock_guard<std::mutex> lock(mutex);
          ++counts[command]["not run, large volume"];
          continue;
        }
        std::vector<std::string> words{program, command, file};
        if (command == "bake")
          words.insert(words.end(), {"-o", folder.file("out.vdb"), "--sun", "1,0.5,-1", "--threads", "1"});
        const Run result = run(words, folder);
        voxels = densityVoxels(result.out);
        std::string what = verdict(result, file);
        if (is_sound)
          what = what == "accepted" ? "sound file accepted" : "sound file " + std::to_string(n) + " " + what;
        const std::lock_guard<std::mutex> lock(mutex);
        ++counts[command][what];
        peak = std::max(peak, result.peak_kilobytes);
        if (isGood(what)) continue;
        const std::string name = kept + "/" + command + "_" + std::to_string(seed) + ".vdb";
        std::filesystem::copy_file(file, name, std::filesystem::copy_options::overwrite_existing);
        std::cout << name << ": " << what << ": " << result.error.substr(0, 300) << std::endl;
      }
    }
  };
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); ++t) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();

  std::cout << mutations << " files, seeds from " << first_seed << "\n";
  bool good = true;
  for (const auto& [command, of_command] : counts)
    for (const auto& [what, count] : of_command) {
      std::cout << command << ": " << what << ": " << count << "\n";
      good = good && isGood(what);
    }
  std::cout << "largest resident size " << peak / 1024 << " MB\n";
  return good ? 0 : 1;
}

}  // namespace
}  // namespace vdb_diffuse

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "mutate_vdb PROGRAM FOLDER [MUTATIONS [SEED]]\n";
    return 2;
  }
  return vdb_diffuse::main(argv[1], argv[2], argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1000,
                           argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1);
}
