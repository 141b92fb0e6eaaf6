"""The stage as a whole: metadata, the component's parts, and the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hairkit.errors import InputError, MissingExtraError
from hairkit.grooming.prepare_export import PreparedGroom
from hairkit.io.coordinate_space import FileSpace
from hairkit.io.textures import picture_names, write_pictures
from hairkit.storage import replace_file
from hairkit.system import utf8_name

from .options import Options

MISSING = "USD files need usd-core, which is not installed: pip install 'hairkit[usd]'"
DIGITS = 6
"""Time codes are rounded to so many decimals, so that frame 3 is at 3."""


def write_stage(ready: PreparedGroom, path: Path, options: Options) -> None:
    """Write the groom to `path`, whose ending says whether as text or as crate.

    Raises
    ------
    InputError
        The axes are left-handed.
    MissingExtraError
        usd-core is not installed.
    """
    space = options.space
    if space.mirrored:
        raise InputError(
            f"axis is {options.axis!r}, but USD is right-handed; take z_up_centimetres, programs"
            " turn USD files themselves as upAxis and metersPerUnit say"
        )
    try:
        from pxr import Tf, Usd
    except ImportError as error:
        raise MissingExtraError(MISSING) from error
    stage = Usd.Stage.CreateInMemory(f"groom{path.suffix.lower()}")
    _describe(stage, ready, space)
    maps = ready.groom.head.maps if options.head_mesh else None
    pictures = {} if maps is None else picture_names(path, maps)
    _fill(stage, ready, space, options, pictures)
    with replace_file(path, path.suffix.lower()) as part:
        try:
            stage.GetRootLayer().Export(utf8_name(part))
        except Tf.ErrorException as error:
            reason = " ".join(str(error).split()).partition("'Error occurred ")[2].partition("'")[0]
            raise InputError(f"{path}: the USD library fails {reason or 'to write it'}") from error
        if maps is not None:
            write_pictures(path, maps)


def _describe(stage: Any, ready: PreparedGroom, space: FileSpace) -> None:
    """Write the stage's axes, unit and times."""
    from pxr import UsdGeom

    up = UsdGeom.Tokens.y if space.axes == "y_up" else UsdGeom.Tokens.z
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, space.metres)
    if ready.cache is not None:
        rate = ready.cache.frames_per_second
        stage.SetTimeCodesPerSecond(rate)
        stage.SetFramesPerSecond(rate)
        stage.SetStartTimeCode(time_codes(ready)[0])
        stage.SetEndTimeCode(time_codes(ready)[-1])


def time_codes(ready: PreparedGroom) -> list[float]:
    """Return the time code of each cached frame; code / timeCodesPerSecond is its second."""
    if ready.cache is None:
        return []
    rate = ready.cache.frames_per_second
    return [round(float(time) * rate, DIGITS) for time in ready.cache.times]


def _fill(
    stage: Any,
    ready: PreparedGroom,
    space: FileSpace,
    options: Options,
    pictures: Mapping[str, str],
) -> None:
    from pxr import Kind, Usd, UsdSkel

    from .body import add_bust, add_head, add_skeleton
    from .curves import add_hair
    from .look import add_materials
    from .settings import settings_of

    root = UsdSkel.Root.Define(stage, "/Groom").GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    root.SetCustomData({"hairkit": settings_of(ready.groom)})
    materials = add_materials(stage, ready.groom, pictures)
    skeleton = add_skeleton(stage, ready, space, time_codes(ready))
    if options.head_mesh:
        add_head(stage, ready.groom.head, space, skeleton, materials.skin)
        if options.bust:
            add_bust(stage, ready, space, materials.cloth, time_codes(ready))
    add_hair(
        stage,
        ready,
        space,
        skeleton,
        materials.hair,
        time_codes(ready),
        attributes=options.attributes,
        mark_guides=options.mark_guides,
    )
