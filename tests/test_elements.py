"""Elements of textures with known centres and masks; bad input; entries as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import texrs
from element_checks import passes, score
from texrs import elements, samples
from texrs._arrays import to_lab
from texrs.elements import ElementAnalysis, ElementSearch, Layout, analyse
from texrs.elements._mask import cut_foreground
from texrs.elements._mixture import Mixture
from texrs.elements._search import Detections, Template, threshold_otsu
from texrs.elements._separation import reconcile
from texrs.errors import FileError, InvalidInput
from texrs.exemplar.element_finder import find_elements
from texrs.point_sets import directions

DISC, SPACING = 9, 32


def discs(rows: int = 5, columns: int = 6, *, jitter: int = 4, seed: int = 0, radius: float = DISC) -> tuple:
    """Return shaded discs on a grainy background: image, centres, mask."""
    rng = np.random.default_rng(seed)
    size = (rows * SPACING, columns * SPACING)
    centres = (np.indices((rows, columns)).reshape(2, -1).T + 0.5) * SPACING
    centres = np.rint(centres + rng.uniform(-jitter, jitter, centres.shape))
    grid = np.indices(size).transpose(1, 2, 0)
    image = np.array([0.55, 0.5, 0.3]) + rng.normal(0, 0.02, (*size, 3))
    mask = np.zeros(size, bool)
    for centre in centres:
        off = (grid - centre) / radius
        inside = (off**2).sum(axis=-1) <= 1
        mask |= inside
        tone = (0.6 + 0.25 * off[..., 0])[inside, None] * np.array([0.9, 0.4, 0.35])
        image[inside] = tone + rng.normal(0, 0.02, tone.shape)
    return np.clip(image * 255, 0, 255).astype(np.uint8), centres, mask


IMAGE, CENTRES, MASK = discs()
BOX = (*CENTRES[8], 2 * DISC + 1, 2 * DISC + 1)
GROUND = [(c[0], c[1] + SPACING / 2) for c in CENTRES[[0, 7, 14, 21, 28]]]


@pytest.fixture(scope="module")
def entry() -> ElementAnalysis:
    return analyse(IMAGE, box=BOX, background=GROUND, layout="disjoint")


# --- what is found ---------------------------------------------------------------------------------------------------


def test_elements_mask_and_places(entry: ElementAnalysis) -> None:
    found = score(entry.points, CENTRES, BOX[2:], IMAGE.shape)
    assert found.recall == 1
    assert found.precision == 1
    assert found.error < 0.7
    assert (entry.mask & MASK).sum() / (entry.mask | MASK).sum() > 0.88
    assert entry.report["mask"] == "finder"
    assert entry.box == (19, 19)
    assert (np.diff(entry.scores) <= 0).all()


@pytest.mark.parametrize(
    ("name", "recall", "overlap"), [("dots", 0.88, 0.75), ("leaves_and_flowers", 0.9, 0.7), ("net", 0.95, 0.3)]
)
def test_samples_with_exact_centres(name: str, recall: float, overlap: float) -> None:
    sample = samples.load(name)
    box, ground = annotate(sample)
    found = analyse(sample.image, box=box, background=ground, layout=sample.layout)
    result = score(found.points, sample.centres, box[2:], sample.image.shape)
    assert result.inner >= recall
    assert result.precision >= 0.95
    assert result.error <= 1.5
    assert (found.mask & sample.mask).sum() / (found.mask | sample.mask).sum() >= overlap


def annotate(sample: samples.Sample) -> tuple:
    """Return the annotation of a sample by a user: the box of a usual element, and points far from all elements."""
    from scipy.ndimage import distance_transform_edt, find_objects

    height, width = sample.image.shape[:2]
    boxes = [
        ((r.start + r.stop - 1) / 2, (c.start + c.stop - 1) / 2, r.stop - r.start, c.stop - c.start)
        for r, c in (s for s in find_objects(sample.labels) if s)
        if r.start > 0 and c.start > 0 and r.stop < height and c.stop < width
    ]
    usual = np.median([b[2] * b[3] for b in boxes])
    away = distance_transform_edt(~sample.mask)
    far = np.argwhere(away >= np.quantile(away[~sample.mask], 0.9))
    return min(boxes, key=lambda b: abs(b[2] * b[3] - usual)), far[:: max(1, len(far) // 8)]


def test_a_mask_of_all_replaces_the_cut() -> None:
    found = analyse(IMAGE, mask=MASK, layout="disjoint")
    assert found.report["mask"] == "given"
    np.testing.assert_array_equal(found.mask, MASK)
    assert len(found.points) == len(CENTRES)


def test_a_mask_of_one_is_a_start() -> None:
    rows, columns = np.indices(MASK.shape)
    one = MASK & (np.hypot(rows - CENTRES[8][0], columns - CENTRES[8][1]) < DISC + 2)
    found = analyse(IMAGE, mask=one, background=GROUND, layout="disjoint")
    assert found.report["box"][:2] == CENTRES[8].astype(int).tolist()
    assert analyse(IMAGE, mask=one, layout="disjoint").report["proposed"] == ["background"]
    assert score(found.points, CENTRES, BOX[2:], IMAGE.shape).recall == 1


def test_points_that_are_listed_stay() -> None:
    listed = CENTRES[:7] + 0.25
    found = analyse(IMAGE, points=listed, background=GROUND, layout="disjoint")
    np.testing.assert_array_equal(found.points, listed)
    assert found.mask[tuple(np.rint(listed).astype(int).T)].all()


def test_elements_that_look_like_the_ground_are_copies_of_the_box() -> None:
    grey = IMAGE[..., 1].copy()
    grey[MASK] = (grey[MASK] * 0.2 + 100).astype(np.uint8)
    grey[~MASK] = (grey[~MASK] * 0.3 + 88).astype(np.uint8)
    found = analyse(grey, box=BOX, background=GROUND, layout="disjoint")
    assert score(found.points, CENTRES, BOX[2:], IMAGE.shape).recall > 0.8
    assert (found.mask & MASK).sum() / (found.mask | MASK).sum() > 0.6


def test_rotations_find_turned_elements() -> None:
    rng = np.random.default_rng(1)
    image = np.full((160, 160), 0.4) + rng.normal(0, 0.01, (160, 160))
    grid = np.indices(image.shape).transpose(1, 2, 0)
    centres, angles = [], []
    for k in range(16):
        centre, turn = np.array([20 + 40 * (k // 4), 20 + 40 * (k % 4)]), 90.0 * (k % 2)
        off = grid - centre
        along, across = (off[..., 1], off[..., 0]) if turn == 0 else (off[..., 0], off[..., 1])
        image[(abs(along) <= 12) & (abs(across) <= 4)] += 0.4
        centres.append(centre)
        angles.append(turn)
    given = {"box": (20, 20, 11, 27), "background": [(40, 40), (80, 80), (120, 40)], "layout": "disjoint"}
    found = analyse(image, search=ElementSearch(rotations=4, threshold=0.5), **given)
    assert score(found.points, np.array(centres, float), (20, 20), image.shape).recall == 1
    assert found.angles is not None
    nearest = np.argmin(((found.points[:, None] - np.array(centres)) ** 2).sum(axis=-1), axis=1)
    np.testing.assert_array_equal(found.angles % 180, np.array(angles)[nearest])
    assert len(analyse(image, search=ElementSearch(threshold=0.5), **given).points) <= 16


def test_directions() -> None:
    grid = np.indices((8, 9)).reshape(2, -1).T
    assert directions(grid * [10.0, 10.0])[:2] in ((0.0, 90.0), (90.0, 0.0))
    turn = np.deg2rad(20)
    turned = grid * 10.0 @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    assert {round(p) for p in directions(turned)[:2]} == {20, 110}
    rng = np.random.default_rng(5)
    assert len(directions(rng.uniform(0, 100, (3, 2)))) == 0


def test_the_automatic_start() -> None:
    found = analyse(IMAGE)
    assert found.layout == Layout.DISJOINT
    assert found.report["proposed"] == ["box", "background", "layout"]
    assert all(0 < sure <= 1 for sure in found.report["confidence"].values())
    assert passes(score(found.points, CENTRES, BOX[2:], IMAGE.shape))


def test_the_elements_are_those_of_the_finder() -> None:
    found, seen = analyse(IMAGE), find_elements(IMAGE)
    assert found.known is not None
    assert found.labels is found.known
    assert ((found.labels > 0) == (seen.labels > 0)).all()
    assert (found.mask == (seen.labels > 0)).all()
    pairs = np.unique(np.stack([found.labels.ravel(), seen.labels.ravel()]), axis=1)
    assert pairs.shape[1] == len(seen.elements) + 1
    sure = [seen.elements[n - 1].confidence for n in pairs[1, 1:]]
    np.testing.assert_allclose(
        [one.confidence for one in found.instances][: len(found.points)], sure[: len(found.points)]
    )


def test_the_report_contains_the_lattice() -> None:
    found = analyse(samples.weave((128, 128)).image)
    assert "lattice of periods" in found.report["lattice"]["description"]
    assert f"found, {found.report['lattice']['confidence']:.0%} sure" in elements.to_html(found)
    assert "lattice" not in analyse(samples.dots((128, 128)).image).report


@pytest.mark.parametrize("layout", ["jointed", "connected"])
def test_a_given_layout_replaces_the_one_that_is_found(layout: str) -> None:
    found, plain = analyse(IMAGE, layout=layout), analyse(IMAGE)
    assert str(found.layout) == layout
    assert "layout" not in found.report["confidence"]
    np.testing.assert_array_equal(found.labels, plain.labels)
    np.testing.assert_array_equal(found.mask, plain.mask if layout == "jointed" else ~plain.mask)


def test_background_removes_the_elements_that_it_hits() -> None:
    plain = analyse(IMAGE)
    hit = [tuple(CENTRES[3]), tuple(CENTRES[20])]
    found = analyse(IMAGE, background=[*hit, GROUND[0]])
    assert len(found.points) == len(plain.points) - 2
    assert not found.mask[tuple(np.array(hit, int).T)].any()
    assert "background" not in found.report["confidence"]


def test_elements_unlike_the_one_in_the_box_are_dropped() -> None:
    image, other = IMAGE.copy(), CENTRES[1::5]
    for row, column in other.astype(int):
        disc = np.s_[row - DISC - 1 : row + DISC + 2, column - DISC - 1 : column + DISC + 2]
        image[disc] = np.where(MASK[disc][..., None], image[disc][..., ::-1], image[disc])
    found = analyse(image, box=(*CENTRES[2], *BOX[2:]))
    assert len(found.points) == len(CENTRES) - len(other)
    assert np.abs(found.points[:, None] - other).max(axis=-1).min() > DISC
    # Without an element of the size of the box, the places that look like the box are searched for.
    assert analyse(image, box=(*CENTRES[2], 9, 9)).report["mask"] != "finder"


def test_elements_continue_across_a_periodic_border() -> None:
    moved = np.roll(IMAGE, (SPACING // 2, SPACING // 2), (0, 1))
    found = analyse(moved, wrap=True)
    assert len(found.points) == found.labels.max() == len(CENTRES)
    area = np.bincount(found.labels.ravel())[1:]
    assert area.min() > 0.9 * np.median(area)
    assert len(analyse(moved).instances) > len(CENTRES)


def test_the_letter_of_the_paper() -> None:
    found = analyse(IMAGE, box=BOX, background=GROUND, layout="disjoint", method="paper")
    assert found.report["threshold"] == -1
    assert found.report["channel"] in range(8)
    assert len(found.points) > len(CENTRES)


@pytest.mark.parametrize("kind", ["grey", "float", "sixteen", "alpha"])
def test_any_array(kind: str, entry: ElementAnalysis) -> None:
    given = {
        "grey": IMAGE[..., 0],
        "float": IMAGE.astype(np.float32) / 255,
        "sixteen": IMAGE.astype(np.uint16) * 257,
        "alpha": np.dstack([IMAGE, np.full(MASK.shape, 255, np.uint8)]),
    }[kind]
    found = analyse(given, box=BOX, background=GROUND, layout="disjoint")
    assert found.image.dtype == given.dtype
    assert score(found.points, CENTRES, BOX[2:], IMAGE.shape).recall == 1
    if kind != "grey":
        np.testing.assert_allclose(found.points, entry.points, atol=0.2)


def test_wrap() -> None:
    moved = np.roll(IMAGE, (SPACING // 2, SPACING // 2), (0, 1))
    place = (BOX[0] + SPACING // 2, BOX[1] + SPACING // 2, *BOX[2:])
    ground = [((r + SPACING / 2) % IMAGE.shape[0], (c + SPACING / 2) % IMAGE.shape[1]) for r, c in GROUND]
    found = analyse(moved, box=place, background=ground, layout="disjoint", wrap=True)
    assert len(found.points) == len(CENTRES)
    assert found.wrap == (True, True)


def test_same_bytes_for_any_number_of_threads() -> None:
    found = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            made = analyse(IMAGE, box=BOX, background=GROUND, layout="disjoint")
            sets = made.similarity().sets
        found.append((made.points.tobytes(), made.mask.tobytes(), made.scores.tobytes(), sets.tobytes()))
    assert len(set(found)) == 1


# --- parts -----------------------------------------------------------------------------------------------------------


def test_otsu_parts_two_heaps() -> None:
    assert 0.3 < threshold_otsu(np.array([0.1, 0.2, 0.25, 0.7, 0.8, 0.9, 0.95])) < 0.65


def test_a_mixture_knows_its_colours() -> None:
    rng = np.random.default_rng(0)
    samples_of = np.concatenate([rng.normal(m, 0.03, (500, 3)) for m in (0.2, 0.8)])
    model = Mixture.fit(samples_of)
    near, far = model.log(np.array([[0.2] * 3, [0.5] * 3]))
    assert near > far + 5
    np.testing.assert_array_equal(model.means, Mixture.fit(samples_of).means)
    assert np.isfinite(Mixture.fit(np.full((3, 3), 0.4)).log(np.zeros((2, 3)))).all()


# --- bad input -------------------------------------------------------------------------------------------------------

GOOD = {"box": BOX, "background": GROUND, "layout": "disjoint"}
HALF = np.zeros(MASK.shape, bool)
HALF[:, :40] = True


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"box": (300, 50, 20, 20)},
            "box: reaches from 290 to 310 along the rows, outside the image, which has 160",
        ),
        ({"box": (80, 96, 1, 20)}, "box: sides must be at least 3"),
        ({"background": [(5, 900)]}, "background: point 0, .* outside the image"),
        ({"background": [(5, 5), (np.nan, 3)]}, "background: must be finite, but point 1"),
        ({"background": [(5, 5), (5, 5)]}, "background: point 1, .* occurs twice"),
        ({"background": [BOX[:2]]}, "background: contradicts the box"),
        ({"mask": MASK, "background": [tuple(CENTRES[3])]}, "background: contradicts the mask"),
        ({"mask": HALF, "box": None, "background": None}, "box: must be given"),
        (
            {"mask": HALF, "box": (80, 30, 30, 30), "background": None},
            "layout: contradicts the mask: disjoint means",
        ),
        (
            {"mask": MASK, "background": None, "layout": "connected"},
            "layout: contradicts the mask: connected means",
        ),
        ({"mask": np.ones_like(MASK)}, "mask: must contain foreground and background, got only foreground"),
        ({"points": [(10, 10), (20, np.inf)]}, "points: must be finite, but point 1"),
        ({"points": [(10, 10), (20, 10), (10, 10)]}, "points: point 2, .* occurs twice"),
        ({"points": [(10, 10), (20, 400)]}, "points: point 1, .* outside"),
        ({"search": {"scales": [9.0]}}, "scales\\[0\\]: must be a number"),
    ],
)
def test_bad_input_gets_a_sentence(change: dict, message: str) -> None:
    given = {**GOOD, **change}
    with pytest.raises(InvalidInput, match=message):
        analyse(IMAGE, **{**given, "search": ElementSearch(**given.get("search", {}))})


@pytest.mark.parametrize(("paper", "layout"), [("F=d", "disjoint"), ("F=c", "connected"), ("B=c", "jointed")])
def test_layouts_go_by_two_names(paper: str, layout: str) -> None:
    assert Layout(paper) is Layout(layout)
    assert str(Layout(paper)) == layout
    assert ElementAnalysis(IMAGE, CENTRES, MASK, (19, 19), paper, np.ones(len(CENTRES))).layout is Layout(layout)


def test_options_are_checked_where_they_are_made() -> None:
    with pytest.raises(TypeError):
        ElementSearch(4)


def test_too_few_elements() -> None:
    with pytest.raises(InvalidInput, match="image: must show at least 3 elements, found [012]; try another box"):
        analyse(IMAGE, search=ElementSearch(threshold=0.9999), method="paper", **GOOD)


@pytest.mark.parametrize("image", [np.zeros((40, 40), np.uint8), np.full((20, 200, 3), 0.5)], ids=["black", "grey"])
def test_nothing_to_be_found(image: np.ndarray) -> None:
    with pytest.raises(InvalidInput, match="^box: no box could be proposed for this image; give a box or the points$"):
        analyse(image.astype(np.float32))


def test_elements_of_noise_are_inside_the_image() -> None:
    found = analyse(np.random.default_rng(0).random((32, 40, 4)).astype(np.float32))
    assert len(found.points) >= 3
    assert ((found.points >= -0.5) & (found.points <= np.array([31.5, 39.5]))).all()
    assert 0 < found.mask.mean() < 1


def test_a_texture_without_elements_gets_a_doubtful_layout() -> None:
    found = analyse(samples.load("bark", size=(160, 160)).image)
    assert found.report["found"] == "none"
    assert found.report["confidence"]["layout"] < 0.5
    assert any("give the layout" in warning for warning in found.report["warnings"])


# --- files -----------------------------------------------------------------------------------------------------------


def test_an_entry_comes_back(tmp_path: Path, entry: ElementAnalysis) -> None:
    kept = entry.with_similarity(k=2)
    kept.save(tmp_path / "e.npz")
    back = elements.load(tmp_path / "e.npz")
    for name in ("image", "points", "mask", "scores", "angles", "scales"):
        np.testing.assert_array_equal(getattr(back, name), getattr(kept, name))
    assert (back.box, back.layout, back.directions, back.wrap, back.report) == (
        kept.box,
        kept.layout,
        kept.directions,
        kept.wrap,
        kept.report,
    )
    assert back.sets is not None
    np.testing.assert_array_equal(back.similarity(k=2).sets, entry.similarity(k=2).sets)


def test_entries_that_cannot_be_read(tmp_path: Path, entry: ElementAnalysis) -> None:
    path = tmp_path / "e.npz"
    entry.save(path)
    parts = dict(np.load(path))
    whole = path.read_bytes()

    def written(**change: object) -> Path:
        np.savez(path, **{**parts, **change})
        return path

    for version in (1, 99):
        with pytest.raises(
            FileError, match=f"version {version}, but this texrs reads version 2; analyse the texture again"
        ):
            elements.load(written(texrs_elements=np.array(version)))
    with pytest.raises(FileError, match="damaged .*differs from the analysed image"):
        elements.load(written(image=255 - parts["image"]))
    with pytest.raises(FileError, match="damaged .*points"):
        elements.load(written(points=parts["points"][:, :1]))
    with pytest.raises(FileError, match="damaged .*layout"):
        elements.load(written(layout=np.frombuffer(b"F=x", np.uint8)))
    for labels in (np.full(entry.mask.shape, 2**31 - 1), np.zeros(entry.mask.shape)):
        with pytest.raises(FileError, match="damaged .*known elements"):
            elements.load(written(known=labels.astype(np.int32)))
    np.savez(path, other=np.zeros(3))
    with pytest.raises(FileError, match="not an analysis"):
        elements.load(path)
    for length in (0, 10, len(whole) // 2, len(whole) - 30):
        path.write_bytes(whole[:length])
        with pytest.raises(FileError):
            elements.load(path)


def test_pictures(entry: ElementAnalysis) -> None:
    made = elements.draw(entry)
    assert all(p.dtype == np.uint8 for p in made.values())
    assert made["points"].shape == made["mask"].shape == IMAGE.shape
    row, column = np.rint(entry.points[0]).astype(int)
    assert made["points"][row, column].tolist() == [255, 40, 40]
    np.testing.assert_array_equal(made["mask"][entry.mask], IMAGE[entry.mask])


def test_copies_are_as_large_and_turned_as_they_were_found() -> None:
    points = np.array([[20.0, 20], [20, 60], [60, 20], [60, 60]])
    bank = [Template((3, 3), (3, 3)), Template((3, 3), (3, 3), 0.0, 0.5), Template((3, 3), (3, 3), 90.0, 1.0)]
    near = Detections(
        points.astype(np.intp),
        points,
        np.ones(4),
        np.array([0, 1, 2, 0]),
        np.ones((80, 80), np.float32),
        0.5,
        None,
        bank,
    )
    # A mask of the whole image is wrong, so copies of the element replace it.
    found = reconcile(np.ones((80, 80), bool), near, np.ones((9, 21), bool), (False, False))
    assert found.made_by == "elements"
    rows = [int(found.mask[r - 15 : r + 16, c].sum()) for r, c in points.astype(int)]
    columns = [int(found.mask[r, c - 15 : c + 16].sum()) for r, c in points.astype(int)]
    np.testing.assert_allclose(rows, [9, 5, 21, 9], atol=1)
    np.testing.assert_allclose(columns, [21, 11, 9, 21], atol=1)


def test_what_the_border_cuts_is_no_ground() -> None:
    mask = np.zeros((80, 80), bool)
    points = np.array([[20.0, 20], [20, 50], [50, 20], [50, 50]])
    rows, columns = np.indices(mask.shape)
    for row, column in points:
        mask |= (rows - row) ** 2 + (columns - column) ** 2 <= 64
    ragged = np.zeros_like(mask)
    ragged[70:, 30:34] = ragged[70:74, 30:50] = True
    inner = np.zeros_like(mask)
    inner[32:42, 66:69] = inner[32:35, 66:78] = True
    near = Detections(
        points.astype(np.intp), points, np.ones(4), np.zeros(4, np.intp), np.ones((80, 80), np.float32), 0.5, None
    )
    found = reconcile(mask | ragged | inner, near, mask[12:29, 12:29], (False, False))
    assert len(found.points) == 4
    assert (found.mask == mask | ragged).all()


def test_what_is_found_small_is_cut_small() -> None:
    """The middles of elements become foreground with the size in which they were found."""
    size, radius = (192, 192), 12
    centres = (np.indices((4, 4)).reshape(2, -1).T + 0.5) * 48
    radii = np.where(np.arange(16) % 3 == 1, radius / 2, radius)
    away = np.linalg.norm(np.indices(size).transpose(1, 2, 0)[:, :, None] - centres, axis=-1) / radii
    mask = (away <= 1).any(axis=-1)
    random = np.random.default_rng(2)
    image = np.where(mask, 0.62, 0.5)[..., None] + random.normal(0, 0.1, (*size, 3))
    poses = np.stack([np.zeros(16), radii / radius], axis=-1)
    given = {"background": np.zeros(size, bool), "layout": Layout.DISJOINT}
    given["background"][::48] = True
    lab = to_lab(np.clip(image, 0, 1).astype(np.float32))
    box = (2 * radius + 1, 2 * radius + 1)
    shares = []
    for scales in (poses[:, 1], np.ones(16)):
        each = np.stack([np.zeros(17), [1.0, *scales]], axis=-1)
        made = cut_foreground(lab, np.concatenate([centres[:1], centres]), box, poses=each, **given)
        shares.append((made & mask).sum() / (made | mask).sum())
    assert shares[0] > 0.93 > shares[1]
