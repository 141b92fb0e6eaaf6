"""Settings of the simulator."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.options import option


@dataclass(frozen=True)
class Options:
    """Settings of the super-helix simulator."""

    elements: int = option(
        0, low=0, high=64, doc="Elements a guide; 0 takes as many as its shape needs, 8 to 32."
    )
    stiffness: float = option(
        4.0, low=0.0001, high=1000.0, doc="Times stiffer than one hair: guides stand for locks."
    )
    young: float = option(4.0, low=0.01, high=50.0, doc="Young's modulus of hair.", unit="GPa")
    diameter: float | None = option(
        None, low=10.0, high=500.0, doc="Of a hair; none takes the groom's width.", unit="um"
    )
    internal_friction: float = option(
        0.02, low=0.0, high=1.0, doc="Damping of changes of shape, as a time.", unit="s"
    )
    air_drag: float = option(
        3.0, low=0.0, high=100.0, doc="Rate at which hair takes on the air's speed.", unit="1/s"
    )
    friction: float | None = option(
        None, low=0.0, high=2.0, doc="Coulomb friction on the head; none takes the groom's."
    )
    hair_friction: float = option(
        4.0, low=0.0, high=200.0, doc="Rate of taking on the speed of hair around.", unit="1/s"
    )
    hair_push: float = option(
        4.0, low=0.0, high=100.0, doc="Push out of hair twice as dense as at rest.", unit="m/s2"
    )
    adhesion: float = option(
        200.0, low=0.0, high=1000.0, unit="1/s2", doc="Pull to where the hair beside has gone."
    )
    contact: bool = option(True, doc="Whether the head keeps hair out.")
    substeps: int = option(2, low=1, high=64, doc="Steps in a sixtieth of a second.")
    iterations: int = option(
        4, low=1, high=20, doc="Newton iterations a step at most; calm hair needs one."
    )
    second_order: bool = option(
        True, doc="BDF2, which keeps swings; false is Euler's step, which damps them."
    )
