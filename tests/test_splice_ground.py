"""The background between separate elements: as rough as the texture's, with shadows of elements, in one light."""

import numpy as np

import texrs
from texrs import samples
from texrs.elements import ElementAnalysis, Layout

SIDE, RADIUS = 160, 9
SHADOW = (8, 8)
"""Centre of a disc's shadow, relative to the disc."""
LAYOUT = ElementAnalysis.of_sample(samples.load("pebbles", size=(SIDE, SIDE)))


def make_discs(*, shadow: bool = False, light: float = 0.0) -> ElementAnalysis:
    """Return discs with shadows on a rough background, optionally in a light that grows from left to right."""
    rng = np.random.default_rng(2)
    image = 0.5 + rng.normal(0, 0.05, (SIDE, SIDE))
    rows, columns = np.indices(image.shape)
    centres = np.array(
        [[20 + 40 * i + rng.integers(-4, 5), 20 + 40 * j + rng.integers(-4, 5)] for i in range(4) for j in range(4)]
    )
    mask = np.zeros(image.shape, bool)
    if shadow:
        for row, column in centres + SHADOW:
            image[(rows - row) ** 2 + (columns - column) ** 2 <= RADIUS**2] -= 0.3
    for row, column in centres:
        mask |= (rows - row) ** 2 + (columns - column) ** 2 <= RADIUS**2
    image[mask] = 0.9
    image = (image * (1 + light * (columns / SIDE - 0.5))).clip(0, 1)
    pixels = np.rint(255 * np.stack([image] * 3, axis=-1)).astype(np.uint8)
    box = (2 * RADIUS + 1, 2 * RADIUS + 1)
    return ElementAnalysis(pixels, centres.astype(float), mask, box, Layout.DISJOINT, np.ones(len(centres)))


def find_ground(result: texrs.Synthesis) -> np.ndarray:
    from scipy.ndimage import binary_dilation

    return ~binary_dilation(result.source_map.label > 0, iterations=6)


def roughness(image: np.ndarray, where: np.ndarray) -> float:
    return float(np.hypot(*np.gradient(image[..., 0].astype(float)))[where].mean())


def test_the_ground_is_as_rough_as_it_was() -> None:
    from scipy.ndimage import binary_dilation

    mine = make_discs()
    own = roughness(mine.image, ~binary_dilation(mine.mask, iterations=4))
    for screening in (None, 0.01):
        result = texrs.splice(mine, LAYOUT, seed=1, screening=screening)
        assert 0.95 <= roughness(result.image, find_ground(result)) / own <= 1.1


def test_ground_comes_from_ground() -> None:
    mine = make_discs()
    result = texrs.splice(mine, LAYOUT, seed=1, screening=None)
    rows, columns = result.source_map.coordinates.astype(int)[result.source_map.label == 0].T
    assert not mine.mask[rows, columns].any()
    assert len(np.unique(rows * SIDE + columns)) > 0.3 * (~mine.mask).sum()


def test_elements_bring_their_shadows() -> None:
    mine = make_discs(shadow=True)
    result = texrs.splice(mine, LAYOUT, seed=1)
    light = result.image[..., 0].astype(float)
    seen = []
    for found in [match["found"] for match in result.report["matches"]]:
        # Look at a part of the shadow that the disc does not cover.
        row, column = np.rint(found).astype(int) + 10
        if (
            2 <= row < SIDE - 2
            and 2 <= column < SIDE - 2
            and not result.source_map.label[row - 2 : row + 3, column - 2 : column + 3].any()
        ):
            seen.append(light[row - 1 : row + 2, column - 1 : column + 2].mean() < 255 * 0.35)
    assert len(seen) >= 5
    assert np.mean(seen) > 0.85
    # Discs do not leave a shadow at their former places.
    far = find_ground(result)
    assert (light[far] < 255 * 0.3).mean() < 0.12


def test_elements_and_ground_are_in_one_light() -> None:
    mine = make_discs(light=0.8)
    plain, even = (texrs.splice(mine, LAYOUT, seed=1, screening=weight) for weight in (None, 0.01))
    np.testing.assert_array_equal(plain.source_map.coordinates, even.source_map.coordinates)
    # Find the borders of the discs' surroundings: adjacent pixels that are not adjacent in the texture.
    apart = np.abs(np.diff(plain.source_map.coordinates, axis=1)).sum(axis=-1) != 1
    apart &= (plain.source_map.label[:, 1:] == 0) & (plain.source_map.label[:, :-1] == 0)
    rows, columns = np.indices(apart.shape)
    steps = np.zeros(2)
    for row, column in [match["found"] for match in plain.report["matches"]]:
        here = apart & ((rows - row) ** 2 + (columns + 0.5 - column) ** 2 <= (RADIUS + 6) ** 2)
        if here.sum() >= 12:
            outwards = np.sign(columns + 0.5 - column)[here]
            values = [np.diff(made.image[..., 0].astype(float), axis=1)[here] for made in (plain, even)]
            steps = np.maximum(steps, [abs((outwards * one).mean()) for one in values])
    assert steps[0] > 15
    assert steps[1] < 0.5 * steps[0]


def test_without_ground_to_speak_of_it_is_warped_as_before() -> None:
    mine = make_discs()
    # Use squares of 40 pixels with lines of one pixel between them, so that there is hardly any background.
    mask = np.ones_like(mine.mask)
    mask[::40] = mask[:, ::40] = False
    full = ElementAnalysis(mine.image, mine.points, mask, (39, 39), Layout.DISJOINT, mine.scores)
    result = texrs.splice(full, LAYOUT, 96, seed=1)
    assert result.image.shape == (96, 96, 3)
    assert result.report["screening"] == 0


def test_what_is_kept_of_a_texture_changes_nothing() -> None:
    from dataclasses import replace

    from texrs.papers.splice.entry import CACHES

    def splice_anew(entry: ElementAnalysis, seed: int) -> np.ndarray:
        for cache in CACHES:
            cache.clear()
        return np.asarray(texrs.splice(entry, LAYOUT, seed=seed).image)

    discs = make_discs(shadow=True)
    # Use the same elements in other colours.
    other = replace(discs, image=255 - discs.image)
    fresh = [splice_anew(entry, seed) for entry in (discs, other) for seed in (1, 2)]
    for _ in range(2):
        again = [texrs.splice(entry, LAYOUT, seed=seed).image for entry in (discs, other) for seed in (1, 2)]
        assert all((a == b).all() for a, b in zip(fresh, again, strict=True))
    assert not (fresh[0] == fresh[2]).all()
