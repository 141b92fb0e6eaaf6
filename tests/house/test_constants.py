"""Law: tuned numbers have names. `python tests/house/test_constants.py` prints those without."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

TRIVIAL = {0, 1, 2, 3, 4, 0.5, 0.25, 1.5}
"""Identities, halves, pairs, and the dimensions of space, of homogeneous vectors and of colours."""
CONVERSIONS = {10, 60, 90, 100, 180, 255, 256, 360, 1000, 1e6, 1e9, 1e-3, 1e-6, 1e-9}
"""Powers of units, parts of a turn, and steps of an 8-bit channel."""
ROUND_OFF = 1e-9
"""Numbers up to this only keep a divisor or a logarithm from 0."""
FORMATS = (
    "hairkit/io/",
    *(
        f"plugins/{name}"
        for name in ("alembic", "fbx", "gltf", "hairworks", "ply", "tressfx", "usc_data", "usd")
    ),
)
"""Readers and writers of files: integers in them are given by the format."""


def unnamed_literals(source: str, *, integers: bool = True) -> Iterator[tuple[int, str]]:
    """Yield line and text of each literal in a function's body that may be tuned and has no name.

    Constants, options and defaults of parameters are declared outside of function bodies. In them,
    these literals follow from the formula or the format around them and are left out:

    * the numbers of `TRIVIAL` and `CONVERSIONS`, with either sign, and those below `ROUND_OFF`;
    * integers that count or place: in subscripts, tuples and lists (shapes, axes, colours), sizes
      of arrays, ranges, exponents, shifts, masks, decimals of `round`, and factors below 10
      (`6 * volume`);
    * integers compared with a length, a shape, a dimension or a count;
    * integers in the `FORMATS`, when `integers` is false.
    """
    tree = ast.parse(source)
    functions = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
    bodies = [statement for function in functions for statement in function.body]
    found: dict[tuple[int, int], str] = {}
    for body in bodies:
        for literal in _literals(body):
            if integers or isinstance(literal.value, float):
                found[literal.lineno, literal.col_offset] = ast.unparse(literal)
    yield from ((line, text) for (line, _), text in sorted(found.items()))


SIZES = {
    "zeros",
    "empty",
    "ones",
    "full",
    "eye",
    "reshape",
    "broadcast_to",
    "range",
    "tile",
    "round",
}
COUNTS = {"len", "ndim", "shape", "size"}


def _literals(node: ast.AST) -> Iterator[ast.Constant]:
    """Yield the literals below a node that count."""
    if isinstance(node, ast.Constant):
        if _may_be_tuned(node.value):
            yield node
        return
    if isinstance(node, ast.FunctionDef):
        return  # its own body is looked at by itself
    left_out: list[ast.AST] = []
    if isinstance(node, ast.Subscript):
        left_out = [node.slice] if _only_integers(node.slice) else []
    elif isinstance(node, ast.Call) and _name(node.func) in SIZES:
        left_out = [n for n in node.args if _only_integers(n)]
    elif isinstance(node, ast.Tuple | ast.List):
        left_out = [n for n in node.elts if _only_integers(n)]
    elif isinstance(node, ast.BinOp):
        left_out = _formula_integers(node)
    elif isinstance(node, ast.Compare) and any(map(_is_count, (node.left, *node.comparators))):
        left_out = [n for n in (node.left, *node.comparators) if _only_integers(n)]
    for child in ast.iter_child_nodes(node):
        if not any(child is one for one in left_out):
            yield from _literals(child)


def _may_be_tuned(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return value not in TRIVIAL | CONVERSIONS and abs(value) > ROUND_OFF


def _formula_integers(node: ast.BinOp) -> list[ast.AST]:
    """Return the operands that are exponents, shifts, masks or small integer factors."""
    if isinstance(node.op, ast.Pow | ast.LShift | ast.RShift | ast.BitAnd | ast.BitOr):
        return [n for n in (node.left, node.right) if _only_integers(n)]
    if isinstance(node.op, ast.Mult | ast.Div | ast.FloorDiv | ast.Mod):
        return [
            n
            for n in (node.left, node.right)
            if isinstance(n, ast.Constant) and isinstance(n.value, int) and abs(n.value) < 10
        ]
    return []


def _only_integers(node: ast.AST) -> bool:
    """Whether no literal below the node is a float."""
    return not any(
        isinstance(n, ast.Constant) and isinstance(n.value, float) for n in ast.walk(node)
    )


def _is_count(node: ast.expr) -> bool:
    names = {
        n.id if isinstance(n, ast.Name) else n.attr
        for n in ast.walk(node)
        if isinstance(n, ast.Name | ast.Attribute)
    }
    return bool(names & COUNTS) or any("count" in name for name in names)


def _name(function: ast.expr) -> str:
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def all_unnamed(project: Path) -> list[tuple[str, int, str]]:
    """Return file, line and text of all that are left."""
    found = []
    for file in sorted(
        [*(project / "hairkit").rglob("*.py"), *(project / "plugins").rglob("*.py")]
    ):
        name = file.relative_to(project).as_posix()
        literals = unnamed_literals(file.read_text(), integers=not name.startswith(FORMATS))
        found += [(name, *hit) for hit in literals]
    return found


def test_tuned_numbers_have_names(project: Path) -> None:
    """No literal that may be tuned stands in the body of a function."""
    found = all_unnamed(project)
    assert not found, "\n".join(f"{n}:{line}: {text}" for n, line, text in found)


def test_the_counter_sees_tuned_numbers_and_leaves_formulas_alone() -> None:
    """Thresholds and weights count; constants, defaults, shapes, units and identities do not."""
    source = """
LIMIT = 0.37
def f(x, tolerance=1e-4, shape=(7, 8)):
    y = np.zeros((6, 9)) + x[12] ** 7 * 180 / np.pi + 1e-12 + 6 * x
    if len(x) < 5 and y > {tuned}:
        return -1, round(y, 5)
    return blur(y, sigma={tuned})
"""
    found = [text for _, text in unnamed_literals(source.format(tuned=0.37))]
    assert found == ["0.37", "0.37"]
    assert list(unnamed_literals(source.format(tuned="LIMIT"))) == []
    assert [text for _, text in unnamed_literals(source.format(tuned=7))] == ["7", "7"]
    assert list(unnamed_literals(source.format(tuned=7), integers=False)) == []


DRAWING = ("hairkit/rendering", "hairkit/viewer", "hairkit/simulation", "plugins/rods")
"""Whose shaders there are: a name means the same in these folders and in their shaders."""


def typed_in_shader(source: str) -> set[str]:
    """Return the names of constants whose values a shader has itself: literals, not formulas."""
    names = r"(\w+) *= *(?:vec[234]\()?[-+.\de, /*]+\)?(?=[,;])"
    lines = re.findall(r"\bconst \w+ ([^;]*;)", source)
    defined = re.findall(r"#define (\w+) +[-.\d]", source)
    return {name for line in lines for name in re.findall(names, line)} | {*defined}


def typed_in_python(source: str) -> set[str]:
    """Return the names of constants of a module, without leading underscores."""
    found = set()
    for node in ast.parse(source).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        names = [name for target in targets for name in ast.walk(target)]
        found |= {n.id.lstrip("_") for n in names if isinstance(n, ast.Name) and n.id.isupper()}
    return found


def test_no_constant_is_typed_in_python_and_in_shaders(project: Path) -> None:
    """A constant of both has its value in Python; `#constants` writes it into the shader."""
    shaders = [path for path in (project / "shaders").iterdir() if path.suffix not in ("", ".py")]
    modules = [path for folder in DRAWING for path in (project / folder).rglob("*.py")]
    assert len(shaders) > 40
    assert len(modules) > 80
    python = {name for path in modules for name in typed_in_python(path.read_text())}
    both = {path.name: typed_in_shader(path.read_text()) & python for path in shaders}
    assert {name: found for name, found in both.items() if found} == {}


def test_constants_of_shaders_are_there_and_used(project: Path) -> None:
    """What `#constants` names is in the module, and the shader or one that includes it uses it."""
    texts = {path.name: path.read_text() for path in (project / "shaders").glob("*.*")}
    asked = [
        (name, module, constant)
        for name, text in texts.items()
        for module, constants in re.findall(r"^#constants (\S+) (.*)$", text, re.MULTILINE)
        for constant in constants.split()
    ]
    assert len(asked) > 40
    for name, module, constant in asked:
        users = [text for text in texts.values() if f'"{name}"' in text] + [texts[name]]
        assert hasattr(importlib.import_module(module), constant), (name, module, constant)
        uses = sum(len(re.findall(rf"\b{constant}\b", text)) for text in users)
        assert uses > 1, (name, constant)


def test_constants_typed_twice_are_found() -> None:
    """Numbers and vectors count, whatever their value; formulas and other names do not."""
    shader = """
#define UNROLLED 16
#constants hairkit.rendering.fibre TILT
const float BOUNCED = 0.1, TILTED = 2.0 * TILT;     // share
const vec3 WRAP = vec3(0.2, 0.1, 0.1);
const int NODES_ = NODES;
"""
    assert typed_in_shader(shader) == {"UNROLLED", "BOUNCED", "WRAP"}
    module = "_BOUNCED, TILT = np.float32(0.35), 3\nWRAP = [1]\nName = 2\ndef f(LIFT=3): NODES = 4"
    assert typed_in_python(module) == {"BOUNCED", "TILT", "WRAP"}


if __name__ == "__main__":
    hits = all_unnamed(Path(__file__).resolve().parents[2])
    for name, line, text in hits:
        print(f"{name}:{line}: {text}")
    print(len(hits))
