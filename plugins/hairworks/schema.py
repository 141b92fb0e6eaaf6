"""Schema of HairWorks 1.1 .apx files: classes, checksums, fields, types and defaults.

Read from files that NVIDIA's tools wrote; order, names (odd capitals included) and checksums are
part of the format.
"""

from __future__ import annotations

from dataclasses import dataclass

VERSION = "1.1"
READABLE_VERSIONS = ("1.1", "1.2")
DOCTYPE = "NvParameters"
NO_BONE = 0xFFFFFFFF
NO_BONE_TEXT = "NV_MAX_U32"

CHECKSUMS = {
    "HairWorksInfo": "0xd225a2e5 0x1295b170 0x7b7dfeef 0x7230aea",
    "HairSceneDescriptor": "0x299b335f 0x2cad8b54 0xcaf3c98f 0xa3094fa7",
    "HairAssetDescriptor": "0xce296058 0xc3539e0a 0x34d9e87f 0xd878cd3",
    "HairInstanceDescriptor": "0x4998e6df 0xd4ef511d 0x91f15d9d 0x29c4b445",
}
"""The four classes in file order and the checksums of their fields in version 1.1."""

INFO_FIELDS = ("fileVersion", "toolVersion", "sourcePath", "authorName", "lastModified")

UNSET_TEXTURES = ("rootWidthTexture", "tipWidthTexture", "clumpNoiseTexture")
"""Textures that NVIDIA's files mark `null`."""
TEXTURES = (
    "densityTexture",
    "rootColorTexture",
    "tipColorTexture",
    "widthTexture",
    "rootWidthTexture",
    "tipWidthTexture",
    "stiffnessTexture",
    "rootStiffnessTexture",
    "clumpScaleTexture",
    "clumpRoundnessTexture",
    "clumpNoiseTexture",
    "waveScaletexture",
    "waveFreqTexture",
    "strandTexture",
    "lengthTexture",
    "specularTexture",
)

COMPONENTS = {"U8": 1, "U32": 1, "I32": 1, "F32": 1, "Vec2": 2, "Vec3": 3, "Vec4": 4, "Mat44": 16}
"""Numbers in one element of each type."""
SPHERE_ELEMENTS = "boneSphereIndex(I32),boneSphereRadius(F32),boneSphereLocalPos(Vec3)"
SPHERE_NUMBERS = 5

MATERIALS = 4
"""HairWorks fills four slots whether the file has them or not, and writes past its array if not."""
HAIRS_PER_FACE = 64
"""Hairs on each face of the growth mesh at density 1."""
MAX_STRING = 127


@dataclass(frozen=True)
class Field:
    """One value of a material."""

    name: str
    type: str
    """`U32`, `F32`, `Bool`, `Vec3`, `Vec4` or `String`."""
    default: str
    """As the file writes it."""


_MATERIAL = """
name String; densityTextureChan U32 0; widthTextureChan U32 0; rootWidthTextureChan U32 0;
tipWidthTextureChan U32 0; clumpScaleTextureChan U32 0; clumpNoiseTextureChan U32 0;
clumpRoundnessTextureChan U32 0; waveScaleTextureChan U32 0; waveFreqTextureChan U32 0;
lengthTextureChan U32 0; stiffnessTextureChan U32 0; rootStiffnessTextureChan U32 0;
splineMultiplier U32 4; width F32 1; widthNoise F32 0; clumpNoise F32 0; clumpNumSubclumps U32
0; clumpRoundness F32 1; clumpScale F32 0; clumpPerVertex Bool true; density F32 1; lengthNoise
F32 1; lengthScale F32 1; widthRootScale F32 1; widthTipScale F32 0.1; waveRootStraighten F32 0;
waveScale F32 0; waveScaleNoise F32 0.5; waveFreq F32 3; waveFreqNoise F32 0.5; waveScaleStrand
F32 1; waveScaleClump F32 0; enableDistanceLOD Bool true; distanceLODStart F32 5; distanceLODEnd
F32 10; distanceLODFadeStart F32 1000; distanceLODDensity F32 0; distanceLODWidth F32 1;
enableDetailLOD Bool true; detailLODStart F32 2; detailLODEnd F32 1; detailLODDensity F32 1;
detailLODWidth F32 1; colorizeLODOption U32 0; useViewfrustrumCulling Bool true;
useBackfaceCulling Bool false; backfaceCullingThreshold F32 -0.2; usePixelDensity Bool false;
alpha F32 0; strandBlendScale F32 1; baseColor Vec4 0 0 0 0; diffuseBlend F32 0.5; diffuseScale
F32 1; diffuseHairNormalWeight F32 0; diffuseBoneIndex U32 NV_MAX_U32; diffuseBoneLocalPos Vec3
0 0 0; diffuseNoiseFreqU F32 64; diffuseNoiseFreqV F32 64; diffuseNoiseScale F32 0;
diffuseNoiseGain F32 0; textureBrightness F32 1; diffuseColor Vec4 0 0 0 0; rootColor Vec4 1 1 1
1; tipColor Vec4 1 1 1 1; glintStrength F32 0; glintCount F32 256; glintExponent F32 2;
rootAlphaFalloff F32 0; rootTipColorWeight F32 0.5; rootTipColorFalloff F32 1; shadowSigma F32
0.2; specularColor Vec4 1 1 1 1; specularPrimary F32 0.1; specularNoiseScale F32 0;
specularEnvScale F32 0.25; specularPrimaryBreakup F32 0; specularSecondary F32 0.05;
specularSecondaryOffset F32 0.1; specularPowerPrimary F32 100; specularPowerSecondary F32 20;
strandBlendMode U32 0; useTextures Bool true; useShadows Bool false; shadowDensityScale F32 0.5;
castShadows Bool true; receiveShadows Bool true; backStopRadius F32 0; bendStiffness F32 0;
interactionStiffness F32 0; pinStiffness F32 1; collisionOffset F32 0; useCollision Bool false;
useDynamicPin Bool false; damping F32 0; friction F32 0; massScale F32 10; gravity Vec3 0 0 -1;
inertiaScale F32 0; inertiaLimit F32 0; rootStiffness F32 0.5; tipStiffness F32 0; simulate Bool
true; stiffness F32 0.5; stiffnessStrength F32 1; stiffnessDamping F32 0; stiffnessCurve Vec4 1
1 1 1; stiffnessStrengthCurve Vec4 1 1 1 1; stiffnessDampingCurve Vec4 1 1 1 1;
bendStiffnessCurve Vec4 1 1 1 1; interactionStiffnessCurve Vec4 1 1 1 1; wind Vec3 0 0 0;
windNoise F32 0; visualizeBones Bool false; visualizeBoundingBox Bool false; visualizeCapsules
Bool false; visualizeControlVertices Bool false; visualizeCullSphere Bool false;
visualizeDiffuseBone Bool false; visualizeFrames Bool false; visualizeGrowthMesh Bool false;
visualizeGuideHairs Bool false; visualizeHairInteractions Bool false; visualizeHairSkips U32 0;
visualizeLocalPos Bool false; visualizePinConstraints Bool false; visualizeShadingNormals Bool
false; visualizeSkinnedGuideHairs Bool false; drawRenderHairs Bool true; enable Bool true
"""

MATERIAL_FIELDS = tuple(
    Field(name, kind, " ".join(default))
    for name, kind, *default in (entry.split() for entry in _MATERIAL.split(";"))
)
"""The 130 values of a material in file order, with the SDK's defaults."""
