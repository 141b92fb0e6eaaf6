"""Hair and pairs of simulators for the tests of the compute backend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods import Options
from hairkit_plugins.rods.simulator import RodSimulator
from rods_reference import TwinSimulator

from hairkit.errors import RenderError
from hairkit.rendering.context import renderer
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

AGREE = 2e-5
"""Metres by which float32 shaders may differ from the float64 reference in these tests."""
SHAKE, STILL_AIR, WIND = ["yaw:25:2", "pitch:10:1.3"], np.zeros(3), np.array([3.0, 0.0, 1.0])


def skip_without_shaders() -> None:
    """Skip the test where no OpenGL 4.3 is."""
    try:
        with renderer():
            pass
    except RenderError as error:
        pytest.skip(str(error))


def bent_groom() -> Groom:
    """Return 20 bent strands of 6 to 14 cm, of 5 to 24 points, on the ball head."""
    ball = bristle_groom()
    pick = np.linspace(0, len(ball.strands) - 1, 20).astype(int)
    strands = []
    for k, root in enumerate(ball.strands.roots[pick].astype(np.float64)):
        way, s = root / np.linalg.norm(root), np.linspace(0, 0.06 + 0.004 * k, 5 + k)[:, None]
        wave = 0.003 * np.sin(40 * s) * np.cross(way, [0.3, 0.2, 0.9])
        strands.append(root + way * s - [0.0, 3.0, 0.0] * s**2 + wave)
    return replace(
        ball,
        strands=Strands.from_list(strands),
        root_triangle=ball.root_triangle[pick],
        root_barycentric=ball.root_barycentric[pick],
    )


def both(groom: Groom, **options: object) -> tuple[RodSimulator, RodSimulator]:
    """Return the reference and the shaders, at rest."""
    settings = Options(**{"backend": "compute", "nodes": 8, **options})
    return TwinSimulator(groom, settings), RodSimulator(groom, settings)


def apart(pair: tuple[RodSimulator, RodSimulator]) -> float:
    """Return the largest distance between their points."""
    return float(np.abs(pair[0].points - pair[1].points).max())
