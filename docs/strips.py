"""Strips of images for the guides. Each strip shows the results of several values of one option."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np

import texrs
from texrs import samples, scale_maps, volume

Picture = np.ndarray
Strip = tuple[str, str, list[tuple[str, Callable[[], Picture]]]]
QUALITY = 82


def several(values: list[Any], make: Callable[[Any], Picture]) -> list[tuple[str, Callable[[], Picture]]]:
    """Return the caption and the function of each image of a strip, one for each value of an option."""
    return [(str(value), lambda value=value: make(value)) for value in values]


# --- the guides ------------------------------------------------------------------------------------------------------


def design() -> Iterator[Strip]:
    leaves, pebbles = samples.leaves_and_flowers((144, 144)).image, samples.pebbles((144, 144)).image
    cloth, buttons = samples.weave((144, 144)).image, samples.dots((144, 144)).image

    def rotate(angle: float) -> Picture:
        options = texrs.DeformationOptions(rotate=angle, allow_mirror=False)
        return texrs.design(pebbles, 192, deformation=options, way="move", seed=1).image

    def mix(share: float) -> Picture:
        return texrs.design([leaves, pebbles], 192, weights=[1 - share, share], seed=1).image

    def scatter(density: float) -> Picture:
        return texrs.design([cloth, buttons], 192, density=density, seed=2).image

    yield (
        "rotate",
        "Largest rotation of moved elements, in degrees.",
        several([0, 15, 45, 90, 180], rotate),
    )
    yield (
        "weights",
        "Share of each example in the result, 0 to 1. The numbers are the share of the pebbles.",
        several([0.1, 0.3, 0.5, 0.7, 0.9], mix),
    )
    yield (
        "density",
        "Share of the area that elements of the second example cover, 0 to 1.",
        several([0.05, 0.1, 0.2, 0.3, 0.4], scatter),
    )


def tile() -> Iterator[Strip]:
    gravel = samples.photograph("gravel").image[:192, :192]
    lawn = samples.photograph("grass").image[:192, :192]

    # Show 2 x 2 copies, because the borders of a single tile are not visible.
    def four(picture: Picture) -> Picture:
        return np.tile(picture, (2, 2))

    def cut(pixels: int) -> Picture:
        return four(texrs.tile(gravel, overlap=pixels).image)

    def wrap(axes: str) -> Picture:
        return four(texrs.tile(lawn, wrap=("y" in axes, "x" in axes)).image if axes != "none" else lawn)

    def size(side: int) -> Picture:
        return texrs.tile(gravel, size=side).image

    yield (
        "overlap",
        "Overlap of opposite borders, in pixels. The images show 2 x 2 copies of the tile.",
        several([8, 24, 48, 72, 96], cut),
    )
    yield (
        "wrap",
        "Axes along which the result is periodic. The images show 2 x 2 copies of the result.",
        several(["none", "x", "y", "xy"], wrap),
    )
    yield (
        "size",
        "Side of the tile, in pixels. The image has a side of 192 pixels. A larger tile is composed of patches.",
        several([96, 144, 192, 288, 384], size),
    )


def inpaint() -> Iterator[Strip]:
    wall = samples.photograph("brick").image[:224, :224]
    rows, columns = np.mgrid[:224, :224]
    hole = np.hypot(rows - 112, columns - 112) < 44

    def fill(**options: Any) -> Picture:
        return texrs.inpaint(wall, hole, seed=1, **options).image

    yield (
        "boundary_width",
        "Width of the band around the hole that may change, in pixels. The band hides the seam.",
        several([0, 2, 4, 8, 16], lambda n: fill(boundary_width=n)),
    )
    yield (
        "patch_size",
        "Side of the patches, in pixels. By default several sizes are tried.",
        several([9, 17, 33, 49, 65], lambda n: fill(patch_size=n)),
    )
    yield (
        "method",
        "`patch` copies patches. `optimise` changes the hole until each of its windows resembles a window of the image.",
        several(["patch", "optimise"], lambda name: fill(method=name)),
    )


def splice() -> Iterator[Strip]:
    dots = texrs.ElementAnalysis.of_sample(samples.dots((192, 192)))
    net = samples.net((192, 192)).image

    def part(strength: float) -> Picture:
        return texrs.splice(dots, net, strength=strength, seed=3).image

    def scale(factor: float) -> Picture:
        return texrs.splice(dots, net, layout_scale=factor, seed=3).image

    def shake(amount: float) -> Picture:
        steps = ["regularise", {"op": "randomise", "amount": amount}]
        return texrs.self_splice(dots, steps, seed=3).image

    yield (
        "strength",
        "Strength of the change, from 0 (elements stay in their own layout) to 1 (elements are in the other layout).",
        several([0, 0.25, 0.5, 0.75, 1.0], part),
    )
    yield ("layout_scale", "Scale factor of the layout.", several([0.7, 0.85, 1.0, 1.25, 1.5], scale))
    yield (
        "randomise",
        "A step of `self_splice`. The numbers are its `amount`: the random displacement, relative to the spacing of elements.",
        several([0, 0.1, 0.2, 0.3, 0.4], shake),
    )


def perspective() -> Iterator[Strip]:
    bricks, floor = samples.bricks((192, 192)).image, samples.tilted_discs((192, 192))
    scale = np.asarray(floor.scale_map, np.float32)

    def slant(angle: float) -> Picture:
        return texrs.perspective(bricks, "front", 192, target=f"plane:slant={angle},tilt=90,fov=50", seed=3).image

    def turn(angle: float) -> Picture:
        return texrs.perspective(bricks, "front", 192, direction=angle, seed=3).image

    def vary(gain: float) -> Picture:
        target = np.asarray(scale_maps.edit(scale, [{"op": "vary", "gain": gain}]))
        return texrs.perspective(floor.image, scale, target=target, seed=3).image

    yield (
        "target",
        "Plane that is covered with the texture. The numbers are its slant, in degrees.",
        several([0, 20, 35, 50, 60], slant),
    )
    yield ("direction", "Rotation of the texture, in degrees counter-clockwise.", several([0, 20, 45, 70, 90], turn))
    yield (
        "vary",
        "A step of `scale_maps.edit`. The numbers are its `gain`: 1 keeps the sizes of the example, and 0 makes them equal.",
        several([-1, 0, 0.5, 1, 1.2], vary),
    )


def rectify() -> Iterator[Strip]:
    floor = samples.tilted_discs((224, 224)).image

    def flatten(**angles: float) -> Picture:
        plane = texrs.PlaneView(**{"slant": 50, "tilt": 90, "fov": 50, **angles})
        return texrs.rectify(floor, view=plane, size=192, seed=1).image

    yield (
        "slant",
        "Slant of the plane, in degrees. Its correct value is 50. With other values, elements become too long or too wide.",
        several([30, 40, 50, 60, 70], lambda a: flatten(slant=a)),
    )
    yield (
        "tilt",
        "Tilt of the plane, in degrees. Its correct value is 90. With other values, elements are sheared.",
        several([50, 70, 90, 110, 130], lambda a: flatten(tilt=a)),
    )
    yield (
        "resolution",
        "Resolution of the texture, relative to the resolution in the middle of the photograph.",
        several([0.35, 0.5, 0.7, 1.0, 1.4], lambda r: texrs.rectify(floor, resolution=r, seed=1).image),
    )


def solid() -> Iterator[Strip]:
    layers = samples.stripes((32, 32, 32)).image

    def grow(field: str) -> Picture:
        return volume.render_block(texrs.solid(layers, 48, field=field, seed=2).image, 240)

    yield (
        "rotation:angle",
        "Rotation of the texture in a plane, in degrees.",
        several([0, 15, 30, 45, 60], lambda a: grow(f"rotation:angle={a}")),
    )
    yield (
        "scale_ramp:stop",
        "Scale of the texture at the end of an axis. At the beginning of the axis, the scale is 1.",
        several([0.5, 0.75, 1.0, 1.5, 2.0], lambda s: grow(f"scale_ramp:axis=y,start=1,stop={s}")),
    )
    yield (
        "shear",
        "Shear of the texture. The numbers are its `amount`.",
        several([0, 0.25, 0.5, 0.75, 1.0], lambda s: grow(f"shear:amount={s}")),
    )


def materials() -> Iterator[Strip]:
    from scipy.ndimage import distance_transform_edt

    # Estimate heights from the labels: each pebble is a dome.
    pebbles = samples.pebbles((144, 144))
    inside = distance_transform_edt(pebbles.labels > 0)
    height = (np.sqrt(np.minimum(inside, 12)) * 4).astype("float32")
    maps = {"albedo": pebbles.image, "height": height, "roughness": np.full((144, 144), 110, np.uint8)}
    stones = texrs.Material(maps)

    def light(azimuth: float, elevation: float) -> Picture:
        return stones.preview(tiles=(1, 1), light=(azimuth, elevation))

    def shrink(level: int) -> Picture:
        with tempfile.TemporaryDirectory() as folder:
            texrs.Material({"albedo": pebbles.image}).save(folder, mipmaps=True)
            files = sorted(Path(folder).rglob("*.png"), key=lambda f: -texrs.io.read(f).shape[0])
            small = texrs.io.read(files[level])
        # Enlarge the copy to the size of the map, so that all images of the strip have one size.
        return np.kron(small, np.ones((2**level, 2**level, 1), np.uint8))

    yield (
        "light: azimuth",
        "Direction of the light of `preview`, in degrees counter-clockwise from the right.",
        several([0, 72, 144, 216, 288], lambda a: light(a, 40)),
    )
    yield (
        "light: elevation",
        "Elevation of the light above the surface, in degrees.",
        several([10, 25, 45, 65, 90], lambda e: light(135, e)),
    )
    yield (
        "mipmaps",
        "Smaller copies of a map. The number n means that the map has 1/2^n of its size.",
        several([0, 1, 2, 3, 4], shrink),
    )


def augment() -> Iterator[Strip]:
    buttons = samples.dots((128, 128))
    boxes = np.array(
        [
            [*(np.argwhere(buttons.labels == n).min(0)[::-1]), *(np.argwhere(buttons.labels == n).max(0)[::-1] + 1)]
            for n in range(1, len(buttons.centres) + 1)
        ]
    )

    def draw(seed: int, min_visible: float = 0.5) -> Picture:
        made = texrs.transforms.TextureAugment(min_visible)(buttons.image, boxes=boxes, seed=seed)
        image = np.kron(made.image, np.ones((2, 2, 1), np.uint8))
        for left, top, right, bottom in np.rint(2 * made.boxes).astype(int):
            for rows, columns in (
                (slice(top, bottom), [left, right - 1]),
                ([top, bottom - 1], slice(left, right)),
            ):
                image[rows, columns] = (0, 230, 60)
        return image

    def label(seed: int) -> Picture:
        return volume.label_to_color(texrs.transforms.TextureAugment()(buttons.image, buttons.labels, seed=seed).mask)

    yield ("seed", "Each seed gives another image with other bounding boxes.", several([0, 1, 2, 3, 4], draw))
    yield ("seed, with labels", "Labels of the images above.", several([0, 1, 2, 3, 4], label))
    yield (
        "min_visible",
        "Minimum share of a bounding box that a piece must show to get a bounding box.",
        several([0.1, 0.3, 0.5, 0.7, 0.95], lambda share: draw(3, share)),
    )


def source_map() -> Iterator[Strip]:
    grit, weave = samples.grit((144, 144)).image, samples.weave((96, 96)).image
    uneven = (grit * np.linspace(0.4, 1, 144)[:, np.newaxis, np.newaxis]).astype(np.uint8)
    # Take sixteen squares from random places, so that their seams are visible without a correction.
    corner = np.random.default_rng(4).integers(0, 144 - 44, (4, 4, 2)).repeat(44, axis=0).repeat(44, axis=1)
    places = np.moveaxis(np.indices((176, 176)) % 44, 0, -1) + corner
    patches = (np.indices((176, 176)) // 44 * [[[4]], [[1]]]).sum(axis=0).astype(np.uint32)
    squares = texrs.SourceMap.from_coordinates(places.astype(np.float32), (144, 144), label=patches)
    field = {"large": "scale_ramp:start=5,stop=5", "small": "scale_ramp:start=0.3,stop=0.3"}
    grown = {name: texrs.synthesize(weave, 144, field=words, seed=2).source_map for name, words in field.items()}

    def blend(screening: float | str) -> Picture:
        return (
            squares.render(uneven)
            if screening == "none"
            else texrs.blend(squares, uneven, wrap=False, screening=screening)
        )

    def smooth(antialias: bool) -> Picture:
        return grown["small"].render(weave, interpolation="cubic", antialias=antialias)

    yield (
        "screening",
        "Weight of the original values when seams are corrected. The example of the squares is darker at the top.",
        several(["none", 1.0, 0.15, 0.05, 0.01], blend),
    )
    yield (
        "interpolation",
        "Interpolation between pixels of the example. Here the example is enlarged 5x.",
        several(["nearest", "linear", "cubic"], lambda how: grown["large"].render(weave, interpolation=how)),
    )
    yield (
        "antialias",
        "If True, the example is smoothed where it is reduced in size. Here it is reduced to 0.3 of its size.",
        several([True, False], smooth),
    )


def batch() -> Iterator[Strip]:
    pebbles = samples.pebbles((144, 144)).image
    presets = {
        "calm": {"rotate": 0.0},
        "turned": {"rotate": 180.0, "allow_mirror": False},
        "mixed sizes": {"rotate": 180.0, "scale": (0.6, 1.5)},
    }

    def make(seed: int, preset: str) -> Picture:
        return texrs.design(
            pebbles, 160, deformation=texrs.DeformationOptions(**presets[preset]), way="move", seed=seed
        ).image

    for preset, options in presets.items():
        said = ", ".join(f"{name} = {value}" for name, value in options.items())
        yield (
            f"presets.{preset}",
            f"Options of this preset: {said}. The numbers are seeds.",
            several([0, 1, 2, 3, 4], lambda s, p=preset: make(s, p)),
        )


GUIDES = (design, tile, inpaint, splice, perspective, rectify, solid, materials, augment, source_map, batch)

# --- writing ---------------------------------------------------------------------------------------------------------


def write_strips(out: Path) -> None:
    """Write the strips of each guide and their images. If a page is newer than the package, it is kept."""
    folder, pictures = out / "strips", out / "extra" / "strips"
    newest = max(f.stat().st_mtime for f in [Path(__file__), *Path(texrs.__file__).parent.rglob("*.py")])
    for guide in GUIDES:
        page = folder / f"{guide.__name__}.md"
        if page.exists() and page.stat().st_mtime > newest:
            continue
        folder.mkdir(parents=True, exist_ok=True)
        pictures.mkdir(parents=True, exist_ok=True)
        text = ""
        for number, (name, about, settings) in enumerate(guide()):
            text += f'**`{name}`**: {about}\n\n```{{raw}} html\n<div class="strip">\n'
            for place, (said, make) in enumerate(settings):
                file = pictures / f"{guide.__name__}-{number}-{place}.jpg"
                image = make()
                if image.ndim == 3 and image.shape[2] == 4:
                    # JPEG has no alpha, so put the image on white.
                    image = 255 - (255 - image[..., :3].astype(int)) * image[..., 3:] // 255
                iio.imwrite(file, image.astype(np.uint8), quality=QUALITY)
                height, width = image.shape[:2]
                alt = f"{guide.__name__} with {name} {said}"
                picture = (
                    f'<img src="../strips/{file.name}" width="{width}" height="{height}" loading="lazy" alt="{alt}">'
                )
                text += (
                    f'<figure><a href="../strips/{file.name}">{picture}</a><figcaption>{said}</figcaption></figure>\n'
                )
            text += "</div>\n```\n\n"
        page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_strips(Path(__file__).resolve().parent / "generated")
