"""Settings of a groom as plain numbers, texts and lists, and back."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from hairkit.errors import DataError
from hairkit.io.plain_settings import capsules_of, made, plain_settings, ties_of
from hairkit.testing import bristle_groom
from hairkit.types.groom import HairMaterial, HairPhysics
from hairkit.types.tie import Tie


def test_settings_come_back_from_json() -> None:
    """Numbers to the last bit, texts as they are; what a file lacks has its default."""
    tie = Tie(np.array([0.0, 0.1, -0.1]), np.array([0.0, 0.0, -1.0]), 0.012, "braid")
    look = HairMaterial(np.array([0.1, 0.2, 0.3]), width=7e-5, curl_radius=0.01)
    groom = replace(bristle_groom(), ties=(tie,), material=look, physics=HairPhysics(0.3))
    settings = json.loads(json.dumps(plain_settings(groom)))
    assert plain_settings(
        replace(
            groom,
            ties=ties_of(settings),
            material=made(HairMaterial, settings["material"]),
            physics=made(HairPhysics, settings["physics"]),
            head=replace(groom.head, capsules=capsules_of(settings)),
        )
    ) == plain_settings(groom)
    assert made(HairPhysics, {"gravity": 1.5}).gravity == 1.5
    assert (ties_of({}), len(capsules_of({}).first)) == ((), 0)


@pytest.mark.parametrize("values", [{"width": -1}, {"root_colour": [1, 2]}, {"width": np.nan}])
def test_what_a_type_refuses_is_refused(values: dict[str, object]) -> None:
    """Settings of a wrong shape or range are an error, not a guess."""
    with pytest.raises(DataError):
        made(HairMaterial, values)


def test_landmarks_are_vertices_of_the_head() -> None:
    """Whichever file they are from."""
    head = bristle_groom().head
    with pytest.raises(DataError, match="landmark_vertices name vertices"):
        replace(head, landmark_vertices=np.full(68, len(head.vertices)))
