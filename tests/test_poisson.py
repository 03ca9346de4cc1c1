import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import texrs
from reference import poisson as reference
from texrs._rust import set_threads
from texrs.errors import InvalidInput
from texrs.kernels import poisson


def problem(seed, shape):
    rng = np.random.default_rng(seed)
    return [rng.uniform(-s, s, shape) for s in (128, 40, 40)]


BOUNDARY = st.sampled_from(["dirichlet", "periodic", "free"])


@settings(max_examples=40, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 24), st.integers(1, 24)),
    boundary=st.tuples(BOUNDARY, BOUNDARY),
    screening=st.sampled_from([1e-3, 0.01, 1.0]),
    masked=st.booleans(),
    seed=st.integers(0, 2**32),
)
def test_agrees_with_the_sparse_direct_solution(shape, boundary, screening, masked, seed):
    data = problem(seed, shape)
    mask = np.random.default_rng(seed).random(shape) < 0.8 if masked else None
    options = {"screening": screening, "boundary": boundary, "mask": mask}
    expected = reference.solve(*data, **options)
    np.testing.assert_allclose(poisson.solve(*data, **options), expected, atol=0.02)


@pytest.mark.parametrize("masked", [False, True])
def test_without_screening_within_a_twentieth_of_a_grey_level(masked):
    data = problem(3, (97, 110))
    y, x = np.mgrid[:97, :110]
    mask = np.hypot(y - 45, x - 60) < 40 if masked else None
    options = {"screening": 0.0, "boundary": ("dirichlet", "dirichlet"), "mask": mask}
    expected = reference.solve(*data, **options)
    np.testing.assert_allclose(poisson.solve(*data, **options), expected, atol=0.05)


@pytest.mark.parametrize("masked", [False, True])
def test_the_same_for_any_number_of_threads(masked):
    data = problem(4, (150, 131, 3))
    mask = np.random.default_rng(4).random((150, 131)) < 0.9 if masked else None
    results = []
    for threads in (1, 2, 7):
        before = set_threads(threads)
        results.append(poisson.solve(*data, mask=mask).tobytes())
        set_threads(before)
    assert results[0] == results[1] == results[2]


@pytest.mark.parametrize("masked", [False, True])
def test_what_flows_in_is_carried_off(masked):
    """`spread` is the change of `solve`: here for an image of zeros, whose differences give the flow."""
    _, rows, columns = problem(8, (40, 37, 2))
    mask = np.random.default_rng(8).random((40, 37)) < 0.8 if masked else None
    options = {"screening": 0.02, "boundary": ("periodic", "free"), "mask": mask}
    flow = np.roll(rows, 1, 0) - rows
    flow[:, :-1] -= columns[:, :-1]
    flow[:, 1:] += columns[:, :-1]
    flow = flow.astype(np.float32)
    poisson.spread(flow, **options)
    np.testing.assert_allclose(flow, poisson.solve(np.zeros_like(rows), rows, columns, **options), atol=1e-3)


@pytest.mark.parametrize("wrong", [np.zeros((4, 4, 1)), np.zeros((4, 8, 1), "f4")[:, ::2]])
def test_flows_must_be_writeable_in_place(wrong):
    with pytest.raises(InvalidInput, match="^flow"):
        poisson.spread(wrong)


@pytest.mark.parametrize("masked", [False, True])
def test_a_solution_can_be_stopped(masked):
    data = problem(9, (600, 640, 3))
    mask = np.random.default_rng(9).random((600, 640)) < 0.9 if masked else None
    shares = []
    poisson.solve(*data, mask=mask, progress=shares.append)
    assert shares == sorted(shares)

    def stop(share):
        assert 0 <= share <= 1
        raise KeyboardInterrupt

    # The image is so large that even a single thread checks for cancellation several times.
    flow = np.zeros((4000 if masked else 12000, 1021, 3), np.float32)
    flow[::7, ::5] = 1
    mask = None if mask is None else np.random.default_rng(9).random(flow.shape[:2]) < 0.9
    with texrs.threads(1), pytest.raises(KeyboardInterrupt):
        poisson.spread(flow, screening=0, mask=mask, progress=stop)


def test_the_mean_is_kept_where_nothing_is_fixed():
    image, rows, columns = problem(5, (40, 41))
    for boundary in ("free", "periodic"):
        solved = poisson.solve(image, rows, columns, screening=0, boundary=boundary)
        assert abs(solved.mean() - image.mean()) < 1e-2


@pytest.mark.parametrize("dtype", [bool, np.uint8, np.uint16, np.int16, np.float32, np.float64])
@pytest.mark.parametrize("mixed", [False, True])
def test_blend_touches_nothing_outside_the_mask(dtype, mixed):
    rng = np.random.default_rng(6)
    source, target = (rng.integers(0, 100, (30, 33, 2)).astype(dtype) for _ in range(2))
    mask = rng.random((30, 33)) < 0.5
    result = poisson.blend(source, target, mask, mixed=mixed)
    assert result.dtype == target.dtype
    assert (result[~mask] == target[~mask]).all()
    assert not (result == target).all()


def test_half_floats_end_at_their_largest():
    target = np.full((8, 8), 65504, np.float16)
    source = np.zeros((8, 8), np.float16)
    source[4, 4] = 1000
    mask = np.zeros((8, 8), bool)
    mask[2:6, 2:6] = True
    assert poisson.blend(source, target, mask).max() == 65504
    assert poisson.blend(-source, -target, mask).min() == -65504


def test_blending_an_image_into_itself_changes_nothing():
    image = np.random.default_rng(7).integers(0, 256, (40, 50, 3), dtype=np.uint8)
    mask = np.zeros((40, 50), bool)
    mask[10:30, 5:45] = True
    for wrap in (False, (True, False)):
        assert (poisson.blend(image, image, mask, wrap=wrap) == image).all()
    assert (poisson.blend(image, image, np.ones((40, 50), bool)) == image).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"screening": -1}, "screening"),
        ({"screening": np.nan}, "screening"),
        ({"boundary": "mirror"}, "boundary"),
        ({"boundary": ("free",)}, "boundary"),
        ({"mask": np.ones((3, 3), bool)}, "mask"),
        ({"gradient_rows": np.zeros((3, 3))}, "gradient_rows: must have the image's shape"),
        ({"image": np.full((8, 8), np.nan)}, "image"),
        ({"image": np.full((8, 8), 1e300)}, r"image: .*infinite \(dtype float32\)"),
        ({"gradient_rows": np.eye(8) * 3e38}, "squares of values or of differences overflow"),
    ],
)
def test_refuses_with_a_reason(options, message):
    zeros = np.zeros((8, 8))
    arguments = {"image": zeros, "gradient_rows": zeros, "gradient_columns": zeros} | options
    with pytest.raises(InvalidInput, match=message):
        poisson.solve(**arguments)
    with pytest.raises(InvalidInput, match="source: must have the target's shape"):
        poisson.blend(zeros, zeros[1:], zeros > 0)
