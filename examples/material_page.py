"""A page of materials: each under a light, and what `texrs.design` makes of it, under the same light and tiled.

``python material_page.py OUT.html FOLDER ...``; each folder holds the maps of a material by the usual names. Of maps that have
no light of their own a result must look lit alike all over: shading that turned with the patches would show here.
"""

import argparse
import sys
from pathlib import Path

import texrs
from texrs._html import document, figure, pair, row, section


def show(folder: Path, size: int, seed: int) -> str:
    """Return a material, and a texture of it."""
    example = texrs.Material.read(folder)
    made = texrs.design(example, size, seed=seed).material
    assert made is not None
    note = f"{example.shape[0]} x {example.shape[1]}: {', '.join(example)}"
    return row(
        figure(example.preview(tiles=(1, 1)), "The example, lit", note=note),
        pair(made.preview(tiles=(1, 1)), f"{size} x {size}, lit", "Tiled 2 x 2"),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--size", type=int, default=768)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    names = [folder.name for folder in given.folders]
    parts = [
        section(f"m{i}", name, "", show(folder, given.size, given.seed))
        for i, (name, folder) in enumerate(zip(names, given.folders, strict=True))
    ]
    given.out.write_text(document([(f"m{i}", name) for i, name in enumerate(names)], parts), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
