"""What options do: for each guide three of them at several settings, as strips of pictures that are made when the pages are."""

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
    """Return what is said below each picture, and what makes it."""
    return [(str(value), lambda value=value: make(value)) for value in values]


# --- the guides ------------------------------------------------------------------------------------------------------


def design() -> Iterator[Strip]:
    leaves, pebbles = samples.leaves_and_flowers((144, 144)).image, samples.pebbles((144, 144)).image
    cloth, buttons = samples.weave((144, 144)).image, samples.dots((144, 144)).image

    def rotate(angle: float) -> Picture:
        options = texrs.DeformationOptions(rotate=angle, allow_mirror=False)
        return texrs.design(pebbles, 192, deformation=options, motion="move", seed=1).image

    def mix(share: float) -> Picture:
        return texrs.design([leaves, pebbles], 192, weights=[1 - share, share], seed=1).image

    def scatter(density: float) -> Picture:
        return texrs.design([cloth, buttons], 192, density=density, seed=2).image

    yield (
        "rotate",
        "How far things that are moved may be turned, in degrees.",
        several([0, 15, 45, 90, 180], rotate),
    )
    yield (
        "weights",
        "How much each example covers: here the share of pebbles.",
        several([0.1, 0.3, 0.5, 0.7, 0.9], mix),
    )
    yield ("density", "How much is covered by things of the others.", several([0.05, 0.1, 0.2, 0.3, 0.4], scatter))


def tile() -> Iterator[Strip]:
    gravel = samples.photograph("gravel").image[:192, :192]
    lawn = samples.photograph("grass").image[:192, :192]

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
        "How far the borders are laid over each other, in pixels. Two by two.",
        several([8, 24, 48, 72, 96], cut),
    )
    yield ("wrap", "Along which axes it is cyclic. Two by two.", several(["none", "x", "y", "xy"], wrap))
    yield (
        "size",
        "How large the tile is: more than the picture is laid as a quilt.",
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
        "How many known pixels around the hole may change, which hides the seam.",
        several([0, 2, 4, 8, 16], lambda n: fill(boundary_width=n)),
    )
    yield (
        "patch_size",
        "How large the patches are, in pixels; by default several sizes are tried.",
        several([9, 17, 33, 49, 65], lambda n: fill(patch_size=n)),
    )
    yield (
        "method",
        "Whether whole patches are laid, or windows corrected until each is like one of the picture.",
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
        "How far things go on their way, from their own layout to the other.",
        several([0, 0.25, 0.5, 0.75, 1.0], part),
    )
    yield ("layout_scale", "How large the layout is drawn.", several([0.7, 0.85, 1.0, 1.25, 1.5], scale))
    yield (
        "randomise",
        "A step of `self_splice`: how far things are shaken, in distances.",
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
        "The plane that it is laid on: here its slant in degrees, of a wall seen from the front.",
        several([0, 20, 35, 50, 60], slant),
    )
    yield ("direction", "How it is turned on the plane, in degrees.", several([0, 20, 45, 70, 90], turn))
    yield (
        "vary",
        "A step of `scale_maps.edit`: how much sizes differ, where 1 is as in the example.",
        several([-1, 0, 0.5, 1, 1.2], vary),
    )


def rectify() -> Iterator[Strip]:
    floor = samples.tilted_discs((224, 224)).image

    def flatten(**angles: float) -> Picture:
        plane = texrs.PlaneView(**{"slant": 50, "tilt": 90, "fov": 50, **angles})
        return texrs.rectify(floor, view=plane, size=192, seed=1).image

    yield (
        "slant",
        "Told wrong, things are long or wide: it is 50 degrees here.",
        several([30, 40, 50, 60, 70], lambda a: flatten(slant=a)),
    )
    yield (
        "tilt",
        "Told wrong, things lean: it is 90 degrees here.",
        several([50, 70, 90, 110, 130], lambda a: flatten(tilt=a)),
    )
    yield (
        "resolution",
        "Pixels of the texture for one in the middle of the photograph.",
        several([0.35, 0.5, 0.7, 1.0, 1.4], lambda r: texrs.rectify(floor, resolution=r, seed=1).image),
    )


def solid() -> Iterator[Strip]:
    layers = samples.stripes((32, 32, 32)).image

    def grow(field: str) -> Picture:
        return volume.render_block(texrs.solid(layers, 48, field=field, seed=2).image, 240)

    yield (
        "rotation:angle",
        "How far the block is turned in a plane, in degrees.",
        several([0, 15, 30, 45, 60], lambda a: grow(f"rotation:angle={a}")),
    )
    yield (
        "scale_ramp:stop",
        "How large things are at the end, where they are as in the example at the beginning.",
        several([0.5, 0.75, 1.0, 1.5, 2.0], lambda s: grow(f"scale_ramp:axis=y,start=1,stop={s}")),
    )
    yield ("shear", "How far it leans.", several([0, 0.25, 0.5, 0.75, 1.0], lambda s: grow(f"shear:amount={s}")))


def materials() -> Iterator[Strip]:
    from scipy.ndimage import distance_transform_edt

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
        return np.kron(small, np.ones((2**level, 2**level, 1), np.uint8))

    yield (
        "light: azimuth",
        "Where the light of `preview` comes from: degrees from the right, counter-clockwise.",
        several([0, 72, 144, 216, 288], lambda a: light(a, 40)),
    )
    yield (
        "light: elevation",
        "How high it stands, in degrees.",
        several([10, 25, 45, 65, 90], lambda e: light(135, e)),
    )
    yield ("mipmaps", "Smaller copies: how often a map is halved.", several([0, 1, 2, 3, 4], shrink))


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

    yield ("seed", "Another picture each, and its boxes.", several([0, 1, 2, 3, 4], draw))
    yield ("seed, with labels", "The labels of the same pictures.", several([0, 1, 2, 3, 4], label))
    yield (
        "min_visible",
        "How much of a box a piece must show for it to have one.",
        several([0.1, 0.3, 0.5, 0.7, 0.95], lambda share: draw(3, share)),
    )


def source_map() -> Iterator[Strip]:
    grit, weave = samples.grit((144, 144)).image, samples.weave((96, 96)).image
    uneven = (grit * np.linspace(0.4, 1, 144)[:, np.newaxis, np.newaxis]).astype(np.uint8)
    # Sixteen squares from anywhere, so that there is something to hide.
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
        "How firmly values stay where seams are made to disappear: here of squares from an example that is darker above.",
        several(["none", 1.0, 0.15, 0.05, 0.01], blend),
    )
    yield (
        "interpolation",
        "Between samples of the example, here five times as large.",
        several(["nearest", "linear", "cubic"], lambda how: grown["large"].render(weave, interpolation=how)),
    )
    yield (
        "antialias",
        "Whether the example is smoothed where it is shrunk, here to a third.",
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
            pebbles, 160, deformation=texrs.DeformationOptions(**presets[preset]), motion="move", seed=seed
        ).image

    for preset, options in presets.items():
        said = ", ".join(f"{name} = {value}" for name, value in options.items())
        yield (f"presets.{preset}", f"{said}; a seed each.", several([0, 1, 2, 3, 4], lambda s, p=preset: make(s, p)))


GUIDES = (design, tile, inpaint, splice, perspective, rectify, solid, materials, augment, source_map, batch)

# --- writing ---------------------------------------------------------------------------------------------------------


def write_strips(out: Path) -> None:
    """Write a page a guide, to be included in it, and the pictures; nothing is made again while the package is as it was."""
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
                    # Upon white.
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
