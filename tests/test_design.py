"""DESIGN, end to end: true stages, exact lookup, the same bytes for any number of threads."""

import inspect
import os
import subprocess
import sys
from dataclasses import FrozenInstanceError
from typing import get_overloads

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import DeformationOptions, ElementOptions, samples
from texrs.errors import Cancelled, InvalidInput, LimitExceeded
from texrs.exemplar import segment, symmetry
from texrs.papers.design.deformation import deform_elements
from texrs.papers.design.elements import measure_elements, place
from texrs.papers.design.logistic_map import iterate
from texrs.papers.design.operations import Moves, Operation
from texrs.papers.design.plan import make_plan
from texrs.papers.design.tiles import fill_holes, mark_elements


@pytest.fixture(scope="module")
def pebbles():
    return samples.pebbles((128, 128)).image


@pytest.fixture(scope="module")
def result(pebbles):
    return texrs.design(pebbles, (160, 224), seed=5)


# --- the result ------------------------------------------------------------------------------------------------------


def test_size_dtype_and_content(pebbles, result):
    assert result.image.shape == (160, 224, 3)
    assert result.image.dtype == np.uint8
    assert result.source_map.shape == (160, 224)
    # All colours come from the exemplar. At integer coordinates, a colour equals the sample exactly.
    whole = (result.source_map.coordinates == np.rint(result.source_map.coordinates)).all(axis=-1)
    at = result.source_map.coordinates[whole].astype(int)
    np.testing.assert_array_equal(result.stages["before_blending"][whole], pebbles[at[:, 0], at[:, 1]])
    assert whole.mean() > 0.3


def test_stages_are_pictures_in_order(result):
    assert [s for s in result.stages if s != "ways"] == [
        "segmentation",
        "deformed",
        "holes",
        "completed",
        "before_blending",
    ]
    assert result.stages["holes"].dtype == bool
    # A separate element leaves a hole where it was.
    apart = texrs.design(samples.dots((96, 96)).image, 96, copies=1, way="move").stages
    assert (apart["completed"][apart["holes"]] != apart["deformed"][apart["holes"]]).any()


def test_the_composite_is_what_the_source_map_shows_in_every_dtype(pebbles):
    stack = {
        "uint8": pebbles,
        "uint16": pebbles.astype(np.uint16) * 257,
        "float32": pebbles.astype(np.float32) * (4 / 255),
    }
    for name, exemplar in stack.items():
        made = texrs.design(exemplar, 96, seed=2, copies=2, way="move")
        assert made.image.dtype == np.dtype(name)
        expected = view(made.source_map, exemplar)
        np.testing.assert_allclose(made.stages["before_blending"], expected, rtol=1e-6 * (name == "float32"))


def test_depth_does_not_change_the_decisions(pebbles):
    eight = texrs.design(pebbles, 96, seed=2, copies=2).source_map
    sixteen = texrs.design(pebbles.astype(np.uint16) * 257, 96, seed=2, copies=2).source_map
    np.testing.assert_array_equal(eight.coordinates, sixteen.coordinates)


@pytest.mark.parametrize("channels", [None, 1, 2, 4, 6])
def test_any_number_of_channels(pebbles, channels):
    grey = pebbles[:80, :80].mean(axis=-1).astype(np.uint8)
    exemplar = grey if channels is None else np.stack([np.roll(grey, c, axis=0) for c in range(channels)], axis=-1)
    made = texrs.design(exemplar, (90, 70), copies=1, way="move")
    assert made.image.shape == ((90, 70) if channels is None else (90, 70, channels))


def test_a_wrapped_result_has_no_seam(result):
    image = result.image.astype(float)
    for axis in range(2):
        inner = np.abs(np.diff(image, axis=axis)).mean()
        across = np.abs(np.take(image, 0, axis) - np.take(image, -1, axis)).mean()
        assert across / inner < 1.5


def test_without_wrap_opposite_edges_are_free(pebbles):
    free = texrs.design(pebbles, 160, seed=5, wrap=False)
    assert free.report["wrap"] == [False, False]
    assert free.image.shape == (160, 160, 3)


def test_elements_really_move(pebbles):
    result = texrs.design(pebbles, (160, 224), seed=5, way="move")
    moved = [entry for entry in result.report["operations"][0][1:] if entry["operations"]]
    # In a heap most stones stay, because others need them as background.
    assert len(moved) >= 0.25 * result.report["elements"]
    other = texrs.design(pebbles, (160, 224), seed=6, way="move")
    assert (other.image != result.image).mean() > 0.5


def test_an_image_without_elements_takes_the_grid_and_says_so():
    made = texrs.design(samples.bark((128, 128)).image, 64, copies=1)
    assert made.report["segmentation"] == "grid"
    assert made.report["reason"]


def test_a_constant_image_gives_a_constant_result():
    made = texrs.design(np.full((40, 40, 3), 77, np.uint8), (50, 64))
    assert (made.image == 77).all()


def test_labels_by_hand(pebbles):
    truth = samples.pebbles((128, 128)).labels
    made = texrs.design(pebbles, 128, elements=ElementOptions(labels=truth), copies=1, way="still")
    assert made.report["segmentation"] == "labels"
    assert made.report["elements"] == truth.max()


@pytest.mark.parametrize("channels", [slice(None), slice(1)], ids=["colours", "grey"])
def test_the_segmentation_is_shown_in_colours_on_the_exemplar(pebbles, channels):
    truth = samples.pebbles((128, 128)).labels
    marked = ElementOptions(labels=truth)
    shown = texrs.design(pebbles[..., channels], 64, elements=marked, copies=1, way="still").stages["segmentation"]
    assert shown.shape == (128, 128, 3)
    assert shown.dtype == np.uint8
    outline = np.zeros(truth.shape, bool)
    outline[1:] |= truth[1:] != truth[:-1]
    outline[:, 1:] |= truth[:, 1:] != truth[:, :-1]
    assert (shown[outline] == 255).all()
    ground = (truth == 0) & ~outline
    np.testing.assert_array_equal(shown[ground], np.broadcast_to(pebbles[..., channels], shown.shape)[ground])
    # The tint of an element does not depend on the colours of the stone.
    tints = [(shown - 0.45 * pebbles[..., channels])[(truth == k) & ~outline] for k in range(1, truth.max() + 1)]
    assert max(t.std(axis=0).max() for t in tints if len(t)) < 1
    assert len({tuple(np.rint(t.mean(axis=0) / 4)) for t in tints if len(t)}) > 0.9 * len(tints)


def test_stages_are_saved(result, tmp_path):
    names = [p.name for p in result.save_stages(tmp_path / "stages")]
    assert names[0] == "01-segmentation.png"
    assert names[-1] == "report.json"


# --- deformation -----------------------------------------------------------------------------------------------------


def test_reference_values_of_the_logistic_map():
    expected = [194, 41, 241, 202, 67, 219, 123, 135, 111, 157, 60, 226]
    assert [int(h) for h in iterate(0.76234783, count=12)] == expected


@pytest.mark.parametrize("start", [0.0, 0.5, -0.5, 1.0, -1.0, 0.5**0.5, 1.5, float("nan")])
def test_absorbing_starts_are_refused(start):
    with pytest.raises(InvalidInput, match="^start"):
        iterate(start)


def test_drawn_operations_obey_their_limits():
    moves = Moves(DeformationOptions(rotate=60))
    counts = dict.fromkeys("TRMS", 0)
    for element in range(200):
        for operation in moves.draw_operations(moves.draw_values(1, 0, element), (False, False), 100):
            counts[operation.kind] += 1
            if operation.kind == "T":
                assert abs(operation.amount) <= 12
            if operation.kind == "R":
                assert abs(operation.amount) <= 60
            if operation.kind == "S":
                assert 0.8 <= operation.amount <= 1.2
    assert min(counts.values()) >= 40
    still = Moves(DeformationOptions(rotate=0, scale=(1, 1), allow_mirror=False))
    drawn = [still.draw_operations(still.draw_values(1, 0, e), (False, False), 100) for e in range(50)]
    kinds = {o.kind for operations in drawn for o in operations}
    assert kinds == {"T"}


def test_what_is_lit_from_one_side_is_not_mirrored():
    mirrors = {}
    noise = np.random.default_rng(3).random((128, 128, 3)).astype(np.float32)
    for name, example in (
        ("beans", samples.beans((128, 128)).image),
        ("bark", samples.bark((128, 128)).image),
        ("noise", noise),
    ):
        made = list(texrs.design_variants(example, 3, 64, seed=2, copies=4, way="move"))
        log = [entry for result in made for tile in result.report["operations"] for entry in tile]
        mirrors[name] = {tuple(entry["mirror"]) for entry in log if "mirror" in entry}
        assert name == "noise" or not any(o[0] == "M" for entry in log for o in entry.get("operations") or [])
    assert mirrors["beans"] == mirrors["bark"] == {(False, False)}
    assert len(mirrors["noise"]) == 4


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, "own"),
        ({"rotate": 0}, 1),
        ({"rotate": 0, "allow_mirror": True}, 4),
        ({"allow_mirror": True}, 4),
        ({"allow_mirror": False}, 1),
    ],
)
def test_who_forbids_turning_forbids_mirrors_unless_asked_for(options, expected):
    noise = np.random.default_rng(3).random((96, 96, 3)).astype(np.float32)
    lit = samples.beans((96, 96)).image
    for example, own in ((noise, 4), (lit, 1)):
        exemplar = texrs.Exemplar(example)
        plan = make_plan(exemplar, exemplar.segment(), DeformationOptions(**options), side=None)
        assert len(plan.mirrors) == (own if expected == "own" else expected)


def test_a_suspected_light_is_enough_not_to_mirror(monkeypatch):
    noise = np.random.default_rng(3).random((96, 96, 3)).astype(np.float32)
    for found, count in (((2.4, 0.0, 0.0), 4), ((2.6, 0.0, 0.0), 2), ((2.6, 2.6, 9.0), 1), ((0.0, 0.0, 9.0), 2)):
        monkeypatch.setattr(symmetry, "measure_polarity", lambda guide, found=found: found)
        assert len(texrs.Exemplar(noise + np.float32(sum(found))).mirror_symmetries) == count


def test_elements_at_the_border_slide_along_it():
    moves, drawn = Moves(DeformationOptions(translate=0.3, rotate=60)), []
    for element in range(50):
        drawn += moves.draw_operations(moves.draw_values(1, 0, element), (True, False), 100)
        assert moves.draw_operations(moves.draw_values(1, 0, element), (True, True), 100) == []
    assert {(operation.kind, operation.axis) for operation in drawn} == {("T", 1)}


def test_a_placed_element_keeps_its_shape():
    labels = np.zeros((60, 60), np.int32)
    labels[20:32, 24:44] = 1
    element = measure_elements(labels)[0]
    turned = place(element, [Operation("R", 90.0, 0)], (60, 60))
    assert turned is not None
    rows, columns = np.nonzero(turned.distance > 0)
    assert abs(np.ptp(rows) + 1 - 20) <= 1
    assert abs(np.ptp(columns) + 1 - 12) <= 1
    assert abs(rows.mean() + turned.window[0].start - 25.5) < 0.6


def test_segmentation_finds_the_pebbles():
    sample = samples.pebbles()
    found = segment(sample.image)
    assert found.kind == "components"
    whole = [np.bincount(sample.labels[found.elements == i]).argmax() for i in range(1, found.count + 1)]
    share = [
        (sample.labels[found.elements == i] == truth).mean() for i, truth in enumerate(whole, start=1) if truth > 0
    ]
    assert len(share) >= 0.5 * len(sample.centres)
    assert np.median(share) > 0.9


# --- invariants ------------------------------------------------------------------------------------------------------

SCRIPT = """
import hashlib, os, sys, texrs
def digest():
    made = texrs.design(texrs.samples.pebbles((64, 64)).image, (72, 80), seed=4, copies=2)
    parts = (made.image, made.source_map.coordinates, made.source_map.label, made.source_map.jacobian)
    return hashlib.sha256(b"".join(p.tobytes() for p in parts)).hexdigest()
print(digest(), flush=True)
if "fork" in sys.argv:
    child = os.fork()
    if child == 0:
        print(digest(), flush=True)
        os._exit(0)
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def digests(*arguments, threads):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", SCRIPT, *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | {"RAYON_NUM_THREADS": str(threads)},
        check=True,
    )
    return done.stdout.split()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the platform has no fork")
def test_processes_with_any_number_of_threads_and_forked_ones_make_the_same_bytes():
    """The number of threads is that of the environment. `test_truth` compares numbers of threads in one process."""
    parent, child = digests("fork", threads=7)
    assert parent == child
    assert digests(threads=1) == [parent]


def test_progress_is_reported_and_raising_stops():
    seen = []
    pebbles = samples.pebbles((64, 64)).image
    texrs.design(pebbles, 64, copies=2, progress=lambda stage, share: seen.append((stage, share)))
    assert seen[0][0] == "segment"
    assert seen[-1] == ("done", 1.0)
    assert all(0 <= share <= 1 for _, share in seen)

    def stop(stage, share):
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        texrs.design(pebbles, 64, progress=stop)


PICTURE = np.zeros((32, 32, 3), np.uint8)


def test_bad_input_names_the_argument():
    with pytest.raises(InvalidInput, match="^exemplar: must have at most 64 channels"):
        texrs.design(np.zeros((100, 100, 100)))


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (ElementOptions, {"labels": np.full((32, 32), -1)}),
        (DeformationOptions, {"translate": 0.6}),
        (DeformationOptions, {"scale": (1.2, 0.8)}),
        (DeformationOptions, {"scale": (0.4, 1)}),
        (DeformationOptions, {"start": 1}),
        (DeformationOptions, {"growth_rate": 2.5}),
    ],
)
def test_options_are_checked_when_they_are_made(kind, options):
    (name,) = options
    with pytest.raises(InvalidInput, match=f"^{name}"):
        kind(**options)


def test_options_are_frozen_and_keyword_only():
    for kind, field in ((ElementOptions, "layers"), (DeformationOptions, "operations")):
        with pytest.raises(TypeError):
            kind(2)
        with pytest.raises(FrozenInstanceError):
            setattr(kind(), field, 3)


@pytest.mark.parametrize("verb", [texrs.design, texrs.design_variants, texrs.inpaint, texrs.tile, texrs.blend])
def test_a_type_checker_knows_every_option(verb):
    """Overloads or ``**options`` would accept misspelt options."""
    assert not get_overloads(verb)
    parameters = inspect.signature(verb).parameters.values()
    assert all(p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD) for p in parameters)
    assert all(p.annotation not in (p.empty, "Any", "object") for p in parameters)


def test_variants_are_checked_at_once_and_made_when_they_are_asked_for():
    with pytest.raises(InvalidInput, match="^count"):
        texrs.design_variants(PICTURE, 0)
    with pytest.raises(InvalidInput, match="^copies"):
        texrs.design_variants(PICTURE, 2, copies=0)
    seen = []
    found = texrs.design_variants(
        samples.pebbles((64, 64)).image, 2, 64, seed=2**64 - 1, copies=1, progress=lambda *step: seen.append(step)
    )
    assert not seen
    first = next(found)
    assert ("done", 1.0) not in seen
    assert seen.count(("segment", 1.0)) == 1
    second = next(found)
    assert (first.report["seed"], second.report["seed"]) == (2**64 - 1, 0)
    assert seen[-1] == ("done", 1.0)
    assert seen.count(("segment", 1.0)) == 1
    with pytest.raises(StopIteration):
        next(found)


def test_variants_are_those_of_their_seeds(pebbles):
    made = list(texrs.design_variants(pebbles, 2, 96, seed=7, copies=1, way="move"))
    assert len(made) == 2
    for seed, result in enumerate(made, start=7):
        np.testing.assert_array_equal(result.image, texrs.design(pebbles, 96, seed=seed, copies=1, way="move").image)


def test_an_exemplar_is_analysed_once(pebbles, monkeypatch):
    """Facts are stored with an exemplar, and cached for arrays of the same content."""
    from texrs.exemplar import _exemplar

    calls = []
    monkeypatch.setattr(_exemplar, "segment", lambda *given, **options: calls.append(1) or segment(*given, **options))
    fresh = np.roll(pebbles, 17, axis=0)
    exemplar = texrs.Exemplar(fresh)
    made = [texrs.design(e, 96, copies=1, way="still").image for e in (exemplar, exemplar, fresh.copy())]
    assert len(calls) == 1
    assert all((image == made[0]).all() for image in made)
    texrs.design(exemplar, 96, copies=1, way="still", elements=ElementOptions(layers=3))
    assert len(calls) == 2


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({"deformation": 2}, "deformation"),
        ({"elements": ElementOptions(labels=np.zeros((3, 3), int))}, "labels"),
        ({"elements": ElementOptions(labels=[np.zeros((32, 32), int)] * 2)}, "labels"),
    ],
)
def test_options_that_do_not_fit_the_exemplar_are_refused(options, names):
    with pytest.raises(InvalidInput, match=f"^{names}"):
        texrs.design(PICTURE, **options)


def test_what_needs_more_memory_than_there_is_is_refused_before_anything_is_made():
    def progress(stage, share):
        raise AssertionError("work has begun")

    with pytest.raises(LimitExceeded, match=r"^size: needs .* GB of memory"):
        texrs.design(np.zeros((32, 32, 64)), (16384, 16384), progress=progress)


def test_holes_are_not_filled_over_the_inside_of_elements(pebbles):
    exemplar = texrs.Exemplar(pebbles)
    parts = exemplar.segment(ElementOptions(labels=samples.pebbles((128, 128)).labels))
    plan = make_plan(exemplar, parts, DeformationOptions(), side=None)
    draft = deform_elements(plan, 5, 0)
    kept = mark_elements(draft, plan)
    assert kept.mean() > 0.2
    assert not kept[~draft.covered].any()
    draft.covered[kept.argmax() // 128 :][:9] = False
    kept &= draft.covered
    filled = fill_holes(draft, plan, ((128, 128),), 0, 5)
    assert filled.holes > 0
    np.testing.assert_array_equal(filled.source.label[kept], draft.label[kept])


def test_what_is_left_in_a_heap_without_ground_stays(pebbles, result):
    plan = make_plan(texrs.Exemplar(pebbles), texrs.Exemplar(pebbles).segment(), DeformationOptions(), side=None)
    assert not plan.pure
    assert not any(result.report["holes"])
    assert make_plan(texrs.Exemplar(pebbles), texrs.Exemplar(pebbles).segment(), DeformationOptions(), side=4).pure
