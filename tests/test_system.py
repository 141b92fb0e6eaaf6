"""Laws of what systems do differently; Windows and macOS by stand-ins for what they have."""

from __future__ import annotations

import errno
import logging
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from hairkit import system
from hairkit.errors import InputError
from hairkit.pipeline.work_folder import WorkFolder


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Windows, as far as Python shows it: its modules, and what was asked of them."""
    asked = SimpleNamespace(locked=[], run=[])

    def locking(handle: int, mode: int, count: int) -> None:
        if mode == 2 and handle in asked.locked:
            raise OSError(errno.EACCES, "Permission denied")
        asked.locked.append(handle)

    class Kernel:
        @staticmethod
        def GetPhysicallyInstalledSystemMemory(pointer: Any) -> None:  # noqa: N802 (its name)
            pointer._obj.value = 16 * 2**20

    msvcrt: Any = ModuleType("msvcrt")
    msvcrt.locking, msvcrt.LK_NBLCK = locking, 2
    monkeypatch.setitem(sys.modules, "msvcrt", msvcrt)
    for module in ("fcntl", "resource"):
        monkeypatch.setitem(sys.modules, module, None)  # importing it fails
    for name in ("getuid", "killpg", "sysconf", "sched_getaffinity"):
        monkeypatch.delattr(os, name)
    windll = SimpleNamespace(kernel32=Kernel)
    monkeypatch.setattr(system.ctypes, "windll", windll, raising=False)
    monkeypatch.setattr(socket, "SO_EXCLUSIVEADDRUSE", -5, raising=False)
    monkeypatch.setattr(system, "SYSTEM", "win32")
    return asked


def test_a_lock_is_held_once(tmp_path: Path) -> None:
    """A second open file of the same name is not locked until the first is closed."""
    path = tmp_path / ".lock"
    with path.open("wb") as first, path.open("rb") as second:
        assert system.lock_file(first.fileno(), path)
        assert not system.lock_file(second.fileno(), path)
        first.close()
        assert system.lock_file(second.fileno(), path)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS])
def test_disks_without_locks_are_used_with_a_warning(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A run goes on where the file system of a network has no locks, and says so."""
    import fcntl

    def refuse(handle: int, operation: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with caplog.at_level(logging.WARNING, "hairkit"), WorkFolder(tmp_path / "work"):
        pass
    assert f"{tmp_path / 'work'}: no locks on this disk" in caplog.text


def test_other_faults_of_locks_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that fails is not taken for one without locks."""
    import fcntl

    def fail(handle: int, operation: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(fcntl, "flock", fail)
    with pytest.raises(OSError, match="Input/output"), WorkFolder(tmp_path / "work"):
        pass


def test_windows_locks_by_its_own_call(windows: SimpleNamespace, tmp_path: Path) -> None:
    """The lock is taken once, and a second try is told that another has it."""
    with (tmp_path / "lock").open("wb") as file:
        assert system.lock_file(file.fileno(), tmp_path)
        assert not system.lock_file(file.fileno(), tmp_path)


def test_windows_needs_nothing_that_it_lacks(
    windows: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Memory, cores, user and folders are known without the modules of POSIX."""
    monkeypatch.setenv("LOCALAPPDATA", "C:/Users/somebody/AppData/Local")
    assert system.physical_bytes() == 16 * 2**30
    assert system.peak_bytes() == 0
    assert system.core_count() == os.cpu_count()
    assert system.user_id() == 0
    assert system.data_folder() == Path("C:/Users/somebody/AppData/Local")
    assert system.of_glibc("mallopt") is None
    system.limit_process(1, 0, None)
    assert "creationflags" in system.own_group()
    assert "apt-get" not in system.gl_cure()
    assert system.gl_backends() == ("native",)


def test_windows_ends_a_process_with_what_it_started(
    windows: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The system's own command ends the tree of processes."""

    def run(words: list[str], **_: object) -> None:
        windows.run.append(words)

    monkeypatch.setattr(subprocess, "run", run)
    killed: list[int] = []
    process: Any = SimpleNamespace(pid=7, kill=lambda: killed.append(7))
    system.kill_group(process)
    assert windows.run == [["taskkill", "/F", "/T", "/PID", "7"]]
    assert killed == [7]


def test_a_port_of_windows_is_nobody_elses(windows: SimpleNamespace) -> None:
    """There another program could listen on a port that is reused."""
    set_: list[tuple[int, int, int]] = []
    listening: Any = SimpleNamespace(setsockopt=lambda *values: set_.append(values))
    system.keep_port(listening)
    assert set_ == [(socket.SOL_SOCKET, -5, 1)]


def test_macos_counts_bytes_and_says_what_opengl_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its peak memory is in bytes, where that of Linux is in kibibytes, and it has no prlimit."""
    on_linux = system.peak_bytes()
    monkeypatch.setattr(system, "SYSTEM", "darwin")
    assert system.peak_bytes() <= on_linux // 1024 * 2
    assert system.data_folder() == Path.home() / "Library" / "Application Support"
    assert "4.1" in system.gl_cure()
    system.limit_process(1, 0, 0)  # the first process of a system may not be limited


def test_a_group_ends_with_its_process() -> None:
    """What a process started ends with it."""
    code = "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'input()']).wait()"
    process = subprocess.Popen([sys.executable, "-c", code], **system.own_group())
    system.kill_group(process)
    assert process.wait(10) == -signal.SIGKILL


def test_names_that_are_not_utf8_are_told(tmp_path: Path) -> None:
    """The name is quoted; names in UTF-8 come back as they are."""
    assert system.utf8_name(tmp_path / "Zöpfe") == str(tmp_path / "Zöpfe")
    with pytest.raises(InputError, match="not UTF-8"):
        system.utf8_name(os.fsdecode(b"front\xff.jpg"))
