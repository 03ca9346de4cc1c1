"""Planes, sheets and lookup without aliasing: the parts of PERSPECTIVE."""

import numpy as np
import pytest

import perspective_checks as checks
import texrs
from texrs import SourceMap, samples, scale_maps
from texrs._engine.pyramid import ONE
from texrs.exemplar.sheet import Copies, Flattened, find_plane
from texrs.scale_maps.slope import Slope


@pytest.fixture(scope="module")
def disc_floor():
    """Return a plane seen from above, and the width of its elements. The square root of areas is its 3/2 power."""
    floor = samples.tilted_discs((128, 128))
    return floor.image, np.asarray(floor.scale_map ** (2 / 3), np.float32)


@pytest.mark.parametrize("tilt", [90, 35, -112])
def test_a_plane_is_recovered_and_its_projection_undone(tilt):
    scale = scale_maps.from_angles((60, 90), 55, tilt)
    plane = Slope.fit(scale)
    assert plane is not None
    assert plane.residual < 1e-4
    grid = np.moveaxis(np.indices(scale.shape), 0, -1)
    np.testing.assert_allclose(plane.scales(grid), scale, rtol=1e-4)
    flat = plane.flatten(grid)
    np.testing.assert_allclose(plane.project(flat), grid, atol=1e-6)
    # Depth grows in the direction of the tilt.
    away = np.degrees(np.arctan2(plane.down[0], -plane.down[1]))
    assert (away - tilt + 180) % 360 - 180 == pytest.approx(0, abs=0.1)


def test_the_jacobians_are_the_derivatives():
    plane = Slope.fit(scale_maps.from_angles((40, 50), 50, 60))
    points = plane.flatten(np.moveaxis(np.indices((40, 50)), 0, -1)[5:-5:7, 5:-5:7])
    step = 1e-6
    by = [(plane.project(points + step * e) - plane.project(points - step * e)) / (2 * step) for e in np.eye(2)]
    np.testing.assert_allclose(plane.projection_jacobians(points), np.stack(by, axis=-1), rtol=1e-4, atol=1e-4)


def test_a_plane_seen_as_it_is_stays_as_it_is():
    scale = scale_maps.from_angles((40, 50), 50, 60)
    plane = Slope.fit(scale)
    grid = np.moveaxis(np.indices((40, 50)), 0, -1)
    together = plane.projection_jacobians(plane.flatten(grid)) @ plane.jacobians(scale, plane)
    np.testing.assert_allclose(together, np.broadcast_to(np.eye(2), together.shape), atol=2e-3)


def test_what_is_seen_along_a_ramp_fits_together_and_stands_as_it_stood():
    plane = Slope.fit(scale_maps.from_angles((40, 50), 50, 60))
    turned = scale_maps.from_angles((40, 50), 50, 80)
    other = Slope.fit(turned)
    frames = plane.jacobians(turned, other)
    # The frames are derivatives of one map, so mixed derivatives agree.
    curl = np.gradient(frames[..., 1], axis=0) - np.gradient(frames[..., 0], axis=1)
    assert np.abs(curl[2:-2, 2:-2]).max() < 0.02 * np.abs(frames).max()
    np.testing.assert_allclose(frames[20, 25] @ plane.down, plane.jacobians(turned)[20, 25] @ plane.down, atol=0.15)
    assert other.order(turned) < 1e-3 < other.order(np.asarray(turned[:, ::-1]))


def test_round_things_are_no_plane_however_well_a_map_fits():
    image, scale = checks.floor((160, 160))
    fitted = Slope.fit(scale)
    exact = np.asarray(fitted.scales(np.moveaxis(np.indices(scale.shape), 0, -1)), np.float32)
    assert find_plane(texrs.Exemplar(image).guidance, exact) is None


def test_a_map_that_hardly_varies_is_no_plane():
    assert Slope.fit(np.ones((20, 20), np.float32)) is None
    assert Slope.fit(scale_maps.from_angles((20, 20), 5, 90)) is None


def test_round_things_that_get_smaller_are_no_plane(disc_floor):
    image, scale = disc_floor
    assert find_plane(texrs.Exemplar(image).guidance, scale) is not None
    # A map of areas gives the same plane.
    areas = find_plane(texrs.Exemplar(image).guidance, scale**1.5)
    assert areas.power == pytest.approx(2 / 3)
    assert areas.slope == pytest.approx(find_plane(texrs.Exemplar(image).guidance, scale).slope, rel=1e-3)
    # A measured map varies, but edges of the image support the plane.
    rough = scale * np.exp(0.05 * np.sin(np.arange(128) / 3))[:, np.newaxis].astype(np.float32)
    assert Slope.fit(rough).residual > 0.03
    assert find_plane(texrs.Exemplar(image).guidance, rough) is not None
    round_, theirs = checks.floor((128, 128))
    assert find_plane(texrs.Exemplar(round_).guidance, theirs) is None


def test_what_a_sheet_shows_is_the_exemplar(disc_floor):
    image, scale = disc_floor
    colours = texrs.Exemplar(image).guidance
    flat = Flattened.of(colours, find_plane(colours, scale), scale)
    copies = Copies.of(colours, scale, (1.0, 0.8, 1.25), scale)
    for sheet in (flat, copies):
        rows, columns = np.nonzero(sheet.free)
        at, frames = sheet.locate(np.stack([rows, columns], axis=-1).astype(np.int32) * ONE)
        assert (at >= 0).all()
        assert (at <= 127).all()
        assert (np.linalg.det(frames) > 0).all()
    grid = np.moveaxis(np.indices((128, 128)), 0, -1)[40:-8:9, 8:-8:9].reshape(-1, 2).astype(np.float32)
    places = flat.place(grid)
    np.testing.assert_allclose(flat.locate(places)[0], grid, atol=0.01)
    near = np.rint(places / ONE).astype(int)
    assert flat.free[near[:, 0], near[:, 1]].all()


def test_copies_have_the_elements_of_the_exemplar():
    image, scale = checks.floor((128, 128))
    sheet = Copies.of(texrs.Exemplar(image).guidance, scale, (1.0, 0.64, 1.5625), np.array([0.5, 1.6], np.float32))
    first = sheet.copies[0]
    for copy in sheet.copies:
        labels, depth = (a[copy.window] for a in (sheet.elements.labels, sheet.elements.depth))
        others = np.delete(
            sheet.elements.labels.ravel(), np.arange(sheet.free.size).reshape(sheet.free.shape)[copy.window]
        )
        assert not np.intersect1d(labels[labels > 0], others).size
        # A rescaled copy has the same share of elements as its source, and their depth is rescaled.
        assert len(np.unique(labels)) > 20
        size = float(np.sqrt(np.prod(copy.factor)))
        ends = [slice(f, f + round(n / k)) for f, n, k in zip(copy.first, copy.shape, copy.factor, strict=True)]
        there = sheet.elements.depth[first.window][tuple(ends)]
        assert (depth > 0).mean() == pytest.approx((there > 0).mean(), rel=0.1)
        assert depth.max() == pytest.approx(size * there.max(), rel=0.1)
    # All numbers of elements occur.
    assert np.array_equal(np.unique(sheet.elements.labels), np.arange(sheet.elements.count + 1))
    assert (sheet.elements.labels[~sheet.free] == 0).all()


def test_a_sheet_shows_pictures_in_register(disc_floor):
    image, scale = disc_floor
    colours = texrs.Exemplar(image).guidance
    for sheet in (
        Flattened.of(colours, find_plane(colours, scale), scale),
        Copies.of(colours, scale, (1.0, 0.8), scale),
    ):
        shown = sheet.show(colours)
        assert shown.shape == sheet.colours.shape
        assert np.abs(shown - sheet.colours)[sheet.free].mean() < 0.03
        assert (shown[~sheet.free] == 0).all()


def test_elements_on_a_plane_are_whole():
    floor = samples.tilted_discs((160, 160))
    scale = np.asarray(floor.scale_map ** (2 / 3), np.float32)
    result = texrs.perspective(floor.image, scale, (160, 200), seed=2)
    assert result.report["sheet"]["kind"] == "plane"
    assert result.report["scale_error"] < 0.05
    # The frames show the view of the exemplar, and agree with coordinate differences inside patches.
    source = result.source_map
    steps = np.diff(source.coordinates, axis=0)[:, :-1]
    same = source.label[:-1, :-1] == source.label[1:, :-1]
    away = np.linalg.norm(steps - source.jacobians()[:-1, :-1, :, 0], axis=-1)[same]
    assert np.median(away) < 0.1


def test_maps_of_widths_and_of_areas_ask_for_the_same(disc_floor):
    image, scale = disc_floor
    ramp = np.geomspace(0.7, 1.3, 96, dtype=np.float32)[:, np.newaxis].repeat(96, axis=1)
    wide, large = (texrs.perspective(image, scale**p, 96, target=ramp**p, seed=1) for p in (1, 1.5))
    sizes = [np.log(np.abs(np.linalg.det(made.source_map.jacobians()))) / 2 for made in (wide, large)]
    shown = [s - 1.5 * np.log(made.source_map.render(scale)) for s, made in zip(sizes, (wide, large), strict=True)]
    assert np.median(np.abs(shown[0] - shown[1])) < 0.02
    assert max(made.report["scale_error"] for made in (wide, large)) < 0.05


def test_a_hole_in_a_plane_is_filled_in_depth(disc_floor):
    image, scale = disc_floor
    hole = np.zeros(scale.shape, bool)
    hole[40:90, 40:90] = True
    bare = np.where(hole[..., np.newaxis], 0, image).astype(np.uint8)
    result = texrs.inpaint(bare, hole, scale_map=np.where(hole, np.nan, scale).astype(np.float32))
    np.testing.assert_array_equal(result.image[~hole], image[~hole])
    at = np.rint(result.source_map.coordinates[hole]).astype(int)
    assert not hole[at[:, 0], at[:, 1]].any()
    # On an oblique plane, copies are projected, so their frames differ from the identity.
    assert np.abs(result.source_map.jacobians()[hole] - np.eye(2)).max() > 0.05
    with texrs.threads(1):
        alone = texrs.inpaint(bare, hole, scale_map=np.where(hole, np.nan, scale).astype(np.float32))
    assert alone.image.tobytes() == result.image.tobytes()


def test_what_is_shrunk_is_smoothed_first():
    lines = np.tile(np.uint8([0, 250]), (64, 32))
    at = np.stack(np.meshgrid(np.arange(16.0) * 4, np.arange(16.0) * 4, indexing="ij"), -1).astype(np.float32)
    shrunk = SourceMap.from_coordinates(at, lines.shape, jacobian=np.float32([np.eye(2) * 4]))
    assert shrunk.render(lines).std() == 0
    assert abs(shrunk.render(lines, antialias=True)[:, 2:-2].astype(int) - 125).max() <= 8
    assert (shrunk.render(lines, antialias=True, interpolation="nearest") == shrunk.render(lines)).all()
    labels = SourceMap.identity(lines.shape)
    np.testing.assert_array_equal(labels.render(lines, antialias=True), lines)
