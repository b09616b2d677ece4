"""The tuned numbers of recordings: value, unit, trade-off, and the command that measured each."""

from __future__ import annotations

__all__: list[str] = []

# Wall-clock time of one read in the helper process, s. A sound read takes milliseconds, and 3000 mutated recordings are
# answered within 5 s (`python tests/hostile/mutated_recordings.py`). A longer time delays the error for a damaged file,
# a shorter one needs the second try on a slow disk or a busy machine more often.
READ_S = 1.5
# Memory of the helper process beyond that of Python, bytes. Follows from the copies that a reply needs: three of four
# 16-bit images of 40 million pixels. More memory lets a damaged file slow the machine down.
MEMORY_BYTES = 1 << 30
# Time that ended helper processes may cost for one file, s. Follows from READ_S: one read without end and its second
# try, or several crashes. Afterwards all further reads of the file fail at once; a longer time rescues more shots
# behind a damaged table.
LOST_S = 2 * READ_S
# Files that the helper process keeps open. A program that opens more at a time, or never closes one, makes the helper
# open them again, which takes milliseconds; more cost memory and file descriptors. Follows from the descriptors that a
# process may have, 1024 on Linux, and is far from them.
OPEN_MAX = 32
