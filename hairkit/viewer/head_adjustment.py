"""Manual alignment of the head with the photos, and a reconstruction from that pose.

The cameras stay at the nominal turntable angles, where the scene plugin `manual` puts them; only
the head is moved. Its pose is saved in the capture's `capture.toml`.
"""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float32Array, Float64Array
from hairkit.cameras.similarity import fit_similarity
from hairkit.errors import InputError
from hairkit.io.capture_toml import head_entry, write_head_entry
from hairkit.manager import Manager
from hairkit.remote import is_url
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.head import Head
from hairkit.viewer.head_motion import AXES, rotation_about

PLUGIN = "manual"
"""The scene plugin that reads the pose."""
EDGE = 640
"""Long edge of the photos while the head is aligned, pixels."""
FITTED_VERTICES = 40
"""Vertices of the head, evenly spaced in their order, whose projections determine a pose."""
UNSEEN_MISFIT = 1e4
"""Misfit of a vertex that a camera cannot project, pixels: more than any visible one has."""


@dataclass(frozen=True)
class PreviousView:
    """Settings of a session before the alignment began; restored when it ends."""

    paused: bool
    photos: bool
    opacity: float
    through: str | None


@dataclass
class Adjustment:
    """A capture whose head is being aligned."""

    manager: Manager
    folder: Path
    """Folder of the capture."""
    capture: Capture
    head: Head
    pose: Float64Array
    """(4, 4) similarity, scene_from_head, metres."""
    before: PreviousView | None = None

    @classmethod
    def of(
        cls, manager: Manager, capture: Capture, head: Head, cameras: dict[str, Camera]
    ) -> Adjustment:
        """Return the alignment saved in capture.toml; without one, fit it to `cameras`.

        Raises `InputError` for a capture that is no folder on this machine.
        """
        folder, asked = capture.source, capture.asked or "these photos"
        if folder is None or not folder.is_dir() or is_url(asked):
            raise InputError(f"{asked}: no folder of photos, in which the pose could be saved")
        if capture.head_pose is not None:
            return cls(manager, folder, capture, head, capture.head_pose)
        start = cls(manager, folder, capture, head, np.eye(4))
        nominal = start.cameras()
        names = [name for name in nominal if name in cameras]
        if len(names) >= 3:
            found = [cameras[n].resized(nominal[n].width, nominal[n].height) for n in names]
            start.pose = _fit_pose(found, [nominal[n] for n in names], head.vertices)
        return start

    def cameras(self) -> dict[str, Camera]:
        """Return the photos' cameras in the head frame for the present pose."""
        capture = replace(self.capture, head_pose=self.pose)
        scene = self.manager.call(
            "estimate_scene", PLUGIN, None, capture=capture, masks=(), head=self.head, start=None
        )
        return dict(zip(scene.names, scene.cameras, strict=True))

    def move(self, camera: Camera, right: float, up: float, back: float) -> None:
        """Move the head by metres along the axes of a photo's camera."""
        steps = np.array([right, -up, -back])
        self.pose = self.pose.copy()
        linear = self.pose[:3, :3]  # with the scale, which steps in metres do not have
        self.pose[:3, 3] += linear @ camera.rotation.T @ steps / np.cbrt(np.linalg.det(linear))

    def turn(self, axis: str, degrees: float) -> None:
        """Rotate the head by degrees about one of its own axes, through its centre."""
        middle = self.head.vertices.mean(axis=0).astype(np.float64)
        self.pose = self.pose @ rotation_about(AXES[axis], float(np.radians(degrees)), middle)

    def grow(self, factor: float) -> None:
        """Scale the head about its centre."""
        middle = self.head.vertices.mean(axis=0).astype(np.float64)
        matrix = np.eye(4)
        matrix[:3, :3] *= factor
        matrix[:3, 3] = (1 - factor) * middle
        self.pose = self.pose @ matrix

    def save(self) -> Path:
        """Write the pose to capture.toml; return the path of that file."""
        path = self.folder / "capture.toml"
        write_head_entry(path, head_entry(self.pose))
        return path


def _fit_pose(found: list[Camera], nominal: list[Camera], vertices: Float32Array) -> Float64Array:
    """Return the pose (4, 4) whose projections by `nominal` cameras match those by `found` ones."""
    points = vertices[np.linspace(0, len(vertices) - 1, FITTED_VERTICES).astype(int)]
    points = points.astype(np.float64)
    wanted = np.stack([camera.project(points) for camera in found])
    rough = fit_similarity([c.position for c in found], [c.position for c in nominal])
    turn = Rotation.from_matrix(rough.rotation).as_rotvec()
    start = np.concatenate([[np.log(rough.scale)], turn, rough.translation])

    def pose(values: Float64Array) -> Float64Array:
        matrix = np.eye(4)
        matrix[:3, :3] = np.exp(values[0]) * Rotation.from_rotvec(values[1:4]).as_matrix()
        matrix[:3, 3] = values[4:]
        return matrix

    def misfit(values: Float64Array) -> Float64Array:
        matrix = pose(values)
        moved = points @ matrix[:3, :3].T + matrix[:3, 3]
        seen = np.stack([camera.project(moved) for camera in nominal])
        return np.nan_to_num((seen - wanted).ravel(), nan=UNSEEN_MISFIT)

    return pose(least_squares(misfit, start).x)


@dataclass
class Rerun:
    """A reconstruction in a child process."""

    process: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)
    """Lines of its standard error: one for each finished stage."""
    began: float = field(default_factory=time.monotonic)
    """Start time on the monotonic clock, seconds."""
    _listener: threading.Thread | None = None

    @classmethod
    def start(cls, capture: Path, results: Path, settings: tuple[str, ...]) -> Rerun:
        """Start to reconstruct a capture into a folder, with `stage=plugin` settings."""
        command = [sys.executable, "-m", "hairkit", "reconstruct", str(capture), "-o", str(results)]
        for setting in settings:
            command += ["--set", setting]
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace"
        )
        rerun = cls(process)
        rerun._listener = threading.Thread(target=rerun._listen, daemon=True)
        rerun._listener.start()
        return rerun

    @property
    def running(self) -> bool:
        """True until the process has ended."""
        return self.process.poll() is None

    @property
    def progress(self) -> str:
        """Elapsed seconds and the last line of output."""
        last = " ".join(self.lines[-1].split()) if self.lines else "starting"
        return f"{time.monotonic() - self.began:.0f} s; {last}"

    def wait(self) -> None:
        """Wait until the process has ended and all its output is read."""
        self.process.wait()
        if self._listener is not None:
            self._listener.join()

    def check(self) -> None:
        """Raise `InputError` if the process has failed."""
        if self.process.poll() not in (None, 0):
            last = self.lines[-1] if self.lines else "it printed no error"
            raise InputError(f"reconstruction failed: {last}")

    def stop(self) -> None:
        """Terminate the process; results of finished stages stay."""
        if self.running:
            self.process.terminate()
            self.process.wait(timeout=10)

    def _listen(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as said:
            self.lines.extend(line.strip() for line in said if line.strip())
