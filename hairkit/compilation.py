"""The line that says that kernels are compiled: a first run on a machine takes a minute more."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

COMPILING = "compiling kernels, once on this machine"


@contextmanager
def announce_compilation(say: Callable[[str], None]) -> Iterator[None]:
    """Say once in a block that kernels are compiled, when the first one is; not for cached ones."""
    from numba.core import event  # heavy; Numba documents it as its interface for listeners

    class First(event.Listener):
        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                self.said = True
                say(COMPILING)

        def on_end(self, event: object) -> None:
            pass

    with event.install_listener("numba:compile", First()):
        yield
