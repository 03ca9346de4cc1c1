"""Properties of results of texrs.perspective, measured at small size (`perspective_checks`)."""

import numpy as np
import pytest

import perspective_checks as checks
import texrs


@pytest.fixture(scope="module")
def floor():
    return checks.floor()


@pytest.fixture(scope="module", params=["ramp", "wave", "radial"])
def grown(request, floor):
    target = checks.targets(floor[1], (224, 224))[request.param]
    return request.param, target, [texrs.perspective(*floor, 224, target=target, seed=seed) for seed in (1, 2, 3)]


def mean(measure, results):
    """Measure several images. Touching discs count as one, and large ones are few, so a single image varies."""
    return np.mean([measure(result.image) for result in results])


def test_elements_have_the_size_that_is_asked(floor, grown):
    name, target, results = grown
    ceiling = checks.fidelity(floor[0], floor[1])[0]
    wanted = {"ramp": 0.9, "wave": 0.9, "radial": 0.8}[name]
    assert mean(lambda image: checks.fidelity(image, target)[0], results) >= min(wanted, 0.95 * ceiling)
    assert 0.75 <= mean(lambda image: checks.discs(image, target)[1], results) <= 1.25


def test_it_chooses_by_scale(grown):
    assert all(result.report["scale_error"] <= 0.08 for result in grown[2])


def test_it_stays_sharp_keeps_its_colours_and_does_not_repeat(floor, grown):
    _, target, results = grown
    assert 0.9 <= mean(lambda image: checks.sharpness(*floor, image, target), results) <= 1.1
    assert mean(lambda image: checks.colour_distance(*floor, image, target), results) <= 0.012
    assert mean(checks.repetition, results) <= checks.repetition(floor[0]) + 0.15


def test_plain_synthesis_fails_the_same_check(floor):
    target = checks.targets(floor[1], (224, 224))["wave"]
    plain = texrs.perspective(floor[0], floor[1], 224, target=target, scale_weight=0, seed=1)
    assert checks.fidelity(plain.image, target)[0] < 0.5
    assert plain.report["scale_error"] > 0.15


def test_the_papers_method_follows_the_scale_too():
    small, scale = checks.floor((96, 96), span=(0.6, 1.3), radius=5.0)
    target = checks.targets(scale, (96, 96))["ramp"]
    result = texrs.perspective(small, scale, 96, target=target, method="paper", seed=1)
    assert checks.fidelity(result.image, target)[0] >= 0.9
    # Averages create colours that the exemplar does not have. The stage before blending does not have such colours.
    known = np.unique(small.reshape(-1, 3), axis=0)
    made = np.unique(result.image.reshape(-1, 3), axis=0)
    assert len(np.unique(np.concatenate([known, made]), axis=0)) > len(known)
    copied = np.unique(result.stages["before_blending"].reshape(-1, 3), axis=0)
    assert len(np.unique(np.concatenate([known, copied]), axis=0)) == len(known)
    for energies in result.report["energies"]:
        assert energies[-1] <= energies[0]
