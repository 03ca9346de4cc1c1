"""Make a page that compares ways to enlarge a texture: this, plain quilting, and the method as printed.

    python examples/design_page.py OUT.html [IMAGE ...]

Without images the page is made of built-in examples.
"""

import sys
from pathlib import Path

import numpy as np

import texrs
from texrs import _html as html

CROP, SEED = 256, 7
STILL = texrs.DeformationOptions(operations=0, allow_mirror=False)
BUILT_IN = ("pebbles", "leaves_and_flowers", "beans", "dots", "tilted_discs", "bark")
WAYS = {
    "texrs.design": {},
    "plain quilting (nothing deformed)": {"deformation": STILL, "copies": 1, "screening": None},
    "as printed (method=paper)": {"method": "paper"},
}


def exemplars(paths: list[str]) -> dict[str, np.ndarray]:
    """Return the middles of images, or built-in examples."""
    if not paths:
        return {name: texrs.samples.load(name).image for name in BUILT_IN}
    found = {}
    for path in paths:
        image = texrs.io.read(path)
        starts = [max(0, (n - CROP) // 2) for n in image.shape[:2]]
        found[Path(path).stem] = np.ascontiguousarray(image[tuple(slice(s, s + CROP) for s in starts)])
    return found


def main(out: str, paths: list[str]) -> None:
    """Write the page."""
    sections = []
    for name, image in exemplars(paths).items():
        size = tuple(2 * n for n in image.shape[:2])
        made = [texrs.design(image, size, seed=SEED, **options).image for options in WAYS.values()]
        pictures = [html.figure(picture, way, exact=True) for picture, way in zip(made, WAYS, strict=True)]
        shown = html.grid([html.figure(image, "the example", exact=True, share=0.5), *pictures], least=2 * CROP)
        sections.append(html.section(name, name.replace("_", " "), "", shown))
    page = html.document([], sections)
    with texrs.io.atomic(out) as temporary:
        Path(temporary).write_text(page, encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
