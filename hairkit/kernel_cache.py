"""The cache of compiled functions: that of the machine, and the one that a wheel brings along.

Numba's cache knows a function by its file's SHA-256, its types, and the processor it was compiled
for. `make wheel` compiles what a reconstruction, a simulation and a picture need for
`PORTABLE_PROCESSOR` and puts it into `SHIPPED`; machines that have its instructions run it as it
is. With another version of Python or Numba, or on another processor, nothing is found there, and
functions are compiled as from a checkout.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from llvmlite import binding
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.runtime.nrt import rtsys

from hairkit.version import __version__

SHIPPED = Path(__file__).with_name("shipped_kernels")
"""Folder of compiled functions, one folder a module; wheels alone have it."""
PORTABLE_PROCESSOR, PORTABLE_FEATURES = "x86-64-v3", ""
"""What shipped functions are compiled for: `NUMBA_CPU_NAME` and `NUMBA_CPU_FEATURES`. The level
(x86-64 psABI, version 1.0) is that of Intel's Haswell, 2013, and AMD's Excavator, 2015."""
PORTABLE_INSTRUCTIONS = (
    "avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sse4.2",
)  # fmt: skip
"""LLVM's names of the instructions of that level."""


class KernelCache(FunctionCache):
    """Numba's cache of a function, and behind it that of the wheel.

    Numba's is empty where its index names types that are no more: Numba reads the types of all that
    is in the index before it looks whether the source is older, so that after an update with a type
    renamed every call would fail.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        """Look for what is kept of a function of a module."""
        super().__init__(function)  # type: ignore[no-untyped-call]
        source = Path(function.__code__.co_filename)
        stamp = hashlib.sha256(source.read_bytes()).digest() if source.is_file() else b""
        name = self._impl.filename_base
        folder = str(SHIPPED / function.__module__)
        self._shipped = IndexDataCacheFile(folder, name, stamp)  # type: ignore[no-untyped-call]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the function compiled for a signature, or None.

        Numba's own method first loads all that its compiler knows, 0.12 processor seconds and
        10 MB; a function that is not found is compiled, and the compiler loads it then.
        """
        rtsys.initialize(target_context)
        try:
            with self._guard_against_spurious_io_errors():
                found = self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except (AttributeError, ImportError):
            self.flush()  # type: ignore[no-untyped-call]
            found = None
        return found or self._load_shipped(sig, target_context)

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        """Return Numba's key and hairkit's version: kernels hold code of others' files, too."""
        return (*super()._index_key(sig, codegen), __version__)  # type: ignore[no-untyped-call]

    def _load_shipped(self, sig: Any, target_context: Any) -> Any:
        if not runs_portable_code():
            return None
        processor = _Processor(target_context.codegen().magic_tuple()[0])
        key = self._index_key(sig, processor)
        data = self._shipped.load(key)  # type: ignore[no-untyped-call]
        return None if data is None else self._impl.rebuild(target_context, data)


class _Processor(NamedTuple):
    """What Numba compiles for, as far as its cache asks."""

    triple: str

    def magic_tuple(self) -> tuple[str, str, str]:
        return self.triple, PORTABLE_PROCESSOR, PORTABLE_FEATURES


@cache
def runs_portable_code() -> bool:
    """Return whether there are shipped functions and this processor has their instructions."""
    if not SHIPPED.is_dir() or platform.machine() not in ("x86_64", "AMD64"):
        return False
    features = binding.get_host_cpu_features()
    return all(features.get(name, False) for name in PORTABLE_INSTRUCTIONS)


class ShippingCache(KernelCache):
    """The cache while a wheel is made: what is compiled goes into `SHIPPED`."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Keep a function of a module in the wheel's folder."""
        super().__init__(function)
        Path(self._shipped._cache_path).mkdir(parents=True, exist_ok=True)
        self._cache_file = self._shipped
