"""Correction of seams: known answers, unchanged values elsewhere, any map, strip and number of threads."""

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import _rust, samples
from texrs.blending import _seams, _values, _visibility, blend, measure_visibility
from texrs.blending._correction import divide_strips
from texrs.errors import InvalidInput
from texrs.source_map import SourceMap


def pasted(places, shapes, exemplar=None, label=None, jacobian=None):
    size = places.shape[:2]
    return SourceMap(
        np.asarray(places, np.float32),
        np.zeros(size, np.uint16) if exemplar is None else exemplar.astype(np.uint16),
        np.zeros(size, np.uint32) if label is None else label.astype(np.uint32),
        jacobian,
        shapes,
    )


@pytest.fixture(scope="module")
def patchwork():
    """Return squares of 32 pixels from random places of a 64 x 64 exemplar."""
    random = np.random.default_rng(1)
    whole = SourceMap.identity((64, 64)).coordinates
    places = np.empty((96, 128, 2), np.float32)
    for row in range(0, 96, 32):
        for column in range(0, 128, 32):
            r, c = random.integers(0, 33, 2)
            places[row : row + 32, column : column + 32] = whole[r : r + 32, c : c + 32]
    return pasted(places, ((64, 64),))


@pytest.fixture(scope="module")
def exemplar():
    random = np.random.default_rng(2)
    rows, columns = np.mgrid[:64, :64] / 64
    smooth = np.stack([rows, columns, 0.5 * (rows + columns)], axis=-1) * 0.8
    return np.rint(255 * (smooth + 0.1 * random.random((64, 64, 3)))).astype(np.uint8)


# --- the equation ----------------------------------------------------------------------------------------------------


def twin(source, image, wrap, screening):
    """Solve the least squares problem directly: one row for each edge, one row for each pixel."""
    height, width = source.shape
    values = view(source, image)
    joined = [source.is_coherent(a, wrap=wrap[a]) for a in range(2)]
    frames = source.jacobians()
    fixed = np.zeros(source.shape, bool)
    for axis in range(2):
        if not wrap[axis]:
            np.moveaxis(fixed, axis, 0)[[0, -1]] = True

    def look(place):
        row, column = np.rint(place).astype(int)
        inside = 0 <= row < image.shape[0] and 0 <= column < image.shape[1]
        return float(image[row, column]) if inside else None

    rows, right = [], []
    for r in range(height):
        for c in range(width):
            for axis in range(2):
                q = (r + (axis == 0), c + (axis == 1))
                if (q[0] == height and not wrap[0]) or (q[1] == width and not wrap[1]):
                    continue
                q = (q[0] % height, q[1] % width)
                if joined[axis][r, c]:
                    wanted = values[q] - values[r, c]
                else:
                    found = []
                    ahead = look(source.coordinates[r, c] + frames[r, c][:, axis])
                    behind = look(source.coordinates[q] - frames[q][:, axis])
                    if ahead is not None:
                        found.append(ahead - values[r, c])
                    if behind is not None:
                        found.append(values[q] - behind)
                    wanted = np.mean(found) if found else 0.0
                row = np.zeros(height * width)
                row[q[0] * width + q[1]] += 1
                row[r * width + c] -= 1
                rows.append(row)
                right.append(wanted)
    matrix = np.concatenate([rows, np.sqrt(screening) * np.eye(height * width)])
    target = np.concatenate([right, np.sqrt(screening) * values.ravel()])
    free = ~fixed.ravel()
    result = values.ravel().astype(float)
    result[free] = np.linalg.lstsq(matrix[:, free], target - matrix[:, ~free] @ result[~free], rcond=None)[0]
    return result.reshape(source.shape)


@pytest.mark.parametrize("wrap", [(True, True), (False, False), (True, False), (False, True)])
@pytest.mark.parametrize("screening", [0.01, 0.3])
def test_against_the_written_out_problem(wrap, screening):
    random = np.random.default_rng(3)
    image = random.random((12, 14))
    whole = SourceMap.identity((12, 14)).coordinates
    mirrored = np.array([11, 0], np.float32) + whole * np.array([-1, 1], np.float32)
    # Put a mirrored piece from the exemplar's edge next to a plain one, so that one side of the seam has no
    # continuation.
    places = np.concatenate([whole[:10, :6], mirrored[:10, 5:11]], axis=1)
    label = np.repeat([0, 1], 6)[np.newaxis].repeat(10, 0)
    frame = np.stack([np.eye(2), np.diag([-1, 1])]).astype(np.float32)
    source = pasted(places, ((12, 14),), label=label, jacobian=frame)
    healed = blend(source, image, wrap=wrap, screening=screening, outlines=False)
    expected = np.clip(twin(source, image, wrap, screening), image.min(), image.max())
    np.testing.assert_allclose(healed, expected, atol=2e-5)


def test_a_source_that_continues_stays_as_it_is(exemplar):
    source = SourceMap.identity((64, 64))
    assert (blend(source, exemplar, wrap=False) == exemplar).all()


def test_a_picture_of_shifted_brightness_becomes_one():
    """With two exemplars that differ by a constant, unscreened and without fixed values, the step disappears."""
    random = np.random.default_rng(4)
    dark = random.random((40, 40)).astype(np.float32)
    light = dark + np.float32(1)
    whole = SourceMap.identity((40, 40))
    which = (np.arange(40) >= 20)[np.newaxis].repeat(40, 0)
    source = pasted(whole.coordinates, ((40, 40), (40, 40)), exemplar=which)
    healed = blend(source, [dark, light], wrap=(False, False), screening=0.01)
    step = (healed - dark)[10:30, 20] - (healed - dark)[10:30, 19]
    assert np.abs(step).max() < 0.15
    # Pixels at the border keep their values.
    rendered = source.render([dark, light])
    assert (healed[0] == rendered[0]).all()
    assert (healed[:, -1] == rendered[:, -1]).all()


def laid_on(ground, light):
    """Return a light disc, cut out along its outline and laid on another background."""
    rows, columns = np.mgrid[:48, :48]
    disc = np.hypot(rows - 23.5, columns - 23.5) < 14
    random = np.random.default_rng(6)
    noise = 0.02 * random.standard_normal((48, 48))
    own = (np.where(disc, light, ground) + noise).astype(np.float32)
    other = (0.2 + noise.T).astype(np.float32)
    return pasted(SourceMap.identity((48, 48)).coordinates, ((48, 48),) * 2, ~disc, ~disc), [own, other]


def test_an_outline_keeps_its_step():
    source, exemplars = laid_on(0.3, 0.8)
    shown = source.render(exemplars)
    # The remaining differences are noise where the image wraps.
    assert np.abs(blend(source, exemplars, wrap=True) - shown).max() < 0.03
    fog = blend(source, exemplars, wrap=True, outlines=False)
    assert np.abs(fog - shown).max() > 0.1
    # If the disc is hardly lighter than its own background, there is no evidence of an outline.
    plain, alike = laid_on(0.78, 0.8)
    assert np.abs(blend(plain, alike, wrap=True) - plain.render(alike)).max() > 0.1


def test_seams_of_a_design_are_as_sharp_as_the_example():
    """In a band of 3 pixels around seams, differences are as large as in the example."""
    from scipy.ndimage import distance_transform_edt

    image = samples.pebbles((128, 128)).image
    result = texrs.design(image, 160, seed=1, copies=2, way="still")
    parted = np.zeros((160, 160), bool)
    for axis in range(2):
        crosses = ~result.source_map.is_coherent(axis, wrap=True)
        parted |= crosses | np.roll(crosses, 1, axis)
    band = distance_transform_edt(~parted) < 3

    def measure(picture):
        grey = picture.astype(np.float32).mean(axis=-1)
        return sum(np.abs(np.roll(grey, -1, axis) - grey) for axis in range(2)).astype(np.float32)

    own = result.source_map.render(measure(image), interpolation="nearest")
    assert 0.9 < measure(result.image)[band].mean() / own[band].mean() < 1.1
    assert np.abs(result.image.mean(axis=(0, 1)) - image.mean(axis=(0, 1))).max() < 12


# --- every map -------------------------------------------------------------------------------------------------------


def test_depth_and_channels(patchwork, exemplar):
    eight = blend(patchwork, exemplar, wrap=True)
    sixteen = blend(patchwork, exemplar.astype(np.uint16) * 257, wrap=True)
    floats = blend(patchwork, exemplar.astype(np.float32) * np.float32(4 / 255), wrap=True)
    assert (eight.dtype, sixteen.dtype, floats.dtype) == (np.uint8, np.uint16, np.float32)
    assert np.abs(eight.astype(int) - sixteen / 257).max() <= 1
    assert np.abs(eight.astype(int) - floats * 255 / 4).max() <= 1
    grey = blend(patchwork, exemplar[..., 0], wrap=True)
    assert grey.shape == patchwork.shape
    np.testing.assert_array_equal(grey, blend(patchwork, exemplar[..., :1], wrap=True)[..., 0])
    # Only outlines depend on all channels together, so without them a single channel has the same result.
    alone, together = (blend(patchwork, e, wrap=True, outlines=False) for e in (exemplar[..., :1], exemplar))
    assert np.abs(alone[..., 0].astype(int) - together[..., 0]).max() <= 1


def test_values_stay_in_the_range_of_each_channel(patchwork, exemplar):
    image = exemplar.copy()
    image[..., 1] = image[..., 1] // 4 + 100
    healed = blend(patchwork, image, wrap=True, screening=0)
    for channel in range(3):
        assert image[..., channel].min() <= healed[..., channel].min()
        assert healed[..., channel].max() <= image[..., channel].max()


@pytest.mark.parametrize("channels", [2, 4])
def test_transparency_is_not_corrected(patchwork, exemplar, channels):
    alpha = np.random.default_rng(5).integers(0, 256, (64, 64, 1)).astype(np.uint8)
    healed = blend(patchwork, np.concatenate([exemplar[..., : channels - 1], alpha], axis=-1), wrap=True)
    np.testing.assert_array_equal(healed[..., -1:], view(patchwork, alpha))
    np.testing.assert_allclose(
        healed[..., :-1].astype(int), blend(patchwork, exemplar[..., : channels - 1], wrap=True), atol=1
    )


@pytest.mark.parametrize("dtype", [np.bool_, np.int8, np.int16, np.int32])
def test_labels_are_not_corrected(patchwork, exemplar, dtype):
    labels = (exemplar[..., 0] // 64).astype(dtype)
    np.testing.assert_array_equal(blend(patchwork, labels, wrap=True), view(patchwork, labels))
    numbers = exemplar[..., 0].astype(np.uint16)
    nearest = blend(patchwork, numbers, wrap=True, interpolation="nearest")
    np.testing.assert_array_equal(nearest, view(patchwork, numbers, "nearest"))


def test_normals_stay_unit_vectors(patchwork, exemplar):
    slope = exemplar[..., :2] / 255 - 0.4
    normals = np.dstack([slope, np.ones((64, 64))])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    healed = blend(patchwork, normals.astype(np.float32), wrap=True, map_type="normal")
    np.testing.assert_allclose(np.linalg.norm(healed, axis=-1), 1, atol=1e-5)
    rendered = patchwork.render(normals.astype(np.float32), map_type="normal")
    at, after = _seams.list_seams(patchwork, 1, True)
    assert np.abs(healed[after] - healed[at]).mean() < 0.5 * np.abs(rendered[after] - rendered[at]).mean()
    coded = np.rint((normals + 1) / 2 * 255).astype(np.uint8)
    eight = blend(patchwork, coded, wrap=True, map_type="normal")
    assert np.abs(eight / 255 * 2 - 1 - healed).max() < 0.03


def test_normals_of_a_turned_copy_meet_where_the_surface_does():
    """A mirror image reverses a ramp, so in the image's own axes each side has its own slope."""
    normals = np.zeros((16, 16, 3), np.float32)
    normals[..., 0], normals[..., 2] = 0.6, 0.8
    # One negative value shows that the map contains vectors without an encoding.
    normals[0, 0, 0] = -0.6
    places = SourceMap.identity((16, 16)).coordinates
    mirrored = places.copy()
    mirrored[:, 8:, 1] = 23 - places[:, 8:, 1]
    label = (np.arange(16) >= 8)[np.newaxis].repeat(16, 0)
    frame = np.stack([np.eye(2), np.diag([1, -1])]).astype(np.float32)
    source = pasted(mirrored, ((16, 16),), label=label, jacobian=frame)
    healed = blend(source, normals, wrap=(True, False), map_type="normal", screening=0.05)
    across = np.diff(healed[8, :, 0])
    assert np.abs(across).max() < 0.35
    assert np.abs(np.diff(source.render(normals, map_type="normal")[8, :, 0])).max() > 1


# --- strips, bands, threads ------------------------------------------------------------------------------------------


def test_a_band_keeps_all_else(patchwork, exemplar):
    image = exemplar.astype(np.float32)
    healed = blend(patchwork, image, wrap=True, band=6)
    changed = (healed != view(patchwork, image)).any(axis=-1)
    distance = np.full(patchwork.shape, 99)
    rows = np.minimum(np.arange(96) % 32, 31 - np.arange(96) % 32)
    columns = np.minimum(np.arange(128) % 32, 31 - np.arange(128) % 32)
    distance = np.minimum(rows[:, np.newaxis], columns[np.newaxis])
    assert not changed[distance > 6].any()
    assert changed[distance <= 6].mean() > 0.9
    everywhere = blend(patchwork, image, wrap=True, band=64)
    np.testing.assert_allclose(everywhere, blend(patchwork, image, wrap=True), atol=0.02)


def patched(light):
    """Return a ramp with lighter pieces of itself, from a second exemplar, in its corner and in its middle."""
    ramp = np.add.outer(np.arange(40.0), np.arange(60.0)).astype(np.float32)
    whole = SourceMap.identity(ramp.shape)
    inside = np.zeros(ramp.shape, bool)
    inside[10:25, 20:40] = inside[30:, 50:] = True
    return pasted(whole.coordinates, (ramp.shape,) * 2, inside, inside), ramp, ramp + np.float32(light), inside


def test_within_a_mask_all_else_stays_and_light_goes_on():
    source, ramp, lighter, inside = patched(9)
    healed = blend(source, [ramp, lighter], wrap=False, screening=0, within=inside)
    np.testing.assert_array_equal(healed[~inside], ramp[~inside])
    # The correction also reaches the corner of the image, where no neighbours fix the outermost pixels.
    np.testing.assert_allclose(healed, ramp, atol=0.02)
    near = blend(source, [ramp, lighter], wrap=False, screening=0, within=inside, band=2)
    np.testing.assert_array_equal(near[~inside], ramp[~inside])
    assert near[17, 30] == lighter[17, 30]


def test_what_is_not_known_of_an_exemplar_says_nothing_of_a_seam():
    source, ramp, lighter, inside = patched(9)
    holed = np.where(inside, np.float32(0), ramp)
    known = [~inside, np.ones(inside.shape, bool)]
    options = {"wrap": False, "screening": 0, "within": inside}
    np.testing.assert_allclose(blend(source, [holed, lighter], known=known, **options), ramp, atol=0.02)
    assert np.abs(blend(source, [holed, lighter], **options) - ramp).max() > 5


@pytest.mark.parametrize("wrap", [True, False])
def test_strips_give_the_whole(monkeypatch, patchwork, exemplar, wrap):
    places = np.tile(patchwork.coordinates, (5, 1, 1))
    tall = pasted(places, patchwork.shapes)
    image = exemplar.astype(np.float32)
    whole = blend(tall, image, wrap=wrap, screening=0.04)
    monkeypatch.setattr(_values, "STRIP", 100 * 128)
    assert len(list(divide_strips(tall.shape, wrap, 0.04))) == 5
    assert len(list(divide_strips(tall.shape, wrap, 0.0))) == 1
    np.testing.assert_allclose(blend(tall, image, wrap=wrap, screening=0.04), whole, atol=0.02)


@pytest.mark.parametrize("kind", ["colour", "normal"])
def test_without_screening_a_large_picture_is_solved_whole(monkeypatch, patchwork, exemplar, kind):
    image = exemplar.astype(np.float32) if kind == "colour" else exemplar
    whole = blend(patchwork, image, wrap=(False, True), screening=0, map_type=kind)
    monkeypatch.setattr(_values, "STRIP", 1000)
    np.testing.assert_array_equal(blend(patchwork, image, wrap=(False, True), screening=0, map_type=kind), whole)


def test_an_exemplar_of_many_rows_is_scaled_in_bands(monkeypatch, patchwork, exemplar):
    whole = blend(patchwork, exemplar, wrap=True)
    monkeypatch.setattr(_values, "BAND", 7)
    np.testing.assert_array_equal(blend(patchwork, exemplar, wrap=True), whole)


def test_work_can_be_watched_and_stopped(monkeypatch, patchwork, exemplar):
    places = np.tile(patchwork.coordinates, (5, 1, 1))
    tall = pasted(places, patchwork.shapes)
    monkeypatch.setattr(_values, "STRIP", 100 * 128)
    seen = []
    blend(tall, exemplar, wrap=True, screening=0.04, progress=lambda stage, share: seen.append((stage, share)))
    shares = [share for _, share in seen]
    assert {stage for stage, _ in seen} == {"blend"}
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert len(shares) >= 5

    def stop(stage, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        blend(tall, exemplar, wrap=True, screening=0.04, progress=stop)


@pytest.mark.parametrize("wrap", [True, False, (True, False)])
def test_visibility_does_not_depend_on_bands(monkeypatch, patchwork, exemplar, wrap):
    image = patchwork.render(exemplar)
    monkeypatch.setattr(_values, "BAND", 96)
    whole = measure_visibility(patchwork, exemplar, image, wrap=wrap)
    pair = (wrap, wrap) if isinstance(wrap, bool) else wrap
    assert whole.edges == sum(len(_seams.list_seams(patchwork, axis, pair[axis])[0][0]) for axis in range(2))
    for rows in (1, 7, 64):
        monkeypatch.setattr(_values, "BAND", rows)
        banded = measure_visibility(patchwork, exemplar, image, wrap=wrap)
        assert banded.edges == whole.edges
        assert banded.outliers == whole.outliers
        assert abs(banded.mean - whole.mean) < 1e-9
    # Use every fourth row of the image and every second row of the exemplar.
    monkeypatch.setattr(_values, "BAND", 1)
    monkeypatch.setattr(_visibility, "LOOK", 96 * 128 // 4)
    sampled = measure_visibility(patchwork, exemplar, image, wrap=wrap)
    assert 0 < sampled.edges < whole.edges
    assert abs(sampled.mean - whole.mean) < 0.2 * whole.mean


# --- in design -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["pebbles", "beans"])
def designed(request):
    sample = samples.load(request.param, size=(144, 144)).image
    return sample, texrs.design(sample, 256, seed=5, copies=2)


def test_seams_disappear(designed):
    """D2 and D2b of the acceptance checks."""
    sample, result = designed
    before, after = result.report["seams"]["before"], result.report["seams"]["after"]
    assert after["mean"] < before["mean"]
    assert after["outliers"] < before["outliers"]
    assert after["mean"] <= 1.5
    assert after["outliers"] <= 0.03
    assert measure_visibility(result.source_map, sample, result.image, wrap=True).outliers == after["outliers"]


def test_away_from_seams_differences_stay(designed):
    """D6: gradients more than 3 pixels from a seam, and the colours as a whole."""
    from scipy.ndimage import distance_transform_edt, gaussian_filter

    _, result = designed
    before, after = (i.astype(float) for i in (result.stages["before_blending"], result.image))
    near = np.zeros(result.source_map.shape, bool)
    for axis in range(2):
        at, beyond = _seams.list_seams(result.source_map, axis, True)
        near[at] = near[beyond] = True
    far = distance_transform_edt(~near) > 3
    errors = np.concatenate(
        [
            np.abs(np.diff(after, axis=axis) - np.diff(before, axis=axis))[far[:-1] if axis == 0 else far[:, :-1]]
            for axis in range(2)
        ]
    )
    assert np.median(errors) <= 0.3
    assert np.percentile(errors, 99) <= 2
    shift = gaussian_filter(after - before, (12, 12, 0), mode="wrap")
    assert np.abs(shift).max() <= 5


def test_blending_can_be_left_out(designed):
    sample, result = designed
    # Ways are compared after blending, so the way could be another one.
    [way] = result.report["way"]
    plain = texrs.design(sample, 256, seed=5, copies=2, screening=None, way=way)
    np.testing.assert_array_equal(plain.image, plain.stages["before_blending"])
    np.testing.assert_array_equal(plain.stages["before_blending"], result.stages["before_blending"])
    assert plain.report["screening"] == 0
    assert plain.report["seams"]["before"] == plain.report["seams"]["after"]


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({"wrap": True, "within": np.zeros((96, 128), bool)}, "within: must mark at least one pixel, got none"),
        ({"wrap": True, "known": [np.ones((64, 64), bool)] * 2}, "known: must be a mask for each of 1"),
    ],
)
def test_bad_input_names_the_argument(patchwork, exemplar, options, names):
    with pytest.raises(InvalidInput, match=f"^{names}"):
        blend(patchwork, exemplar, **options)


def test_volumes_and_other_sizes_are_refused(patchwork):
    with pytest.raises(InvalidInput, match="^source"):
        blend(SourceMap.identity((4, 4, 4)), np.zeros((4, 4, 4)), wrap=True)
    with pytest.raises(InvalidInput, match="^exemplars"):
        blend(patchwork, np.zeros((10, 10)), wrap=True)
    with pytest.raises(InvalidInput, match="^image"):
        measure_visibility(patchwork, np.zeros((64, 64)), np.zeros((3, 3)), wrap=True)


def test_the_public_name_is_the_function():
    """The module of the same name must not hide it."""
    assert texrs.blend is blend
    whole = SourceMap.identity((12, 16))
    apart = np.where(np.arange(16)[:, np.newaxis] < 8, whole.coordinates, whole.coordinates[:, ::-1])
    source = SourceMap(apart.astype(np.float32), whole.exemplar, whole.label, None, whole.shapes)
    image = np.random.default_rng(0).integers(0, 256, (12, 16, 3)).astype(np.uint8)
    within, known = np.zeros((12, 16), bool), np.ones((12, 16), bool)
    within[:, 8:] = True
    known[:, 0] = False
    plain, healed = view(source, image), texrs.blend(source, image, wrap=False, within=within, known=known)
    np.testing.assert_array_equal(healed[~within], plain[~within])
    assert (healed[within] != plain[within]).any()
    everywhere = texrs.blend(source, image, wrap=False, within=within)
    assert (healed != everywhere).any()


def test_parts_do_not_stain_each_other() -> None:
    whole = texrs.SourceMap.identity((12, 40))
    places = np.concatenate([whole.coordinates[:, :10], whole.coordinates[:, 30:]], axis=1)
    source = texrs.SourceMap(places, whole.exemplar[:, :20], whole.label[:, :20], None, whole.shapes)
    image = np.zeros((12, 40), np.uint8)
    image[:, 20:] = 200
    shown = source.render(image)
    parts = np.zeros((12, 20), np.uint16)
    assert (texrs.blend(source, image, wrap=False, parts=parts) != shown).any()
    parts[:, 10:] = 1
    np.testing.assert_array_equal(texrs.blend(source, image, wrap=False, parts=parts), shown)
    with pytest.raises(InvalidInput, match="parts: must have shape"):
        texrs.blend(source, image, wrap=False, parts=parts[:4])


@pytest.mark.parametrize("cyclic", [False, True])
@pytest.mark.parametrize("shape", [(40, 56), (9, 30), (1, 5)])
def test_sums_along_seams_are_those_of_the_whole_picture_filtered(shape, cyclic):
    """Compare with SciPy, which filters every pixel. Only the last bit of one value differs."""
    from scipy.ndimage import gaussian_filter

    random = np.random.default_rng(5)
    marked = random.random(shape) < 0.2
    marked[0, -1] = True
    at = np.nonzero(marked)
    values = random.normal(size=len(at[0])).astype(np.float32)
    spread = np.zeros(shape, np.float32)
    spread[at] = values
    wanted = gaussian_filter(spread, _seams.ALONG, mode="wrap" if cyclic else "constant")[at]
    found = _rust.sum_nearby(np.stack(at, axis=1), values, shape, cyclic, _seams.WINDOW)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-8)
