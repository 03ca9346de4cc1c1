"""How well elements are found in annotated textures (check S1), from given boxes and by the automatic start.

TEXRS_TEXTURES=FOLDER python benches/elements_table.py [PICTURES]

FOLDER holds b-disjoint, c-connected and d-background, each image with its annotation. With PICTURES, a folder, what
was found is drawn there. Detections within half a box of the border do not count; of the keyboard, whose centres are
not all listed, recall alone does.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from texrs import elements, io
from texrs.errors import TexrsError

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from element_checks import annotated, passes, score


def main(folder: Path, pictures: Path | None) -> None:
    print("| texture | layout | start | elements | of | recall | inner | precision | error | mask | s | S1 |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    totals = {"box": [0, 0, 0], "auto": [0, 0, 0]}
    for texture in annotated(folder):
        image = io.read(texture.image)
        given = {"box": texture.box, "background": texture.background, "layout": texture.layout}
        for start, options in (("box", given), ("auto", {})):
            began = time.perf_counter()
            try:
                found = elements.analyse(image, **options)
            except TexrsError as error:
                print(f"| {texture.name} | {texture.layout} | {start} | {error} |")
                continue
            seconds = time.perf_counter() - began
            total = totals[start]
            total[2] += found.layout == texture.layout
            row = [texture.name, texture.layout if start == "box" else f"{found.layout}", start, len(found.points)]
            if texture.centres is None:
                row += ["-", "-", "-", "-", "-"]
            else:
                result = score(found.points, texture.centres, texture.box[2:], image.shape)
                row += [len(texture.centres), *(f"{v:.2f}" for v in (result.recall, result.inner, result.precision))]
                row.append(f"{result.error:.1f}")
            row += [f"{found.report['mask']} {found.mask.mean():.2f}", f"{seconds:.1f}"]
            if texture.centres is None:
                row.append("-")
            else:
                met = passes(result, recall_only="keyboard" in texture.name)
                total[0] += met
                total[1] += 1
                row.append("yes" if met else "no")
            print("| " + " | ".join(map(str, row)) + " |", flush=True)
            if pictures is not None:
                for name, picture in elements.pictures(found).items():
                    io.write(pictures / f"{texture.name}-{start}-{name}.png", picture)
    for start, (met, count, layouts) in totals.items():
        print(f"{start}: S1 met on {met} of {count}; layout right on {layouts}")


if __name__ == "__main__":
    if "TEXRS_TEXTURES" not in os.environ:
        sys.exit("TEXRS_TEXTURES: needs the folder of the annotated textures")
    where = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    if where is not None:
        where.mkdir(parents=True, exist_ok=True)
    main(Path(os.environ["TEXRS_TEXTURES"]), where)
