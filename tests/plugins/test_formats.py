"""Every format holds what its plugin's `FORMAT` declares: no more is claimed, and no less."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from rich_groom import rich_groom, with_degenerate

from hairkit.errors import MissingExtraError
from hairkit.grooming.prepare_export import complete_groom
from hairkit.head_model.scalp import evaluate, roots_at
from hairkit.head_model.template import default_head
from hairkit.io.file_format import Feature
from hairkit.manager import Manager, PluginInfo
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Head

FORMATS = [info for info in Manager.loaded(autoload=False).plugins() if info.format is not None]
FILES = [(info, suffix) for info in FORMATS for suffix in info.suffixes]
BOTH_WAYS = [
    (info, suffix) for info, suffix in FILES if {"import_groom", "export_groom"} <= {*info.stages}
]
CONDITIONAL = {Feature.HEAD, Feature.CURL}
"""Features that some formats change only where they must, so that they may come back whole."""
KEEPS_ALL = "native"
"""The native format also keeps strands without length."""


def named(values: object) -> str:
    """Return the test's name of a plugin or an ending."""
    return values.name if isinstance(values, PluginInfo) else str(values).strip(".")


def there_and_back(manager: Manager, name: str, path: Path, groom: Groom) -> Groom:
    """Return the groom after it was written and read; skip where an optional library lacks."""
    try:
        manager.call("export_groom", name, groom=groom, path=path)
    except MissingExtraError as error:
        pytest.skip(str(error))
    back = manager.call("import_groom", name, path=path)
    assert isinstance(back, Groom)
    return back


def close(found: npt.ArrayLike | None, wanted: npt.ArrayLike | None) -> bool:
    """Return whether two arrays are equal within float32."""
    if found is None or wanted is None or np.shape(found) != np.shape(wanted):
        return False
    return bool(np.allclose(found, wanted, rtol=2e-6, atol=2e-7))


def same_values(found: object, wanted: object, names: tuple[str, ...]) -> bool:
    """Return whether named fields of two objects are equal within float32."""
    return all(close(getattr(found, name), getattr(wanted, name)) for name in names)


def pictures(head: Head) -> dict[str, bytes]:
    """Return the pixels of a head's texture maps by name."""
    present = {} if head.maps is None else head.maps.present()
    return {name: texture.pixels.tobytes() for name, texture in present.items()}


def shapes(head: Head) -> dict[str, bytes]:
    """Return the offsets of a head's blendshapes by name."""
    return {shape.name: shape.offsets.tobytes() for shape in head.blendshapes}


def comes_back(feature: Feature, back: Groom, true: Groom) -> bool:
    """Return whether a feature of the groom is the same after reading."""
    strands, wanted = back.strands, true.strands
    per_strand = {Feature.ROOT_UV: "root_uv", Feature.GROUP: "group", Feature.GUIDE: "guide"}
    if feature in per_strand:
        return same_values(strands, wanted, (per_strand[feature],))
    if feature is Feature.HEAD:
        return same_values(back.head, true.head, ("vertices", "faces", "uv", "scalp")) and close(
            evaluate(back.head, back.root_triangle, back.root_barycentric),
            evaluate(true.head, true.root_triangle, true.root_barycentric),
        )
    return {
        Feature.MAPS: pictures(back.head) == pictures(true.head),
        Feature.SHAPES: shapes(back.head) == shapes(true.head),
        Feature.POINTS: close(strands.points, wanted.points),
        Feature.COUNTS: close(strands.counts, wanted.counts),
        Feature.WIDTHS: close(strands.widths, wanted.widths),
        Feature.DENSITY: close(back.root_density, true.root_density),
        Feature.TIES: len(back.ties) == len(true.ties)
        and all(
            same_values(tie, other, ("centre", "axis", "radius")) and tie.kind == other.kind
            for tie, other in zip(back.ties, true.ties, strict=True)
        ),
        Feature.SKIN: close(back.head.joints, true.head.joints),
        Feature.CAPSULES: same_values(
            back.head.capsules, true.head.capsules, ("first", "second", "radius")
        ),
        Feature.COLOUR: same_values(back.material, true.material, ("root_colour", "tip_colour")),
        Feature.COLOURS: close(strands.colours, wanted.colours),
        Feature.CURL: same_values(back.material, true.material, ("curl_radius", "curl_pitch")),
        Feature.PHYSICS: same_values(back.physics, true.physics, tuple(vars(HairPhysics()))),
    }[feature]


def is_lost(feature: Feature, back: Groom, true: Groom) -> bool:
    """Return whether a feature is at its default or absent after reading."""
    strands = back.strands
    own_uv = roots_at(back.head, back.root_triangle, back.root_barycentric).uv
    return {
        Feature.MAPS: back.head.maps is None or pictures(back.head) == pictures(default_head()),
        Feature.SHAPES: not back.head.blendshapes or shapes(back.head) == shapes(default_head()),
        Feature.POINTS: False,
        Feature.COUNTS: len(np.unique(strands.counts)) == 1,
        Feature.WIDTHS: strands.widths is None or np.ptp(strands.widths) == 0,
        Feature.ROOT_UV: strands.root_uv is None or close(strands.root_uv, own_uv),
        Feature.GROUP: strands.group is None or len(np.unique(strands.group)) == 1,
        Feature.GUIDE: strands.guide is None or bool(strands.guide.all()),
        Feature.TIES: not back.ties,
        Feature.DENSITY: bool((back.root_density == 1).all()),
        Feature.HEAD: not close(back.head.vertices, true.head.vertices),
        Feature.SKIN: not close(back.head.joints, true.head.joints),
        Feature.CAPSULES: not same_values(back.head.capsules, true.head.capsules, ("first",)),
        Feature.COLOUR: same_values(back.material, HairMaterial(), ("root_colour", "tip_colour")),
        Feature.COLOURS: strands.colours is None,
        Feature.CURL: back.material.curl_radius == 0,
        Feature.PHYSICS: vars(back.physics) == vars(HairPhysics()),
    }[feature]


def counterpart(info: PluginInfo, back: Groom, groom: Groom) -> Groom:
    """Return the part of the groom that the file holds: all, or guides where it declares so."""
    assert info.format is not None
    true = complete_groom(groom)
    if len(back.strands) == len(true.strands) or Feature.POINTS in info.format.exact:
        return true
    assert true.strands.guide is not None
    return true.select(true.strands.guide)


@pytest.mark.parametrize(("info", "suffix"), BOTH_WAYS, ids=named)
def test_a_format_carries_what_it_declares(
    manager: Manager, info: PluginInfo, suffix: str, tmp_path: Path
) -> None:
    """`exact` comes back within float32; what is lost is at defaults; the rest is in between."""
    assert info.format is not None
    groom = rich_groom()
    back = there_and_back(manager, info.name, tmp_path / f"hair{suffix}", groom)
    true = counterpart(info, back, groom)
    for feature in set(Feature) - {Feature.GUIDE_WEIGHTS, Feature.ANIMATION}:
        kept, gone = comes_back(feature, back, true), is_lost(feature, back, true)
        if feature in info.format.exact:
            assert kept, f"{feature.value} is declared exact"
        elif feature in info.format.partial:
            whole = kept and feature not in CONDITIONAL
            assert not whole, f"{feature.value} is declared changed, but comes back"
            assert not gone or feature in CONDITIONAL, (
                f"{feature.value} is declared changed, but is lost"
            )
        elif feature not in info.format.partial:
            assert gone, f"{feature.value} comes back, which the declaration does not say"


@pytest.mark.parametrize(("info", "suffix"), BOTH_WAYS, ids=named)
def test_strands_without_length_are_dropped(
    manager: Manager,
    info: PluginInfo,
    suffix: str,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """A strand that is one point is not written, and counted in a warning."""
    groom = replace(with_degenerate(rich_groom()))
    groom = replace(groom, strands=replace(groom.strands, guide=None))
    back = there_and_back(manager, info.name, tmp_path / f"hair{suffix}", groom)
    kept = info.name == KEEPS_ALL
    assert len(back.strands) == len(groom.strands) - (not kept)
    assert kept or "1 strands without length" in caplog.text


@pytest.mark.parametrize(("info", "suffix"), FILES, ids=named)
def test_equal_grooms_are_equal_files(
    manager: Manager, info: PluginInfo, suffix: str, tmp_path: Path
) -> None:
    """Neither the clock, nor the machine, nor the file's folder is in the file."""
    if "export_groom" not in info.stages:
        pytest.skip(f"{info.name} does not write")
    found = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        try:
            manager.call("export_groom", info.name, groom=rich_groom(), path=folder / f"h{suffix}")
        except MissingExtraError as error:
            pytest.skip(str(error))
        found.append({file.name: file.read_bytes() for file in folder.iterdir()})
    assert found[0] == found[1]


@pytest.mark.parametrize(("info", "suffix"), FILES, ids=named)
def test_an_interrupted_export_leaves_nothing(
    manager: Manager,
    info: PluginInfo,
    suffix: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Files come into being whole, by a rename; when that is interrupted, no part is left."""
    if "export_groom" not in info.stages:
        pytest.skip(f"{info.name} does not write")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    try:
        with pytest.raises(KeyboardInterrupt):
            manager.call(
                "export_groom", info.name, groom=rich_groom(), path=tmp_path / f"h{suffix}"
            )
    except MissingExtraError as error:
        pytest.skip(str(error))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("info", FORMATS, ids=named)
def test_declarations_make_sense(info: PluginInfo) -> None:
    """A feature has one state; only what is read can be exact; animation needs a cache to write."""
    assert info.format is not None
    form = info.format
    states = [form.exact, set(form.partial), form.written]
    assert sum(map(len, states)) == len(set().union(*states))
    assert Feature.GUIDE_WEIGHTS not in form.exact, "a groom holds none; it makes them of guides"
    assert "import_groom" in info.stages or not form.exact | set(form.partial)
    animated = "cache" in {option.name for option in info.options}
    assert bool(form.state(Feature.ANIMATION)) == animated
    assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in form.suffixes)
