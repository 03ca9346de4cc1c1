"""Methods to compose images from patches: given, or tried and judged."""

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs.cli import main
from texrs.errors import InvalidInput
from texrs.metrics import evaluate
from texrs.papers.solid import plans


@pytest.fixture(scope="module")
def beans():
    return texrs.Exemplar(samples.beans((96, 96)).image)


def test_the_usual_plan_is_what_is_made_where_nothing_is_said(beans):
    default, usual = (texrs.synthesize(beans, 128, seed=2, **said) for said in ({}, {"patches": "default"}))
    np.testing.assert_array_equal(default.image, usual.image)
    assert (default.report["patches"], default.report["candidates"]) == ("default", None)


def test_large_patches_are_fewer(beans):
    usual, large = (
        texrs.synthesize(beans, 192, seed=1, patches=plan).report["stitched"] for plan in ("default", "large")
    )
    assert large["patches"] < usual["patches"]


def test_seams_of_a_plain_texture_run_through_things():
    heap = texrs.Exemplar(samples.pebbles((128, 128)).image)
    torn = {
        plan: np.mean(
            [evaluate(heap, texrs.synthesize(heap, 192, seed=seed, patches=plan).source_map).torn for seed in range(2)]
        )
        for plan in ("default", "unmasked")
    }
    assert torn["default"] < torn["unmasked"]


def test_what_is_judged_clearly_best_is_taken(monkeypatch):
    scores = {"default": 1.0, "large": 0.9, "unmasked": 0.8, "unmasked-large": 1.2}
    exemplars = [texrs.Exemplar(samples.pebbles((64, 64), seed=seed).image) for seed in range(2)]
    for exemplar, best, score in ((exemplars[0], "unmasked", 0.8), (exemplars[1], "default", 0.86)):
        given = scores | {"unmasked": score}
        names = {plan: name for name, plan in plans.PLANS.items()}
        monkeypatch.setattr(plans, "evaluate", lambda exemplar, name, given=given: given[name])
        monkeypatch.setattr(plans, "average", lambda figures: {"score": figures[0]})
        monkeypatch.setattr("texrs.papers.solid.try_plan", lambda asked, progress, plan, seed, names=names: names[plan])
        found = texrs.synthesize(exemplar, 64, patches="auto").report
        assert found["patches"] == best
        assert {name: figures["score"] for name, figures in found["candidates"].items()} == given


def test_plans_are_tried_once_an_exemplar():
    exemplar = texrs.Exemplar(samples.beans((80, 80)).image)
    tried = []
    made = [
        texrs.synthesize(
            exemplar, 64, seed=seed, patches="auto", progress=lambda stage, _, s=seed: tried.append((s, stage))
        )
        for seed in range(2)
    ]
    assert tried.count((0, "try")) == 2 * len(plans.PLANS)
    assert tried.count((1, "try")) == 0
    assert made[0].report["candidates"] == made[1].report["candidates"]
    assert set(made[0].report["candidates"]) == set(plans.PLANS)
    assert set(made[0].report["candidates"]["default"]) == {
        "score",
        "torn",
        "broken",
        "seam_blur",
        "repetition",
        "coverage",
    }


def test_without_elements_there_is_nothing_to_be_plain_about():
    noise = np.random.default_rng(3).random((64, 64, 3)).astype(np.float32)
    assert set(texrs.synthesize(noise, 64, patches="auto").report["candidates"]) == {"default", "large"}


def test_labels_are_not_tried():
    labels = texrs.Exemplar(samples.beans((64, 64)).labels.astype(np.uint8), labels=True)
    found = texrs.synthesize(labels, 64, patches="auto").report
    assert (found["patches"], found["candidates"]) == ("default", None)


def test_the_command_takes_a_plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["synthesize", "sample:dots", "--size", "72", "--patches", "large", "-o", "out.png", "-q"]) == 0
    expected = texrs.synthesize(samples.load("dots").image, 72, patches="large").image
    np.testing.assert_array_equal(texrs.io.read("out.png"), expected)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"patches": "large", "quality": "fast"}, "^patches: cannot be combined with quality='fast'"),
        ({"patches": "auto", "method": "paper"}, "^patches: cannot be combined with method='paper'"),
    ],
)
def test_plans_are_checked(beans, options, message):
    with pytest.raises(InvalidInput, match=message):
        texrs.synthesize(beans, 64, **options)
