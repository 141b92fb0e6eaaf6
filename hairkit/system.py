"""What Linux, macOS and Windows do differently: one function each, with a branch for every system.

Nothing else in hairkit asks on which system it runs, or uses what one of them lacks. hairkit is
run on Linux; the other branches are tested with stand-ins, and were not run.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import logging
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hairkit.errors import InputError

SYSTEM = sys.platform
"""`linux`, `darwin` for macOS, or `win32`."""
IN_MEMORY, LEAST_FREE = "/dev/shm", 2**30
"""Linux's folder in memory, and bytes that must be free there."""
CGROUP = Path("/sys/fs/cgroup")
"""Where Linux says what a container may take."""
KIBIBYTE = 1024
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP}
"""What file systems of networks answer that have no locks."""
_log = logging.getLogger(__name__)


def utf8_name(path: str | os.PathLike[str]) -> str:
    """Return a path as C++ libraries take it: its bytes are UTF-8, whatever the locale says.

    Raises `InputError` where the file system's name is not UTF-8.
    """
    try:
        return os.fsencode(path).decode()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: its name is not UTF-8; rename the file or its folder") from error


def lock_file(handle: int, path: Path) -> bool:
    """Lock an open file until it is closed; False where another process has locked it.

    Where the file system has no locks a warning says so, and the file counts as locked.
    """
    try:
        if SYSTEM == "win32":
            msvcrt: Any = __import__("msvcrt")
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            _log.warning("%s: no locks on this disk; use the folder for one run at a time", path)
            return True
        if error.errno in (errno.EAGAIN, errno.EACCES, errno.EDEADLK):
            return False
        raise
    return True


def own_group() -> dict[str, Any]:
    """Return settings of `Popen` for a process that Ctrl-C does not reach."""
    if SYSTEM == "win32":
        return {"creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)}
    return {"start_new_session": True}


def kill_group(process: subprocess.Popen[Any]) -> None:
    """End a process of `own_group` and all that it started, at once."""
    with contextlib.suppress(OSError):
        if SYSTEM == "win32":
            words = ["taskkill", "/F", "/T", "/PID", str(process.pid)]
            subprocess.run(words, capture_output=True, check=False)
        else:
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


def limit_process(pid: int, file_bytes: int, address_bytes: int | None) -> None:
    """Keep a process from filling the disk by one file or its core, and from more addresses.

    A limit that is lower already stays. Linux alone can limit a process that runs.
    """
    if SYSTEM != "linux":
        return
    import resource

    limits = {resource.RLIMIT_CORE: 0, resource.RLIMIT_FSIZE: file_bytes}
    if address_bytes is not None:
        limits[resource.RLIMIT_AS] = address_bytes
    for kind, wanted in limits.items():
        with contextlib.suppress(OSError):
            _, most = resource.prlimit(pid, kind)
            if most == resource.RLIM_INFINITY or most > wanted:
                resource.prlimit(pid, kind, (wanted, wanted))


def peak_bytes() -> int:
    """Return the most memory that this process has had; 0 on Windows."""
    if SYSTEM == "win32":
        return 0
    import resource

    unit = 1 if SYSTEM == "darwin" else KIBIBYTE
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def resident_bytes(pid: int) -> int:
    """Return the resident memory of a process and its descendants; 0 where Linux does not say."""
    try:
        with open(f"/proc/{pid}/statm", "rb") as file:
            total = int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0
    with contextlib.suppress(OSError):  # it may end meanwhile
        for children in Path(f"/proc/{pid}/task").glob("*/children"):  # each thread has its own
            total += sum(resident_bytes(int(child)) for child in children.read_bytes().split())
    return total


def physical_bytes() -> int:
    """Return the memory of this machine."""
    if SYSTEM != "win32":
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    kernel: Any = getattr(ctypes, "windll").kernel32  # noqa: B009 (unknown to mypy elsewhere)
    kibibytes = ctypes.c_ulonglong()
    kernel.GetPhysicallyInstalledSystemMemory(ctypes.byref(kibibytes))
    return kibibytes.value * KIBIBYTE


def available_bytes() -> int:
    """Return the memory that is free within the limits of a container; all of it off Linux."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free = next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError):
        return physical_bytes()
    with contextlib.suppress(OSError, ValueError):  # it has no limit
        most, used = (int((CGROUP / f"memory.{name}").read_bytes()) for name in ("max", "current"))
        return min(free * KIBIBYTE, most - used)
    return free * KIBIBYTE


def core_count() -> int:
    """Return the number of cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


def user_id() -> int:
    """Return the number of the user as `os.stat` has it, which is 0 on Windows."""
    return os.getuid() if SYSTEM != "win32" else 0


def memory_folder() -> str | None:
    """Return the system's folder in memory, None where it has none or little is left there.

    `TMPDIR`, where it is set, is used instead.
    """
    if os.environ.get("TMPDIR"):
        return None
    try:
        free = shutil.disk_usage(IN_MEMORY).free
    except OSError:
        return None
    return IN_MEMORY if free > LEAST_FREE and os.access(IN_MEMORY, os.W_OK) else None


def data_folder() -> Path:
    """Return the user's folder for data of programs, by the system's convention."""
    if SYSTEM == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if SYSTEM == "darwin":
        return Path.home() / "Library" / "Application Support"
    chosen = os.environ.get("XDG_DATA_HOME", "")
    return Path(chosen) if os.path.isabs(chosen) else Path.home() / ".local" / "share"


def keep_port(listening: socket.socket) -> None:
    """Let a server have its port again soon after its end, and nobody else meanwhile."""
    exclusive = getattr(socket, "SO_EXCLUSIVEADDRUSE", None)  # on Windows, where REUSE lets others
    listening.setsockopt(socket.SOL_SOCKET, exclusive or socket.SO_REUSEADDR, 1)


def of_glibc(name: str) -> Callable[..., Any] | None:
    """Return a function of the C library, None where there is none of the name."""
    return getattr(ctypes.CDLL(None), name, None) if SYSTEM == "linux" else None


def gl_backends() -> tuple[str, ...]:
    """Return the ways to OpenGL without a window, to be tried in this order."""
    found = {"win32": ("native",), "darwin": ("native", "osmesa")}
    return found.get(SYSTEM, ("egl", "osmesa"))


def gl_cure() -> str:
    """Return what to do for OpenGL 4.3, as the end of a sentence."""
    if SYSTEM == "win32":
        return "install the driver of the graphics card"
    if SYSTEM == "darwin":
        return "macOS itself has OpenGL 4.1: install a Mesa with OSMesa, or leave pictures out"
    return "on Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri libosmesa6"
