"""Textures enlarged by sparse coding over two coupled dictionaries (Yang et al. 2010).

A patch of a small picture is written as a combination of few atoms of one dictionary; the same
combination of the other's atoms is its large, sharp twin. Steps:

1. pairs of patches from the example and from the example made small and large again; a small patch
   is described by its first and second derivatives (section III-C there), reduced to their
   principal components, its twin by what was lost;
2. both dictionaries are learned together (section IV): atoms by least squares for given
   coefficients (method of optimal directions, Engan et al. 1999), coefficients by orthogonal
   matching pursuit (Pati et al. 1993; Yang's l1 penalty chooses similar ones);
3. the large dictionary is fitted once more to the coefficients that the small one finds alone, as
   it will be used (Zeyde et al. 2012);
4. every patch of the enlarged texture is coded and gets its twin; overlaps are averaged;
5. back projection: made small again, the result must be the texture (section III-B).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hairkit.arrays import Float32Array
from hairkit.errors import InputError
from hairkit.hookspecs import hookimpl
from hairkit.io.textures import read_texture
from hairkit.options import option
from hairkit.types.skin import LARGEST_TEXTURE, Texture
from hairkit.types.texture_example import TextureExample

STEP = 2
"""Pixels from one patch to the next."""
KEPT_VARIANCE = 0.999
"""Share of the variance of derivatives that the principal components keep."""
BACK_PROJECTIONS = 10
"""Rounds of back projection; the remaining difference falls below one level of 8 bits."""
BAND = 16
"""Rows of patches that are coded at once, which bounds the memory."""
LEAST_ENERGY = 1e-4
"""Squared norm of a feature below which its patch is flat and gets no detail."""
_LAPLACE_OFFSETS = (1, 0, -2, 0, 1)
"""Second derivative over two pixels to either side, as Yang uses it."""
_RIDGE = 1e-6
"""Added to the diagonal of Gram matrices that may be singular."""


@dataclass(frozen=True)
class Options:
    """Settings of the super-resolution."""

    factor: int = option(2, low=2, high=4, doc="Enlargement of the texture.")
    patch: int = option(
        6, low=3, high=16, doc="Edge of a patch of the enlarged picture.", unit="px"
    )
    atoms: int = option(256, low=8, high=4096, doc="Atoms of each dictionary.")
    sparsity: int = option(3, low=1, high=16, doc="Atoms that describe one patch.")
    samples: int = option(20_000, low=100, high=1_000_000, doc="Patches to learn from, at most.")
    rounds: int = option(10, low=1, high=200, doc="Rounds of learning.")
    seed: int = option(0, low=0, doc="Of the choice of patches and of the first atoms.")
    close_up: Path | None = option(
        None, doc="Picture of sharp skin that the texture of a reconstruction is learned from."
    )


@dataclass(frozen=True, eq=False)
class Dictionaries:
    """Coupled dictionaries of K atoms."""

    components: Float32Array
    """(4 P, F) principal components of the derivatives of a patch of P pixels."""
    small: Float32Array
    """(F, K) unit atoms of small patches' features."""
    large: Float32Array
    """(P, K) atoms of the detail that belongs to them."""


@hookimpl
def enhance_texture(texture: Texture, example: TextureExample | None, options: Options) -> Texture:
    """Return the texture `factor` times as large, with detail like the example's."""
    sharp = _sharp(example, options)
    height, width, _ = texture.pixels.shape
    if height * width * options.factor**2 > LARGEST_TEXTURE:
        raise InputError(
            f"a texture of {width} x {height} pixels enlarged {options.factor} times has more than"
            f" {LARGEST_TEXTURE} pixels"
        )
    if min(height, width) * options.factor < options.patch:
        raise InputError(f"a texture of {width} x {height} pixels is smaller than a patch")
    learned = learn_dictionaries(sharp, options)
    colours = cv2.cvtColor(texture.pixels, cv2.COLOR_RGB2YCrCb)
    luminance = colours[..., 0].astype(np.float32) / np.float32(255)
    made = enlarge_luminance(luminance, learned, options)
    large = cv2.resize(colours, made.shape[::-1], interpolation=cv2.INTER_CUBIC)
    large[..., 0] = np.rint(255 * made.clip(0, 1)).astype(np.uint8)
    return Texture.encode(np.asarray(cv2.cvtColor(large, cv2.COLOR_YCrCb2RGB), np.uint8))


def _sharp(example: TextureExample | None, options: Options) -> Float32Array:
    """Return the luminance (H, W) of the example, of a size that the factor divides."""
    if example is not None:
        filtered = example.filtered
    elif options.close_up is not None:
        filtered = read_texture(options.close_up)
    else:
        raise InputError("super_resolution: no example; name a close-up of skin by close_up=FILE")
    grey = cv2.cvtColor(filtered.pixels, cv2.COLOR_RGB2GRAY).astype(np.float32) / np.float32(255)
    height, width = (n - n % options.factor for n in grey.shape)
    if min(height, width) < 4 * options.patch:
        raise InputError(
            f"the example has {grey.shape[1]} x {grey.shape[0]} pixels, too few for patches of"
            f" {options.patch} pixels; expected {4 * options.patch} at least"
        )
    return np.ascontiguousarray(grey[:height, :width])


def learn_dictionaries(sharp: Float32Array, options: Options) -> Dictionaries:
    """Return the dictionaries of a sharp picture (H, W), of values from 0 to 1."""
    blurred = _resize(_resize(sharp, 1 / options.factor), options.factor)
    rows = _starts(sharp.shape[0], options.patch)
    features = _features(_derivatives(blurred), options.patch, rows)
    lost = _patches(sharp - blurred, options.patch, rows)
    lively = np.flatnonzero((features**2).sum(axis=1) > LEAST_ENERGY)
    if len(lively) < options.atoms:
        raise InputError(
            f"the example has {len(lively)} patches with detail, too few for {options.atoms} atoms"
        )
    rng = np.random.default_rng(options.seed)
    chosen = rng.permutation(lively)[: options.samples]
    features, lost = features[chosen], lost[chosen]
    spread, vectors = np.linalg.eigh(features.T @ features)
    order = np.argsort(spread)[::-1]
    share = np.cumsum(spread[order]) / spread.sum()
    components = vectors[:, order[: int(np.searchsorted(share, KEPT_VARIANCE)) + 1]]
    reduced = features @ components
    # Both kinds of numbers have the same weight, whatever their count (equation 14).
    balance = np.sqrt((reduced**2).mean() / max(float((lost**2).mean()), 1e-12))
    joint = np.hstack([reduced / np.sqrt(reduced.shape[1]), balance * lost / options.patch])
    atoms = _learn(joint.astype(np.float32), options, rng)
    small = _unit(atoms[: reduced.shape[1]])
    codes = _codes(reduced, small, options.sparsity)
    gram = codes.T @ codes + _RIDGE * len(codes) * np.eye(options.atoms)
    large = np.linalg.solve(gram, codes.T @ lost).T
    return Dictionaries(
        components.astype(np.float32), small.astype(np.float32), large.astype(np.float32)
    )


def enlarge_luminance(small: Float32Array, learned: Dictionaries, options: Options) -> Float32Array:
    """Return a picture (h, w) enlarged by the factor, with the detail of the dictionaries."""
    smooth, edge = _resize(small, options.factor), options.patch
    derivatives, starts = _derivatives(smooth), _starts(smooth.shape[0], edge)
    total, count = np.zeros_like(smooth), np.zeros_like(smooth)
    for first in range(0, len(starts), BAND):
        rows = starts[first : first + BAND]
        features = _features(derivatives, edge, rows)
        detail = np.zeros((len(features), edge**2), np.float32)
        lively = (features**2).sum(axis=1) > LEAST_ENERGY
        codes = _codes(features[lively] @ learned.components, learned.small, options.sparsity)
        detail[lively] = codes @ learned.large.T
        _add_patches(detail, rows, edge, total, count)
    made = smooth + total / count
    for _ in range(BACK_PROJECTIONS):
        made += _resize(small - _resize(made, small.shape), made.shape)
    return made


def _learn(joint: Float32Array, options: Options, rng: np.random.Generator) -> Float32Array:
    """Return (D, K) unit atoms for data (N, D), by the method of optimal directions."""
    atoms = _unit(joint[rng.permutation(len(joint))[: options.atoms]].T)
    for _ in range(options.rounds):
        codes = _codes(joint, atoms, options.sparsity)
        gram = codes.T @ codes + _RIDGE * len(codes) * np.eye(options.atoms, dtype=np.float32)
        fitted = np.linalg.solve(gram, codes.T @ joint).T
        unused = (codes != 0).sum(axis=0) == 0
        fitted[:, unused] = joint[rng.permutation(len(joint))[: int(unused.sum())]].T
        atoms = _unit(fitted)
    return atoms


def _codes(data: Float32Array, atoms: Float32Array, sparsity: int) -> Float32Array:
    """Return coefficients (N, K) of data (N, D) over unit atoms (D, K), `sparsity` of them not 0.

    Orthogonal matching pursuit on all rows at once, by the atoms' Gram matrix (Rubinstein 2008).
    """
    gram, first = atoms.T @ atoms, data @ atoms
    rows = np.arange(len(data))
    chosen = np.zeros((len(data), 0), np.int64)
    left = first.copy()
    for _ in range(sparsity):
        chosen = np.column_stack([chosen, np.abs(left).argmax(axis=1)])
        matrix = gram[chosen[:, :, None], chosen[:, None]] + _RIDGE * np.eye(chosen.shape[1])
        wanted = np.take_along_axis(first, chosen, axis=1)
        values = np.linalg.solve(matrix, wanted[..., None])[..., 0]
        codes = np.zeros_like(first)
        codes[rows[:, None], chosen] = values
        left = first - codes @ gram
        np.put_along_axis(left, chosen, 0, axis=1)  # never twice the same
    return codes


def _derivatives(image: Float32Array) -> tuple[Float32Array, ...]:
    """Return the first and second derivatives of an image (H, W), both ways."""
    first = np.array([[-1, 0, 1]], np.float32)
    second = np.array([_LAPLACE_OFFSETS], np.float32) / 2
    return tuple(
        np.asarray(cv2.filter2D(image, cv2.CV_32F, f, borderType=cv2.BORDER_REFLECT), np.float32)
        for f in (first, first.T, second, second.T)
    )


def _features(derivatives: tuple[Float32Array, ...], patch: int, rows: list[int]) -> Float32Array:
    """Return (N, 4 P) the derivatives of the patches that start in some rows."""
    return np.hstack([_patches(image, patch, rows) for image in derivatives])


def _starts(length: int, patch: int) -> list[int]:
    """Return the first pixels of patches that cover a side, `STEP` apart, the last at its end."""
    return sorted({*range(0, length - patch + 1, STEP), length - patch})


def _patches(image: Float32Array, patch: int, rows: list[int]) -> Float32Array:
    """Return (N, P) the patches of an image (H, W) that start in some rows, row by row."""
    windows = np.lib.stride_tricks.sliding_window_view(image, (patch, patch))
    return windows[np.ix_(rows, _starts(image.shape[1], patch))].reshape(-1, patch * patch)


def _add_patches(
    patches: Float32Array, rows: list[int], patch: int, total: Float32Array, count: Float32Array
) -> None:
    """Add patches (N, P), as `_patches` takes them, to sums and numbers (H, W) of their pixels."""
    first, columns = np.array(rows), np.array(_starts(total.shape[1], patch))
    cells = patches.reshape(len(first), len(columns), patch, patch)
    for y in range(patch):
        for x in range(patch):
            total[np.ix_(first + y, columns + x)] += cells[:, :, y, x]
            count[np.ix_(first + y, columns + x)] += 1


def _unit(atoms: Float32Array) -> Float32Array:
    return np.asarray(atoms / np.maximum(np.linalg.norm(atoms, axis=0), 1e-9), np.float32)


def _resize(image: Float32Array, to: float | tuple[int, ...]) -> Float32Array:
    """Return an image made larger by cubic interpolation, or smaller by means over pixels."""
    shape = to if isinstance(to, tuple) else tuple(round(n * to) for n in image.shape)
    way = cv2.INTER_CUBIC if shape[0] > image.shape[0] else cv2.INTER_AREA
    return np.asarray(cv2.resize(image, shape[::-1], interpolation=way), np.float32)
