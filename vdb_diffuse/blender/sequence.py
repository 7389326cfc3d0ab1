"""Names of volume files and their lit copies. No bpy, so that it can be tested alone.

Blender takes the last run of digits before the extension for the frame; vdb_diffuse takes #### for it.
"""

import os
import re


def _split(path):
    """Folder, stem, digits ("" where there are none) and extension."""
    folder, name = os.path.split(path)
    stem, extension = os.path.splitext(name)
    digits = re.search(r"\d*$", stem).group()
    return folder, stem[: len(stem) - len(digits)], digits, extension


def litPath(source, folder, is_sequence, suffix="lit"):
    """cumulus.vdb -> cumulus_lit.vdb; of a sequence smoke_0007.vdb -> smoke_lit_0007.vdb. Empty folder: beside it."""
    beside, stem, digits, extension = _split(source)
    if is_sequence:
        name = f"{stem.rstrip('_.-')}_{suffix}_{digits}{extension}"
    else:
        name = f"{stem}{digits}_{suffix}{extension}"
    return os.path.join(folder or beside, name)


def pattern(path):
    """smoke_0007.vdb -> smoke_####.vdb; None where the name has no number."""
    folder, stem, digits, extension = _split(path)
    return os.path.join(folder, f"{stem}{'#' * len(digits)}{extension}") if digits else None


def framePath(path, number):
    """The file of that number in the sequence that `path` belongs to."""
    folder, stem, digits, extension = _split(path)
    return os.path.join(folder, f"{stem}{number:0{len(digits)}d}{extension}")


def gaps(path, numbers):
    """Which of the files are missing; Blender shows nothing there, and says nothing."""
    return [number for number in numbers if not os.path.exists(framePath(path, number))]


def ranges(numbers):
    """Ascending numbers as the program's --frames has them: [1, 2, 3, 5] -> 1-3,5."""
    runs = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ",".join(str(a) if a == b else f"{a}-{b}" for a, b in runs)
