from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference import patch_search as reference
from texrs._rust import set_threads
from texrs.errors import InvalidInput
from texrs.kernels.patch_search import Match, PatchIndex


def integers(seed, shape, levels=256):
    return np.random.default_rng(seed).integers(0, levels, shape).astype(np.uint8)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    channels=st.integers(1, 4),
    patch=st.tuples(st.integers(1, 9), st.integers(1, 9)),
    levels=st.sampled_from([2, 8, 256]),
    count=st.integers(1, 5),
    separation=st.integers(0, 5),
    ratio=st.sampled_from([1.0, 2.0, np.inf]),
    masked=st.booleans(),
)
def test_agrees_with_the_naive_twin(seed, channels, patch, levels, count, separation, ratio, masked):
    images = [integers(seed + i, (20 - i, 17 + 2 * i, channels), levels) for i in range(2)]
    sample = integers(seed + 7, (*patch, channels), levels)
    weight = integers(seed + 8, patch, 3)
    allowed = [integers(seed + 9, images[0].shape[:2], 2) > 0, None] if masked else None
    pick = {"count": count, "separation": separation, "ratio": ratio}
    found = PatchIndex(images, allowed=allowed, max_patch=9).best(sample, weight, **pick)
    expected = reference.best(images, sample, weight, allowed=allowed, **pick)
    assert [astuple(m) for m in found] == expected


def test_cost_map_is_near_the_naive_one():
    image = integers(1, (90, 70, 3))
    patch, weight = integers(2, (20, 12, 3)), integers(3, (20, 12), 4)
    exact = reference.costs(image, patch, weight)
    allowed = np.ones((90, 70), bool)
    allowed[4, 5] = False
    costs = PatchIndex(image, allowed=allowed, max_patch=20).cost_map(patch, weight)
    assert costs.shape == exact.shape
    assert np.isinf(costs[4, 5])
    costs[4, 5] = exact[4, 5]
    np.testing.assert_allclose(costs, exact, rtol=1e-5)


def test_restricted_candidates_give_exact_costs():
    images = [integers(i, (30, 40, 3)) for i in range(2)]
    index = PatchIndex(images, max_patch=12)
    patch, weight = integers(4, (12, 9, 3)), integers(5, (12, 9), 4)
    all_costs = [reference.costs(i, patch, weight) for i in images]
    candidates = [(0, 3, 4), (1, 0, 0), (1, 18, 31), (0, 3, 5)]
    found = index.best_among(patch, weight, candidates=candidates, count=9, separation=0)
    expected = sorted(Match(all_costs[e][r, c], e, r, c) for e, r, c in candidates)
    assert found == expected
    with pytest.raises(InvalidInput, match=r"\(0, 19, 0\)"):
        index.best_among(patch, candidates=[(0, 19, 0)])


def test_the_same_for_any_number_of_threads():
    image = integers(1, (150, 160, 3))
    index = PatchIndex(image, max_patch=24)
    patch, known = integers(2, (24, 24, 3)), np.tri(24)
    results = []
    for threads in (1, 2, 7):
        before = set_threads(threads)
        results.append((index.best(patch, known, count=5), index.cost_map(patch, known).tobytes()))
        set_threads(before)
    assert results[0] == results[1] == results[2]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PatchIndex([np.zeros((9, 9)), np.zeros((9, 9, 3))]), "must have the same number of channels"),
        (
            lambda: PatchIndex([np.zeros((9, 9))], allowed=[None, None]),
            "allowed: must be a list of 1",
        ),
        (lambda: PatchIndex(np.zeros((9, 9))).best(np.zeros((10, 3))), r"patch: .*\(10, 3\)"),
        (lambda: PatchIndex(np.zeros((9, 9))).best([["a"]]), "real numbers"),
        (
            lambda: PatchIndex(np.zeros((9, 9))).best(np.zeros((3, 3)), -np.ones((3, 3))),
            "not negative",
        ),
        (lambda: PatchIndex(np.zeros((9, 9))).best(np.full((3, 3), np.nan)), "finite where"),
    ],
)
def test_refuses_with_a_reason(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()


def test_an_index_made_again_finds_what_a_new_one_finds():
    images = [integers(i, (80, 70 + i, 3)) for i in range(2)]
    allowed = [integers(9, (80, 70), 3) > 0, None]
    patch, weight = images[0][30:54, 20:44] / 2.0, integers(3, (24, 24), 4)
    again = PatchIndex(images, max_patch=40).again(allowed=allowed, max_patch=24)
    new = PatchIndex(images, allowed=allowed, max_patch=24)
    assert again.shapes == new.shapes
    assert again.max_patch == new.max_patch == (24, 24)
    assert again.best(patch, weight, count=5) == new.best(patch, weight, count=5)
    with pytest.raises(InvalidInput, match="allowed: must be a list of 2"):
        again.again(allowed=allowed[0])
    with pytest.raises(InvalidInput, match=r"allowed\[1\]: must have shape"):
        again.again(allowed=[None, allowed[0]])
    with pytest.raises(InvalidInput, match="max_patch"):
        again.again(max_patch=0)


def test_nothing_allowed_gives_nothing():
    assert PatchIndex(np.zeros((9, 9)), allowed=np.zeros((9, 9), bool)).best(np.zeros((3, 3))) == []
