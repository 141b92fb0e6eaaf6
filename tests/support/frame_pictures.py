"""Frames of the viewer with a ball head and 3000 bristles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.head import head_solid
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera
from hairkit.viewer.draw.frame import FrameRenderer
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.interface import FrameInputs, HairLook
from hairkit.viewer.draw.place_kernels import MOST_STRETCH, PARTED, TOGETHER

GROOM = bristle_groom()
CAMERA = Camera.on_turn(20.0, distance=0.6, focal=260.0, width=160, height=120)
LOOK = HairLook(3000, True)
RED, GREEN = (0.4, 0.05, 0.05), (0.05, 0.4, 0.05)


def make_frame_renderer(
    gl: Renderer, *, soft: bool, colour: tuple[float, float, float] = RED
) -> FrameRenderer:
    """Return a frame renderer with the ball head and 3000 bristles of a colour."""
    look = replace(GROOM.material, root_colour=np.array(colour), tip_colour=np.array(colour))
    body = HairBody.of(replace(GROOM, material=look), 3000)
    return FrameRenderer(gl, head_solid(GROOM.head, GROOM.material), body, soft)


def inputs(**changes: object) -> FrameInputs:
    """Return what a frame of the groom at rest is drawn from, with changes."""
    plain = FrameInputs(CAMERA, np.eye(4), None, LOOK, whole_light=True)
    return replace(plain, **changes)  # type: ignore[arg-type]


def picture(frame_renderer: FrameRenderer, wanted: FrameInputs) -> UInt8Array:
    """Return the picture (H, W, 3)."""
    rows = frame_renderer.body.guide_rest if wanted.guide_rows is None else wanted.guide_rows
    frame_renderer.draw(replace(wanted, guide_rows=rows))
    return frame_renderer.read().copy()


def changed(first: UInt8Array, second: UInt8Array) -> np.ndarray:
    """Return (H, W) where two pictures differ visibly."""
    result: np.ndarray = np.abs(first.astype(int) - second).max(axis=2) > 12
    return result


def twin(body: HairBody, rows: Float32Array) -> Float32Array:
    """Return where hair goes with guides (G, m, 3): the slow twin of `place_kernels`."""
    turns = np.empty((*rows.shape[:2], 4))
    was, now = (np.diff(r.astype(float), axis=1) for r in (body.guide_rest, rows))
    stretch = np.linalg.norm(now, axis=2) / np.linalg.norm(was, axis=2)
    for g in range(len(rows)):
        frames = [carried(was[g, 0], edges) for edges in (was[g], now[g])]
        turns[g, 1:] = [(b * a.inv()).as_quat() for a, b in zip(*frames, strict=True)]
    roots = np.einsum("sk,skc->sc", body.weights, rows[:, 0][body.followed])
    hair = [roots + body.edges[:, 0]]
    for k in range(1, rows.shape[1]):
        q = turns[body.followed, k]
        along = np.einsum("skc,sc->sk", q, q[:, 0])
        t = np.clip((np.abs(along) - PARTED) / (TOGETHER - PARTED), 0, 1)
        share = body.weights * np.sign(along) * t * t * (3 - 2 * t)
        turn = Rotation.from_quat(np.einsum("sk,skc->sc", share, q))
        length = np.minimum(stretch[body.followed[:, 0], k - 1], MOST_STRETCH)
        hair.append(hair[-1] + length[:, None] * turn.apply(body.edges[:, k]))
    return np.stack(hair, axis=1).astype(np.float32)


def carried(start: np.ndarray, edges: np.ndarray) -> list[Rotation]:
    """Return a frame carried from a direction (3,) along segments (n, 3) by least rotations."""
    frames, frame, before = [], Rotation.identity(), start / np.linalg.norm(start)
    for edge in edges:
        way = edge / np.linalg.norm(edge)
        frame = Rotation.from_quat([*np.cross(before, way), 1 + before @ way]) * frame
        frames.append(frame)
        before = way
    return frames
