"""Hair curves made in Blender and written by its own exporters."""

from typing import Any

import bpy
import numpy as np
from contents import emptied, imported


def hair(path: str, points: Any, counts: list, radius: Any) -> None:
    """Write hair curves, Catmull-Rom as Blender's hair is, with the exporter of the ending."""
    _add_hair(np.asarray(points, np.float32), counts, np.asarray(radius, np.float32))
    _export(path)


def _add_hair(points: np.ndarray, counts: list, radius: np.ndarray) -> None:
    emptied()
    curves = bpy.data.hair_curves.new("hair")
    curves.add_curves(counts)
    curves.position_data.foreach_set("vector", points.ravel())
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radius)
    thing = bpy.data.objects.new("hair", curves)
    bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.update()


def _export(path: str) -> None:
    if path.endswith(".abc"):
        bpy.ops.wm.alembic_export(filepath=path, start=1, end=1, as_background_job=False)
    else:
        bpy.ops.wm.usd_export(filepath=path)


def again(source: str, operator: str, target: str, axes: dict) -> None:
    """Import a file and write what came with the exporter of the same format."""
    imported(source, operator, axes)
    getattr(bpy.ops.wm, operator.split(".")[1].replace("import", "export"))(filepath=target, **axes)
