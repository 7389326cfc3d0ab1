#include <sys/stat.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "bake.h"
#include "commands.h"
#include "example.h"
#include "interrupt.h"
#include "sequence/frame_list.h"
#include "sequence/frame_name.h"
#include "words.h"

namespace vdb_diffuse {
namespace {

constexpr char kProgressLines[] =
    "--progress json prints lines that begin with { on standard error; others there are messages:\n"
    "  {\"phase\":\"solve\",\"fraction\":0.25}   share done of read, source, surface, solve, sweeps or "
    "write; one that\n"
    "                                      another follows ends at 1; they come again for each colour\n"
    "  {\"phase\":\"done\",\"status\":0,\"seconds\":3.2,\"output\":\"lit.vdb\"}   last; or with status and "
    "error:\n"
    "  {\"phase\":\"failed\",\"status\":3,\"error\":\"...\"}\n"
    "  {\"phase\":\"skipped\",\"output\":\"lit.0007.vdb\"}                    by --skip-existing\n"
    "With --frames each begins with {\"frame\":7,\"index\":6,\"frames\":100, : the frame, how many came "
    "before it, and\n"
    "how many there are. Ctrl-C (SIGINT) ends within a second with status 130 and leaves no part of a file.";

constexpr char kExitStatus[] =
    "Exit status: 0 done; 2 wrong usage; 3 input unreadable or refused; 4 the solve did not reach the "
    "tolerance\n"
    "(the output is written, and says so); 5 output not written; 130 interrupted. Over frames the highest.";

/// What `bake` adds to the flags of a single one.
struct SequenceFlags {
  std::string frames;
  bool skip_existing = false, dry_run = false;
};

bool exists(const std::string& path) {
  struct stat status;
  return ::stat(path.c_str(), &status) == 0;
}

ExitStatus worse(ExitStatus a, ExitStatus b) {
  return static_cast<int>(a) > static_cast<int>(b) ? a : b;
}

/// The flags of one frame: its number in the names of all files.
BakeFlags flagsOf(BakeFlags flags, int frame) {
  std::vector<std::string*> names = flags.scene.paths();
  names.insert(names.end(), {&flags.input, &flags.output, &flags.stats});
  for (std::string& more : flags.more_inputs) names.push_back(&more);
  for (std::string* name : names) *name = frameName(*name, frame);
  return flags;
}

/// The line of JSON that ends a frame, whatever became of it.
class LastLine {
 public:
  LastLine(const ProgressFlags& flags, std::string json_fields)
      : wanted_(flags.mode == "json" && !flags.quiet), fields_(std::move(json_fields)) {}
  void operator()(const nlohmann::ordered_json& members) const {
    using Json = nlohmann::ordered_json;
    if (wanted_)
      std::cerr << "{" + fields_ + members.dump(-1, ' ', false, Json::error_handler_t::replace).substr(1) +
                       "\n";
  }

 private:
  bool wanted_;
  std::string fields_;
};

/// Bakes one frame or skips it. Every outcome but success and non-convergence is an exception.
ExitStatus bakeOrSkip(const BakeFlags& flags, const SequenceFlags& sequence, const std::string& json_fields) {
  const LastLine last_line(flags.progress, json_fields);
  if (sequence.skip_existing && exists(flags.output)) {
    if (!flags.progress.quiet) std::cout << flags.output << ": exists, skipped\n";
    last_line({{"phase", "skipped"}, {"output", flags.output}});
    return ExitStatus::kDone;
  }
  if (sequence.dry_run) {
    dryRun(flags);
    return ExitStatus::kDone;
  }
  const double start = now();
  try {
    const ExitStatus status = bakeFrame(flags, json_fields);
    last_line({{"phase", "done"},
               {"status", static_cast<int>(status)},
               {"seconds", now() - start},
               {"output", flags.output}});
    return status;
  } catch (const Error& error) {
    last_line({{"phase", "failed"}, {"status", static_cast<int>(error.status())}, {"error", error.what()}});
    throw;
  }
}

/// Bakes frame after frame. One that fails is told in one line and does not keep the others from being baked;
/// only wrong flags, which would fail every frame, and an interrupt end the loop.
ExitStatus bakeFrames(const BakeFlags& flags, const SequenceFlags& sequence) {
  const std::vector<int> frames = framesIn(sequence.frames);
  if (frames.size() > 1 && !hasFrame(flags.output))
    throw UsageError("-o " + flags.output + ": every frame would be written there; put #### in the name");
  if (frames.size() > 1 && !flags.stats.empty() && !hasFrame(flags.stats))
    throw UsageError("--stats " + flags.stats + ": every frame would be written there; put #### in the name");
  const Log log = flags.progress.logOf("bake");
  ExitStatus worst = ExitStatus::kDone;
  size_t done = 0;
  std::string others;
  for (size_t n = 0; n < frames.size(); ++n) {
    throwIfInterrupted();
    const std::string number = std::to_string(frames[n]);
    const std::string json_fields = "\"frame\":" + number + ",\"index\":" + std::to_string(n) +
                                    ",\"frames\":" + std::to_string(frames.size()) + ",";
    ExitStatus status = ExitStatus::kDone;
    try {
      status = bakeOrSkip(flagsOf(flags, frames[n]), sequence, json_fields);
    } catch (const UsageError&) {
      throw;
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& error) {
      log.error("frame " + number + ": " + error.what());
      status = error.status();
    } catch (const std::bad_alloc&) {
      log.error("frame " + number + ": not enough memory; free some, or use a smaller volume");
      status = ExitStatus::kOutputNotWritten;
    }
    worst = worse(worst, status);
    if (status == ExitStatus::kDone)
      ++done;
    else
      others += (others.empty() ? ": " : ",") + number;
  }
  if (!flags.progress.quiet)
    std::cout << done << " of " << frames.size()
              << (sequence.dry_run ? " frames can be baked" : " frames done")
              << (others.empty() ? "" : ", not") << others << "\n";
  return worst;
}

ExitStatus run(const BakeFlags& flags, const SequenceFlags& sequence) {
  const auto limit = flags.limitThreads();
  if (!sequence.frames.empty()) return bakeFrames(flags, sequence);
  return bakeOrSkip(flags, sequence, "");
}

}  // namespace

void addBake(CLI::App& program, ExitStatus& status) {
  CLI::App* command =
      program.add_subcommand("bake", "First scatter and diffusion: lighting grids for a volume");
  const auto flags = std::make_shared<BakeFlags>();
  const auto sequence = std::make_shared<SequenceFlags>();
  flags->addInputTo(*command);
  const std::string group = "Frames (#### , %04d or $F4 in the names of files stands for the number)";
  addWord(*command, group, "--frames", sequence->frames, "LIST",
          "Bake each of these: 1-100, 1-100x2 (every second), 1-3,5,7-20:2");
  command
      ->add_flag("--skip-existing", sequence->skip_existing,
                 "Leave alone what has its output already, also where that says that it did not converge")
      ->group(group);
  command
      ->add_flag(
          "--dry-run", sequence->dry_run,
          "Read the input, say what was found and about how much memory and time a bake would take, and "
          "write nothing")
      ->group("Output");
  flags->addMethodTo(*command);
  flags->addOutputTo(*command, "density,diffuse,direct,flux,source", "density,diffuse,direct",
                     "JSON file with times, memory, residual and energy");
  setExample(command,
             "vdb_diffuse bake cloud.vdb -o lit.vdb --sun 1,0.5,-1 --sun-irradiance 3 --env 0.3 --g 0.6\n"
             "vdb_diffuse bake 'cloud.####.vdb' -o 'lit.####.vdb' --frames 1-100 --scene 'scene.####.json'");
  command->footer(std::string(kProgressLines) + "\n\n" + kExitStatus + "\n\n" + command->get_footer());
  command->callback([flags, sequence, &status] { status = run(*flags, *sequence); });
}

}  // namespace vdb_diffuse
