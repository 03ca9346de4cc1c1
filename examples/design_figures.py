"""Make figures 3 to 8 of "Completion-based texture design using deformation" (Shen et al. 2006) anew: design-figure-N.png.

On built-in examples, where the paper shows several textures by default beside ``method="paper"``.
``python design_figures.py FOLDER [NUMBERS]``; about a minute.
"""

import sys
from pathlib import Path

import numpy as np

import texrs
from layout import below, beside
from texrs import DeformationOptions, samples
from wang_tiles import lay_tiles, make_tiles

SIDE, SMALL, LARGE = 230, 144, 360
NAMES = ("pebbles", "leaves_and_flowers", "beans", "dots", "bark")


def example(name: str, side: int = SMALL) -> np.ndarray:
    """Return a sample's picture."""
    return samples.load(name, size=(side, side)).image


def draw_cyclic() -> np.ndarray:
    """Figure 3: a texture, a cyclic one made of it, and that beside itself in each direction."""
    source = example("leaves_and_flowers", SIDE)
    made = texrs.design(source, (SIDE, SIDE), seed=1).image
    return beside([source, made, np.tile(made, (2, 2, 1))])


def draw_comparison() -> np.ndarray:
    """Figure 4: a texture, image quilting, corner tiles, patches of graph cuts that nothing deforms, as printed, and ours."""
    source = example("pebbles", SIDE)
    size, still = (LARGE, LARGE), DeformationOptions(operations=0, allow_mirror=False)
    return beside(
        [
            source,
            quilt(source, LARGE, seed=1),
            lay_tiles(make_tiles(source), size),
            texrs.design(source, size, seed=1, way="still", copies=1, deformation=still, screening=None).image,
            texrs.design(source, size, seed=1, method="paper").image,
            texrs.design(source, size, seed=1).image,
        ]
    )


def quilt(source: np.ndarray, side: int, *, block: int = 64, seed: int = 0) -> np.ndarray:
    """Return an image quilt (Efros and Freeman 2001): blocks in a lattice, each fitting those before it, cut by a seam."""
    rng, overlap = np.random.default_rng(seed), block // 6
    step = block - overlap
    count = -(-(side - overlap) // step)
    made = np.zeros((count * step + overlap,) * 2 + source.shape[2:], np.float32)
    known = np.zeros(made.shape[:2], bool)
    index = texrs.kernels.patch_search.PatchIndex(source, max_patch=block)
    for row in range(0, count * step, step):
        for column in range(0, count * step, step):
            here = slice(row, row + block), slice(column, column + block)
            if known[here].any():
                [match] = index.best(made[here], known[here])
            else:
                match = None
            at = (match.row, match.column) if match else tuple(rng.integers(0, n - block) for n in source.shape[:2])
            patch = source[at[0] : at[0] + block, at[1] : at[1] + block].astype(np.float32)
            take = texrs.kernels.seam.cut(made[here], patch, known[here], np.ones((block, block), bool)).mask
            made[here] = np.where(take[..., np.newaxis], patch, made[here])
            known[here] = True
    return np.rint(made[:side, :side]).astype(np.uint8)


def draw_deformed() -> np.ndarray:
    """Figure 5: textures, and four deformed ones of each; by default, then as printed."""
    rows = []
    for name in NAMES:
        source = example(name)
        for method in (None, "paper"):
            variants = texrs.design_variants(source, 4, SMALL, seed=1, way="move", copies=1, method=method)
            rows.append(beside([source, *(made.image for made in variants)]))
    return below(rows)


def draw_cyclic_variants() -> np.ndarray:
    """Figure 6: deformed textures that repeat, each beside itself."""
    variants = [texrs.design(example(name), SMALL, seed=2).image for name in NAMES]
    return below([beside(variants), beside([np.tile(made, (2, 2, 1)) for made in variants], SMALL)])


def draw_mixed() -> np.ndarray:
    """Figure 7: several textures, and those that mix them: by equal shares, by others, and by a map."""
    several = [example(name) for name in ("leaves_and_flowers", "pebbles", "bark")]
    down, right = np.indices((LARGE, LARGE))
    disc = (np.hypot(down - LARGE / 2, right - LARGE / 2) < LARGE / 3).astype(int)
    asked: list[tuple[list[np.ndarray], object]] = [(several, None), (several, (0.6, 0.3, 0.1)), (several[:2], disc)]
    made = [texrs.design(mixed, LARGE, weights=weights, seed=1).image for mixed, weights in asked]
    return below([beside(several), beside(made)])


def draw_larger() -> np.ndarray:
    """Figure 8: small textures, and large ones made of them."""
    sources = [example(name, SIDE) for name in NAMES]
    made = [texrs.design(source, LARGE, seed=3).image for source in sources]
    more = [
        texrs.design(source, LARGE, seed=4, deformation=DeformationOptions(operations=4)).image for source in sources
    ]
    return below([beside(row, SIDE) for row in (sources, made, more)])


FIGURES = {
    3: draw_cyclic,
    4: draw_comparison,
    5: draw_deformed,
    6: draw_cyclic_variants,
    7: draw_mixed,
    8: draw_larger,
}


def main(folder: str = ".", *numbers: str) -> None:
    """Write the figures."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    for number in map(int, numbers or map(str, FIGURES)):
        texrs.io.write(place / f"design-figure-{number}.png", FIGURES[number]())


if __name__ == "__main__":
    main(*sys.argv[1:])
