"""The samples are correct: their truth is measured again from the labels and images."""

from __future__ import annotations

import functools
import inspect
import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from texrs import samples
from texrs.samples import Sample

SOLID = ("particles", "stripes", "weave_solid", "wood_solid")
PLANAR = tuple(n for n in samples.names() if n not in SOLID)
WRAPPED = tuple(n for n in samples.names() if "wrap" in inspect.signature(getattr(samples, n)).parameters)
COUNTED = ("beans", "bricks", "dots", "leaves_and_flowers", "net", "pebbles", "scales", "weave")


@functools.cache
def default(name: str) -> Sample:
    return samples.load(name)


@functools.cache
def torus(name: str) -> Sample:
    size = (64, 48, 80) if name in SOLID else (128, 160)
    return samples.load(name, size=size, seed=4, wrap=True)


@pytest.mark.parametrize("name", samples.names())
def test_same_seed_same_bytes(name: str) -> None:
    size = (32, 40, 36) if name in SOLID else (56, 72)
    draw = inspect.unwrap(getattr(samples, name))
    one, two, other = (draw(size=size, seed=s) for s in (7, 7, 8))
    for field in ("image", "centres", "labels", "mask", "scale_map", "jacobians"):
        a, b = getattr(one, field), getattr(two, field)
        assert (a is None) == (b is None)
        assert a is None or a.tobytes() == b.tobytes(), field
    assert one.image.tobytes() != other.image.tobytes()


@pytest.mark.parametrize("name", samples.names())
def test_shapes_and_types(name: str) -> None:
    sample = default(name)
    axes = 3 if name in SOLID else 2
    shape = (64,) * 3 if axes == 3 else (256,) * 2
    assert sample.name == name
    assert sample.image.shape == (*shape, 3)
    assert sample.image.dtype == np.uint8
    assert sample.layout in ("disjoint", "connected", "jointed", None)
    assert (sample.centres is None) == (sample.labels is None)
    if sample.centres is not None and sample.labels is not None:
        assert sample.centres.dtype == np.float64
        assert sample.centres.shape[1:] == (axes,)
        assert ((sample.centres >= -0.5) & (sample.centres < np.array(shape) - 0.5)).all()
        assert sample.labels.dtype == np.int32
        assert sample.labels.shape == shape
        # Every number from 1 up to the last is used.
        assert (np.bincount(sample.labels.ravel())[1:] > 0).all()
        assert sample.labels.max() >= len(sample.centres) > 0
    if sample.mask is not None:
        assert sample.mask.dtype == np.bool_
        assert sample.mask.shape == shape
        if sample.labels is not None:
            assert (sample.mask == ((sample.labels > 0) ^ (name == "net"))).all()
    if sample.scale_map is not None:
        assert sample.scale_map.dtype == np.float32
        assert sample.scale_map.shape == shape
    if sample.jacobians is not None:
        assert sample.jacobians.dtype == np.float32
        assert sample.jacobians.shape == (*shape, axes, axes)
    # The image uses most of its range, but few pixels are black or white.
    assert 40 < sample.image.mean() < 190
    assert sample.image.std() > 12
    assert (sample.image == 255).mean() < 0.02
    assert (sample.image == 0).mean() < 0.05


@pytest.mark.parametrize("name", COUNTED)
@pytest.mark.parametrize("seed", [0, 5])
def test_centres_are_centroids_of_whole_elements(name: str, seed: int) -> None:
    sample = default(name) if seed == 0 else samples.load(name, size=(150, 280), seed=seed)
    assert sample.labels is not None
    assert sample.centres is not None
    whole = whole_labels(sample.labels)
    assert len(whole) >= 3
    # The centroid of a whole element is inside the image, so its number is among the centres.
    assert max(whole) <= len(sample.centres)
    found = np.array(ndimage.center_of_mass(sample.labels > 0, sample.labels, whole))
    away = np.hypot(*(found - sample.centres[np.array(whole) - 1]).T)
    assert away.max() <= 1.5
    assert away.mean() <= 0.5


@pytest.mark.parametrize("name", [n for n in WRAPPED if n in COUNTED])
def test_no_element_comes_from_beyond_a_torus(name: str) -> None:
    sample = torus(name)
    assert sample.labels is not None
    assert sample.centres is not None
    assert sample.labels.max() == len(sample.centres)


@pytest.mark.parametrize("name", ["pebbles", "dots", "leaves_and_flowers"])
def test_disjoint_elements_do_not_touch(name: str) -> None:
    labels = default(name).labels
    assert labels is not None
    _, parts = ndimage.label(labels > 0, np.ones((3, 3)))
    assert parts == labels.max()


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_a_wall_has_21_whole_vertical_joints(seed: int) -> None:
    labels = samples.bricks(seed=seed).labels
    assert labels is not None
    rows: dict[tuple[int, int], int] = {}
    for row in labels:
        changes = np.nonzero(np.diff(row))[0]
        for left, right in itertools.pairwise(changes):
            pair = int(row[left]), int(row[right + 1])
            if row[left + 1] == 0 and 0 != pair[0] != pair[1] != 0 and right - left < 14:
                rows[pair] = rows.get(pair, 0) + 1
    cut = set(labels[0]) | set(labels[-1])
    # Rough edges also make gaps in the bed joints, but a vertical joint is as tall as a brick.
    whole = [p for p, count in rows.items() if count > 20 and not cut & set(p)]
    assert len(whole) == 21


def test_mortar_is_connected_and_so_is_the_net() -> None:
    for name, connected in (("bricks", 0), ("net", 1)):
        mask = default(name).mask
        assert mask is not None
        parts, _ = ndimage.label(mask == connected, np.ones((3, 3)))
        assert np.bincount(parts.ravel())[1:].max() / parts.astype(bool).sum() > 0.97


def test_beans_touch_and_share_one_colour() -> None:
    sample = default("beans")
    labels, centres = sample.labels, sample.centres
    assert labels is not None
    assert centres is not None
    touching = set()
    for axis in (0, 1):
        a, b = np.moveaxis(labels, axis, 0)[:-1], np.moveaxis(labels, axis, 0)[1:]
        where = (a > 0) & (b > 0) & (a != b)
        touching |= set(zip(a[where].tolist(), b[where].tolist(), strict=True))
    assert len({i for pair in touching for i in pair}) > 0.95 * labels.max()
    _, parts = ndimage.label(labels > 0)
    assert parts < 0.2 * labels.max()
    number = np.arange(1, len(centres) + 1)
    colour = np.array([ndimage.mean(sample.image[..., k], labels, number) for k in range(3)])
    hue = colour / colour.sum(0)
    assert hue.std(1).max() < 0.025


@pytest.mark.parametrize("name", ["pebbles", "leaves_and_flowers", "bricks"])
def test_a_threshold_does_not_find_the_elements(name: str) -> None:
    sample = default(name)
    assert sample.mask is not None
    assert best_threshold(sample.image, sample.mask) < 0.9


@pytest.mark.parametrize("name", ["tilted_discs", "tilted_bricks"])
def test_scale_map_is_what_the_frames_say(name: str) -> None:
    sample = default(name)
    assert sample.scale_map is not None
    assert sample.jacobians is not None
    assert abs(float(np.log(sample.scale_map).mean())) < 1e-5
    assert sample.scale_map.max() / sample.scale_map.min() > 2.5
    from_frames = np.linalg.det(sample.jacobians.astype(np.float64)) ** -0.5
    np.testing.assert_allclose(sample.scale_map, from_frames, rtol=1e-5)
    # A Jacobian's columns are the derivatives of one map, so their mixed derivatives agree.
    mixed = [np.gradient(sample.jacobians[..., 1 - k], axis=k) for k in (0, 1)]
    np.testing.assert_allclose(mixed[0][2:-2, 2:-2], mixed[1][2:-2, 2:-2], atol=2e-4)


def test_discs_have_the_area_that_the_scale_map_gives() -> None:
    sample = default("tilted_discs")
    labels, centres, scale = sample.labels, sample.centres, sample.scale_map
    assert labels is not None
    assert centres is not None
    assert scale is not None
    whole = np.array(whole_labels(labels))
    assert len(whole) > 60
    area = np.bincount(labels.ravel())[whole]
    at = np.rint(centres[whole - 1]).astype(int)
    radius = np.sqrt(area / np.pi) / scale[at[:, 0], at[:, 1]]
    assert abs(radius.mean() / 10.5 - 1) < 0.02
    assert radius.std() / radius.mean() < 0.03
    found = np.array(ndimage.center_of_mass(labels > 0, labels, whole))
    assert np.abs(found - centres[whole - 1]).max() < 1.5


@pytest.mark.parametrize("name", WRAPPED)
def test_a_torus_has_no_seam(name: str) -> None:
    image = torus(name).image.astype(float)
    for axis in range(image.ndim - 1):
        steps = np.abs(image - np.roll(image, 1, axis))
        steps = steps.mean(tuple(k for k in range(image.ndim) if k != axis))
        # On lattices the border is at one phase of the element, so compare with steps of the same phase.
        inner = np.sort(steps[1:])
        assert steps[0] <= 1.3 * inner.mean() or steps[0] <= inner[int(0.95 * len(inner))]


@pytest.mark.parametrize("name", [n for n in WRAPPED if n not in SOLID])
def test_the_smallest_torus(name: str) -> None:
    sample = samples.load(name, size=(32, 32), wrap=True)
    assert sample.image.shape == (32, 32, 3)
    if sample.labels is not None:
        assert sample.centres is not None
        assert sample.labels.max() == len(sample.centres) > 0


@pytest.mark.parametrize("name", [n for n in WRAPPED if n in COUNTED])
def test_labels_go_on_across_the_border(name: str) -> None:
    sample = torus(name)
    assert sample.labels is not None
    assert sample.centres is not None
    # On the torus every element is whole, so its centroid can be measured after rolling it to the middle.
    for i, centre in enumerate(sample.centres):
        at = np.argwhere(sample.labels == i + 1)
        box = np.array(sample.labels.shape)
        away = (at - centre + box / 2) % box - box / 2
        assert np.hypot(*away.mean(0)) < 1.0
        assert np.abs(away).max() < 45
    border = sample.labels[:, [0, -1]]
    assert ((border[:, 0] == border[:, 1]) & (border[:, 0] > 0)).any()


def test_stripes_repeat_every_nine_voxels() -> None:
    sample = samples.stripes((90, 48, 48), seed=2)
    assert sample.mask is not None
    assert sample.jacobians is not None
    dark = sample.mask.astype(float)
    dark = dark - dark.mean()
    power = (np.abs(np.fft.rfft(dark, axis=0)) ** 2).mean((1, 2))
    spread = power[7:14]
    assert abs(90 / ((spread * np.arange(7, 14)).sum() / spread.sum()) - 9.0) < 0.5
    # Count layers along each line. Their number is the integral of the frame.
    layers = (np.diff(sample.mask.astype(int), axis=0) > 0).sum(0)
    turns = sample.jacobians[..., 0, 0].astype(float).sum(0) / 9
    assert np.abs(layers - turns).max() <= 1.1
    lit = sample.image.mean(-1)
    assert lit[~sample.mask].mean() - lit[sample.mask].mean() > 25


def test_stripes_normals_turn_gently() -> None:
    jacobians = default("stripes").jacobians
    assert jacobians is not None
    normal = jacobians[..., 0, :].astype(float)
    length = np.linalg.norm(normal, axis=-1)
    assert 0.5 < length.min() < length.max() < 1.6
    tilt = np.degrees(np.arccos(normal[..., 0] / length))
    assert 5 < tilt.max() < 45
    step = np.linalg.norm(np.diff(normal, axis=0), axis=-1)
    assert step.max() < 0.08


def test_particles_come_in_three_equal_classes_on_a_torus() -> None:
    sample = default("particles")
    labels, centres = sample.labels, sample.centres
    assert labels is not None
    assert centres is not None
    number = np.arange(1, len(centres) + 1)
    colour = np.stack([ndimage.mean(sample.image[..., k], labels, number) for k in range(3)], -1)
    red, ochre, blue = (colour[k::3] for k in range(3))
    assert (red[:, 0] > 1.5 * red[:, 1]).all()
    assert (ochre[:, 1] > 1.2 * ochre[:, 2]).all()
    assert (ochre[:, 1] > 0.6 * ochre[:, 0]).all()
    assert (blue[:, 2] > blue[:, 0]).all()
    assert 0.05 < (labels > 0).mean() < 0.2
    for i in number:
        at = np.argwhere(labels == i)
        away = (at - centres[i - 1] + 32) % 64 - 32
        assert np.linalg.norm(away.mean(0)) < 0.5
        assert np.linalg.norm(away, axis=1).max() <= 6.01
    image = sample.image.astype(float)
    for axis in range(3):
        steps = np.abs(image - np.roll(image, 1, axis)).mean(tuple(k for k in range(4) if k != axis))
        assert steps[0] <= 1.3 * steps[1:].mean()


@pytest.mark.parametrize("name", samples.photographs())
def test_photographs_need_no_network(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a photograph was looked for on the network")

    monkeypatch.setattr("socket.socket.connect", refuse)
    sample = samples.load(name)
    assert sample.name == name
    assert sample.image.dtype == np.uint8
    assert min(sample.image.shape[:2]) > 300
    assert sample.centres is None
    assert sample.mask is None


def test_names_are_the_generators_and_no_photograph_shares_one() -> None:
    assert len(set(samples.names()) | set(samples.photographs())) == len(samples.names() + samples.photographs())
    assert all(callable(getattr(samples, name)) for name in samples.names())


@pytest.mark.parametrize("size", [(31, 64), (64,), (64, 64, 64), (64.0, 64), (True, 64), 31, "64"])
@pytest.mark.parametrize("name", ["pebbles", "tilted_discs"])
def test_bad_sizes_are_refused(name: str, size: object) -> None:
    # The request must be checked, although an equal one was drawn before.
    samples.load(name, size=(64, 64))
    with pytest.raises(ValueError, match="size: "):
        samples.load(name, size=size)


def test_bad_names_seeds_and_solids_are_refused() -> None:
    with pytest.raises(ValueError, match="must be empty for a photograph"):
        samples.load("coins", seed=1)


def whole_labels(labels: NDArray[np.int32]) -> list[int]:
    """Return the labels that do not touch the border."""
    border = {*labels[0], *labels[-1], *labels[:, 0], *labels[:, -1]}
    return [i for i in range(1, int(labels.max()) + 1) if i not in border]


def best_threshold(image: NDArray[np.uint8], mask: NDArray[np.bool_]) -> float:
    """Return the overlap of `mask` and the best threshold of any channel of four colour spaces."""
    from skimage.color import rgb2gray, rgb2hsv, rgb2lab

    lab = rgb2lab(image)
    channels = np.concatenate([image / 255, rgb2gray(image)[..., None], rgb2hsv(image), lab], axis=-1, dtype=np.float64)
    best = 0.0
    for k in range(channels.shape[-1]):
        values = channels[..., k]
        for level in np.quantile(values, np.linspace(0.01, 0.99, 50)):
            for guess in (values > level, values <= level):
                overlap = (guess & mask).sum() / (guess | mask).sum()
                best = max(best, float(overlap))
    return best
