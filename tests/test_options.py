"""Laws of option descriptions and of their checking."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import OptionError
from hairkit.options import describe, fill_options, make_options, option


@dataclasses.dataclass(frozen=True)
class Options:
    """One option of every kind."""

    count: int = option(9, low=3, high=31, doc="Size.", unit="px")
    share: float = option(0.5, low=0.0, high=1.0, doc="Share.")
    soft: bool = option(False, doc="Soft.")
    mode: str = option("sum", choices=("sum", "product"), doc="Mode.")
    model: Literal["a", "b"] = option("a", doc="Model.")
    scales: tuple[float, ...] = option((1.0, 2.0), low=0.1, doc="Scales.")
    size: tuple[int, int] = option((3, 4), doc="Size.")
    file: Path | None = option(None, doc="File.")
    seed: int | None = option(None, low=0, doc="Seed.")
    plain: int = 1


def test_every_field_is_described_as_declared() -> None:
    """Name, type, default, bounds, choices, doc and unit come back as they were given."""
    infos = {info.name: info for info in describe(Options)}
    assert list(infos) == [field.name for field in dataclasses.fields(Options)]
    count = infos["count"]
    assert (count.type, count.default, count.low, count.high) == (int, 9, 3, 31)
    assert (count.doc, count.unit, count.choices) == ("Size.", "px", None)
    assert infos["model"].choices == ("a", "b")
    assert infos["file"].optional
    assert not infos["count"].optional


@given(
    st.integers(3, 31), st.floats(0, 1), st.booleans(), st.lists(st.floats(0.1, 1e3), max_size=4)
)
def test_texts_mean_the_same_as_values(
    count: int, share: float, soft: bool, scales: list[float]
) -> None:
    """A value written as `--set` writes it gives the same options as the value itself."""
    values = {"count": count, "share": share, "soft": soft, "scales": scales}
    texts = {
        "count": str(count),
        "share": repr(share),
        "soft": str(soft).lower(),
        "scales": ",".join(map(repr, scales)),
    }
    assert make_options(Options, texts, "x") == make_options(Options, values, "x")


def test_no_values_give_the_defaults() -> None:
    """What a recipe does not say keeps its default."""
    assert make_options(Options, {}, "x") == Options()


@pytest.mark.parametrize("text", ["none", ""])
def test_none_can_be_written_for_optional_options(text: str) -> None:
    """`none` and the empty text unset an option that may be None."""
    assert make_options(Options, {"seed": text, "file": text}, "x") == Options()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("count", 2),
        ("count", 32),
        ("count", 9.0),
        ("count", "9.5"),
        ("count", True),
        ("count", None),
        ("share", 1.5),
        ("share", float("nan")),
        ("share", "inf"),
        ("share", True),
        ("soft", "maybe"),
        ("soft", 1),
        ("mode", "max"),
        ("model", "c"),
        ("scales", [0.05]),
        ("scales", "1,x"),
        ("scales", 3.0),
        ("size", [1, 2, 3]),
        ("size", [1.5, 2]),
        ("seed", -1),
        ("file", 3),
    ],
)
def test_what_does_not_fit_is_refused_by_name(name: str, value: object) -> None:
    """A wrong type, a bound overstepped or an unknown choice is one line: where, which, wanted."""
    with pytest.raises(OptionError) as caught:
        make_options(Options, {name: value}, "gabor")
    message = str(caught.value)
    assert message.startswith(f"gabor: option {name} is {value!r}, expected ")
    assert "\n" not in message


def test_bounds_are_inside() -> None:
    """Both bounds themselves are allowed."""
    assert make_options(Options, {"count": 3, "share": 1}, "x") == Options(count=3, share=1.0)
    assert make_options(Options, {"count": 31}, "x").count == 31


def test_an_unknown_name_lists_the_valid_ones_and_the_closest() -> None:
    """A misspelt option is answered with the right one."""
    with pytest.raises(OptionError, match=r"did you mean 'count'.*valid: count, share"):
        make_options(Options, {"cuont": 3}, "x")


def test_relative_paths_stay_as_written() -> None:
    """A path option is a path, not resolved."""
    assert make_options(Options, {"file": "a/b.toml"}, "x").file == Path("a/b.toml")


def test_missing_options_are_filled_within_their_bounds() -> None:
    """None takes the given value, clamped; what is set stays."""

    @dataclasses.dataclass(frozen=True)
    class Some:
        unset: float | None = option(None, low=0.0, high=1.0, doc="Clamped.")
        kept: float | None = option(None, low=0.0, high=1.0, doc="Set.")
        free: float | None = option(None, doc="Without bounds.")

    filled = fill_options(Some(kept=0.5), unset=3.0, kept=0.1, free=-7.0)
    assert filled == Some(1.0, 0.5, -7.0)
