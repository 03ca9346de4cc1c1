"""Ways of DESIGN: treatments of elements, tried at a small size and compared."""

import numpy as np
import pytest

import texrs
from texrs import SourceMap, samples
from texrs._comparison_of_ways import EQUAL, Judge, choose, compare


@pytest.fixture(scope="module")
def gravel():
    return np.ascontiguousarray(samples.photograph("gravel").image[:128, :128])


@pytest.fixture(scope="module")
def chosen(gravel):
    ways = ("auto", "move", "still", "stitch", "cells")
    return {plan: texrs.design(gravel, 160, seed=5, way=plan) for plan in ways}


def test_the_better_plan_is_taken_and_the_report_says_why(chosen):
    [tried] = chosen["auto"].report["candidates"]
    # Moved cells of a grid are not tried.
    ways = {"still", "stitch"} if chosen["auto"].report["segmentation"] == "grid" else {"move", "still", "stitch"}
    assert ways <= set(tried) <= ways | {"cells"}
    [best] = chosen["auto"].report["way"]
    assert tried[best]["score"] <= min(each["score"] for each in tried.values()) + EQUAL
    for plan in ("move", "still", "stitch", "cells"):
        assert chosen[plan].report["way"] == [plan]
        assert chosen[plan].report["candidates"] == [None]
    shown, height = chosen["auto"].stages["ways"], 224
    assert shown.shape == (height, height * len(tried), 3)
    [refused] = chosen["auto"].report["refused"]
    assert not set(refused) & {"move", "still", "stitch"}
    assert refused["sow"] == "no separate elements on a background were found in the exemplar"
    np.testing.assert_array_equal(chosen["auto"].image, chosen[best].image)
    assert (chosen["move"].image != chosen["still"].image).any()
    assert (chosen["stitch"].image != chosen["still"].image).any()


def test_stitched_patches_are_copies_that_wrap(gravel, chosen):
    made = chosen["stitch"]
    np.testing.assert_array_equal(made.source_map.jacobians(), np.broadcast_to(np.eye(2), (160, 160, 2, 2)))
    unblended = texrs.design(gravel, 160, seed=5, way="stitch", screening=None)
    np.testing.assert_array_equal(unblended.image, unblended.source_map.render(gravel))
    assert made.report["tiling"]


def test_moved_elements_are_not_taken_where_they_are_torn():
    """Blades of grass are not elements that can be cut out."""
    grass = np.ascontiguousarray(samples.photograph("grass").image[:160, :160])
    assert texrs.design(grass, 192).report["way"] != ["move"]


def test_moved_elements_do_little_harm_where_they_are_found():
    """Buttons on plain cloth are found reliably, so moved ones look nearly as good."""
    [tried] = texrs.design(samples.dots((96, 96)).image, 64).report["candidates"]
    assert tried["move"]["score"] < 1.7 * min(each["score"] for each in tried.values())


def scramble(shape, side, seed):
    """Return a source map of square pieces of an exemplar in random order."""
    rows, columns = np.indices(shape)
    rng = np.random.default_rng(seed)
    count = (shape[0] // side, shape[1] // side)
    order = rng.permutation(count[0] * count[1]).reshape(count)[rows // side, columns // side]
    places = np.stack([order // count[1] * side + rows % side, order % count[1] * side + columns % side], axis=-1)
    return SourceMap.from_coordinates(places.astype(np.float32), shape, label=order.astype(np.uint32))


@pytest.mark.parametrize("name", ["bricks", "pebbles", "weave", "leaves_and_flowers"])
def test_faults_of_scrambled_images_are_seen(name):
    exemplar = texrs.Exemplar(samples.load(name, size=(160, 160)).image)
    judge, whole = Judge(exemplar), SourceMap.identity((160, 160))
    own = judge.measure(whole, exemplar.image, wrap=False)
    assert max(own.report().values()) <= 0.05
    ways = {"whole": own}
    for side in (16, 40):
        torn = scramble((160, 160), side, 1)
        ways[str(side)] = judge.measure(torn, torn.render(exemplar.image), wrap=False)
    scores = compare(ways)
    assert scores["whole"] < 0.5 * min(scores["16"], scores["40"]), (scores, ways)


def test_still_elements_are_copied_as_they_are(chosen):
    still = chosen["still"]
    assert still.report["holes"] == [0.0] * len(still.report["holes"])
    assert all(not entry.get("operations") for log in still.report["operations"] for entry in log)
    frames = np.abs(still.source_map.jacobians())
    np.testing.assert_array_equal(frames, np.broadcast_to(np.eye(2), frames.shape))
    # Each mirror image is used once.
    shown = [tuple(log[0]["mirror"]) for log in still.report["operations"]]
    assert len(set(shown)) == len(shown)


def test_who_says_how_to_deform_is_obeyed(gravel):
    asked = texrs.DeformationOptions(translate=0.1)
    found = texrs.design(gravel, 64, deformation=asked, copies=1)
    assert (found.report["way"], found.report["candidates"]) == (["move"], [None])
    paper = texrs.design(gravel, 64, method="paper", way="still", copies=1)
    assert (paper.report["way"], paper.report["candidates"]) == (["move"], [None])


def test_plans_are_tried_once_an_exemplar():
    exemplar = texrs.Exemplar(samples.beans((80, 80)).image)
    steps = []
    made = [
        texrs.design(exemplar, 64, seed=seed, progress=lambda stage, share: steps.append((seed, stage, share)))  # noqa: B023
        for seed in range(2)
    ]
    tried = [share for seed, stage, share in steps if stage == "try" and seed == 0]
    assert tried == sorted(tried)
    assert len(set(tried)) >= 3
    assert not any(stage == "try" for seed, stage, _ in steps if seed == 1)
    assert made[0].report["candidates"] == made[1].report["candidates"]


def test_each_exemplar_of_several_has_a_plan(gravel):
    dots = samples.dots((128, 128)).image
    grey = np.repeat(gravel[..., np.newaxis], 3, axis=-1) if gravel.ndim == 2 else gravel
    found = texrs.design([dots, grey], 128, seed=1)
    assert len(found.report["way"]) == len(found.report["candidates"]) == 2
    assert found.report["way"][0] == texrs.design(dots, 128).report["way"][0]


def test_mirrored_copies_must_give_a_better_texture():
    tried = {
        "still": {"score": 0.5, "repetition": 0.1},
        "stitch": {"score": 0.5 + 0.9 * EQUAL, "repetition": 0.3},
    }
    assert choose(tried) == "still"
    assert choose(tried, ["still"]) == "stitch"
    assert choose(tried | {"stitch": {"score": 0.5 + 1.1 * EQUAL, "repetition": 0.3}}, ["still"]) == "still"
