"""Texture sets: choose by the UVs of a mesh which faces share an atlas."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._notices import assume, ignore
from texrs._progress import ask
from texrs.errors import InvalidInput
from texrs.painting._meshes import unwrap
from texrs.painting._surface import PAINTED, Floats64, Surface

__all__ = ["UnwrappedMesh", "lay_flat"]

OFTEN = 256
"""Number of triangles between two checks for cancellation."""
COARSE = 512
"""Side in texels of the atlas that is searched for overlaps."""
EDGE = 1e-6
"""Maximum distance of a UV beyond its tile that counts as a rounding error."""
SHARED = 0.02
"""Minimum overlap, as a fraction of the smaller part's texels. Touching edges share a few texels."""
MOST = 64
"""Maximum number of texture sets."""


class UnwrappedMesh(NamedTuple):
    """A mesh whose faces all have a position in an atlas.

    Attributes
    ----------
    surface : Surface
        The mesh, with UVs for all faces.
    names : tuple of str
        Names of the texture sets.
    which : (M,) int64
        Index of the texture set of each face.
    tile : (M, 2) float64
        Lower left corner of each face's tile.

    """

    surface: Surface
    names: tuple[str, ...]
    which: NDArray[np.int64]
    tile: Floats64


def lay_flat(surface: Surface, side: int, padding: int, *, fresh: bool) -> UnwrappedMesh:
    """Return a mesh with its texture sets: several if the UVs of materials, parts or tiles would overlap, else one.

    Raises
    ------
    InvalidInput
        If faces cross the borders of tiles, or there are too many sets.

    """
    bare: NDArray[np.bool_] = np.ones(len(surface.faces), bool)
    if surface.uv is not None and not fresh:
        bare = np.asarray(np.isnan(surface.uv[surface.faces]).any(axis=(1, 2)), bool)
    if bare.all():
        vertices, faces, uv, kept = unwrap(surface.vertices, surface.faces, side, padding)
        # Drop the text of the OBJ file, because its indices do not fit the new layout.
        whole = surface._replace(vertices=vertices, faces=faces, uv=uv, text=None, origin=None)
        whole = whole._replace(normals=None if surface.normals is None else surface.normals[kept])
        return UnwrappedMesh(whole, (PAINTED,), np.zeros(len(faces), np.int64), np.zeros((len(faces), 2)))
    if bare.any():
        assume(
            f"{surface.name}: {bare.sum()} of {len(bare)} faces have no UVs, and are laid out in a separate texture set"
        )
        surface = _unwrap_part(surface, bare, side, padding)
    tile = _find_tiles(surface)
    which, names = _choose(surface, bare, tile)
    if len(names) > MOST:
        raise InvalidInput(
            f"mesh: its UVs need {len(names)} texture sets, more than {MOST}; pass unwrap (--unwrap) for another layout"
        )
    if len(names) > 1:
        why = "its UVs overlap" if not tile.any() else "its UVs are in several tiles"
        assume(f"{surface.name}: read as {len(names)} texture sets, {', '.join(names)}, because {why}")
    return UnwrappedMesh(surface, names, which, tile)


def _unwrap_part(surface: Surface, bare: NDArray[np.bool_], side: int, padding: int) -> Surface:
    """Return a mesh whose faces without UVs are unwrapped. They have their own vertices, which follow all others."""
    assert surface.uv is not None
    used, local = np.unique(surface.faces[bare], return_inverse=True)
    vertices, faces, uv, kept = unwrap(surface.vertices[used], local.reshape(-1, 3), side, padding)
    whole = surface.faces.copy()
    whole[bare] = faces + len(surface.vertices)
    normals = surface.normals
    return surface._replace(
        vertices=np.concatenate([surface.vertices, vertices]),
        faces=whole,
        uv=np.concatenate([np.nan_to_num(surface.uv), uv]),
        normals=None if normals is None else np.concatenate([normals, normals[used[kept]]]),
        text=None,
        origin=None,
    )


def _find_tiles(surface: Surface) -> Floats64:
    """Return the tile of each face."""
    assert surface.uv is not None
    uv = surface.uv[surface.faces]
    tile = np.floor(uv.mean(axis=1))
    away = ((uv < tile[:, np.newaxis] - EDGE) | (uv > tile[:, np.newaxis] + 1 + EDGE)).any(axis=(1, 2))
    if away.any():
        low, high = uv.min(axis=(0, 1)), uv.max(axis=(0, 1))
        raise InvalidInput(
            f"mesh: UVs of {away.sum()} faces cross a tile's border (u {low[0]:g} to {high[0]:g}, v {low[1]:g} to {high[1]:g});"
            " pass unwrap (--unwrap) for another layout"
        )
    return np.asarray(tile)


def _choose(surface: Surface, bare: NDArray[np.bool_], tile: Floats64) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Return the texture set of each face, and the names of the sets."""
    # Faces that xatlas laid out are a separate part.
    labels = [*surface.materials, "unwrapped"]
    part = np.where(bare, len(surface.materials), surface.part)
    keys, number = np.unique(np.column_stack([tile, part]), axis=0, return_inverse=True)
    number = number.reshape(-1)
    over, own, none = _find_overlaps(surface, number, tile)
    if own:
        ignore(
            f"{surface.name}: UVs of {own} faces overlap others and show the same texels; unwrap (--unwrap) separates them"
        )
    if none:
        ignore(f"{surface.name}: {none} faces have no area in the atlas, and show a single texel")
    materials = {name: k for k, name in enumerate(dict.fromkeys(labels))}
    material = np.array([materials[labels[int(key[2])]] for key in keys])
    tiles = np.unique(keys[:, :2], axis=0, return_inverse=True)[1].reshape(-1)
    # Take the fewest sets without an overlap: one, one for each material, one for each part.
    for group in (np.zeros(len(keys), int), material, np.arange(len(keys))):
        if not any(group[a] == group[b] for a, b in over):
            break
    sets, which = np.unique(np.column_stack([tiles, group]), axis=0, return_inverse=True)
    which = which.reshape(-1)
    names: list[str] = []
    for k in range(len(sets)):
        mine = np.flatnonzero(which == k)
        u, v = (int(x) for x in keys[mine[0], :2])
        words = list(dict.fromkeys(labels[int(keys[m, 2])] for m in mine))
        # Name the set after its material, and the tile by its UDIM number.
        name = words[0] if group.any() or len(words) == 1 else PAINTED
        if len(np.unique(tiles)) > 1:
            name += f"_{1001 + u + 10 * v}" if 0 <= u < 10 and v >= 0 else f"_u{u}v{v}"
        same = sum(each == name or each.rpartition("~")[0] == name for each in names)
        names.append(f"{name}~{same + 1}" if same else name)
    return which[number], tuple(names)


def _find_overlaps(
    surface: Surface, number: NDArray[np.int64], tile: Floats64
) -> tuple[list[tuple[int, int]], int, int]:
    """Return the parts that overlap, the number of faces that overlap their own part, and the number without area."""
    assert surface.uv is not None
    uv = surface.uv[surface.faces] - tile[:, np.newaxis]
    seen: dict[tuple[int, int], NDArray[np.int64]] = {}
    shared: dict[tuple[int, int], int] = {}
    size = np.zeros(int(number.max()) + 1, np.int64)
    own = none = 0
    for face, (mine, texels) in enumerate(zip(number.tolist(), _cover(uv), strict=True)):
        if texels is None:
            none += 1
            continue
        size[mine] += len(texels)
        here = (int(tile[face, 0]), int(tile[face, 1]))
        # Texels belong to the first part that covers them.
        owner = seen.setdefault(here, np.full(COARSE * COARSE, -1, np.int64))
        met, counts = np.unique(owner[texels], return_counts=True)
        for other, count in zip(met.tolist(), counts.tolist(), strict=True):
            if other == mine:
                own += count > SHARED * len(texels) and count > 2
            elif other >= 0:
                pair = (min(mine, other), max(mine, other))
                shared[pair] = shared.get(pair, 0) + count
        owner[texels] = np.where(owner[texels] < 0, mine, owner[texels])
    over = [(a, b) for (a, b), count in shared.items() if count > SHARED * min(size[a], size[b])]
    return over, own, none


def _cover(uv: Floats64) -> Iterator[NDArray[np.int64] | None]:
    """Yield the texels of a coarse atlas whose centres are in each triangle; None for a triangle without area."""
    for number, flat in enumerate(uv * COARSE - 0.5):
        if number % OFTEN == 0:
            ask()
        edge, other = flat[1] - flat[0], flat[2] - flat[0]
        double = edge[0] * other[1] - edge[1] * other[0]
        if abs(double) < 1e-9:
            yield None
            continue
        low = np.maximum(np.ceil(flat.min(axis=0)).astype(int), 0)
        high = np.minimum(np.floor(flat.max(axis=0)).astype(int) + 1, COARSE)
        if (high <= low).any():
            yield np.zeros(0, np.int64)
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        right, up = x - flat[0, 0], y - flat[0, 1]
        b, c = (right * other[1] - up * other[0]) / double, (edge[0] * up - edge[1] * right) / double
        inside = np.minimum(np.minimum(b, c), 1 - b - c) > EDGE
        yield (y * COARSE + x)[inside]
