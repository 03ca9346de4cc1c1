"""Scale maps that specify whether they contain widths or square roots of areas."""

import copy
import pickle

import numpy as np
import pytest

import scale_checks as checks
import texrs
from texrs import Plane, io, samples, scale_maps
from texrs.cli import main
from texrs.errors import InvalidInput
from texrs.exemplar.sheet import find_plane
from texrs.scale_maps import ScaleMap

SEEN = scale_maps.from_angles((48, 64), 50, 90)


@pytest.mark.parametrize(
    "make",
    [
        lambda m: m[3:],
        lambda m: m.copy(),
        lambda m: copy.deepcopy(m),
        lambda m: pickle.loads(pickle.dumps(m)),
        lambda m: m * 2,
        lambda m: 2 * m,
        lambda m: m / m.mean(),
        lambda m: np.clip(m, 0.5, 2),
        lambda m: scale_maps.edit(m, ["magnify"]),
        lambda m: scale_maps.resample(m, (30, 30)),
        lambda m: scale_maps.resample(m, (60, 90), "extend"),
        lambda m: scale_maps.extend(m, np.arange(48 * 64).reshape(48, 64) % 7 > 0),
    ],
)
@pytest.mark.parametrize("kind", ["width", "area"])
def test_what_stays_a_map_keeps_its_kind(make, kind):
    made = make(SEEN.as_kind(kind))
    assert isinstance(made, ScaleMap)
    assert made.kind == kind
    assert made.dtype == np.float32


@pytest.mark.parametrize(
    "make", [lambda m: m**1.5, lambda m: np.log(m), lambda m: 1 / m, lambda m: m * m, lambda m: m + 1, lambda m: m > 1]
)
def test_what_is_no_map_any_more_is_a_plain_array(make):
    assert type(make(SEEN)) is np.ndarray
    np.testing.assert_array_equal(make(SEEN), make(np.asarray(SEEN)))


def test_in_place_a_power_forgets_the_kind():
    own = SEEN.copy()
    own *= 2
    assert own.kind == "width"
    own **= 1.5
    assert own.kind is None


def test_each_maker_says_what_it_makes():
    floor = samples.tilted_discs((96, 96))
    assert scale_maps.from_mask(floor.mask).kind == "area"
    assert scale_maps.from_mask(floor.mask, foreshortened=True).kind == "width"
    assert Plane((8, 8), 40).scale_map("area").kind == "area"
    assert Plane((8, 8), 40).scale_map().kind == "width"
    wide = Plane((48, 64), 40).scale_map()
    np.testing.assert_allclose(wide.as_kind("area"), Plane((48, 64), 40).scale_map("area"), rtol=1e-5)
    np.testing.assert_allclose(wide.as_kind("area").as_kind("width"), wide, rtol=1e-5)
    with pytest.raises(InvalidInput, match="kind: must be one of width, area"):
        ScaleMap(np.ones((4, 4), np.float32), "height")


def test_planes_are_told_of_either_kind():
    wide = Plane((48, 64), 40, 70).scale_map()
    for scale in (wide, wide.as_kind("area")):
        found = Plane.of_scale_map(scale)
        assert (found.slant, found.tilt) == pytest.approx((40, 70), abs=0.1)
    # A map of areas is not treated as a map of widths, even if it would fit well.
    image = texrs.Exemplar(samples.tilted_discs((128, 128)).image).guidance
    straight = scale_maps.from_angles((128, 128), 50, 90)
    assert find_plane(image, straight).power == 1
    assert find_plane(image, ScaleMap(straight, "area")).power == pytest.approx(2 / 3)
    assert find_plane(image, np.asarray(straight), "area").power == pytest.approx(2 / 3)


@pytest.mark.parametrize("number", range(4))
def test_a_plane_is_laid_through_widths(number):
    """Roots of areas are not linear in an image, so a plane fitted to them has errors at both ends."""
    case = checks.generated(256)[number]
    found = scale_maps.from_mask(case.mask, trend="plane")
    np.testing.assert_allclose(
        found.as_kind("width"), scale_maps.from_mask(case.mask, trend="plane", foreshortened=True), rtol=0.02
    )
    wide = np.asarray(found.as_kind("width"), np.float64)
    bent = np.abs(np.diff(wide, 2, axis=0)).max() + np.abs(np.diff(wide, 2, axis=1)).max()
    assert bent < 1e-4 * wide.max()


def test_a_target_of_the_other_kind_asks_for_the_same():
    floor = samples.tilted_discs((96, 96))
    plane = texrs.planes.find(floor.image)
    target = Plane((64, 64), 30, 60).scale_map()
    wide, mixed = (
        texrs.perspective(floor.image, plane.scale_map(), target=t, seed=1) for t in (target, target.as_kind("area"))
    )
    assert wide.report["sheet"]["kind"] == "plane"
    np.testing.assert_allclose(mixed.stages["target"], wide.stages["target"], rtol=1e-5)
    other = texrs.perspective(
        floor.image, plane.scale_map("area"), target=np.asarray(target), scale_kind="width", seed=1
    )
    np.testing.assert_allclose(other.stages["target"], target.as_kind("area"), rtol=1e-5)
    with pytest.raises(InvalidInput, match="kind: must be one of width, area"):
        texrs.perspective(floor.image, plane.scale_map(), scale_kind="length")


@pytest.mark.parametrize("name", ["map.tif", "map.png"])
def test_files_keep_the_kind(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    io.write("floor.png", samples.tilted_discs((96, 96)).image)
    for way, kind in (("--slant 40", "width"), ("--auto", "area"), ("--auto --foreshortened", "width")):
        assert main(["scale-map", "floor.png", "-o", name, *way.split()]) == 0
        said = capsys.readouterr().err
        assert ("widths" if kind == "width" else "roots of areas") in said
        assert ("--fov" in said) == (way == "--slant 40")
        assert io.read_description(name) == f"scale map: {kind}"
        # A map that is computed from this file has the same kind.
        assert main(["scale-map", "floor.png", "-o", "two.tif", "--scale-map", name, "--size", "32", "-q"]) == 0
        assert io.read_description("two.tif") == f"scale map: {kind}"
    assert main(["perspective", "floor.png", "-o", "out.png", "--scale-map", name, "--size", "32", "-q"]) == 0
    assert main(["perspective", "floor.png", "-o", "out.png", "--scale-map", name, "--scale-kind", "length"]) == 2
    assert "--scale-kind: must be one of" in capsys.readouterr().err


def test_holes_are_filled_by_maps_of_either_kind(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    floor = samples.tilted_discs((96, 96))
    hole = np.zeros((96, 96), np.bool_)
    hole[50:70, 40:60] = True
    plane = texrs.planes.find(floor.image)
    wide, areas = plane.scale_map(), plane.scale_map("area")
    by_widths = texrs.inpaint(floor.image, hole, scale_map=wide)
    # Plain arrays do not record their kind, so pass it.
    one, other = np.array(wide), np.array(areas)
    said = texrs.inpaint(floor.image, hole, scale_map=one, scale_kind="width")
    np.testing.assert_array_equal(said.image, by_widths.image)
    by_areas = texrs.inpaint(floor.image, hole, scale_map=areas)
    np.testing.assert_array_equal(
        texrs.inpaint(floor.image, hole, scale_map=other, scale_kind="area").image, by_areas.image
    )
    assert (by_areas.image != texrs.inpaint(floor.image, hole, scale_map=other, scale_kind="width").image).any()
    with pytest.raises(InvalidInput, match="kind: must be one of width, area"):
        texrs.inpaint(floor.image, hole, scale_map=one, scale_kind="length")
    with pytest.raises(InvalidInput, match="kind: has no effect without scale_map"):
        texrs.inpaint(floor.image, hole, scale_kind="width")
    for name, values in (("floor.png", floor.image), ("hole.png", hole), ("map.npy", other)):
        io.write(name, values)
    command = ["inpaint", "floor.png", "hole.png", "-o", "out.png", "--scale-map", "map.npy", "--scale-kind"]
    assert main([*command, "area", "-q"]) == 0
    np.testing.assert_array_equal(io.read("out.png"), by_areas.image)
    assert main([*command, "length"]) == 2
    assert "--scale-kind: must be one of" in capsys.readouterr().err


def test_descriptions_come_back(tmp_path):
    for name in ("a.png", "a.tif", "a.npy"):
        io.write(tmp_path / name, np.zeros((4, 5), np.uint8), description="plain words")
        assert io.read_description(tmp_path / name) == (None if name == "a.npy" else "plain words")
        np.testing.assert_array_equal(io.read(tmp_path / name), np.zeros((4, 5), np.uint8))
        io.write(tmp_path / name, np.zeros((4, 5), np.uint8))
        assert io.read_description(tmp_path / name) is None
    assert io.read_description(tmp_path / "none.png") is None
    with pytest.raises(InvalidInput, match="description: must be an ASCII string"):
        io.write(tmp_path / "a.png", np.zeros((4, 5), np.uint8), description="\N{GREEK SMALL LETTER PI}")
