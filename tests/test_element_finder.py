"""The finder of elements: generated samples with truth, layouts, threads, and inputs that are not textures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import texrs
from texrs import elements, samples
from texrs.errors import InputWarning, InvalidInput
from texrs.exemplar.element_finder import FoundElements, _finder, find_elements
from texrs.exemplar.element_finder._candidates import Candidates, make_leaves, measure
from texrs.exemplar.element_finder._contour_strength import find_contours
from texrs.exemplar.element_finder._overlaps import find_overlaps
from texrs.exemplar.element_finder._selection import join_parts


def rate(found: FoundElements, truth: NDArray[np.int32]) -> tuple[float, float]:
    """Return the F measure at an overlap of one half, and the mean overlap. Small parts at the border do not count."""
    area, own = np.bincount(truth.ravel()), np.bincount(found.labels.ravel())
    both = np.zeros((len(area), len(own)))
    np.add.at(both, (truth, found.labels), 1)
    iou = both / (area[:, None] + own[None] - both)
    iou[0] = iou[:, 0] = 0
    least = 0.3 * np.median(area[1:][area[1:] > 0])
    right = iou > 0.5
    counts, found_counts = area >= least, (own >= least) | right.any(axis=0)
    counts[0] = found_counts[0] = False
    pairs = int(right[counts].sum())
    return 2 * pairs / (counts.sum() + found_counts.sum()), float(iou[right].mean())


@pytest.mark.parametrize(
    ("name", "least", "layout"),
    [
        ("dots", 0.9, "separate"),
        ("leaves_and_flowers", 0.86, "separate"),
        ("pebbles", 0.9, "separate heap"),
        ("scales", 0.9, "heap jointed"),
        ("net", 0.92, "net"),
        ("bricks", 0.85, "jointed"),
        ("weave", 0.7, "jointed"),
        ("beans", 0.75, "heap"),
    ],
)
def test_generated_elements_are_found(name: str, least: float, layout: str) -> None:
    sample = samples.load(name, size=(256, 256), seed=0)
    assert sample.labels is not None
    found = find_elements(sample.image)
    f, iou = rate(found, sample.labels)
    assert f >= least
    assert iou >= 0.73
    assert found.layout in layout.split()


def test_textures_without_elements_have_no_layout() -> None:
    assert find_elements(samples.bark((256, 256)).image).layout == "none"


def test_the_parts_of_a_result_agree() -> None:
    found = find_elements(samples.beans((128, 128)).image)
    assert len(found.elements) == found.labels.max()
    assert sum(found.layouts.values()) == pytest.approx(1)
    assert found.confidence == max(found.layouts.values())
    for i, element in enumerate(found.elements):
        mask = found.mask(i)
        assert mask.sum() == element.area
        assert element.centre == pytest.approx(np.argwhere(mask).mean(axis=0)) if element.area else True
        assert 0 <= element.confidence <= 1
        assert element.at_border == bool(mask[[0, -1]].any() or mask[:, [0, -1]].any())
    assert (found.background == (found.labels == 0)).all()
    for overlap in found.overlaps:
        assert overlap.above != overlap.below
        assert 0.5 <= overlap.confidence <= 1


def test_the_lattice_or_the_courses_are_part_of_the_result() -> None:
    regular, scattered = (
        texrs.Exemplar(image.image) for image in (samples.weave((128, 128)), samples.dots((128, 128)))
    )
    found = regular.elements
    assert found.lattice is not None
    assert 0.9 < found.lattice.confidence < 1
    assert str(found.lattice) in repr(found)
    assert found is find_elements(regular.image)
    assert regular.segment().lattice is found.lattice
    assert scattered.elements.lattice is scattered.elements.courses is None
    with pytest.raises(InvalidInput):
        _ = texrs.Exemplar(np.zeros((20, 20, 20)), axes=3).elements


def test_threads_do_not_change_a_result() -> None:
    image = samples.pebbles((160, 120)).image
    results = []
    for threads in (1, 3):
        with texrs.threads(threads):
            results.append(find_elements(image))
    assert (results[0].labels == results[1].labels).all()
    assert results[0].elements == results[1].elements
    assert results[0].layouts == results[1].layouts


def test_other_types_of_one_image_give_one_result() -> None:
    image = samples.dots((96, 96)).image
    expected = find_elements(image)
    # The colours are the same, so the result is the cached one.
    assert find_elements(image.astype(np.uint16) * 257) is expected
    assert find_elements(image.astype(np.float32) / np.float32(255)) is expected


def test_all_functions_share_one_analysis(monkeypatch: pytest.MonkeyPatch) -> None:
    image = np.roll(samples.dots((96, 96)).image, 7, axis=1)
    calls: list[int] = []
    monkeypatch.setattr(_finder, "analyse", lambda *given, run=_finder.analyse: calls.append(1) or run(*given))
    exemplar = texrs.Exemplar(image, repeat=False)
    found, parts, separate, view = exemplar.elements, exemplar.segment(), exemplar.instances, elements.analyse(image)
    texrs.Exemplar(np.dstack([image, np.full((96, 96), 255, np.uint8)])).segment()
    assert len(calls) == 1
    assert parts.elements is found.labels
    assert separate is not None
    assert np.array_equal(separate.labels > 0, found.labels > 0)
    assert np.array_equal(view.labels > 0, found.labels > 0)


def test_separate_elements_continue_across_periodic_borders() -> None:
    image = np.roll(samples.dots((128, 128)).image, 20, axis=0)
    image = np.concatenate([image, image[::-1]])
    found = [texrs.Exemplar(image, repeat=(repeat, False)).instances for repeat in (False, True)]
    assert found[0] is not None
    assert found[1] is not None
    assert found[1].count < found[0].count
    ends = found[1].labels[[0, -1]]
    assert (ends[0] == ends[1])[(ends > 0).all(axis=0)].all()


def test_grey_images_of_any_shape_are_allowed() -> None:
    image = samples.dots((128, 128)).image
    assert find_elements(image[..., 0]).labels.shape == (128, 128)
    assert find_elements(image[..., :2]).labels.shape == (128, 128)
    assert find_elements(image[..., 0] > 128).labels.dtype == np.int32


@pytest.mark.parametrize(
    "image",
    [
        np.full((64, 64, 3), 7, np.uint8),
        np.zeros((1, 1), np.float32),
        np.zeros((1, 5000), np.uint8),
        np.tile(np.arange(256, dtype=np.uint8), (3, 4)),
        np.eye(12) > 0,
        np.random.default_rng(0).random((40, 3000)).astype(np.float32),
    ],
    ids=["constant", "pixel", "line", "strip", "tiny", "long"],
)
def test_images_without_elements_are_allowed(image: NDArray[Any]) -> None:
    found = find_elements(image)
    assert found.labels.shape == image.shape[:2]
    assert found.layout in found.layouts


@pytest.mark.parametrize("image", [np.full((32, 32), np.nan), np.zeros((0, 4)), np.zeros(3), "no file"])
def test_bad_images_are_errors(image: object) -> None:
    with pytest.raises((InvalidInput, texrs.errors.TexrsError)):
        find_elements(image)


def test_a_stain_is_not_a_joint() -> None:
    # Draw rows of four tiles with dark joints. A soft stain covers parts of some tiles.
    rows, columns = np.mgrid[:160, :160]
    noise = np.random.default_rng(1).normal(0, 3, (160, 160))
    image = 150 + noise + 12 * ((rows // 40 + columns // 40) % 3)
    stain = np.hypot(rows - 60, columns - 62) < 13
    image[stain] -= 25
    image[(rows % 40 < 3) | (columns % 40 < 3)] = 40
    truth = np.where((rows % 40 < 3) | (columns % 40 < 3), 0, 1 + rows // 40 * 4 + columns // 40).astype(np.int32)
    found = find_elements(image.clip(0, 255).astype(np.uint8))
    f, _ = rate(found, truth)
    assert f >= 0.9
    assert found.layout == "jointed"


@pytest.mark.parametrize(("other", "joined"), [("halves", 16), ("notched", 24)])
def test_touching_parts_are_joined_if_they_form_alike_convex_elements(other: str, joined: int) -> None:
    # Draw 16 elements of two halves, or 8 single discs and 8 pairs of touching discs.
    rows, columns = np.mgrid[:240, :240]
    parts = np.zeros((240, 240), np.int32)
    for k in range(16):
        y, x = rows - 30 - k // 4 * 60, columns - 30 - k % 4 * 60
        if other == "halves":
            inside = (y / 20) ** 2 + (x / 14) ** 2 < 1
            parts[inside & (y < 0)], parts[inside & (y >= 0)] = 2 * k + 1, 2 * k + 2
        elif k % 2:
            parts[np.hypot(y, x) < 12] = 2 * k + 1
        else:
            parts[np.hypot(y + 11, x) < 11.5], parts[np.hypot(y - 11, x) < 11.5] = 2 * k + 1, 2 * k + 2
    image = np.random.default_rng(4).uniform(0.2, 0.9, (33, 3))[parts].astype(np.float32)
    borders = (np.diff(parts, axis=0, append=0) != 0) | (np.diff(parts, axis=1, append=0) != 0)
    leaves = make_leaves(borders.astype(np.float32), find_contours(image, 0), 0.2)
    # Each part is the region at its most frequent label.
    votes = np.zeros((leaves.count, 33), int)
    np.add.at(votes, (leaves.labels, parts), 1)
    members = np.flatnonzero(votes.argmax(axis=1)).astype(np.uint32)
    members = members[np.argsort(votes.argmax(axis=1)[members], kind="stable")]
    _, sizes = np.unique(votes.argmax(axis=1)[members], return_counts=True)
    starts = np.concatenate([[0], np.cumsum(sizes)])
    elements, quality = join_parts(
        Candidates(starts, members, *measure(leaves, starts, members)), np.ones(len(sizes)), leaves
    )
    assert len(elements) == len(quality) == joined


def test_the_upper_one_of_two_discs_is_known() -> None:
    # Draw discs in rows, each on top of the previous ones.
    rows, columns = np.mgrid[:200, :200]
    labels = np.zeros((200, 200), np.int32)
    shifts = np.random.default_rng(2).uniform(-5, 5, (36, 2))
    for k, (y, x) in enumerate((y, x) for y in range(10, 200, 34) for x in range(10, 200, 34)):
        labels[np.hypot(rows - y - shifts[k, 0], columns - x - shifts[k, 1]) < 21] = k + 1
    right = [overlap.above > overlap.below for overlap in find_overlaps(labels) if overlap.confidence > 0.75]
    assert len(right) > 20
    assert np.mean(right) > 0.9


@pytest.mark.parametrize("factor", [0.5, 1.6])
def test_other_sizes_of_one_image_give_similar_elements(factor: float) -> None:
    from PIL import Image

    sample = samples.leaves_and_flowers((256, 256))
    assert sample.labels is not None
    size = (round(256 * factor), round(256 * factor))
    found = find_elements(Image.fromarray(sample.image).resize(size, Image.Resampling.LANCZOS))
    f, _ = rate(found, np.array(Image.fromarray(sample.labels).resize(size, Image.Resampling.NEAREST)))
    assert f >= 0.8


def test_elements_of_clear_textures_are_surer() -> None:
    clear, vague = (find_elements(image.image) for image in (samples.net((192, 192)), samples.bark((192, 192))))
    means = [np.mean([element.confidence for element in found.elements]) for found in (clear, vague)]
    assert means[0] > 0.8
    assert means[0] > means[1] + 0.2


def test_strokes_part_fused_elements_and_add_missed_ones():
    image, truth = samples.pebbles((96, 104)).image, samples.pebbles((96, 104)).labels
    found = find_elements(image)
    numbers = np.flatnonzero(np.bincount(truth.ravel()) > 60)[1:]
    missed = [
        i for i in numbers if max(np.bincount(found.labels[truth == i])[1:], default=0) < 0.5 * (truth == i).sum()
    ]
    marks = np.zeros(truth.shape, int)
    for i in missed or numbers[:3]:
        rows, columns = np.nonzero(truth == i)
        middle = rows == round(rows.mean())
        marks[rows[middle], columns[middle]] = i
    again = find_elements(image, marks=marks)
    held = [np.bincount(again.labels[marks == i]).argmax() for i in np.unique(marks[marks > 0])]
    assert 0 not in held
    assert len(set(held)) == len(held)
    assert rate(again, truth)[0] >= rate(found, truth)[0]


def test_one_element_with_two_marks_becomes_two():
    image = samples.dots((128, 128)).image
    found = find_elements(image)
    number = int(np.argmax([element.area for element in found.elements])) + 1
    rows, columns = np.nonzero(found.labels == number)
    marks = np.zeros(found.labels.shape, int)
    marks[rows[:9], columns[:9]], marks[rows[-9:], columns[-9:]] = 1, 2
    again = find_elements(image, marks=marks).labels
    first, second = (np.bincount(again[marks == i]).argmax() for i in (1, 2))
    assert first != second
    assert min(first, second) > 0


def test_marks_that_find_nothing_are_reported():
    plain = np.full((64, 64, 3), 90, np.uint8)
    for image, marks in ((plain, np.eye(64, dtype=int)), (samples.dots((64, 64)).image, np.full((64, 64), -1))):
        with pytest.warns(InputWarning, match="marks: nothing was found"):
            assert not find_elements(image, marks=marks).elements


@pytest.mark.parametrize(
    "marks", [np.zeros((3, 3), int), np.full((64, 64), -2), np.zeros((64, 64)), 7, np.arange(4096).reshape(64, 64)]
)
def test_unsuitable_marks_are_refused(marks):
    with pytest.raises(InvalidInput, match="marks"):
        find_elements(samples.dots((64, 64)).image, marks=marks)
