"""Sizes of elements on a plane, without a plane, and without evidence."""

import json
from pathlib import Path

import numpy as np
import pytest

import texrs
from plane_checks import bend, bulge, look, look_twice, roll
from texrs import Plane, io, planes, samples
from texrs.cli import main
from texrs.errors import InvalidInput
from texrs.planes.choose import measure_known_scale
from texrs.planes.sizes import SURE, agree, weigh_bands


@pytest.mark.parametrize("name", ["weave", "dots", "pebbles"])
def test_a_bulge_is_no_plane(name: str) -> None:
    picture, truth = bend(name, (256, 320), bulge)
    found = planes.measure_scale(picture)
    assert (found.shape, found.scale.kind) == ("curved", "area")
    assert found.confidence >= SURE
    off = np.log(found.scale) - np.log(truth)
    assert np.corrcoef(np.log(found.scale).ravel(), np.log(truth).ravel())[0, 1] > 0.93
    # The nearest plane has an error as large as the range of sizes. Patterns under one Gaussian find 60 % of it.
    assert off.std() < 0.35 * np.log(truth).std()


def test_a_column_is_no_plane() -> None:
    picture, truth = bend("weave", (256, 320), roll)
    found = planes.measure_scale(picture)
    assert found.shape == "curved"
    assert np.corrcoef(np.log(found.scale).ravel(), np.log(truth).ravel())[0, 1] > 0.93
    # Along the axis of the column, the pattern has the same size everywhere.
    assert np.log(found.scale).mean(axis=1).std() < 0.03


@pytest.mark.parametrize(("slant", "tilt"), [(0, 90), (30, 200), (55, 90)])
def test_a_plane_is_one(slant: float, tilt: float) -> None:
    found = planes.measure_scale(look("weave", Plane((256, 320), slant, tilt)))
    assert (found.shape, found.scale.kind) == ("plane", "width")
    assert found.plane is not None
    assert found.confidence == found.plane.confidence
    np.testing.assert_array_equal(found.scale, found.plane.scale_map())


def test_few_things_that_differ_by_chance_are_no_curve() -> None:
    for seed in (0, 1):
        found = planes.measure_scale(look("bricks", Plane((256, 320), 0, 90), seed=seed))
        assert found.shape in ("even", "plane")
        assert np.abs(found.scale - 1).max() < 0.05
    slope = np.linspace(-0.5, 0.5, 200)
    assert weigh_bands([slope, slope, slope]) == 1
    assert weigh_bands([0.5 * slope, 0.7 * slope, slope]) < 0.4


def test_what_nobody_knows_is_even_and_said() -> None:
    found = planes.measure_scale(look_twice())
    assert found.shape == "even"
    assert found.confidence < SURE
    assert found.scale.min() == found.scale.max() == 1
    with pytest.warns(UserWarning, match="no plane was found with confidence.*sizes do not agree"):
        measure_known_scale(look_twice(), np.ones((192, 224), np.bool_))


def test_verbs_say_what_was_measured_and_how_surely(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    floor = samples.tilted_discs((128, 128)).image
    hole = np.zeros((128, 128), np.bool_)
    hole[60:80, 50:70] = True
    found = planes.measure_scale(floor)
    grown = texrs.perspective(floor, size=64)
    assert grown.report["measured"] == found.as_dict() == json.loads(json.dumps(grown.report["measured"]))
    assert (found.as_dict()["shape"], found.as_dict()["scale_kind"]) == ("plane", "width")
    assert texrs.perspective(floor, "front", 64).report["measured"] is None
    report = texrs.inpaint(floor, hole, scale_map="auto").report
    assert report["measured"]["shape"] == "plane"
    assert report["measured"]["confidence"] >= SURE
    assert report["exemplar_measured"] is None
    report = texrs.inpaint(
        floor, hole, exemplar=floor, scale_map=found.scale, exemplar_scale_map="auto", method="optimise"
    ).report
    assert (report["measured"], report["exemplar_measured"]) == (None, found.as_dict())
    io.write(tmp_path / "floor.png", floor)
    assert main(["perspective", str(tmp_path / "floor.png"), "-o", str(tmp_path / "out.png"), "--size", "64"]) == 0
    assert found.plane is not None
    says = (
        f"sizes measured on a plane (slant {found.plane.slant:.0f}, tilt {found.plane.tilt:.0f}) with a confidence of"
    )
    assert says in capsys.readouterr().err


def test_a_voice_the_other_way_round_is_outvoted() -> None:
    slope = np.linspace(-0.5, 0.5, 200)
    noise = np.random.default_rng(0).normal(0, 0.03, (4, 200))
    agreed, sure = agree([slope + noise[0], -slope, slope + noise[1], 0.8 * slope + noise[2]])
    assert agreed == [0, 2, 3]
    assert sure > SURE
    assert agree([slope, -slope, slope**2, 0.2 * np.sin(20 * slope)])[1] < SURE
    assert agree([slope]) == ([0], 0.0)


def test_small_pictures_are_doubtful() -> None:
    floor = samples.tilted_discs((56, 56))
    with pytest.warns(UserWarning, match="too small for several measurements"):
        scale = measure_known_scale(floor.image, np.ones((56, 56), np.bool_)).scale
    assert scale.shape == (56, 56)


def test_what_is_not_known_does_not_count() -> None:
    picture, _ = bend("weave", (256, 320), bulge)
    known = np.ones((256, 320), np.bool_)
    known[:, :70] = False
    covered = picture.copy()
    covered[:, :70] = np.random.default_rng(0).integers(0, 255, (256, 70, 3))
    one, other = (planes.measure_scale(p, known=known) for p in (picture, covered))
    np.testing.assert_allclose(np.log(one.scale), np.log(other.scale), atol=0.02)


def test_nothing_to_measure_gets_a_sentence() -> None:
    with pytest.raises(InvalidInput, match="a single colour"):
        planes.measure_scale(np.zeros((128, 128), np.uint8))
    with pytest.raises(InvalidInput, match="known"):
        planes.measure_scale(samples.dots().image, known=np.zeros((3, 3), bool))
