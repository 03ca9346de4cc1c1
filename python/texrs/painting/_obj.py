"""Wavefront OBJ files: reading with the file's own indices, and writing with other materials.

Trimesh reorders vertices, drops the UVs of a material if one of its faces has none, and packs materials into one
atlas. Here, the geometry of a file is kept as text, so vertices, quads, groups, objects and normals do not change.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._notices import assume, ignore
from texrs.errors import FileError
from texrs.painting._surface import MESH, PAINTED, Floats64, Surface

__all__ = ["paint_text", "read_obj", "spell_obj"]

KNOWN = {"v", "vt", "vn", "f", "o", "g", "s", "usemtl", "mtllib", "mg"}
"""Keywords of lines that are read, or copied unchanged."""


def read_obj(name: str, text: str) -> Surface:
    """Return the surface in the text of an OBJ file.

    Raises
    ------
    FileError
        If a line cannot be read.

    """
    rows: dict[str, list[list[float]]] = {"v": [], "vt": [], "vn": []}
    corners: list[tuple[int, int, int]] = []
    parts: dict[tuple[str, str], int] = {}
    owner, cut, coloured, unread = [], 0, False, Counter[str]()
    group = material = ""
    for number, line in enumerate(text.replace("\\\n", " \n").splitlines(), start=1):
        word, *rest = line.split("#", 1)[0].split() or [""]
        try:
            if word in rows:
                coloured |= word == "v" and len(rest) >= 6
                # A one-dimensional UV has no second coordinate, so append 0.
                width, rest = (2, [*rest, "0"]) if word == "vt" else (3, rest)
                rows[word].append([float(rest[k]) for k in range(width)])
            elif word == "f":
                # Cut a polygon into triangles around its first corner.
                ends = [_read_corner(end, rows) for end in rest]
                for k in range(1, len(ends) - 1):
                    corners += [ends[0], ends[k], ends[k + 1]]
                    owner.append(parts.setdefault((material, group), len(parts)))
                cut += len(ends) > 3
        except (ValueError, IndexError):
            raise FileError(f"{name}: line {number} cannot be read: {line.strip()[:60]!r}") from None
        if word == "usemtl":
            material = " ".join(rest)
        elif word in ("o", "g"):
            group = " ".join(rest)
        elif word and word not in KNOWN:
            unread[word] += 1
    if unread:
        ignore(f"{name}: lines of {', '.join(sorted(unread))} are not used")
    if coloured:
        ignore(f"{name}: the colours of its vertices are not used")
    if cut:
        assume(f"{name}: {cut} faces of more than three corners are cut into triangles")
    return _join(rows, corners, owner, list(parts), text)


def _read_corner(end: str, rows: Mapping[str, Sequence[object]]) -> tuple[int, int, int]:
    """Return the indices of a corner in the lists of vertices, UVs and normals; -1 if it has none."""
    found = []
    for key, index in zip(("v", "vt", "vn"), [*end.split("/"), "", ""][:3], strict=True):
        place = int(index or 0)
        place = place - 1 if place >= 0 else len(rows[key]) + place
        if place >= len(rows[key]) or (place < 0 and (key == "v" or index)):
            raise IndexError(end)
        found.append(place)
    return found[0], found[1], found[2]


def _join(
    rows: Mapping[str, list[list[float]]],
    corners: list[tuple[int, int, int]],
    owner: list[int],
    parts: list[tuple[str, str]],
    text: str,
) -> Surface:
    """Return a surface with one vertex for each distinct corner, in the order of the file."""
    vertices, uv, normals = (
        np.array(rows[key], np.float64).reshape(-1, width) for key, width in (("v", 3), ("vt", 2), ("vn", 3))
    )
    each = np.array(corners, np.int64).reshape(-1, 3)
    # Keep vertices that no face uses.
    spare = np.setdiff1d(np.arange(len(vertices)), each[:, 0])
    every = np.concatenate([each, np.stack([spare, spare * 0 - 1, spare * 0 - 1], axis=1)])
    known, place = np.unique(every, axis=0, return_inverse=True)

    def look_up(table: Floats64, index: NDArray[np.int64]) -> Floats64 | None:
        found = np.concatenate([table, np.full((1, table.shape[1]), np.nan)])[index]
        return found if np.isfinite(found).any() else None

    return Surface(
        vertices[known[:, 0]],
        place.reshape(-1)[: len(each)].reshape(-1, 3),
        look_up(uv, known[:, 1]),
        look_up(normals, known[:, 2]),
        np.array(owner, np.int64),
        tuple(material or PAINTED for material, _ in parts),
        tuple(group or MESH for _, group in parts),
        text,
        known[:, 0],
    )


def paint_text(text: str, library: str | None, names: Sequence[str], colours: NDArray[np.uint8] | None = None) -> bytes:
    """Return the text of a file with other materials, or with colours of its vertices instead.

    Parameters
    ----------
    text : str
        Text of the file.
    library : str, optional
        Name of the file of materials.
    names : sequence of str
        Material of each triangle. Faces are cut into triangles.
    colours : (N, 3) uint8, optional
        Colour of each vertex.

    """
    lines, used, count, vertex = [] if library is None else [f"mtllib {library}"], "", 0, 0
    for line in text.replace("\\\n", " \n").splitlines():
        word, *rest = line.split("#", 1)[0].split() or [""]
        if word in ("mtllib", "usemtl"):
            continue
        if word == "f":
            if library is not None and len(rest) > 2 and names[count] != used:
                used = names[count]
                lines.append(f"usemtl {used}")
            count += max(0, len(rest) - 2)
        elif word == "v" and colours is not None:
            line = " ".join(["v", *rest[:3], *(f"{c / 255:.9g}" for c in colours[vertex].tolist())])
            vertex += 1
        lines.append(line)
    return ("\n".join(lines) + "\n").encode("utf-8", "surrogateescape")


def spell_obj(
    vertices: Floats64,
    faces: NDArray[np.int64],
    normals: Floats64,
    uv: Floats64 | None,
    colours: NDArray[np.uint8] | None,
    library: str | None,
    names: Sequence[str] = (),
) -> bytes:
    """Return OBJ text for a mesh that was not read from such a file, with one material name for each face."""
    lines = ["# texrs"] + ([] if library is None else [f"mtllib {library}"])
    if colours is None:
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices.tolist()]
    else:
        both = np.concatenate([vertices, colours / 255], axis=1)
        lines += ["v " + " ".join(f"{v:.9g}" for v in row) for row in both.tolist()]
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in normals.tolist()]
    corner = "{0}//{0}" if uv is None else "{0}/{0}/{0}"
    if uv is not None:
        lines += [f"vt {u:.9g} {v:.9g}" for u, v in uv.tolist()]
    # Write a line for the material only where it changes.
    used = ""
    for number, row in enumerate((faces + 1).tolist()):
        if library is not None and names[number] != used:
            used = names[number]
            lines.append(f"usemtl {used}")
        lines.append("f " + " ".join(corner.format(i) for i in row))
    return ("\n".join(lines) + "\n").encode()
