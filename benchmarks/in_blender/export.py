"""How long Blender's own exporters take for the same strands; runs in Blender's Python.

python benchmarks/in_blender/export.py STRANDS.npz FOLDER ROUNDS .abc .usdc ...

The strands stand in the scene as what each exporter takes: hair curves for Alembic and USD, a mesh
of edges for the others. Only the export is timed, until the file is on the disk. Prints for each
ending wall and processor seconds and the file's size:
{ending: {"seconds": s, "processor": s, "bytes": n}}.
"""

import json
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np


def main() -> None:
    """Time each ending; the answer is the last line."""
    arrays, folder, rounds, *endings = sys.argv[1:]
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # Blender prints what it likes
    with np.load(arrays) as stored:
        points, counts, radius = stored["points"], stored["counts"], stored["radius"]
    took = {}
    for ending in endings:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        if ending in (".abc", ".usdc"):
            _add_curves(points, counts, radius)
        else:
            _add_edges(points, counts)
        path = Path(folder) / f"blender{ending}"
        best = np.min([_timed(path) for _ in range(int(rounds))], axis=0).tolist()
        took[ending] = {"seconds": best[0], "processor": best[1], "bytes": path.stat().st_size}
    print(json.dumps(took), file=answers)


def _timed(path: Path) -> tuple[float, float]:
    """Return wall and processor seconds."""
    path.unlink(missing_ok=True)
    wall, processor = time.perf_counter(), time.process_time()
    _export(str(path))
    with path.open("rb+") as file:  # hairkit waits for the disk too
        os.fsync(file.fileno())
    return time.perf_counter() - wall, time.process_time() - processor


def _export(path: str) -> None:
    if path.endswith(".abc"):
        bpy.ops.wm.alembic_export(filepath=path, start=1, end=1, as_background_job=False)
    elif path.endswith(".usdc"):
        bpy.ops.wm.usd_export(filepath=path)
    elif path.endswith(".glb"):
        bpy.ops.export_scene.gltf(filepath=path, use_mesh_edges=True)
    elif path.endswith(".ply"):
        bpy.ops.wm.ply_export(filepath=path)
    else:
        bpy.ops.wm.obj_export(filepath=path, export_materials=False)


def _add_curves(points: np.ndarray, counts: np.ndarray, radius: np.ndarray) -> None:
    curves = bpy.data.hair_curves.new("hair")
    curves.add_curves(counts.tolist())
    curves.position_data.foreach_set("vector", points.ravel())
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radius)
    _link(curves)


def _add_edges(points: np.ndarray, counts: np.ndarray) -> None:
    first = np.delete(np.arange(len(points), dtype=np.int32), np.cumsum(counts) - 1)
    mesh = bpy.data.meshes.new("hair")
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.edges.add(len(first))
    mesh.edges.foreach_set("vertices", np.stack([first, first + 1], axis=1).ravel())
    mesh.update()
    _link(mesh)


def _link(data: bpy.types.ID) -> None:
    bpy.context.collection.objects.link(bpy.data.objects.new("hair", data))
    bpy.context.view_layer.update()


if __name__ == "__main__":
    main()
