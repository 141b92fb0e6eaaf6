"""Laws of the compiled code as a whole."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path


def stores_through_fields(source: str) -> Iterator[tuple[str, str]]:
    """Yield name and target of what parallel kernels write through attributes: `rod.point[i]`."""
    for kernel in ast.walk(ast.parse(source)):
        if isinstance(kernel, ast.FunctionDef) and any(map(_parallel, kernel.decorator_list)):
            places = (node for node in ast.walk(kernel) if isinstance(node, ast.Subscript))
            for place in places:
                if isinstance(place.ctx, ast.Store) and isinstance(place.value, ast.Attribute):
                    yield kernel.name, ast.unparse(place)


def _parallel(decorator: ast.expr) -> bool:
    settings = decorator.keywords if isinstance(decorator, ast.Call) else []
    return any(k.arg == "parallel" and ast.unparse(k.value) == "True" for k in settings)


def test_no_parallel_kernel_writes_through_a_tuples_field(project: Path) -> None:
    """Numba loses such writes without a word (its issues 5872 and 7135, open in 0.68).

    Reading through a field is right, and so is writing in a function that the kernel calls.
    """
    files = [*(project / "hairkit").rglob("*.py"), *(project / "plugins").rglob("*.py")]
    found = [(file.name, *hit) for file in files for hit in stores_through_fields(file.read_text())]
    assert len(files) > 100
    assert found == []


def test_a_write_through_a_field_is_found() -> None:
    """Plain and augmented, inside of loops; what is read, and plain kernels, are left alone."""
    body = "\n    for i in prange(9):\n        rod.x[i] += rod.v[i]\n        y[i] = rod.x[i]\n"
    parallel = f"@njit(cache=True, parallel=True)\ndef move(rod, y):{body}"
    assert list(stores_through_fields(parallel)) == [("move", "rod.x[i]")]
    assert list(stores_through_fields(f"@njit(cache=True)\ndef move(rod, y):{body}")) == []
