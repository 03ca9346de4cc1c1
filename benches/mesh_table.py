"""Measure the visibility of atlas cuts: painted meshes with interpolated texels, compared with the texture itself.

Run ``python benches/mesh_table.py MESH... [--sample particles] [--atlas 1024]``. The table has two differences:
between the two sides of an edge, and between a side and the texture. Cut edges and all others are separate rows. They
are in levels of 8 bit (median, 90 % and 99 % of 1500 points). Cuts are invisible if their edges are as near to the
texture as the others.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

import texrs
from texrs import samples
from texrs.painting import TexturedMesh, choose_scale, texture_mesh

POINTS = 1500
SHARES = (0.5, 0.9, 0.99)


def find_edges(painted: TexturedMesh) -> dict[str, np.ndarray]:
    """Return the vertices (n, 2 sides, 2 ends) of edges that two triangles share, separately for cut and other edges."""
    place = np.unique(np.round(painted.vertices, 5), axis=0, return_inverse=True)[1].reshape(-1)
    ends = np.concatenate([painted.faces[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    ends = np.where(place[ends[:, :1]] <= place[ends[:, 1:]], ends, ends[:, ::-1])
    order = np.lexsort(place[ends].T)
    ends = ends[order]
    same = (place[ends[1:]] == place[ends[:-1]]).all(axis=1)
    pairs = np.stack([ends[:-1][same], ends[1:][same]], axis=1)
    cut = (pairs[:, 0] != pairs[:, 1]).any(axis=1)
    return {"cut": pairs[cut], "whole": pairs[~cut]}


def mix(values: np.ndarray, pairs: np.ndarray, share: np.ndarray) -> list[np.ndarray]:
    """Return values interpolated between the vertices at points of edges, for each side."""
    return [values[pairs[:, side, 0]] * share + values[pairs[:, side, 1]] * (1 - share) for side in (0, 1)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", metavar="MESH")
    parser.add_argument("--sample", default="particles")
    parser.add_argument("--atlas", type=int, default=1024)
    given = parser.parse_args()
    texture = texrs.SolidTexture(samples.load(given.sample).image, seed=1)
    rng = np.random.default_rng(0)
    print(f"{'mesh':20} {'edges':12} {'side to side':>20} {'to the texture':>20}")
    for name in given.meshes:
        painted = texture_mesh(name, texture, atlas=given.atlas)
        assert painted.uv is not None
        side, size, pixels = given.atlas, choose_scale(painted.vertices, texture), painted.maps["image"].astype(float)

        def look(uv: np.ndarray, pixels: np.ndarray = pixels, side: int = side) -> np.ndarray:
            at = [(1 - uv[:, 1]) * side - 0.5, uv[:, 0] * side - 0.5]
            return np.stack([map_coordinates(p, at, order=1, mode="nearest") for p in np.moveaxis(pixels, -1, 0)], -1)

        for kind, pairs in find_edges(painted).items():
            if not len(pairs):
                continue
            some, share = pairs[rng.integers(0, len(pairs), POINTS)], rng.random((POINTS, 1))
            one, other = (look(uv) for uv in mix(painted.uv, some, share))
            there = texture.sample(mix(painted.vertices, some, share)[0][:, ::-1] * size).astype(float)
            apart = [np.quantile(np.abs(d).max(axis=-1), SHARES) for d in (one - other, one - there)]
            words = ["  ".join(f"{v:4.1f}" for v in each) for each in apart]
            print(f"{Path(name).name:20} {f'{len(pairs)} {kind}':12} {words[0]:>20} {words[1]:>20}", flush=True)


if __name__ == "__main__":
    main()
