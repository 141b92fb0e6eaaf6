"""Laws of the compiled code as a whole."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

MOST_PARAMETERS = 8
LARGEST_COMPONENT = 3
"""Subscripts up to this are coordinates: of points, colours, and of rigid motions (4, 4)."""
NUMBA = {"njit", "jit", "vectorize", "guvectorize"}
"""Numba's decorators, of which those of the house are made."""


def decorators(texts: list[str]) -> set[str]:
    """Return the names of decorators that compile: Numba's, and those that modules make of them.

    `stage = compiled_with(fastmath=True)`, or a function that calls one of them in its body.
    """
    modules = [ast.parse(text) for text in texts]
    used = {name for module in modules for one in ast.walk(module) for name in _decorated(one)}
    made = [pair for module in modules for pair in _made_of(module) if pair[0] in used]
    found = set(NUMBA)
    while more := {name for name, called in made if called & found} - found:
        found |= more
    return found


def _decorated(node: ast.AST) -> set[str]:
    """Return the names of a function's decorators."""
    return {*map(_last_name, node.decorator_list)} if isinstance(node, ast.FunctionDef) else set()


def _made_of(module: ast.Module) -> Iterator[tuple[str, set[str]]]:
    """Yield the names that a module defines, and what is called to make each or in its body."""
    for node in module.body:
        called = {_last_name(call) for call in ast.walk(node) if isinstance(call, ast.Call)}
        if isinstance(node, ast.FunctionDef):
            yield node.name, called - _decorated(node)
        elif isinstance(node, ast.AnnAssign):
            yield _last_name(node.target), called
        elif isinstance(node, ast.Assign):
            yield from ((_last_name(target), called) for target in node.targets)


def kernels(source: str, compilers: set[str] = NUMBA) -> Iterator[ast.FunctionDef]:
    """Yield the functions of a module that one of the `decorators` compiles."""
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef) and any(
            _last_name(decorator) in compilers for decorator in function.decorator_list
        ):
            yield function


def untyped_arguments(kernel: ast.FunctionDef) -> list[str]:
    """Return the parameters, and `return`, that have no type or one that says nothing."""
    arguments = [*kernel.args.posonlyargs, *kernel.args.args, *kernel.args.kwonlyargs]
    types = [(one.arg, one.annotation) for one in arguments] + [("return", kernel.returns)]
    return [name for name, type_ in types if type_ is None or ast.unparse(type_) == "Any"]


def parameters(kernel: ast.FunctionDef) -> list[str]:
    """Return the names of all parameters."""
    own = kernel.args
    named = [one.arg for one in (*own.posonlyargs, *own.args, *own.kwonlyargs)]
    return named + [one.arg for one in (own.vararg, own.kwarg) if one is not None]


def column_numbers(kernel: ast.FunctionDef) -> list[str]:
    """Return the subscripts that pick a column of packed numbers by a literal: `row[12]`.

    Coordinates of points (`p[2]`, `centre[view, 1]`), the ends (`p[-1]`) and slices are left alone:
    only whole literals above `LARGEST_COMPONENT` count, in any place of the subscript.
    """
    found = []
    for node in ast.walk(kernel):
        if isinstance(node, ast.Subscript):
            places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            for place in places:
                number = place.value if isinstance(place, ast.Constant) else 0
                if isinstance(number, int) and number > LARGEST_COMPONENT:
                    found.append(ast.unparse(node))
    return found


def returns_array(kernel: ast.FunctionDef) -> bool:
    """Return whether the type of the result has an array in it."""
    return kernel.returns is not None and "Array" in ast.unparse(kernel.returns)


def array_callers(found: list[ast.FunctionDef]) -> list[tuple[str, str]]:
    """Return the kernels that call one that returns an array, and which."""
    makers = {kernel.name for kernel in found if returns_array(kernel)}
    return [
        (kernel.name, called)
        for kernel in found
        for node in ast.walk(kernel)
        if isinstance(node, ast.Call) and (called := _last_name(node)) in makers
    ]


def _last_name(node: ast.expr) -> str:
    """Return `njit` for `@njit`, `@numba.njit` and `@njit(cache=True)`."""
    node = node.func if isinstance(node, ast.Call) else node
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def sources(project: Path, *folders: str) -> dict[str, str]:
    """Return the texts of all modules in folders by their paths."""
    files = [file for folder in folders for file in (project / folder).rglob("*.py")]
    return {file.relative_to(project).as_posix(): file.read_text() for file in sorted(files)}


@cache
def compilers_of(project: Path) -> set[str]:
    """Return the `decorators` of the product."""
    return decorators([*sources(project, "hairkit", "plugins").values()])


@cache
def all_kernels(project: Path) -> list[tuple[str, ast.FunctionDef]]:
    """Return name and tree of all kernels."""
    return [
        (f"{name}:{kernel.name}", kernel)
        for name, source in sources(project, "hairkit", "plugins").items()
        for kernel in kernels(source, compilers_of(project))
    ]


def test_kernels_are_typed(project: Path) -> None:
    """Every parameter and result of a compiled function has a type."""
    found = all_kernels(project)
    assert len(found) > 200
    assert [(name, left) for name, kernel in found if (left := untyped_arguments(kernel))] == []


def test_kernels_have_few_parameters(project: Path) -> None:
    """What belongs together is a record: no kernel has more than `MOST_PARAMETERS`."""
    many = [(name, len(parameters(kernel))) for name, kernel in all_kernels(project)]
    assert [(name, count) for name, count in many if count > MOST_PARAMETERS] == []


def test_kernels_pick_no_columns_by_number(project: Path) -> None:
    """What is not a coordinate is a named field, or a column with a named number."""
    found = all_kernels(project)
    assert [(name, hits) for name, kernel in found if (hits := column_numbers(kernel))] == []


def test_loops_are_shared_in_one_way(project: Path) -> None:
    """No kernel of the project asks Numba for threads: `hairkit.parallel` shares all loops."""
    files = [*(project / "hairkit").rglob("*.py"), *(project / "plugins").rglob("*.py")]
    assert len(files) > 100
    names = [
        (file.name, node.id)
        for file in files
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Name) and node.id == "prange"
    ]
    assert names == []


def test_numba_is_used_by_its_public_names(project: Path) -> None:
    """No module imports the insides of Numba or llvmlite.

    Numba documents `numba.core.event`, by which compilations are announced. Its cache has no public
    name, and fails on an index of an older version (`tests/test_parallel.py`).
    """
    inside = []
    for folder in ("hairkit", "plugins"):
        for file in (project / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text())):
                modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
                modules += [n.name for n in node.names] if isinstance(node, ast.Import) else []
                if any(m.startswith(("numba.", "llvmlite")) for m in modules):
                    inside.append(file.relative_to(project).as_posix())
    assert {*inside} <= {
        "hairkit/compilation.py",
        "hairkit/kernel_cache.py",
    }


def test_arrays_are_returned_to_python_alone(project: Path) -> None:
    """Kernels count no references: an array that one got from another would never be freed."""
    found = [kernel for _, kernel in all_kernels(project)]
    assert any(returns_array(kernel) for kernel in found)
    assert array_callers(found) == []


def inside_names(module: ast.Module) -> set[str]:
    """Return the functions of a module that compiled functions alone may call."""
    return {
        node.name
        for node in ast.walk(module)
        if isinstance(node, ast.FunctionDef)
        and any("inside=True" in ast.unparse(one) for one in node.decorator_list)
    }


def names_in_python(node: ast.AST, compilers: set[str]) -> Iterator[str]:
    """Yield the names that are used where no function is compiled."""
    if not _decorated(node) & compilers:
        yield from {_last_name(node)} if isinstance(node, ast.Name | ast.Attribute) else ()
        for child in ast.iter_child_nodes(node):
            yield from names_in_python(child, compilers)


def test_what_is_compiled_for_kernels_is_called_by_kernels(project: Path) -> None:
    """Python names no function that has no entry for it: a call would end the process."""
    folders = ("hairkit", "plugins", "tests", "benchmarks", "studies", "examples")
    texts = sources(project, *folders)
    marked = [ast.parse(text) for text in texts.values() if "inside=True" in text]
    inside = {name for module in marked for name in inside_names(module)}
    assert len(inside) > 40
    words = re.compile(rf"\b({'|'.join(inside)})\b")
    naming = {name: ast.parse(text) for name, text in texts.items() if words.search(text)}
    compilers = compilers_of(project)
    called = {name: inside & {*names_in_python(it, compilers)} for name, it in naming.items()}
    assert {name: names for name, names in called.items() if names} == {}


def test_faults_of_kernels_are_found() -> None:
    """Untyped and many parameters, columns by number, arrays that kernels get from others; points
    and slices are left alone."""
    made = "@jit\ndef f(n: int) -> Float64Array: ...\n@jit\ndef g() -> float:\n    return f(3)[0]"
    assert array_callers([*kernels(made)]) == [("g", "f")]
    [kernel] = kernels("@numba.njit(cache=True)\ndef f(p, i: int):\n    return p[i, 12] + p[15]")
    assert untyped_arguments(kernel) == ["p", "return"]
    assert parameters(kernel) == ["p", "i"]
    assert column_numbers(kernel) == ["p[i, 12]", "p[15]"]
    [kernel] = kernels("@njit\ndef f(a, /, b=1, *c, d: int, **e): ...")
    assert parameters(kernel) == ["a", "b", "d", "c", "e"]
    [kernel] = kernels("@njit\ndef f(p: A) -> float:\n    return p[0, 2] + p[-1] + p[3:6]")
    assert untyped_arguments(kernel) == []
    assert column_numbers(kernel) == []
    assert list(kernels("def plain(p):\n    return p[12]")) == []


def test_decorators_of_the_house_are_found() -> None:
    """A name counts that is made of one that counts, in whatever module; others do not."""
    first = "def compiled(f):\n    def inner():\n        return njit(f)\n    return inner"
    second = "stage = compiled(fast=True)\ninlined: Any = stage(1)\ncached = cache()\n"
    use = "".join(f"@{n}\ndef {n}_f(p): ...\n" for n in ("compiled", "stage", "inlined", "cached"))
    found = decorators([use, second, first])
    assert found == NUMBA | {"compiled", "stage", "inlined"}
    assert [kernel.name for kernel in kernels(use, found)] == ["compiled_f", "stage_f", "inlined_f"]
