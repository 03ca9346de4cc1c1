"""Drawings for the pages of ideas and papers: each idea with a real result, and each paper as printed and by default."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

import texrs
from texrs import fields, samples, scale_maps, volume
from texrs.metrics import evaluate

matplotlib.use("agg")
import matplotlib.pyplot as plt

INK, ACCENT, BLUE = "#1c1b19", "#c2410c", "#1d4ed8"
Panels = Any


def lay(count: int, width: float = 11.0) -> tuple[Any, Panels]:
    """Return a figure and its panels in one row."""
    figure, panels = plt.subplots(1, count, figsize=(width, width / count + 0.45), layout="constrained")
    return figure, np.atleast_1d(panels)


def stack(figure: Any) -> None:
    """Put the panels of a figure below each other, for a phone."""
    for panel, place in zip(figure.axes, figure.add_gridspec(len(figure.axes), 1), strict=True):
        panel.set_subplotspec(place)
    figure.set_size_inches(3.2, 3.4 * len(figure.axes))


def show(panel: Any, image: Any, title: str, **options: Any) -> None:
    panel.imshow(image, **options)
    panel.set_title(title, fontsize=10, color=INK)
    panel.set_xticks([])
    panel.set_yticks([])


def picture_scale(scale: Any) -> Any:
    """Show a scale map with its key. It is enlarged, because the digits of the key have a fixed size."""
    return scale_maps.picture(np.repeat(np.repeat(scale, 2, axis=0), 2, axis=1))


def colour_places(coordinates: Any, shape: tuple[int, ...]) -> Any:
    """Show positions in an example as colours: red increases downwards, green increases to the right."""
    red, green = (coordinates[..., axis] / (shape[axis] - 1) for axis in (0, 1))
    return np.clip(np.stack([red, green, np.full_like(red, 0.45)], axis=-1), 0, 1)


# --- ideas -----------------------------------------------------------------------------------------------------------


def source_map() -> Any:
    sample = samples.dots((112, 112))
    made = texrs.design(sample.image, (112, 160), seed=6)
    source = made.source_map
    figure, panels = lay(4)
    show(panels[0], sample.image, "the example")
    show(panels[1], made.image, "the result, with three pixels")
    # Connect three pixels of the result with their sources in the example.
    for row, column in ((26, 59), (57, 89), (84, 70)):
        there = source.coordinates[row, column][::-1]
        panels[0].plot(*there, "o", ms=6, mfc="none", mec=ACCENT, mew=2)
        panels[1].plot(column, row, "o", ms=6, mfc="none", mec=ACCENT, mew=2)
        figure.add_artist(
            matplotlib.patches.ConnectionPatch(
                (column, row),
                there,
                "data",
                "data",
                axesA=panels[1],
                axesB=panels[0],
                color=ACCENT,
                lw=1.4,
                arrowstyle="->",
            )
        )
    show(panels[2], colour_places(source.coordinates, sample.image.shape), "the source map, shown as colours")
    labels = source.render(sample.labels, interpolation="nearest")
    show(panels[3], volume.label_to_color(labels), "labels of the result, looked up")
    # Draw the colours of all positions in the example as a key.
    key = panels[2].inset_axes((0.02, 0.03, 0.22, 0.3))
    place = np.stack(np.meshgrid(range(112), range(112), indexing="ij"), axis=-1)
    show(key, colour_places(place, (112, 112)), "")
    return figure


def element() -> Any:
    figure, panels = lay(4)
    for panel, (name, layout) in zip(
        panels, {"dots": "disjoint", "bricks": "jointed", "net": "connected"}.items(), strict=False
    ):
        sample = samples.load(name, size=(128, 128))
        show(panel, sample.image, f"{name}: {layout}")
        for label in np.unique(sample.labels[sample.labels > 0]):
            panel.contour(sample.labels == label, [0.5], colors=ACCENT, linewidths=1.2)
        panel.plot(*sample.centres.T[::-1], "+", color="white", ms=7, mew=1.6)
    # Enlarge the element that is nearest to the middle, with its mask, its box and the box of its surroundings.
    dots = texrs.ElementAnalysis.of_sample(samples.dots((128, 128)))
    one = min(dots.instances, key=lambda i: np.hypot(i.centre[0] - 64, i.centre[1] - 64))
    row, column = one.centre
    show(panels[3], dots.image, "an element: mask, box, surroundings")
    panels[3].contour(
        np.pad(one.mask, 1),
        [0.5],
        colors=ACCENT,
        linewidths=2,
        extent=(
            one.origin[1] - 1.5,
            one.origin[1] + one.mask.shape[1] + 0.5,
            one.origin[0] - 1.5,
            one.origin[0] + one.mask.shape[0] + 0.5,
        ),
    )
    for grow, style in ((0, "-"), (10, "--")):
        height, width = dots.box[0] + grow, dots.box[1] + grow
        panels[3].add_patch(
            plt.Rectangle((column - width / 2, row - height / 2), width, height, fill=False, ec=BLUE, lw=1.8, ls=style)
        )
    panels[3].set_xlim(column - 34, column + 34)
    panels[3].set_ylim(row + 34, row - 34)
    return figure


def scale_map() -> Any:
    floor = samples.tilted_discs((192, 192))
    scale = np.asarray(floor.scale_map, np.float32)
    figure, panels = lay(4)
    # Draw rays from the eye to tiles on a floor, and where the rays meet the image plane.
    side = panels[0]
    side.set_title("equal tiles on a floor, from the side", fontsize=10, color=INK)
    side.plot([0, 7], [0, 0], color=INK, lw=2)
    eye, screen = np.array([0.0, 2.0]), 0.9
    for start in (1.2, 2.6, 4.0, 5.4):
        side.plot([start, start + 0.8], [0, 0], color=ACCENT, lw=9, solid_capstyle="butt")
        heights = [eye[1] - eye[1] / x * screen for x in (start, start + 0.8)]
        side.plot([screen, screen], heights, color=ACCENT, lw=5, solid_capstyle="butt")
        for x in (start, start + 0.8):
            side.plot([0, x], [eye[1], 0], color="0.6", lw=0.8)
    side.plot([screen, screen], [0.2, 2.3], color=INK, lw=1)
    side.plot(*eye, "o", color=INK, ms=8)
    side.text(0.1, 2.15, "eye", fontsize=9)
    side.text(screen + 0.1, 2.15, "image", fontsize=9)
    side.set_xlim(-0.3, 7)
    side.set_ylim(-0.8, 3)
    side.set_axis_off()
    show(panels[1], floor.image, "a floor, and circles that show sizes")
    for row in (20, 60, 105, 160):
        for column in (40, 96, 152):
            panels[1].add_patch(plt.Circle((column, row), 10 * scale[row, column], fill=False, ec="white", lw=2))
    show(panels[2], picture_scale(scale), "its scale map")
    # Grow the floor again for a map that is large in the middle, within the range of its own sizes.
    at = (np.arange(192) + 0.5) / 192
    far = np.hypot(at - 0.5, at[:, np.newaxis] - 0.5) / 0.7
    low, high = np.log(np.quantile(scale, [0.05, 0.95]))
    hill = np.asarray(np.exp(high - (high - low) * np.minimum(far, 1)), np.float32)
    show(
        panels[3],
        texrs.perspective(floor.image, scale, target=hill, seed=3).image,
        "the result for another scale map",
    )
    return figure


def frame_field() -> Any:
    example, size = samples.weave((128, 128)).image, 224
    field = fields.parse("spiral:angle=35", 2)
    made = texrs.synthesize(example, size, field=field, seed=3)
    figure, panels = lay(4)

    def draw(panel: Any, places: Any, length: float) -> None:
        jacobians = field.over((size, size)).jacobians(places)
        for axis, colour in ((0, ACCENT), (1, BLUE)):
            along = jacobians[..., axis]
            panel.quiver(
                places[:, 1], places[:, 0], along[:, 1], along[:, 0], angles="xy", scale_units="xy", scale=1 / length,
                color=colour, width=0.012,
            )  # fmt: skip

    show(panels[0], example, "the example, with its axes")
    panels[0].quiver(
        [30, 30], [30, 30], [0, 50], [50, 0], angles="xy", scale_units="xy", scale=1, color=[ACCENT, BLUE], width=0.02
    )
    grid = np.stack(np.meshgrid(*[np.arange(22.0, size, 36)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    panels[1].set_xlim(0, size)
    panels[1].set_ylim(size, 0)
    panels[1].set_aspect("equal")
    show(panels[1], np.ones((size, size, 3)), "the field: axes at each point")
    draw(panels[1], grid, 24)
    show(panels[2], made.image, "the result")
    show(panels[3], made.image, "the result, with the field")
    draw(panels[3], grid[::2], 24)
    return figure


def wrap() -> Any:
    gravel = samples.photograph("brick").image[:192, :192]
    figure, panels = lay(4)
    tile, along = texrs.tile(gravel).image, texrs.tile(gravel, wrap=(False, True)).image
    show(panels[0], tile, "opposite borders are joined", cmap="gray")
    rows, columns = tile.shape[:2]
    # Arrows across each border show that opposite borders continue each other.
    arrow = {"arrowstyle": "-|>", "lw": 2.2, "shrinkA": 0, "shrinkB": 0}
    for at, colour in ((0.3, ACCENT), (0.7, ACCENT)):
        for x in (0.06, 0.94):
            panels[0].annotate(
                "",
                ((x + 0.05) * columns, at * rows),
                ((x - 0.05) * columns, at * rows),
                arrowprops={**arrow, "color": colour},
                annotation_clip=False,
            )
            panels[0].annotate(
                "",
                (at * columns, (x + 0.05) * rows),
                (at * columns, (x - 0.05) * rows),
                arrowprops={**arrow, "color": BLUE},
                annotation_clip=False,
            )
    for panel, image, title in zip(
        panels[1:],
        (gravel, along, tile),
        ("the photograph, 2 × 2", "periodic along x only, 2 × 2", "periodic along x and y, 2 × 2"),
        strict=True,
    ):
        show(panel, np.tile(image, (2, 2)), title, cmap="gray")
    return figure


# --- papers ----------------------------------------------------------------------------------------------------------


def compare(given: list[tuple[str, Any]], results: list[tuple[str, Any]]) -> Any:
    figure, panels = lay(len(given) + len(results))
    for panel, (title, image) in zip(panels, given + results, strict=True):
        show(panel, image, title, cmap="gray")
    return figure


PRINTED, OURS = 'method="paper"', "by default"
Measured = list[tuple[str, str, str]]


def tell(figures: dict[str, Any], names: dict[str, str]) -> Measured:
    """Return rows of a table: measure, value as printed, value by default."""
    return [(words, *(f"{getattr(figures[m], name):.3f}" for m in (PRINTED, OURS))) for name, words in names.items()]


JUDGED = {
    "torn": "length of seams inside elements, relative to the length of outlines (0 is best)",
    "broken": "share of lines that end at seams (0 is best)",
    "seam_blur": "share of detail that is lost next to seams (0 is best)",
    "repetition": "exact repetition, relative to random patches (1)",
}


def design() -> tuple[Any, Measured]:
    example = samples.pebbles((128, 128)).image
    made = {PRINTED: texrs.design(example, 192, method="paper", seed=1), OURS: texrs.design(example, 192, seed=1)}
    figures = {name: evaluate(example, each.source_map) for name, each in made.items()}
    return compare([("the example", example)], [(n, m.image) for n, m in made.items()]), tell(figures, JUDGED)


def splice() -> tuple[Any, Measured]:
    a, b = (texrs.ElementAnalysis.of_sample(samples.load(n, size=(160, 160))) for n in ("dots", "net"))
    made = {PRINTED: texrs.splice(a, b, method="paper", seed=1), OURS: texrs.splice(a, b, seed=1)}
    figures = {name: evaluate(a.image, each.source_map) for name, each in made.items()}
    given = [("elements", a.image), ("layout", b.image)]
    return compare(given, [(n, m.image) for n, m in made.items()]), tell(
        figures, {n: JUDGED[n] for n in ("torn", "seam_blur")}
    )


def perspective() -> tuple[Any, Measured]:
    floor = samples.tilted_discs((128, 128))
    scale = np.asarray(floor.scale_map, np.float32)
    turned = np.ascontiguousarray(scale.T)
    made = {
        name: texrs.perspective(floor.image, scale, target=turned, seed=3, **options)
        for name, options in ((PRINTED, {"method": "paper"}), (OURS, {}))
    }
    figures = {name: evaluate(floor.image, each.source_map) for name, each in made.items()}
    given = [("the example", floor.image), ("the target scale map", picture_scale(turned))]
    return compare(given, [(n, m.image) for n, m in made.items()]), tell(
        figures, {n: JUDGED[n] for n in ("torn", "broken")}
    )


def solid() -> tuple[Any, Measured]:
    stone = samples.particles((48, 48, 48)).image
    around = fields.parse("circular:axis=y,radial=z")
    made = {
        name: texrs.solid(stone, 64, field=around, seed=1, **options)
        for name, options in ((PRINTED, {"method": "paper"}), (OURS, {}))
    }
    figures = {name: volume.integrity(stone, each.source_map) for name, each in made.items()}
    names = {
        "torn": "share of element voxels in torn elements",
        "crumbs": "small fragments of elements per 100 000 voxels",
    }
    shown = [(n, volume.render_block(m.image, 320)) for n, m in made.items()]
    return compare([("the example", volume.render_block(stone, 240))], shown), tell(figures, names)


IDEAS: tuple[Callable[[], Any], ...] = (source_map, element, scale_map, frame_field, wrap)
PAPERS: tuple[Callable[[], tuple[Any, Measured]], ...] = (design, splice, perspective, solid)


def write_drawings(out: Path) -> None:
    """Write each drawing in two widths, and a table for each paper. Drawings newer than the package are kept."""
    folder = out / "drawings"
    folder.mkdir(parents=True, exist_ok=True)
    newest = max(f.stat().st_mtime for f in [Path(__file__), *Path(texrs.__file__).parent.rglob("*.py")])
    with plt.rc_context({"font.size": 10, "savefig.facecolor": "white"}):
        for make in (*IDEAS, *PAPERS):
            file = folder / f"{make.__name__.replace('_', '-')}.png"
            if file.exists() and file.stat().st_mtime > newest:
                continue
            made = make()
            figure, rows = made if isinstance(made, tuple) else (made, None)
            if rows is not None:
                table = f"| | `{PRINTED}` | {OURS} |\n|---|---|---|\n" + "".join(f"| {' | '.join(r)} |\n" for r in rows)
                file.with_suffix(".md").write_text(table, encoding="utf-8")
            figure.savefig(file, dpi=120)
            stack(figure)
            figure.savefig(file.with_stem(f"{file.stem}-narrow"), dpi=240)
            plt.close(figure)


if __name__ == "__main__":
    write_drawings(Path(__file__).resolve().parent / "generated")
