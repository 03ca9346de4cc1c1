"""Targets that are surfaces: another plane, a curved sheet by its normals, a mesh by its UVs, Jacobians."""

import numpy as np
import pytest

import texrs
from texrs import Plane, io, samples, scale_maps
from texrs._engine.pyramid import ONE
from texrs.cli import main
from texrs.errors import InvalidInput
from texrs.exemplar.sheet import Flattened

SIDE = 96
EYE = np.eye(2)


def make_column(side=SIDE, turned=0.0, reach=0.9):
    """Return normals of a cylinder, upright or rotated by some degrees."""
    y, x = np.mgrid[:side, :side] - (side - 1) / 2
    angle = np.radians(turned)
    u = np.clip((x * np.cos(angle) - y * np.sin(angle)) / (side / 2), -1, 1) * reach
    return np.stack([u * np.cos(angle), u * np.sin(angle), np.sqrt(1 - u * u)], axis=-1)


def derive(values):
    """Return the derivatives of coordinates (rows, columns, 2) by pixels."""
    return np.stack(np.gradient(values, axis=(0, 1)), axis=-1)


# --- how surfaces are seen --------------------------------------------------------------------------------------------


def test_a_plane_s_jacobians_are_the_derivatives():
    plane = Plane((40, 56), 48, 30, 50, rotation=20)
    grid = np.moveaxis(np.indices((40, 56)), 0, -1).astype(float)
    step = 1e-5
    by = [(plane.flatten(grid + step * e) - plane.flatten(grid - step * e)) / (2 * step) for e in EYE]
    np.testing.assert_allclose(plane.jacobians(), np.stack(by, axis=-1), rtol=1e-6, atol=1e-7)
    # These Jacobians are also the inverses of the Jacobians of `project`.
    np.testing.assert_allclose(
        plane.projection_jacobians(plane.flatten(grid)) @ plane.jacobians(),
        np.broadcast_to(EYE, (40, 56, 2, 2)),
        atol=1e-9,
    )


@pytest.mark.parametrize("turned", [0, 30, 90, 140])
def test_a_cylinder_is_unrolled_by_its_normals(turned):
    found = scale_maps.jacobians_of_normals(make_column(turned=turned))
    # Unroll the cylinder: one coordinate is the arc length in the direction of curvature.
    y, x = np.mgrid[:SIDE, :SIDE] - (SIDE - 1) / 2
    angle, radius = np.radians(turned), SIDE / 2 / 0.9
    u, v = x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)
    arc = radius * np.arcsin(np.clip(u / radius, -0.9, 0.9))
    texture = np.stack([-arc * np.sin(angle) + v * np.cos(angle), arc * np.cos(angle) + v * np.sin(angle)], axis=-1)
    inner = np.abs(u) < SIDE / 2 - 2
    np.testing.assert_allclose(found[inner], derive(texture)[inner], atol=0.05)


def test_normals_in_any_form_say_the_same():
    normals = make_column(turned=30)
    wanted = scale_maps.jacobians_of_normals(normals)
    # A cylinder that curves away to one side only has no negative values, and must not be taken for an encoded one.
    half = make_column()[:, SIDE // 2 :]
    assert half.min() >= 0
    np.testing.assert_allclose(
        scale_maps.jacobians_of_normals(half), scale_maps.jacobians_of_normals(make_column())[:, SIDE // 2 :]
    )
    for top, dtype in ((255, np.uint8), (65535, np.uint16)):
        coded = np.rint((normals + 1) / 2 * top).astype(dtype)
        np.testing.assert_allclose(scale_maps.jacobians_of_normals(coded), wanted, atol=0.05)
    np.testing.assert_allclose(scale_maps.jacobians_of_normals((normals + 1) / 2), wanted, atol=1e-9)
    flipped = normals * [1, -1, 1]
    np.testing.assert_allclose(scale_maps.jacobians_of_normals(flipped, green="down"), wanted)
    bare = normals.copy()
    bare[:9], bare[9:12] = 0, np.nan
    found = scale_maps.jacobians_of_normals(bare)
    np.testing.assert_array_equal(found[:12], np.broadcast_to(EYE, (12, SIDE, 2, 2)))
    np.testing.assert_array_equal(found[12:], wanted[12:])
    # Parts seen edge on are not visible, and nothing becomes infinite.
    assert np.abs(scale_maps.jacobians_of_normals(np.array([[[1.0, 0, 0], [0, 0, -1], [0.6, 0, 0.8]]]))).max() < 7


def test_coordinates_may_jump_and_end():
    plane = Plane((40, 56), 40, 60)
    grid = np.moveaxis(np.indices((40, 56)), 0, -1).astype(float)
    uv = plane.flatten(grid)
    wanted = plane.jacobians()
    smooth = scale_maps.jacobians_of_coordinates(uv)
    np.testing.assert_allclose(smooth[1:-1, 1:-1], wanted[1:-1, 1:-1], rtol=0.01, atol=0.01)
    torn = uv.copy()
    torn[:, 20:] += 500
    torn[30:, 40:] = np.nan
    found = scale_maps.jacobians_of_coordinates(torn)
    assert np.isfinite(found).all()
    known = np.ones((40, 56), bool)
    known[30:, 40:] = False
    np.testing.assert_allclose(found[known], wanted[known], rtol=0.1, atol=0.1)


def test_what_is_no_surface_is_refused():
    with pytest.raises(InvalidInput, match="coordinates: must have at least two rows"):
        scale_maps.jacobians_of_coordinates(np.zeros((1, 4, 2)))


# --- textures that lie on them ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def weave():
    return samples.weave((128, 128)).image


@pytest.fixture(scope="module")
def around(weave):
    return texrs.perspective(weave, "front", target=make_column(), seed=1)


def test_frames_are_those_of_the_surface(around):
    assert around.report["surface"]
    assert around.report["sheet"]["kind"] == "front"
    frames = around.source_map.jacobians()
    np.testing.assert_allclose(frames, scale_maps.jacobians_of_normals(make_column()), atol=0.01)
    # Steps of the coordinates follow the frames, except at seams.
    labels, made = around.source_map.label, derive(around.source_map.coordinates.astype(float))
    inside = np.ones(labels.shape, bool)
    for axis in (0, 1):
        for by in (-1, 1):
            inside &= labels == np.roll(labels, by, axis)
    inside[[0, -1]] = inside[:, [0, -1]] = False
    assert inside.mean() > 0.5
    off = np.abs(made - frames)[inside].max(axis=(-2, -1))
    assert np.quantile(off, 0.9) < 0.12


def test_elements_are_foreshortened_as_the_surface_is(weave, around):
    """In the image, slopes across the axis get steeper where a column curves away, and slopes along it do not."""
    grey = around.image.mean(axis=-1)
    rows, columns = np.gradient(grey)
    cos = make_column()[0, :, 2]

    def steepness(part):
        return np.sqrt((columns[:, part] ** 2).mean() / (rows[:, part] ** 2).mean())

    middle, edge = np.abs(np.arange(SIDE) - SIDE / 2) < 12, (cos < 0.75) & (cos > 0.5)
    assert 0.75 / np.mean(cos[edge]) < steepness(edge) / steepness(middle) < 1.35 / np.mean(cos[edge])


def test_normal_maps_of_the_texture_turn_with_it(weave, around):
    slope = np.dstack(np.gradient(weave.mean(axis=-1) / 255 * 3))
    normal = np.dstack([-slope[..., 1], slope[..., 0], np.ones(slope.shape[:2])])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    shown = around.source_map.render(normal.astype(np.float32), map_type="normal", interpolation="linear")
    plain = around.source_map.render(normal.astype(np.float32), interpolation="linear")
    # Bumps are compressed across the axis, so their slopes are divided by the cosine.
    cos = make_column()[..., 2]
    np.testing.assert_allclose(
        (shown[..., 0] / shown[..., 2]), (plain[..., 0] / plain[..., 2]) / cos, atol=0.02, rtol=0.02
    )
    np.testing.assert_allclose((shown[..., 1] / shown[..., 2]), (plain[..., 1] / plain[..., 2]), atol=0.02, rtol=0.02)


@pytest.mark.parametrize("count", [2, 7])
def test_same_bytes_for_any_number_of_threads(weave, around, count):
    with texrs.threads(count):
        again = texrs.perspective(weave, "front", target=make_column(), seed=1)
    assert again.image.tobytes() == around.image.tobytes()
    np.testing.assert_array_equal(again.source_map.coordinates, around.source_map.coordinates)


def test_one_floor_laid_on_another():
    floor = samples.tilted_discs((128, 128)).image
    own = texrs.planes.find(floor, fov=37)
    other = Plane((96, 120), 30, 20, 45)
    made = texrs.perspective(floor, own, target=other, seed=1)
    assert made.image.shape == (96, 120, 3)
    assert made.report["sheet"]["kind"] == "plane"
    assert made.report["scale_error"] < 0.05
    # Without the exemplar's own plane, the frames equal the target.
    at, frames = made.source_map.coordinates.astype(float), made.source_map.jacobians().astype(float)
    flat = Plane((128, 128), own.slant, own.tilt, own.fov)
    away = at - flat.principal_point
    wide = flat.width(at)[..., None, None]
    fold = flat._affine / wide - (away @ flat._affine.T)[..., :, None] * flat._rise / wide**2
    np.testing.assert_allclose(fold @ frames, other.jacobians(), atol=0.03, rtol=0.03)
    words = texrs.perspective(floor, own, (96, 120), target="plane:slant=30,tilt=20,fov=45", seed=1)
    np.testing.assert_array_equal(words.image, made.image)


def test_a_plane_laid_on_itself_is_seen_as_it_was():
    floor = samples.tilted_discs((128, 128)).image
    plane = Plane((128, 128), 50, 70, 50)
    slope = plane.as_slope()
    sheet = Flattened.of(texrs.Exemplar(floor).guidance, slope, plane.scale_map())
    bent = sheet.bend(plane.jacobians(), plane.scale_map()).reshape(128, 128, 2, 2) / ONE
    grid = np.moveaxis(np.indices((128, 128)), 0, -1).astype(float)
    seen = slope.projection_jacobians(slope.flatten(grid)) / sheet.resolution
    together = (seen @ bent)[plane.scale_map() > 0.4]
    np.testing.assert_allclose(together, np.broadcast_to(EYE, together.shape), atol=0.01)


def test_jacobians_and_coordinates_are_targets_too(weave):
    turned = np.array([[0.0, 1.0], [-1.0, 0.0]])
    field = np.broadcast_to(turned, (64, 64, 2, 2))
    by_field = texrs.perspective(weave, "front", target=field, seed=1)
    np.testing.assert_allclose(by_field.source_map.jacobians(), field, atol=1e-3)
    uv = np.moveaxis(np.indices((64, 64)), 0, -1) @ turned.T
    np.testing.assert_array_equal(texrs.perspective(weave, "front", target=uv, seed=1).image, by_field.image)
    # A target of another size is stretched.
    assert texrs.perspective(weave, "front", (48, 80), target=field, seed=1).image.shape == (48, 80, 3)
    half = texrs.perspective(weave, "front", target=2 * EYE * np.ones((64, 64, 1, 1)), seed=1)
    assert half.report["scale_error"] < 0.02
    np.testing.assert_allclose(half.stages["target"], 0.5, rtol=1e-3)


def test_what_is_no_plane_and_has_many_sizes_is_bent_in_copies():
    import perspective_checks as checks

    image, scale = checks.floor((128, 128))
    made = texrs.perspective(image, scale, target=make_column(), seed=1)
    assert made.report["sheet"]["kind"] == "copies"
    assert made.report["scale_error"] < 0.15
    whole = np.abs(np.linalg.det(made.source_map.jacobians()))
    wanted = np.abs(np.linalg.det(scale_maps.jacobians_of_normals(make_column())))
    # Copies from places with other scales are enlarged or shrunk by the scale there.
    sizes = scale[tuple(np.rint(made.source_map.coordinates).astype(int).reshape(-1, 2).T)].reshape(whole.shape)
    assert np.median(np.abs(np.log(whole / wanted / sizes**2))) < 0.25


def test_what_is_too_small_is_shown_as_small_as_there_is(weave):
    far = 20 * EYE * np.ones((32, 32, 1, 1))
    far[:16] = 2 * EYE
    with pytest.warns(UserWarning, match="target: 50.0% of the pixels are outside the scales"):
        made = texrs.perspective(weave, "front", target=far, seed=1)
    np.testing.assert_allclose(made.stages["target"][16:], 1 / 8, rtol=1e-3)


def test_a_column_that_repeats(weave):
    ends = make_column(reach=0.8)
    grit = samples.grit((128, 128)).image
    made = texrs.perspective(grit, "front", target=ends, wrap=(True, False), seed=1)
    image = made.image.astype(float)
    assert np.abs(image[0] - image[-1]).mean() < 1.6 * np.abs(np.diff(image, axis=0)).mean()
    with pytest.raises(InvalidInput, match="wrap: the target's first and last columns"):
        texrs.perspective(weave, "front", target=ends[:, SIDE // 2 :], wrap=(False, True))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"target": "floor"}, "target: must be plane:slant=DEGREES"),
        ({"target": "plane:tilt=9"}, "target: must be plane:slant=DEGREES"),
        ({"target": "plane:slant=steep"}, "target: must be plane:slant=DEGREES"),
        ({"target": "plane:slant=99"}, "target: slant: must be a number between 0 and 88"),
        ({"target": "plane:slant=80,fov=90"}, "target: must not contain the horizon, but with slant 80"),
        ({"target": np.zeros((8, 8, 2, 2))}, "target: must have scales of .* 64 of 64 do not"),
        ({"target": np.full((8, 8, 2, 2), np.nan)}, "target: must be finite"),
        ({"target": np.zeros((8, 8, 2), np.uint8)}, "target: coordinates .* must be floats"),
        ({"target": make_column(8), "method": "paper"}, "method: 'paper' cannot be combined with a surface"),
        ({"scale_map": "plane:slant=x"}, "scale_map: must be plane:slant=DEGREES"),
        ({"scale_map": Plane((9, 9), 20)}, "scale_map: a plane must belong to an image of"),
        ({"scale_map": "plane:slant=30", "fov": 40}, "fov: cannot be combined with a plane"),
        ({"scale_map": Plane((128, 128), 30), "fov": 40}, "fov: cannot be combined with a plane"),
    ],
)
def test_bad_input_is_named(weave, given, words):
    call = {"scale_map": "front", **given}
    with pytest.raises(InvalidInput, match=words):
        texrs.perspective(weave, size=32, **call)


def test_the_angle_of_view_of_a_photograph_is_used(tmp_path, monkeypatch):
    from PIL import Image

    monkeypatch.chdir(tmp_path)
    floor = samples.tilted_discs((128, 128)).image
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 54
    Image.fromarray(floor).save("floor.webp", exif=exif, lossless=True)
    line = "perspective floor.webp -o out.png --target plane:slant=30 --size 64 --seed 1 -q"
    assert main(line.split()) == 0
    stated = texrs.perspective(floor, size=64, target="plane:slant=30", fov=io.read_fov("floor.webp"), seed=1)
    np.testing.assert_array_equal(io.read("out.png"), stated.image)
    unknown = texrs.perspective(floor, size=64, target="plane:slant=30", seed=1)
    assert (unknown.image != stated.image).any()
    # A given plane has its own angle of view.
    assert main([*line.split(), "--scale-map", "plane:slant=50,fov=37"]) == 0


def test_on_the_command_line(tmp_path, monkeypatch, capsys, weave):
    monkeypatch.chdir(tmp_path)
    io.write("weave.png", weave)
    io.write("column.png", np.rint((make_column(48) + 1) * 127.5).astype(np.uint8))
    np.save("bent.npy", scale_maps.jacobians_of_normals(make_column(48)))
    np.save("places.npy", Plane((48, 48), 30).flatten(np.moveaxis(np.indices((48, 48)), 0, -1)))
    io.write("map.npy", np.full((48, 48), 0.8, np.float32))
    for target, shape in (
        ("plane:slant=40,tilt=60,fov=50 --size 50x40", (40, 50)),
        ("column.png", (48, 48)),
        ("bent.npy", (48, 48)),
        ("places.npy", (48, 48)),
        ("map.npy", (48, 48)),
        ("plane:slant=20", (256, 256)),
    ):
        line = f"perspective weave.png -o out.png --scale-map front --target {target} --seed 1 -q"
        assert main(line.split()) == 0, capsys.readouterr().err
        assert io.read("out.png").shape[:2] == shape
    by_words = texrs.perspective(weave, "front", (256, 256), target=Plane((8, 8), 20), seed=1)
    np.testing.assert_array_equal(io.read("out.png"), by_words.image)
    assert main(["perspective", "weave.png", "-o", "two.png", "--scale-map", "front", "--target", "plane:slant=x"]) == 2
    assert "plane:slant=DEGREES" in capsys.readouterr().err
    assert (
        main(["perspective", "weave.png", "-o", "two.png", "--scale-map", "plane:slant=30", "--target", "none.npy"])
        == 2
    )
    assert "none.npy" in capsys.readouterr().err
