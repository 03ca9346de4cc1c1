"""Make the pictures that open the guides, inputs in orange frames: python examples/guide_pictures.py [GUIDE ...]."""

import sys
from collections.abc import Callable

import numpy as np

import texrs
from layout import FOLDER, INPUT, RESULT, Panel, write_panels
from texrs import samples, volume
from texrs.painting import texture_mesh

HEIGHT = 240
"""Height of the highest picture of a row, in pixels; the others are at the same scale."""


def tile() -> list[Panel]:
    gravel = samples.photograph("gravel").image[:192, :192]
    made = texrs.tile(gravel).image
    return [
        (gravel, "input", INPUT),
        (np.tile(gravel, (2, 2)), "input, 2 x 2", INPUT),
        (made, "texrs tile", RESULT),
        (np.tile(made, (2, 2)), "result, 2 x 2", RESULT),
    ]


def design() -> list[Panel]:
    stones = samples.pebbles((160, 160)).image
    made = [texrs.design(stones, (256, 256), seed=seed).image for seed in (1, 2, 3)]
    return [(stones, "input", INPUT), *((image, f"seed {n}", RESULT) for n, image in enumerate(made, 1))]


def splice() -> list[Panel]:
    dots, net = samples.dots((192, 192)).image, samples.net((192, 192)).image
    return [
        (dots, "input: elements", INPUT),
        (net, "input: layout", INPUT),
        (texrs.splice(dots, net, seed=1).image, "texrs splice", RESULT),
        (texrs.self_splice(dots, "randomise", seed=5).image, "texrs self-splice", RESULT),
    ]


def field() -> list[Panel]:
    weave, bark = samples.weave((128, 128)).image, samples.bark((128, 128)).image
    turned = texrs.synthesize(weave, 256, field="spiral:angle=35", seed=3).image
    bent = texrs.synthesize(bark, 256, field="zigzag:period=96,angle=30", seed=1).image
    return [
        (weave, "input", INPUT),
        (turned, "along a spiral", RESULT),
        (bark, "input", INPUT),
        (bent, "along a zigzag", RESULT),
    ]


def solid() -> list[Panel]:
    wood, stone = samples.wood_solid((48, 48, 48)).image, samples.particles((32, 32, 32)).image
    rings = texrs.solid(wood, 96, field="circular:axis=z", seed=1).image
    block = texrs.solid(stone, 64, seed=1).image
    return [
        (volume.render_block(wood, 160), "input", INPUT),
        (volume.render_block(rings, 260), "around an axis", RESULT),
        (volume.render_block(stone, 160), "input", INPUT),
        (volume.render_block(block, 260), "twice the side", RESULT),
    ]


def microstructure() -> list[Panel]:
    scan = segment()
    grown = texrs.solid(scan, 80, seed=1).image
    return [
        (volume.render_block(volume.label_to_color(scan), 200), "input: labels", INPUT),
        (volume.render_block(volume.label_to_color(grown), 280), "texrs solid", RESULT),
        (volume.label_to_color(grown[40]).repeat(3, 0).repeat(3, 1), "a slice", RESULT),
    ]


def segment() -> np.ndarray:
    """Return a segmented volume: pores 0, two kinds of grains 1 and 2."""
    stone = samples.particles((40, 40, 40))
    kinds = volume.classes(stone.image, 3)
    return kinds.of(stone.image).astype(np.uint8)


def mesh() -> list[Panel]:
    block = samples.particles((48, 48, 48)).image
    side = 260
    y, x = np.mgrid[:side, :side] / (side / 2 - 4) - side / (side - 8)
    inside = x**2 + y**2 < 1
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    shade = np.clip(0.35 + 0.65 * (-0.4 * x - 0.5 * y + 0.77 * z), 0.15, 1)[..., np.newaxis]
    # The half of the ball that is seen, with a vertex for each pixel.
    number = np.cumsum(inside).reshape(side, side) - 1
    whole = inside[:-1, :-1] & inside[1:, :-1] & inside[:-1, 1:] & inside[1:, 1:]
    corners = [number[:-1, :-1][whole], number[1:, :-1][whole], number[1:, 1:][whole], number[:-1, 1:][whole]]
    faces = np.concatenate([np.stack([corners[i] for i in three], axis=-1) for three in ((0, 1, 2), (0, 2, 3))])
    ball = np.stack([x[inside], -y[inside], z[inside]], axis=-1)
    painted = texture_mesh((ball, faces), texrs.SolidTexture(block, seed=2), scale=24, atlas=None)
    shown = np.full((side, side, 3), 255, np.uint8)
    shown[inside] = painted.maps["image"] * shade[inside]
    plain = np.where(inside[..., np.newaxis], 235 * shade, 255).astype(np.uint8)
    return [
        (volume.render_block(block, side), "input: a volume", INPUT),
        (plain, "input: a mesh", INPUT),
        (shown, "texrs paint", RESULT),
    ]


def large() -> list[Panel]:
    grit = samples.grit((160, 160)).image
    tiles = texrs.CornerTiles(grit, seed=1)
    return [
        (grit, "input", INPUT),
        (tiles[0:256, 0:384], "rows 0 to 255", RESULT),
        (tiles[10**12 : 10**12 + 256, 0:384], "rows from 10^12 on", RESULT),
    ]


def inpaint() -> list[Panel]:
    wall = samples.photograph("brick").image[:224, :224]
    rows, columns = np.mgrid[:224, :224]
    hole = np.hypot(rows - 112, columns - 112) < 44
    shown = np.repeat(wall[..., np.newaxis], 3, axis=-1)
    shown[hole] = (235, 90, 40)
    filled = texrs.inpaint(wall, hole, seed=1, boundary_width=4).image
    return [
        (shown, "input", INPUT),
        (255 * hole.astype(np.uint8), "input: the hole", INPUT),
        (filled, "filled", RESULT),
    ]


def remove() -> list[Panel]:
    wall = samples.tilted_bricks((224, 280)).image
    rows, columns = np.mgrid[:224, :280]
    mark = np.hypot((rows - 130) / 1.6, columns - 96) < 27
    shade = np.clip(0.55 + (columns - 96 - (rows - 130) / 3) / -110, 0.15, 1)[..., np.newaxis]
    seen = np.where(mark[..., np.newaxis], shade * [235, 120, 60], wall).astype(np.uint8)
    return [
        (seen, "input", INPUT),
        (255 * mark.astype(np.uint8), "input: the object", INPUT),
        (texrs.remove(seen, mark, seed=3).image, "texrs remove", RESULT),
    ]


def extend() -> list[Panel]:
    wall = samples.tilted_bricks((224, 256)).image
    return [(wall, "input", INPUT), (texrs.extend(wall, left=48, right=144, seed=1).image, "texrs extend", RESULT)]


def rectify() -> list[Panel]:
    floor = samples.tilted_discs((256, 256)).image
    flat = texrs.rectify(floor, view=texrs.PlaneView(slant=50, fov=53), size=224, wrap=True, seed=1).image
    return [
        (floor, "input", INPUT),
        (flat, "texrs rectify", RESULT),
        (np.tile(flat, (2, 2, 1)), "result, 2 x 2", RESULT),
    ]


def perspective() -> list[Panel]:
    floor, bricks = samples.tilted_discs((192, 192)), samples.bricks((192, 192)).image
    wave = np.exp(0.6 * np.cos(np.linspace(0, 2 * np.pi, 224)))[np.newaxis].repeat(192, axis=0).astype(np.float32)
    grown = texrs.perspective(
        floor.image, np.asarray(floor.scale_map, np.float32), wave.shape, target=wave, seed=1
    ).image
    laid = texrs.perspective(bricks, "front", 192, target="plane:slant=50,tilt=90,fov=50", seed=3).image
    return [
        (floor.image, "input", INPUT),
        (grown, "sizes as a wave", RESULT),
        (bricks, "input", INPUT),
        (laid, "as a floor", RESULT),
    ]


def materials() -> list[Panel]:
    from scipy.ndimage import distance_transform_edt

    pebbles = samples.pebbles((128, 128))
    inside = distance_transform_edt(pebbles.labels > 0)
    height = (np.sqrt(np.minimum(inside, 12)) * 4 + pebbles.image.mean(axis=-1) / 60).astype("float32")
    example = texrs.Material({"albedo": pebbles.image, "height": height})
    made = texrs.design(example, (192, 192), seed=3).material
    return [
        (pebbles.image, "input: albedo", INPUT),
        (height / height.max(), "input: height", INPUT),
        (made["albedo"].pixels, "albedo", RESULT),
        (made["height"].pixels / height.max(), "height", RESULT),
        (made.preview(tiles=(1, 1), light=(135, 35)), "lit", RESULT),
    ]


def source_map() -> list[Panel]:
    pebbles = samples.pebbles((128, 128))
    made = texrs.design(pebbles.image, (192, 192), seed=1)
    return [
        (pebbles.image, "input", INPUT),
        (made.image, "texrs design", RESULT),
        (volume.label_to_color(pebbles.labels), "input: labels", INPUT),
        (volume.label_to_color(made.source_map.render(pebbles.labels, interpolation="nearest")), "texrs apply", RESULT),
    ]


def augment() -> list[Panel]:
    buttons = samples.dots((128, 128))
    corners = [np.argwhere(buttons.labels == n) for n in range(1, len(buttons.centres) + 1)]
    boxes = np.array([[*c.min(0)[::-1], *(c.max(0)[::-1] + 1)] for c in corners])

    def draw(image: np.ndarray, some: np.ndarray) -> np.ndarray:
        shown = np.kron(image, np.ones((2, 2, 1), np.uint8))
        for left, top, right, bottom in np.rint(2 * some).astype(int):
            for rows, columns in ((slice(top, bottom), [left, right - 1]), ([top, bottom - 1], slice(left, right))):
                shown[rows, columns] = (0, 230, 60)
        return shown

    made = [texrs.transforms.TextureAugment()(buttons.image, boxes=boxes, seed=seed) for seed in (1, 2, 3)]
    return [
        (draw(buttons.image, boxes), "input, with boxes", INPUT),
        *((draw(each.image, each.boxes), f"seed {n}", RESULT) for n, each in enumerate(made, 1)),
    ]


def files() -> list[Panel]:
    from PIL import Image

    bricks = Image.fromarray(samples.bricks((64, 64)).image).quantize(12, dither=Image.Dither.NONE).convert("RGB")
    given = np.asarray(bricks)
    made = texrs.design(given, 128, seed=1).image
    return [
        (given.repeat(4, 0).repeat(4, 1), "input: 12 colours", INPUT),
        (made.repeat(3, 0).repeat(3, 1), "result: the same 12 colours", RESULT),
    ]


def batch() -> list[Panel]:
    given = [samples.load(name, size=(128, 128)).image for name in ("pebbles", "grit")]
    panels: list[Panel] = [(image, f"input {s + 1}", INPUT) for s, image in enumerate(given)]
    return panels + [
        (texrs.design(image, 128, seed=s).image, f"result {s + 1}", RESULT) for s, image in enumerate(given)
    ]


GUIDES: tuple[Callable[[], list[Panel]], ...] = (
    tile, design, splice, field, solid, microstructure, mesh, large, inpaint, remove, extend, rectify, perspective, materials,
    source_map, augment, files, batch,
)  # fmt: skip


def main() -> None:
    """Write the pictures of the guides that are named, or of all."""
    folder = FOLDER / "guides"
    for make in GUIDES:
        if not sys.argv[1:] or make.__name__ in sys.argv[1:]:
            write_panels(folder / f"{make.__name__.replace('_', '-')}.jpg", [make()], HEIGHT)


if __name__ == "__main__":
    main()
