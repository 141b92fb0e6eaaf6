"""An OSMesa context for moderngl, for machines without EGL."""

from __future__ import annotations

import ctypes
import ctypes.util
from typing import Any

from hairkit.errors import RenderError

_FORMAT, _DEPTH_BITS, _PROFILE, _CORE_PROFILE = 0x22, 0x30, 0x33, 0x34
_MAJOR_VERSION, _MINOR_VERSION = 0x36, 0x37
_RGBA, _UNSIGNED_BYTE = 0x1908, 0x1401


class OSMesaContext:
    """Off-screen Mesa: renders into memory, without display or device."""

    def __init__(self) -> None:
        self._library = _open_library()
        wanted = [_FORMAT, _RGBA, _DEPTH_BITS, 24, _PROFILE, _CORE_PROFILE]
        wanted += [_MAJOR_VERSION, 4, _MINOR_VERSION, 3, 0]
        attributes = (ctypes.c_int * len(wanted))(*wanted)
        self._context = self._library.OSMesaCreateContextAttribs(attributes, None)
        if not self._context:
            raise RenderError("OSMesa has no OpenGL 4.3 core context; install a newer Mesa")
        self._pixel = (ctypes.c_ubyte * 4)()
        self._depth = 0
        self._make_current()

    def load(self, name: str) -> int:
        """Return the address of an OpenGL function, 0 if there is none."""
        return self._library.OSMesaGetProcAddress(name.encode()) or 0

    def release(self) -> None:
        """Free the context."""
        if self._context:
            self._library.OSMesaDestroyContext(self._context)
            self._context = None

    def __enter__(self) -> OSMesaContext:
        self._depth += 1
        self._make_current()
        return self

    def __exit__(self, *exception: object) -> None:
        self._depth -= 1
        if self._depth:  # an outer block still draws
            return
        self._library.OSMesaMakeCurrent(None, None, 0, 0, 0)

    def _make_current(self) -> None:
        done = self._library.OSMesaMakeCurrent(self._context, self._pixel, _UNSIGNED_BYTE, 1, 1)
        if not done:
            raise RenderError("OSMesa could not make its context current")


def _open_library() -> Any:
    name = ctypes.util.find_library("OSMesa") or "libOSMesa.so.8"
    try:
        library: Any = ctypes.CDLL(name)
    except OSError as error:
        raise RenderError(f"{name} is not installed") from error
    library.OSMesaCreateContextAttribs.restype = ctypes.c_void_p
    library.OSMesaCreateContextAttribs.argtypes = [ctypes.POINTER(ctypes.c_int), ctypes.c_void_p]
    library.OSMesaMakeCurrent.argtypes = [ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int] * 3]
    library.OSMesaMakeCurrent.restype = ctypes.c_ubyte
    library.OSMesaDestroyContext.argtypes = [ctypes.c_void_p]
    library.OSMesaGetProcAddress.restype = ctypes.c_void_p
    library.OSMesaGetProcAddress.argtypes = [ctypes.c_char_p]
    return library
