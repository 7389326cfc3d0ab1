#pragma once

namespace vdb_diffuse {

/// From here on the first SIGINT asks the work to stop at its next step; half a second later, or at a second
/// SIGINT, the process ends at once with status 130, as a step on a large volume takes many seconds. SIGTERM
/// and SIGHUP end it at once. No temporary file is left behind. A write beyond a file size limit becomes an
/// error where it happens, instead of a signal. Memory that runs out where no one can catch it is told as
/// such, with status 5.
void catchSignals();

/// Throws `Interrupted` after a SIGINT.
void throwIfInterrupted();

}  // namespace vdb_diffuse
