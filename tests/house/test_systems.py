"""Laws of portability: what one system lacks is used in `hairkit.system` alone."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
SOURCES = sorted((PROJECT / "hairkit").rglob("*.py")) + sorted((PROJECT / "plugins").rglob("*.py"))
LACKED_MODULES = {"fcntl", "grp", "msvcrt", "posix", "pwd", "pty", "resource", "termios", "winreg"}
"""Modules that Python has on some systems only."""
LACKED = {
    "os": """O_NONBLOCK chown fork forkpty getegid geteuid getgid getgroups getloadavg getpgid
        getpriority getuid initgroups killpg lchown mkfifo mknod name nice openpty posix_spawn pread
        pwrite sched_getaffinity sched_setaffinity setsid statvfs sync sysconf umask uname wait
        wait3 wait4""",
    "signal": "SIGALRM SIGCHLD SIGHUP SIGKILL SIGPIPE SIGQUIT SIGUSR1 SIGUSR2 alarm setitimer",
    "socket": "AF_UNIX SO_REUSEADDR SO_REUSEPORT",
    "sys": "platform",
    "platform": "system",
    "ctypes": "CDLL WinDLL windll",
}
"""Names of modules that are not the same everywhere."""
FULL_NAMES = {f"{module}.{name}" for module, names in LACKED.items() for name in names.split()}
ELSEWHERE = {
    "hairkit/rendering/osmesa.py": {"ctypes.CDLL"},
}
"""Files that name what is portable in the way they use it."""


def uses(source: str) -> set[str]:
    """Return what a source uses that some system lacks."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names} & LACKED_MODULES
        elif isinstance(node, ast.ImportFrom) and node.module in LACKED_MODULES:
            found.add(node.module)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            found |= {f"{node.value.id}.{node.attr}"} & FULL_NAMES
    return found


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PROJECT)))
def test_what_a_system_lacks_is_used_in_one_place(path: Path) -> None:
    """`hairkit.system` alone asks for the system; text files are opened in a stated encoding."""
    name = path.relative_to(PROJECT).as_posix()
    assert unsaid(path.read_text()) == []
    if name != "hairkit/system.py":
        assert uses(path.read_text()) - ELSEWHERE.get(name, set()) == set()


def test_such_uses_are_found() -> None:
    """The law above sees imports, also from within, and attributes."""
    source = (
        "import os, sys\ndef f():\n    import resource\n    from fcntl import flock\n    os.fork()"
    )
    assert uses(source + "\nsys.platform") == {"resource", "fcntl", "os.fork", "sys.platform"}


def unsaid(source: str) -> list[int]:
    """Return the lines of calls that open a text file in the system's encoding."""
    lines = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call) or any(k.arg == "encoding" for k in node.keywords):
            continue
        called = node.func
        name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
        of_path = isinstance(called, ast.Attribute)
        if (name == "read_text" and of_path and not node.args) or (
            name == "write_text" and of_path and len(node.args) == 1
        ):
            lines.append(node.lineno)
        if name in ("open", "fdopen"):
            mode = next((k.value for k in node.keywords if k.arg == "mode"), None)
            given = node.args[0 if of_path and name == "open" else 1 :]
            mode = mode or (given[0] if given else None)
            if isinstance(mode, ast.Constant) and "b" not in str(mode.value):
                lines.append(node.lineno)
    return lines


def test_files_without_an_encoding_are_found() -> None:
    """The law above sees paths' own functions and `open`, and lets binary files pass."""
    bad = "p.read_text()\np.write_text(t)\nopen(p, 'w')\np.open('r')"
    good = "p.read_text('utf-8')\nwrite_text(p, t)\nopen(p, 'rb')\nopen(p, 'w', encoding='utf-8')"
    assert unsaid(bad) == [1, 2, 3, 4]
    assert unsaid(good) == []
