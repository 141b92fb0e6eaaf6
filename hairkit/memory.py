"""Memory of freed arrays is kept by the process for the next ones.

Photos and maps are arrays of many megabytes that live for milliseconds. glibc asks the kernel for
each of them and gives it back, and the kernel clears all its pages anew: a fifth of the processor
time of a small capture, and more where two processes do so at once. After the stages that need the
most it is given back, so that what one stage leaves does not add to the peak of the next.
"""

from __future__ import annotations

import atexit
import gc

from hairkit.system import of_glibc

TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD, ARENA_MAX = -1, -2, -3, -8
"""Numbers of the settings, from glibc's `malloc.h`."""
SETTINGS = {TRIM_THRESHOLD: 2**31 - 1, TOP_PAD: 2**26, MMAP_THRESHOLD: 2**25, ARENA_MAX: 1}
"""Free bytes that are kept, bytes that are asked for beyond what is needed, bytes of an array for
which the kernel is asked in any case, and pools: a pool for each thread would hold 0.2 GiB more.
Kept too, arrays of more than 32 MiB would tear holes that the next ones do not fit into: 0.07 GiB
more for the sample, at the same processor time."""
NEW_OBJECTS = 20_000
"""Objects after which Python looks for cycles: 13 times in a run of the sample, 386 with 700."""


def keep_freed_memory() -> None:
    """Keep freed memory where the C library is glibc, and look for cycles less often, and not at
    the end: that took 0.43 processor seconds of a run, for 400,000 objects of libraries.
    """
    gc.set_threshold(NEW_OBJECTS, *gc.get_threshold()[1:])
    atexit.register(gc.freeze)
    mallopt = of_glibc("mallopt")
    if mallopt is not None:
        for setting, value in SETTINGS.items():
            mallopt(setting, value)


def give_back_memory() -> None:
    """Give back what is kept; nothing happens where the C library is not glibc."""
    trim = of_glibc("malloc_trim")
    if trim is not None:
        trim(0)
