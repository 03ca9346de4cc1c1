"""Patches stitched into textures: their positions, their repetitions, and their source map."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import texrs
from reference import quilting as reference
from texrs import SourceMap, samples
from texrs.blending import measure_visibility
from texrs.quilting import Picture, quilt
from texrs.quilting._quilt import find_calm_lines, find_phase
from texrs.quilting._windows import divide_axis, plan_waves


def picture(image: np.ndarray, *, mirrored: bool = False) -> Picture:
    """Return an image, or its mirror image, with its source."""
    source = SourceMap.identity(image.shape[:2])
    if mirrored:
        flipped = np.ascontiguousarray(source.coordinates[:, ::-1])
        frame = np.array([np.diag([1, -1])], np.float32)
        source = SourceMap(flipped, source.exemplar, source.label, frame, source.shapes)
    colours = (source.render(image) / 255).astype(np.float32)
    return Picture(colours, source, np.zeros(image.shape[:2], np.float32))


@pytest.fixture(scope="module")
def pebbles() -> np.ndarray:
    return samples.pebbles((128, 128)).image


def made(pictures: list[Picture], size: tuple[int, int] = (200, 240), **options: object) -> SourceMap:
    asked = {"patch": 64, "overlap": 24, "wrap": (True, True), "seed": 4} | options
    return quilt(pictures, size, progress=lambda share: None, **asked)  # type: ignore[arg-type]


@given(
    length=st.integers(16, 400),
    side=st.integers(16, 128),
    part=st.floats(0.3, 0.9),
    share=st.floats(0, 0.5),
    wrap=st.booleans(),
)
def test_spans_cover_an_axis(length: int, side: int, part: float, share: float, wrap: bool) -> None:
    patch = max(8, int(part * side))
    found = divide_axis(length, side, patch, int(share * patch), wrap)
    covered = np.zeros(length, int)
    for span in found:
        assert 0 < span.extent <= side
        places = span.start + np.arange(span.extent)
        assert wrap or places[-1] < length
        # Earlier patches cover the stated overlap at the beginning of this span, and nothing behind it.
        inside = covered[places % length] > 0
        expected = np.zeros(span.extent, bool)
        expected[: span.before] = True
        expected[span.extent - span.after :] = True
        assert (inside == expected).all()
        covered[places % length] += 1
    assert covered.min() > 0


def test_every_pixel_is_one_of_the_exemplar(pebbles: np.ndarray) -> None:
    source = made([picture(pebbles), picture(pebbles, mirrored=True)])
    assert source.shape == (200, 240)
    assert source.shapes == (pebbles.shape[:2],)
    assert (source.coordinates == np.rint(source.coordinates)).all()
    assert source.jacobian is not None
    hands = np.linalg.det(source.jacobians())
    assert set(np.unique(hands)) <= {-1.0, 1.0}
    # If a pixel and the next one are of one piece, the step between them follows its frame.
    step = np.diff(source.coordinates[..., 1], axis=1)
    same = np.diff(source.label.astype(np.int64), axis=1) == 0
    assert (np.abs(step[same]) == 1).mean() > 0.99


def test_no_piece_grows_to_a_copy(pebbles: np.ndarray) -> None:
    """The exact continuation of a patch would match without a seam. Four of them would be the exemplar again."""
    assert made([picture(pebbles)]).reuse().largest < 0.3


def test_no_mirror_image_lies_beside_its_original(pebbles: np.ndarray) -> None:
    met = edges = 0
    for seed in range(3):
        source = made([picture(pebbles), picture(pebbles, mirrored=True)], seed=seed)
        hands = np.linalg.det(source.jacobians()) > 0
        for axis in range(2):
            turned = hands != np.roll(hands, -1, axis)
            apart = np.abs(source.coordinates - np.roll(source.coordinates, -1, axis)).max(axis=-1)
            met, edges = met + int((apart[turned] <= 2).sum()), edges + int(turned.sum())
    # Without the rejection of mirrored patches, the share would be 1/7.
    assert met < 0.08 * edges


def test_same_seed_same_map_and_other_seeds_others(pebbles: np.ndarray) -> None:
    one, again, other = (made([picture(pebbles)], seed=seed) for seed in (1, 1, 2))
    assert (one.coordinates == again.coordinates).all()
    assert (one.label == again.label).all()
    assert (one.coordinates != other.coordinates).any(axis=-1).mean() > 0.5


@pytest.mark.parametrize("wrap", [(True, True), (True, False), (False, False)])
def test_threads_change_nothing(pebbles: np.ndarray, wrap: tuple[bool, bool]) -> None:
    maps = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            maps.append(made([picture(pebbles), picture(pebbles, mirrored=True)], wrap=wrap))
    assert all((m.coordinates == maps[0].coordinates).all() for m in maps)
    assert all((m.label == maps[0].label).all() for m in maps)


def test_seams_run_between_elements() -> None:
    """Colours do not differ here, but the depth does."""
    image = np.full((96, 96, 3), 128, np.uint8)
    rows, columns = np.mgrid[:96, :96] % 24
    depth = np.maximum(0, 8 - np.hypot(rows - 12, columns - 12)).astype(np.float32)
    crossed = []
    for known in (np.zeros_like(depth), depth):
        plain = picture(image)
        source = made([Picture(plain.colours, plain.source, known)], size=(192, 192))
        beside = [~source.is_coherent(axis, wrap=True) for axis in range(2)]
        crossed.append(np.mean([source.render(depth)[seam].mean() for seam in beside]))
    assert crossed[1] < 0.6 * crossed[0]


@pytest.mark.parametrize("size", [(16, 16), (17, 200), (40, 41)])
def test_a_texture_smaller_than_a_patch_is_stitched_around(pebbles: np.ndarray, size: tuple[int, int]) -> None:
    source = made([picture(pebbles)], size=size)
    assert source.shape == size
    # Each axis has at least two patches, so no step over the wrap goes from one end of a patch to its other end.
    for axis in range(2):
        apart = np.abs(source.coordinates - np.roll(source.coordinates, -1, axis)).max(axis=-1)
        ends = np.take(apart, -1, axis)
        assert (ends <= 1).mean() > 0.5


@pytest.mark.parametrize("wrap", [(True, True), (True, False), (False, False)])
@pytest.mark.parametrize("size", [(40, 41), (100, 130)])
@pytest.mark.parametrize("kind", ["plain", "mirrored", "regular", "striped", "fixed", "waves"])
def test_it_is_that_of_the_slow_twin(
    monkeypatch: pytest.MonkeyPatch, wrap: tuple[bool, bool], size: tuple[int, int], kind: str
) -> None:
    image = (samples.bricks if kind in ("regular", "striped") else samples.pebbles)((96, 144)).image
    pictures, asked = [picture(image)], {"patch": 36, "overlap": 11, "wrap": wrap, "size": size}
    if kind == "mirrored":
        pictures.append(picture(image, mirrored=True))
    elif kind in ("regular", "striped"):
        lattice = np.array([[0.0, 12.0], [24.0, 12.0]] if kind == "regular" else [[12.0, 0.0], [0.0, 0.0]])
        pictures = [Picture(p.colours, p.source, p.depth, True, lattice) for p in pictures]
    elif kind == "fixed":
        asked |= {"fixed": 0, "size": (min(size[0], 60), size[1])}
    elif kind == "waves":
        monkeypatch.setattr("texrs.quilting.LARGE", 0)
        asked |= {"size": (100, 260)}
    found = made(pictures, **asked)
    monkeypatch.setattr("texrs.quilting.stitch", reference.stitch)
    expected = made(pictures, **asked)
    assert (found.coordinates == expected.coordinates).all()
    assert (found.label == expected.label).all()


def test_a_calm_line_is_no_edge() -> None:
    lines = np.random.default_rng(0).random((65, 80, 3)).astype(np.float32) * 0.1
    lines[20:] += 0.5
    found = find_calm_lines(lines)
    assert found
    assert 20 not in found
    assert min(found) >= 1
    assert max(found) <= 64


@given(
    width=st.integers(200, 900),
    height=st.integers(40, 400),
    patch=st.integers(12, 40),
    share=st.floats(0, 0.5),
    wrap=st.tuples(st.booleans(), st.booleans()),
)
def test_patches_of_a_wave_lie_apart(
    width: int, height: int, patch: int, share: float, wrap: tuple[bool, bool]
) -> None:
    rows, columns = (
        divide_axis(n, 64, patch, int(share * patch), w) for n, w in zip((height, width), wrap, strict=True)
    )
    waves = plan_waves(rows, columns, 4)
    assert sorted((w.rows.start, w.columns.start) for wave in waves for w in wave) == sorted(
        (r.start, c.start) for r in rows for c in columns
    )
    covered = np.zeros((height, width), bool)
    for wave in waves:
        near = np.zeros((height, width), int)
        for window in wave:
            near[reference.surround(window, (height, width), wrap)[0]] += 1
            # The stated overlaps with patches above and before the window are already covered.
            at, known = reference.index(window, (height, width)), reference.mark_known(window)
            if window.rows.after == 0:
                assert covered[at][known].all()
        assert near.max() == 1
        for window in wave:
            covered[reference.index(window, (height, width))] = True


def test_waves_are_the_same_for_any_number_of_threads(monkeypatch: pytest.MonkeyPatch, pebbles: np.ndarray) -> None:
    monkeypatch.setattr("texrs.quilting.LARGE", 0)
    asked = {"size": (200, 640), "patch": 48, "overlap": 16}
    sources = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            sources.append(made([picture(pebbles)], **asked))
    assert all((s.coordinates == sources[0].coordinates).all() for s in sources[1:])
    assert all((s.label == sources[0].label).all() for s in sources[1:])
    # Another order of patches gives another texture of the same quality.
    monkeypatch.undo()
    row = made([picture(pebbles)], **asked)
    assert (row.coordinates != sources[0].coordinates).any()
    waves, raster = (measure_visibility(s, pebbles, s.render(pebbles), wrap=True) for s in (sources[0], row))
    assert waves.mean < 1.1 * raster.mean


def test_the_phase_of_a_shifted_image_is_its_shift():
    rows, columns = np.indices((72, 96))
    image = ((rows % 12 < 3) | (columns % 24 < 3)).astype(np.float32)[..., None]
    lattice = np.diag([12.0, 24.0])

    def picture(colours):
        return Picture(colours, SourceMap.identity((72, 96)), np.zeros((72, 96), np.float32), True, lattice)

    first = picture(image)
    assert find_phase(first, first) == (0.0, 0.0)
    for shift in ((5, 7), (0, 13), (11, 0)):
        assert find_phase(first, picture(np.roll(image, shift, (0, 1)))) == pytest.approx(shift, abs=1.0)
    lattice = np.array([[12.0, 0.0], [0.0, 0.0]])
    stripes = np.repeat(image[:, 5:6], 96, axis=1)
    assert find_phase(picture(stripes), picture(np.roll(stripes, 5, 0))) == pytest.approx((5, 0), abs=1.0)
