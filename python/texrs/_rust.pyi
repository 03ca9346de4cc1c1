from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias, final

from numpy import bool_, float32, float64, int16, int32, int64, uint8, uint16, uint32
from numpy.typing import NDArray

__all__ = [
    "VERSION",
    "Appearance",
    "Cholesky",
    "Correlation",
    "PatchIndex",
    "PatchSamples",
    "Stitcher",
    "choose_disjoint",
    "cohere",
    "complete",
    "contour_strength",
    "decode_image",
    "encode_image",
    "exif_orientation",
    "gather",
    "jitter",
    "mean_shift",
    "measure_regions",
    "merge_regions",
    "outlines",
    "philox",
    "place",
    "poisson",
    "poisson_spread",
    "quilt",
    "reconstruct",
    "refine_outlines",
    "region_adjacency",
    "region_candidates",
    "seam_cut",
    "seam_labels",
    "seam_strips",
    "set_threads",
    "similar",
    "smooth",
    "sum_nearby",
    "sum_regions",
    "uniform",
    "upsample",
    "warp_mesh",
    "warp_points",
    "watershed_regions",
]

VERSION: Final[str]

_Pasting: TypeAlias = tuple[tuple[int, ...], NDArray[uint32], NDArray[float32], NDArray[bool_], NDArray[bool_]]

_Window: TypeAlias = Sequence[Sequence[int]]

def set_threads(threads: int) -> int: ...
def philox(counter: tuple[int, int, int, int] | Sequence[int], key: tuple[int, int] | Sequence[int]) -> list[int]: ...
def uniform(seed: int, position: Sequence[int]) -> float: ...
def gather(
    exemplars: Sequence[NDArray[Any]],
    wrap: Sequence[bool],
    which: NDArray[uint16],
    coordinates: NDArray[float32],
    interpolation: str,
) -> NDArray[Any]: ...
def outlines(
    labels: NDArray[int32], windows: Sequence[tuple[int, Sequence[int], Sequence[int]]]
) -> list[NDArray[float32] | None]: ...
def smooth(
    values: NDArray[float32] | NDArray[float64], shape: Sequence[int], axes: Sequence[tuple[Sequence[float], str]]
) -> NDArray[Any]: ...
def sum_nearby(
    points: NDArray[int64], values: NDArray[float32], shape: Sequence[int], cyclic: bool, window: Sequence[float]
) -> NDArray[float32]: ...
def place(
    distance: NDArray[float32],
    origin: Sequence[float],
    centre: Sequence[float],
    matrix: Sequence[Sequence[float]],
    shift: Sequence[float],
    canvas: Sequence[int],
    depth: float,
) -> (
    tuple[
        list[int],
        list[int],
        NDArray[float32],
        NDArray[float32],
        NDArray[bool_],
        NDArray[bool_],
        int,
        list[list[float]],
    ]
    | None
): ...

@final
class Correlation:
    def __new__(cls, image: NDArray[float32]) -> Correlation: ...
    def maps(self, template: NDArray[float32]) -> NDArray[float32]: ...

@final
class PatchIndex:
    def __new__(
        cls,
        exemplars: Sequence[NDArray[float32]],
        allowed: Sequence[NDArray[bool_] | None],
        max_patch: tuple[int, int],
    ) -> PatchIndex: ...
    def again(self, allowed: Sequence[NDArray[bool_] | None], max_patch: tuple[int, int]) -> PatchIndex: ...
    @property
    def max_patch(self) -> list[int]: ...
    def best(
        self,
        patch: NDArray[float32],
        weight: NDArray[float32],
        count: int,
        separation: int,
        ratio: float,
    ) -> list[tuple[float, int, int, int]]: ...
    def best_among(
        self,
        patch: NDArray[float32],
        weight: NDArray[float32],
        candidates: Sequence[tuple[int, int, int]],
        count: int,
        separation: int,
        ratio: float,
    ) -> list[tuple[float, int, int, int]]: ...
    def cost_map(
        self, patch: NDArray[float32], weight: NDArray[float32], exemplar: int
    ) -> tuple[NDArray[float32], float]: ...

def complete(
    colours: NDArray[float32],
    known: NDArray[bool_],
    keep: NDArray[bool_] | None,
    index: PatchIndex,
    wrap: Sequence[bool],
    patch: Sequence[int],
    pick: tuple[int, int, float],
    seed: int,
    paper: bool,
    shown: int | None,
    lattice: Sequence[Sequence[float]] | None,
    progress: Callable[[float], object] | None,
) -> tuple[NDArray[float32], NDArray[int32], NDArray[int64]]: ...
def decode_image(name: str, file: bytes, limit: int) -> tuple[NDArray[uint8], str, tuple[int, int, int], int]: ...
def encode_image(
    name: str,
    format: str,
    sample: str,
    shape: tuple[int, int, int],
    pixels: NDArray[uint8],
) -> NDArray[uint8]: ...
def exif_orientation(exif: bytes) -> int: ...
def poisson(
    image: NDArray[float32],
    gradients: tuple[NDArray[float32], NDArray[float32]] | None,
    screening: float,
    edges: tuple[str, str],
    mask: NDArray[bool_] | None,
    progress: Callable[[float], object] | None,
) -> NDArray[float32]: ...
def poisson_spread(
    flow: NDArray[float32],
    screening: float,
    edges: tuple[str, str],
    mask: NDArray[bool_] | None,
    progress: Callable[[float], object] | None,
) -> None: ...
def mean_shift(
    image: NDArray[float32],
    radius: int,
    range: float,
    max_iterations: int,
    tolerance: float,
    wrap: Sequence[bool],
    progress: Callable[[float], object] | None,
) -> NDArray[float32]: ...
def merge_regions(
    image: NDArray[float32],
    scale: float,
    blur: float,
    least: int,
    wrap: Sequence[bool],
    progress: Callable[[float], object] | None,
) -> NDArray[int32]: ...
def quilt(
    pictures: Sequence[tuple[NDArray[float32], Sequence[Sequence[float]] | None, Sequence[float]]],
    pixels: tuple[NDArray[uint16], NDArray[float32], NDArray[bool_], NDArray[uint32]],
    samples: PatchSamples,
    options: tuple[Sequence[int], Sequence[bool], Sequence[int], bool, int | None],
    first: tuple[_Window, int, Sequence[int]],
    waves: Sequence[Sequence[_Window]],
    progress: Callable[[float], object] | None,
) -> tuple[NDArray[uint32], NDArray[uint32]]: ...
def reconstruct(seed: NDArray[float32], mask: NDArray[float32], wrap: Sequence[bool]) -> NDArray[float32]: ...
def contour_strength(labels: NDArray[uint8], count: int, sigma: float) -> NDArray[float32]: ...
def watershed_regions(height: NDArray[float32], reach: int) -> tuple[NDArray[uint32], int]: ...
def region_adjacency(
    labels: NDArray[uint32], strength: NDArray[float32], count: int, weak: float
) -> tuple[NDArray[uint32], NDArray[float64], NDArray[float32]]: ...
def region_candidates(
    area: NDArray[float64],
    mean: NDArray[float64],
    pairs: NDArray[uint32],
    arcs: NDArray[float64],
    open: NDArray[bool_],
    costs: Sequence[Sequence[float]],
    least: float,
    most: float,
) -> tuple[NDArray[int64], NDArray[uint32], NDArray[float64]]: ...
def measure_regions(
    starts: NDArray[int64],
    members: NDArray[uint32],
    pairs: NDArray[uint32],
    arcs: NDArray[float64],
    histograms: NDArray[float32],
    extremes: NDArray[float32],
) -> NDArray[float64]: ...
def sum_regions(starts: NDArray[int64], members: NDArray[uint32], values: NDArray[float64]) -> NDArray[float64]: ...
def choose_disjoint(
    starts: NDArray[int64],
    members: NDArray[uint32],
    worth: NDArray[float64],
    quality: NDArray[float64],
    rounds: int,
) -> NDArray[bool_]: ...
def refine_outlines(
    labels: NDArray[int32], inside: NDArray[float32], price: NDArray[float32], pull: float, reach: Sequence[int]
) -> NDArray[int32]: ...
def seam_cut(
    a: NDArray[float32],
    b: NDArray[float32],
    mask_a: NDArray[bool_],
    mask_b: NDArray[bool_],
    core_a: NDArray[bool_] | None,
    core_b: NDArray[bool_] | None,
    penalty: NDArray[float32] | None,
    old: Sequence[Sequence[NDArray[float32]]] | None,
    cost: str,
    wrap: Sequence[bool],
) -> tuple[NDArray[bool_], float, int]: ...
def seam_strips(
    strips: Sequence[tuple[NDArray[float32], NDArray[float32], int, NDArray[float32] | None]],
    cyclic: bool,
    cost: str,
) -> list[tuple[NDArray[bool_], float, int]]: ...
def seam_labels(
    unary: NDArray[float32],
    forward: Sequence[NDArray[float32]],
    backward: Sequence[NDArray[float32]],
    wrap: Sequence[bool],
) -> tuple[NDArray[bool_], float]: ...

@final
class Stitcher:
    def __new__(
        cls,
        colours: NDArray[float32],
        shape: Sequence[int],
        wrap: Sequence[bool],
        labels: NDArray[uint32],
        depth: NDArray[float32],
        classes: NDArray[uint8],
        costs: NDArray[float32],
    ) -> Stitcher: ...
    def stitch(
        self,
        place: tuple[Sequence[int], Sequence[int], Sequence[bool]],
        jacobians: NDArray[int16],
        patch: tuple[float, float, int, float, bool, bool],
        weights: Sequence[float],
        charges: Sequence[float],
        seed: int,
        held: NDArray[bool_],
        given: NDArray[int32],
        loose: NDArray[bool_],
        demand: tuple[NDArray[int16], NDArray[int16], NDArray[uint16], NDArray[uint32], int] | None,
        lattice: list[list[float]] | None,
        progress: Callable[[float], object] | None,
    ) -> tuple[NDArray[int32], NDArray[uint32], NDArray[int16], float, int]: ...
    def judge(
        self,
        place: tuple[Sequence[int], Sequence[int], Sequence[bool]],
        places: NDArray[int32],
        patches: NDArray[uint32],
        weights: Sequence[float],
    ) -> NDArray[float32]: ...
    def cover(
        self,
        place: tuple[Sequence[int], Sequence[int], Sequence[bool]],
        jacobians: NDArray[int16],
        shown: tuple[NDArray[int32], NDArray[uint32], NDArray[float32], NDArray[float32], NDArray[int32]],
        patch: tuple[float, float, int, float, bool, bool],
        weights: Sequence[float],
        charges: Sequence[float],
        progress: Callable[[float], object] | None,
    ) -> tuple[NDArray[int32], NDArray[uint32], NDArray[float32], NDArray[float32], NDArray[int32]]: ...

@final
class PatchSamples:
    def __new__(
        cls, colours: NDArray[float32], depth: NDArray[float32], weights: tuple[float, float]
    ) -> PatchSamples: ...
    def judge(self, window: _Pasting, patches: NDArray[uint32]) -> list[float]: ...
    def cut(self, window: _Pasting, patch: NDArray[uint32]) -> tuple[NDArray[bool_], NDArray[float32]]: ...

@final
class Appearance:
    def __new__(
        cls, colours: NDArray[float32], shape: Sequence[int], wrap: Sequence[bool], radius: int
    ) -> Appearance: ...
    @property
    def shape(self) -> list[int]: ...
    @property
    def wrap(self) -> list[bool]: ...
    @property
    def radius(self) -> int: ...
    @property
    def channels(self) -> int: ...
    @property
    def spacing(self) -> float: ...
    def parts(self) -> tuple[NDArray[int16], NDArray[int16], NDArray[int16], NDArray[int64], int, int]: ...
    @staticmethod
    def from_parts(
        shape: Sequence[int],
        wrap: Sequence[bool],
        radius: int,
        channels: int,
        colours: NDArray[int16],
        features: NDArray[int16],
        basis: NDArray[int16],
        bias: NDArray[int64],
        gain: int,
        spacing: int,
    ) -> Appearance: ...
    def blocks(
        self,
        place: tuple[Sequence[int], Sequence[int], Sequence[bool]],
        frames: NDArray[int16],
        cell: int,
        rounds: int,
        candidates: int,
        contrast: float,
        continuation: float,
        repetition: float,
        seed: int,
        margin: int,
        held: NDArray[bool_],
        given: NDArray[int32],
        guide: tuple[NDArray[int16], NDArray[int16], NDArray[uint16], NDArray[uint32], int] | None,
        progress: Callable[[float], object] | None,
    ) -> NDArray[int32]: ...
    def correct(
        self,
        places: NDArray[int32],
        place: tuple[Sequence[int], Sequence[int], Sequence[bool]],
        frames: NDArray[int16],
        held: NDArray[bool_],
        passes: int,
        first: int,
        exhaustive: bool,
        reach: int,
        acceptance: float,
        coherence: float,
        vote: int,
        settled: float,
        seed: int,
        guide: tuple[NDArray[int16], NDArray[int16], NDArray[uint16], NDArray[uint32], int] | None,
        progress: Callable[[float], object] | None,
    ) -> tuple[int, float]: ...

def upsample(
    parents: NDArray[int32],
    from_: tuple[Sequence[int], Sequence[int], Sequence[bool]],
    to: tuple[Sequence[int], Sequence[int], Sequence[bool]],
    frames: NDArray[int16],
) -> NDArray[int32]: ...
def similar(
    appearance: Appearance, k: int, n: int, numbers: int, progress: Callable[[float], object] | None
) -> NDArray[uint32]: ...
def cohere(
    appearance: Appearance,
    sets: NDArray[uint32],
    k: int,
    places: NDArray[int32],
    place: tuple[Sequence[int], Sequence[int], Sequence[bool]],
    frames: NDArray[int16],
    held: NDArray[bool_],
    kinds: tuple[NDArray[uint8], NDArray[uint8]],
    passes: int,
    numbers: int,
    compensated: bool,
    progress: Callable[[float], object] | None,
) -> NDArray[int32]: ...
def jitter(
    places: NDArray[int32],
    place: tuple[Sequence[int], Sequence[int], Sequence[bool]],
    held: NDArray[bool_],
    reach: int,
    seed: int,
    level: int,
) -> NDArray[int32]: ...

@final
class Cholesky:
    def __new__(
        cls, starts: NDArray[uint32], rows: NDArray[uint32], values: NDArray[float64], limit: int
    ) -> Cholesky: ...
    @staticmethod
    def several(
        matrices: Sequence[tuple[NDArray[uint32], NDArray[uint32], NDArray[float64]]], limit: int
    ) -> list[Cholesky]: ...
    @property
    def size(self) -> int: ...
    @property
    def entries(self) -> int: ...
    def solve(self, sides: NDArray[float64]) -> NDArray[float64]: ...

def warp_mesh(
    source: tuple[int, int],
    target: NDArray[float64],
    weight: NDArray[uint8],
    shape: tuple[int, int],
    progress: Callable[[float], object] | None,
) -> tuple[NDArray[float32], NDArray[uint32], tuple[int, int, int]]: ...
def warp_points(
    source: NDArray[float64], target: NDArray[float64], shape: tuple[int, int]
) -> tuple[tuple[NDArray[float32], NDArray[uint32], tuple[int, int, int]], NDArray[uint32]]: ...
