"""The simplest method for every hook, from which `hairkit new-plugin` writes a module."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Sketch:
    """The simplest method that fulfils a stage's contract, in pieces of source text."""

    summary: str
    option: str
    """Empty for a hook without options."""
    body: str
    before: str = ""
    """Code between the imports and the options."""


SKETCHES = {
    "capture": Sketch(
        "Captures of an archive, by the names of their folders.",
        'archive: str = option("", doc="Folder of the archive.")',
        """
folder = Path(options.archive) / source
return read_folder(folder, max_edge) if folder.is_dir() else None""",
    ),
    "detect_landmarks": Sketch(
        "A face in the middle of the photo, seen from in front.",
        'noise: float = option(50.0, low=1.0, high=500.0, doc="Of each landmark.", unit="px")',
        """
middle = np.tile([view.width / 2, view.height / 2], (LANDMARKS, 1))
return Face(0.5, middle, np.full(LANDMARKS, options.noise), 0.0, 0.0, 0.0)""",
    ),
    "segment_person": Sketch(
        "All that differs from the picture's upper corner is the person.",
        'gain: float = option(4.0, low=0.1, high=100.0, doc="Opacity for a grey level.")',
        """
difference = np.abs(view.image.astype(np.float32) - view.image[0, 0]).mean(axis=-1)
return Person(np.clip(options.gain * difference, 0, 255).astype(np.uint8))""",
    ),
    "find_turn": Sketch(
        "Photos in file order, evenly around the head.",
        'step: float = option(45.0, low=-180.0, high=180.0, doc="To the next.", unit="deg")',
        """
index = np.arange(len(capture.views))
names = tuple(view.name for view in capture.views)
azimuth, level = options.step * index % 360, np.zeros(len(index))
return Turnaround(index, azimuth, level, names, np.inf, "turn as numbered")""",
    ),
    "segment": Sketch(
        "Everything dark is hair.",
        'threshold: int = option(90, low=1, high=254, doc="Darker pixels are hair.")',
        """
dark = view.image.mean(axis=-1) < options.threshold
labels = np.where(dark, HAIR, 0).astype(np.uint8)
return Mask(labels, person_known=False) if dark.any() else None""",
    ),
    "estimate_scene": Sketch(
        "The nominal turn: every camera where the capture says, all at one distance.",
        'distance: float = option(0.8, low=0.3, high=5.0, doc="From the head.", unit="m")',
        """
cameras = tuple(
    Camera.on_turn(
        view.azimuth_deg,
        distance=options.distance,
        focal=view.focal_px or 1.3 * view.height,
        width=view.width,
        height=view.height,
    )
    for view in capture.views
)
return Scene(tuple(view.name for view in capture.views), cameras, head)""",
    ),
    "refine_masks": Sketch(
        "Take specks off the hair.",
        'radius: int = option(1, low=0, high=50, doc="Of the specks.", unit="px")',
        """
refined = []
for mask in masks:
    size = 2 * options.radius + 1
    opened = cv2.morphologyEx(mask.labels, cv2.MORPH_OPEN, np.ones((size, size), np.uint8))
    labels = np.where((mask.labels == HAIR) & (opened != HAIR), np.uint8(PERSON), mask.labels)
    refined.append(Mask(labels, mask.person_known) if (labels == HAIR).any() else mask)
return Masks(tuple(refined))""",
    ),
    "fit_head": Sketch(
        "Scale the head about its centre.",
        'scale: float = option(1.0, low=0.5, high=2.0, doc="Factor on the head\'s size.")',
        """
head = replace(scene.head, vertices=scene.head.vertices * options.scale)
return replace(scene, head=head)""",
    ),
    "enhance_texture": Sketch(
        "More contrast.",
        'gain: float = option(1.2, low=0.1, high=10.0, doc="Of the contrast.")',
        """
pixels = texture.pixels.astype(np.float32)
mean = pixels.mean(axis=(0, 1))
stronger = np.clip(mean + options.gain * (pixels - mean), 0, 255)
return Texture.encode(np.rint(stronger).astype(np.uint8))""",
    ),
    "orient": Sketch(
        "Strands run across the gradient of brightness.",
        'sigma: float = option(2.0, low=0.5, high=20.0, doc="Blur before.", unit="px")',
        """
grey = cv2.cvtColor(view.image, cv2.COLOR_RGB2GRAY).astype(np.float32)
grey = cv2.GaussianBlur(grey, (0, 0), options.sigma)
across_x, across_y = cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)
strength = np.hypot(across_x, across_y) * mask.hair
angle = np.arctan2(across_y, across_x) + np.pi / 2  # along the strand
return OrientationMap(wrap_angle(angle), strength / max(float(strength.max()), 1e-6))""",
    ),
    "build_hull": Sketch(
        "Cells outside the head that enough views see as hair.",
        'votes: int = option(4, low=1, high=8, doc="Views that must see hair.")',
        """
head = scene.head
grid = VoxelGrid.around(head.vertices.min(axis=0) - 0.1, head.vertices.max(axis=0) + 0.1, 0.01)
centres = grid.centres().astype(np.float64)
votes = np.zeros(grid.shape, int)
for camera, mask in zip(scene.cameras, masks, strict=True):
    x, y = np.moveaxis(np.nan_to_num(np.floor(camera.project(centres)), nan=-1), -1, 0)
    inside = (x >= 0) & (y >= 0) & (x < camera.width) & (y < camera.height)
    votes[inside] += mask.hair[y[inside].astype(int), x[inside].astype(int)]
_, nearest = cKDTree(head.vertices).query(centres)
out = centres - head.vertices[nearest]  # signed by the nearest vertex's normal
distance = np.einsum("xyzc,xyzc->xyz", out, head.normals()[nearest]).astype(np.float32)
hair = (votes >= options.votes) & (distance > 0)
return Hull(grid, hair, hair, distance)""",
    ),
    "solve_field": Sketch(
        "All hair hangs straight down.",
        'confidence: float = option(1.0, low=0.0, high=1.0, doc="Given to every cell.")',
        """
tensor = np.zeros((*hull.grid.shape, 6), np.float32)
tensor[..., 1] = hull.loose  # yy: along the vertical
confidence = (options.confidence * hull.loose).astype(np.float32)
return OrientationField(hull.grid, tensor, confidence, np.maximum(hull.head_distance, 0))""",
    ),
    "track": Sketch(
        "Straight bristles along the scalp's normals.",
        'length: float = option(0.05, low=0.001, high=1.0, doc="Of a strand.", unit="m")',
        """
along = np.linspace(0.0, options.length, 10, dtype=np.float32)[None, :, None]
points = roots.positions[:, None] + along * roots.normals[:, None]
offsets = np.arange(len(roots) + 1) * 10
return Strands(points.reshape(-1, 3), offsets, root_uv=roots.uv)""",
    ),
    "edit_groom": Sketch(
        "Strokes of hairkit's brushes, and of one that lets hair sink.",
        'drop: float = option(0.01, low=0.0, high=1.0, doc="Of the brush sink.", unit="m")',
        """
def sink(hair, strokes):
    for stroke in strokes:
        reach = stroke.amount * stroke.reach(hair.points)[0]
        hair.move(-reach[..., None] * np.array([0.0, 1.0, 0.0]))


every = brushes.BRUSHES | {"sink": brushes.Kind(sink, options.drop)}
return brushes.edit_groom(groom, edits, every)""",
    ),
    "make_simulator": Sketch(
        "Hair that goes rigidly with the head.",
        'sink: float = option(0.0, low=0.0, high=1.0, doc="Speed of falling.", unit="m/s")',
        "return Rigid(groom, options)",
        before='''

class Rigid:
    """Guides fixed to the head: every member that hairkit.simulation.Simulator asks for."""

    def __init__(self, groom: Groom, options: Options) -> None:
        self.strands = groom.strands
        self.options = options
        self.reset()

    def reset(self, head_from_rest: np.ndarray | None = None) -> None:
        """Put the guides at rest on the head."""
        self.time = 0.0
        self._move(np.eye(4) if head_from_rest is None else np.asarray(head_from_rest))

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Go on by some seconds; replace this by your method."""
        self.time += seconds
        self._move(surroundings.head_from_rest)

    def retune(self, options: Options) -> None:
        """Take other options; the positions stay."""
        self.options = options

    def measure(self) -> Measures:
        """Return stretch and energies of the present state."""
        return Measures(stretch=0.0, kinetic_energy=0.0, potential_energy=0.0)

    def _move(self, head: np.ndarray) -> None:
        down = np.array([0.0, -self.options.sink * self.time, 0.0])
        moved = self.strands.points @ head[:3, :3].T + head[:3, 3] + down
        self.points = moved.astype(np.float32)
''',
    ),
    "export_groom": Sketch(
        "One text line a point: strand, x, y, z.",
        'digits: int = option(6, low=1, high=9, doc="Decimals of a coordinate in metres.")',
        """
strand = np.repeat(np.arange(len(groom.strands)), groom.strands.counts)
rows = zip(strand, groom.strands.points.tolist(), strict=True)
lines = (f"{s} " + " ".join(f"{c:.{options.digits}f}" for c in point) for s, point in rows)
write_text(path, "\\n".join(lines) + "\\n")
return True""",
        before="""
FORMAT = FileFormat(
    "NAME",
    (".NAME",),
    written=frozenset({Feature.POINTS, Feature.COUNTS}),
)
""",
    ),
    "import_groom": Sketch(
        "Read the native form and thin it out.",
        'every: int = option(1, low=1, high=1000, doc="Keep one strand of so many.")',
        """
groom = Groom.load(path)
keep = range(0, len(groom.strands), options.every)
return replace(
    groom,
    strands=groom.strands.select(list(keep)),
    root_triangle=groom.root_triangle[list(keep)],
    root_barycentric=groom.root_barycentric[list(keep)],
)""",
        before="""
FORMAT = FileFormat(
    "NAME",
    (".NAME",),
    partial={Feature.POINTS: "one strand of `every`"},
)
""",
    ),
    "validate_groom": Sketch(
        "Strands must be shorter than the studio's longest wig.",
        "",
        """
longest = float(groom.strands.lengths().max())
said = f"the longest strand has {longest:.2f} m, expected {LONGEST}"
return [Finding.of("wig-length", longest <= LONGEST, said)]""",
        before="\nLONGEST = 0.8\n",
    ),
    "stage_finished": Sketch(
        "Tells when stages end.", "", 'print(f"{stage} took {seconds:.2f} s", file=sys.stderr)'
    ),
    "groom_ready": Sketch(
        "Tells how much hair a run has made.",
        "",
        'print(f"{len(groom.strands)} strands", file=sys.stderr)',
    ),
}
"""The method of each hook."""
