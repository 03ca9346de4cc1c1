"""Plans of DESIGN: treatments of elements, tried at a small size and judged."""

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs.errors import InvalidInput
from texrs.metrics import evaluate
from texrs.papers.design.trials import CLEARLY


@pytest.fixture(scope="module")
def gravel():
    return np.ascontiguousarray(samples.photograph("gravel").image[:128, :128])


@pytest.fixture(scope="module")
def chosen(gravel):
    return {plan: texrs.design(gravel, 160, seed=5, motion=plan) for plan in ("auto", "move", "keep")}


def test_the_better_plan_is_taken_and_the_report_says_why(chosen):
    [tried] = chosen["auto"].report["candidates"]
    assert sorted(tried) == ["keep", "move"]
    clearly = tried["keep"]["score"] < CLEARLY * tried["move"]["score"]
    assert chosen["auto"].report["motion"] == ["keep" if clearly else "move"]
    for plan in ("move", "keep"):
        assert chosen[plan].report["motion"] == [plan]
        assert chosen[plan].report["candidates"] == [None]
    np.testing.assert_array_equal(chosen["auto"].image, chosen[chosen["auto"].report["motion"][0]].image)
    assert (chosen["move"].image != chosen["keep"].image).any()


def test_what_wins_small_wins_large(gravel, chosen):
    scores = {p: evaluate(gravel, r.source_map, r.image, wrap=True).score for p, r in chosen.items()}
    assert scores["auto"] <= min(scores.values()) / CLEARLY, scores


def test_still_elements_are_taken_where_moved_ones_are_torn():
    """Blades of grass are not elements that can be cut out."""
    grass = np.ascontiguousarray(samples.photograph("grass").image[:160, :160])
    auto, move = (texrs.design(grass, 192, motion=plan) for plan in ("auto", "move"))
    assert auto.report["motion"] == ["keep"]
    still, moved = (evaluate(grass, r.source_map, r.image, wrap=True) for r in (auto, move))
    assert still.torn < 0.8 * moved.torn, (still, moved)
    assert still.broken < 0.8 * moved.broken, (still, moved)


def test_deformation_is_kept_where_it_does_no_harm():
    """Buttons on plain cloth are found reliably, so moved ones look as good."""
    assert texrs.design(samples.dots((96, 96)).image, 64).report["motion"] == ["move"]


def test_still_elements_are_copied_as_they_are(chosen):
    still = chosen["keep"]
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
    assert (found.report["motion"], found.report["candidates"]) == (["move"], [None])
    paper = texrs.design(gravel, 64, method="paper", motion="keep", copies=1)
    assert (paper.report["motion"], paper.report["candidates"]) == (["move"], [None])


def test_plans_are_tried_once_an_exemplar():
    exemplar = texrs.Exemplar(samples.beans((80, 80)).image)
    steps = []
    made = [
        texrs.design(exemplar, 64, seed=seed, progress=lambda stage, share: steps.append((seed, stage, share)))  # noqa: B023
        for seed in range(2)
    ]
    tried = [share for seed, stage, share in steps if stage == "try" and seed == 0]
    assert tried == sorted(tried)
    assert {0.0, 0.5} <= set(tried)
    assert not any(stage == "try" for seed, stage, _ in steps if seed == 1)
    assert made[0].report["candidates"] == made[1].report["candidates"]


def test_each_exemplar_of_several_has_a_plan(gravel):
    dots = samples.dots((128, 128)).image
    grey = np.repeat(gravel[..., np.newaxis], 3, axis=-1) if gravel.ndim == 2 else gravel
    found = texrs.design([dots, grey], 128, seed=1)
    assert len(found.report["motion"]) == len(found.report["candidates"]) == 2
    assert found.report["motion"][0] == texrs.design(dots, 128).report["motion"][0]


def test_plans_are_checked(gravel):
    with pytest.raises(InvalidInput, match="^motion"):
        texrs.design(gravel, 64, motion="fly")
