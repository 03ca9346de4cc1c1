"""Unbounded designs from corner tiles, whose windows are computed by look-up.

The method is A. Lagae and P. Dutre, "An alternative for Wang tiles: colored edges versus colored corners", ACM
Transactions on Graphics 25(4), 2006. Each corner of a lattice has one of three colours, chosen by a hash. The four
corners of a cell select one of 81 tiles. Neighbouring tiles therefore agree along their edges and at their corners,
and the texture is not periodic. Computing a window takes only as long as a copy, at any position.

First, several tileable images are designed (`texrs.design_variants`). Then a strip for each pair of corners is cut
from them. Finally the inside of each tile is cut into its ring of strips by one cut along all four edges
(`texrs.corner_tiles._cutting`). Candidates are the positions that are most similar to the known part
(`texrs.corner_tiles._fitting`). The candidate with the least visible cut is used; cuts through elements cost more. If
the exemplar repeats on a lattice, tiles contain whole periods, and all their pieces are aligned with the lattice. The
paper has neither the search nor the alignment. Its strips are twice as wide, so more content recurs.

The atlas arranges the tiles on a torus of 9 x 9. Each tile occurs once and fits its neighbours. The atlas can
therefore be filtered, and is a tileable texture itself.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_int, as_seed, as_size, check_work
from texrs._cache import content_hash
from texrs._checks import as_tuple
from texrs._chunks.grid import Box, as_sides
from texrs._chunks.parts import InParts, Part
from texrs._chunks.reading import Channel
from texrs._progress import listen, stage
from texrs._typing import Array, Floats, Path, Progress
from texrs.corner_tiles._corners import TILES, TORUS, draw_colours, number_tiles
from texrs.corner_tiles._cutting import cut_tiles
from texrs.corner_tiles._fitting import Pictures, look_up
from texrs.corner_tiles._lattice_step import choose_side, find_step
from texrs.corner_tiles._shaders import write_shaders
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.io.files import as_path
from texrs.materials import Material
from texrs.papers.design import design_variants
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["CornerTiles"]

MAX_COORDINATE = 10**15
"""Largest absolute coordinate of the unbounded texture."""
LARGER = "texrs.CornerTiles.to_zarr and to_dask give it in parts"
"""Remedy in the error for windows that are too large for one array."""
IMAGE = "image"
KEEP = 4.0
"""Extra cost of a cut deep inside an element, relative to the cost of other cuts."""
DEPTH = 3.0


class CornerTiles(InParts):
    """An unbounded design: 81 corner tiles, and the tile of each cell.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, Exemplar or Material
        Example, as for `texrs.design`.
    tile_size : int, optional
        Side of a tile in pixels, 32 to 1024 and a multiple of 4. Default: the exemplar's shorter side, limited to 64
        to 256, or reduced so that a tile contains whole periods of a repeating exemplar.
    seed : int
        Seed of the tiles and of their arrangement, 0 to 2^64 - 1.
    variants : int
        Number of tileable images that tiles are cut from, 1 to 64. Each is twice as large as a tile along each axis.
        Default: 4.
    progress : callable or True, optional
        Function called as ``progress(stage, share)``. If it raises an exception, the work stops. True shows a bar.
    **options
        Options of `texrs.design_variants`, such as ``way`` or ``deformation``.

    Raises
    ------
    InvalidInput
        If `texrs.design` refuses the exemplar, or an option is out of its range.
    Cancelled
        If the work was stopped.

    Examples
    --------
    >>> import texrs
    >>> stones = texrs.CornerTiles(texrs.samples.dots((64, 64)).image, 64, seed=1, variants=1)
    >>> far = stones.window((10**12, -5), (40, 60))
    >>> far.image.shape, bool((far.image == stones[10**12 : 10**12 + 40, -5:55]).all())
    ((40, 60, 3), True)

    """

    axes = 2

    def __init__(
        self,
        exemplar: Array | Exemplar | Material,
        tile_size: int | None = None,
        *,
        seed: int = 0,
        variants: int = 4,
        progress: Progress | bool | None = None,
        **options: Any,
    ) -> None:
        watch = listen(progress)
        shown = exemplar.guide if isinstance(exemplar, Material) else exemplar
        known = as_exemplar(shown)
        if tile_size is None:
            tile_size = choose_side(known.segment().repeats, int(np.clip(min(known.shape), 64, 256)) // 4 * 4)
        if as_int(tile_size, "tile_size", 32, 1024) % 4:
            raise InvalidInput(f"tile_size: must be a multiple of 4, got {tile_size}")
        self._side, self._seed = tile_size, as_seed(seed)
        if {"size", "wrap", "count"} & options.keys():
            raise InvalidInput(
                f"{min({'size', 'wrap', 'count'} & options.keys())}: cannot be set; use tile_size and variants"
            )
        check_work("CornerTiles", [known.pixels], (9 * tile_size, 9 * tile_size), "tile_size")
        given = exemplar if isinstance(exemplar, Material) else known
        made = list(
            design_variants(
                given, as_int(variants, "variants", 1, 64), 2 * tile_size, seed=seed, progress=watch, **options
            )
        )
        # Increase the cost of cuts through elements with the depth inside the element.
        depth = _measure_depth(known)
        costs = [np.asarray(KEEP * each.source_map.render(depth, interpolation="linear"), np.float32) for each in made]
        pictures = Pictures(np.stack([each.image for each in made]), np.stack(costs))
        advance = stage(watch, "tiles")
        step = find_step(list(pictures.images), known.segment().repeats, tile_size)
        tiles = cut_tiles(pictures, tile_size, step, self._seed, advance or (lambda share: None))
        # Arrange the tiles on the torus, which contains each tile once, and store the position of each tile number.
        around = np.pad(TORUS, (0, 1), mode="wrap")
        order = number_tiles(around)
        self._place: NDArray[np.intp] = np.empty(TILES, np.intp)
        self._place[order.reshape(-1)] = np.arange(TILES)
        laid = tiles[order].transpose(0, 2, 1, 3, 4).reshape(9 * tile_size, 9 * tile_size, 3)
        materials = [each.material for each in made if each.material is not None]
        self._maps: dict[str, Array] = {}
        if materials:
            for name in materials[0]:
                self._maps[name] = look_up(np.stack([each[name].pixels for each in materials]), laid)
        else:
            self._maps[IMAGE] = pictures.look(laid)
        self._like = materials[0] if materials else None
        # Combine the source map from the atlas into the designs with the source maps from the designs into the
        # exemplar.
        outer = SourceMap(
            laid[..., 1:].astype(np.float32),
            laid[..., 0].astype(np.uint16),
            laid[..., 0].astype(np.uint32),
            None,
            tuple(each.image.shape[:2] for each in made),
        )
        self._source = outer.compose([each.source_map for each in made])

    def __repr__(self) -> str:
        """Return the number, size and seed of the tiles."""
        return f"<{TILES} corner tiles of {self._side} x {self._side}, seed {self._seed}>"

    @property
    def tile_size(self) -> int:
        """Side of a tile, in pixels."""
        return self._side

    @property
    def atlas(self) -> Array:
        """All tiles on a torus, (9 tile_size, 9 tile_size[, C]). Each tile fits its neighbours."""
        return self._maps[self._base]

    @property
    def material(self) -> Material | None:
        """All maps of the atlas, if the exemplar is a material."""
        return None if self._like is None else self._like.replace(**self._maps)

    @property
    def source_map(self) -> SourceMap:
        """Source map of the atlas."""
        return self._source

    @cached_property
    def key(self) -> str:
        """Hash of everything that determines the windows."""
        return content_hash(self._side, self._seed, *self._maps, *self._maps.values()).hex()

    @property
    def _base(self) -> str:
        return IMAGE if self._like is None else self._like.base_name

    def index(self, origin: int | Sequence[int], size: int | Sequence[int]) -> NDArray[np.uint8]:
        """Return the index of the tile in each cell of the lattice.

        Parameters
        ----------
        origin : int or (int, int)
            Row and column of the first cell. Cell (i, j) begins at pixel (i tile_size, j tile_size).
        size : int or (rows, columns)
            Number of cells, as rows and columns.

        Returns
        -------
        (rows, columns) uint8
            Index of the tile in the atlas: 9 times its row plus its column.

        Raises
        ------
        InvalidInput
            If the origin or size is not valid.

        Examples
        --------
        >>> import texrs
        >>> tiles = texrs.CornerTiles(texrs.samples.pebbles((96, 96)).image, 32, seed=1)
        >>> tiles.index((0, 0), (2, 3)).shape
        (2, 3)

        """
        first, sides = self._as_origin(origin), as_size(size)
        lines = [np.arange(o, o + n + 1, dtype=np.int64) for o, n in zip(first, sides, strict=True)]
        return self._place[number_tiles(draw_colours(self._seed, *lines))].astype(np.uint8)

    def __getitem__(self, index: Any) -> Array:
        """Return a window: ``tiles[y0:y1, x0:x1]``, for any integers."""
        wanted = "ranges [y0:y1, x0:x1] of integers, each with both ends"
        parts = as_tuple(index, "index", 2, wanted)
        if not all(isinstance(p, slice) and p.step is None and None not in (p.start, p.stop) for p in parts):
            raise InvalidInput(f"index: must be {wanted}, got {index!r}")
        origin = self._as_origin([p.start for p in parts])
        size = as_size([int(p.stop) - o for p, o in zip(parts, origin, strict=True)], way=LARGER)
        return self._read(origin, size, [self._maps[self._base]])[0]

    def window(
        self, origin: int | Sequence[int], size: int | Sequence[int], *, progress: Progress | bool | None = None
    ) -> Synthesis:
        """Return a window with its source map.

        Parameters
        ----------
        origin : int or (int, int)
            First pixel of the window: integers from -10^15 to 10^15.
        size : int or (rows, columns)
            Size of the window in pixels.
        progress : callable or True, optional
            Function called as ``progress(stage, share)``, as for all verbs.

        Returns
        -------
        Synthesis
            Window, with all maps of a material, and its source map. Its labels are the labels of the atlas.

            Stages:

            - ``before_blending``: The window.

            Report:

            - ``tile_size``: Side of a tile, in pixels.
            - ``seed``: The seed.
            - ``origin``: (row, column) of the first pixel.

        Raises
        ------
        InvalidInput
            If the origin or size is not valid.

        Examples
        --------
        >>> import texrs
        >>> tiles = texrs.CornerTiles(texrs.samples.pebbles((96, 96)).image, 32, seed=1)
        >>> tiles.window((-10, 10**9), (40, 50)).image.shape
        (40, 50, 3)

        """
        watch = stage(listen(progress), "window")
        start, sides = self._as_origin(origin), as_size(size, way=LARGER)
        # Cut a Jacobian per pixel like the other arrays, but keep a table of Jacobians by label complete.
        source = self._source
        jacobian = source.jacobian_array()
        names, dense = list(self._maps), jacobian is not None and jacobian.ndim > 3
        arrays: list[Array] = [source.coordinates, source.exemplar, source.label, *self._maps.values()]
        if jacobian is not None and dense:
            arrays.append(jacobian)
        coordinates, exemplar, label, *found = self._read(start, sides, arrays)
        here = SourceMap(coordinates, exemplar, label, found[-1] if dense else jacobian, source.shapes)
        maps = dict(zip(names, found[: len(names)], strict=True))
        report = {"tile_size": self._side, "seed": self._seed, "origin": list(start)}
        if watch is not None:
            watch(1.0)
        material = None if self._like is None else self._like.replace(**maps)
        return Synthesis(maps[self._base], here, {"before_blending": maps[self._base]}, report, material)

    def _read(self, origin: Sequence[int], size: Sequence[int], arrays: Sequence[Array]) -> list[Array]:
        """Read a window from each of the given arrays of the atlas."""
        side = self._side
        first = [o // side for o in origin]
        cells = [(o + n - 1) // side - f + 1 for o, n, f in zip(origin, size, first, strict=True)]
        index = self.index(first, cells)
        out = [np.empty((*size, *a.shape[2:]), a.dtype) for a in arrays]
        for i, j in np.ndindex(*index.shape):
            here, there = [], []
            for axis, k in enumerate((i, j)):
                start = (first[axis] + k) * side - origin[axis]
                low, high = max(0, start), min(size[axis], start + side)
                here.append(slice(low, high))
                corner = (int(index[i, j]) // 9, int(index[i, j]) % 9)[axis] * side
                there.append(slice(corner + low - start, corner + high - start))
            for made, atlas in zip(out, arrays, strict=True):
                made[tuple(here)] = atlas[tuple(there)]
        return out

    def _read_part(self, origin: int | Sequence[int], shape: int | Sequence[int]) -> Part:
        """Check the origin and size of a part, and return its reader."""
        as_sides(shape, "shape", 2)
        start = self._as_origin(origin)
        return Part(_Reader(self, start), start, self._base)

    def save(self, folder: Path, cells: int | Sequence[int] = 256) -> list[FilePath]:
        """Write the tiles for game engines: atlases, an index texture, and short shaders for GLSL and Godot.

        Parameters
        ----------
        folder : path_like
            Output folder. It is created if it is missing, and files of the same names are replaced.
        cells : int or (rows, columns)
            Size of the index texture in cells. A shader repeats it beyond its ends. Default: 256.

        Returns
        -------
        list of pathlib.Path
            Written files: ``NAME.png`` for each map (.tif if it has floats), ``index.png``, ``tiles.glsl`` and
            ``tiles.gdshader``.

        Raises
        ------
        FileError
            If a file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> tiles = texrs.CornerTiles(texrs.samples.dots((64, 64)).image, 32, variants=1)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in tiles.save(folder, 16)]
        ['image.png', 'index.png', 'tiles.glsl', 'tiles.gdshader']

        """
        from texrs.io import write

        where, sides = as_path(folder), as_size(cells)
        where.mkdir(parents=True, exist_ok=True)
        written = []
        for name, array in self._maps.items():
            written.append(where / f"{name}.{'tif' if array.dtype.kind == 'f' else 'png'}")
            write(written[-1], array)
        # Shaders repeat the index texture, so its last corners along each axis must equal its first corners.
        colours = draw_colours(self._seed, *(np.arange(n, dtype=np.int64) for n in sides))
        around = number_tiles(np.pad(colours, (0, 1), mode="wrap"))
        written.append(where / "index.png")
        write(written[-1], self._place[around].astype(np.uint8))
        return written + write_shaders(where, os.path.basename(written[0]))

    def _as_origin(self, origin: int | Sequence[int]) -> tuple[int, int]:
        values = (origin, origin) if isinstance(origin, int | np.integer) else origin
        pair = as_tuple(values, "origin", 2, f"2 integers from -{MAX_COORDINATE} to {MAX_COORDINATE}")
        row, column = (as_int(v, "origin", -MAX_COORDINATE, MAX_COORDINATE) for v in pair)
        return row, column


@dataclass(frozen=True)
class _Reader:
    """Reader of parts of the texture, relative to an origin."""

    tiles: CornerTiles
    origin: tuple[int, int]

    @property
    def maps(self) -> Mapping[str, Channel]:
        """Maps by name."""
        like = self.tiles._like
        return {
            name: Channel.of(each, 2, labelled=like is not None and like[name].role.labelled)
            for name, each in self.tiles._maps.items()
        }

    @property
    def key(self) -> str:
        """Hash of the tiles and the origin."""
        return content_hash(self.tiles.key, self.origin).hex()

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Read a part of the given maps."""
        start = [s.start + o for s, o in zip(box, self.origin, strict=True)]
        size = [s.stop - s.start for s in box]
        found = self.tiles._read(start, size, [self.tiles._maps[name] for name in names])
        return dict(zip(names, found, strict=True))


def _measure_depth(known: Exemplar) -> Floats:
    """Return the depth of each pixel inside its element, 0 to 1, or 0 if no elements are found."""
    parts = known.segment()
    if parts.kind != "components":
        return np.zeros(known.shape, np.float32)
    return parts.measure_depth(DEPTH)
