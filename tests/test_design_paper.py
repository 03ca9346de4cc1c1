"""DESIGN as printed (``method="paper"``): the printed constants, and the reasons for the departures of the default."""

import numpy as np
import pytest

import texrs
from reference.look_up import view
from texrs import DeformationOptions, ElementOptions, samples
from texrs._arrays import to_unit
from texrs.exemplar.symmetry import flip
from texrs.kernels.inpaint import inpaint
from texrs.kernels.patch_search import PatchIndex
from texrs.papers.design.literal import START, choose_operation, choose_start, stitch_layers
from texrs.papers.design.logistic_map import iterate

WEAK = -0.356261
"""A start whose first two operations are translations by 0."""


@pytest.fixture(scope="module")
def pebbles():
    return samples.pebbles((128, 128)).image


@pytest.fixture(scope="module")
def result(pebbles):
    return texrs.design(pebbles, (160, 192), seed=1, copies=2, method="paper")


def apart(a, b):
    """Return the difference of two images. 1 is the difference of an image and itself rolled by half its size."""
    a, b = a.astype(float), b.astype(float)
    rolled = np.roll(a, (a.shape[0] // 2, a.shape[1] // 2), (0, 1))
    return np.abs(a - b).mean() / np.abs(a - rolled).mean()


def nearest(a, b):
    """Return the same for the nearest of an image and its mirror images."""
    return min(apart(a, flip(b, axes)) for axes in [(False, False), (True, False), (False, True), (True, True)])


# --- the generator ---------------------------------------------------------------------------------------------------


def test_reference_operations():
    values = iterate(START, count=12)
    assert [int(h) for h in values] == [194, 41, 241, 202, 67, 219, 123, 135, 111, 157, 60, 226]
    assert (
        " ".join(f"{choose_operation(h, 100).kind}{int(h) % 10}" for h in values)
        == "T4 R1 R1 M2 S7 R9 S3 R5 R1 S7 T0 M6"
    )


def test_the_worked_example():
    """h(k) = 37 gives n = 7, m = 3: scale by 0.91."""
    assert (choose_operation(37, 100).kind, choose_operation(37, 100).amount) == ("S", 0.91)


def test_scale_sees_two_numbers_and_never_enlarges():
    drawn = [(h, choose_operation(h, 100)) for h in range(256)]
    assert {h % 10 for h, chosen in drawn if chosen.kind == "S"} == {3, 7}
    assert {chosen.amount for _, chosen in drawn if chosen.kind == "S"} == {0.8, 0.91}


def test_extents_and_directions():
    assert choose_operation(194, 100).amount == 20
    assert choose_operation(41, 100).amount == -9
    assert {choose_operation(h, 100).axis for h in range(0, 256, 10)} == {0, 1}
    shifts = {
        tuple(np.sign(choose_operation(h, 100).shift())) for h in range(256) if choose_operation(h, 100).kind == "T"
    }
    assert shifts >= {(0, 1), (0, -1), (1, 0), (-1, 0)}
    assert max(abs(choose_operation(h, 100).amount) for h in range(256) if choose_operation(h, 100).kind == "R") == 81


def test_u_v_and_xi_choose_the_range():
    kinds = {v: {choose_operation(h, 100, DeformationOptions(v=v)).kind for h in range(256)} for v in (1, 2, 3, 4)}
    assert kinds == {1: {"T"}, 2: {"T", "R"}, 3: {"T", "R", "M"}, 4: {"T", "R", "M", "S"}}
    fine = DeformationOptions(u=100, xi=0.012, scale=(0.5, 2))
    sizes = {choose_operation(h, 100, fine).amount for h in range(256) if choose_operation(h, 100, fine).kind == "S"}
    assert len(sizes) > 10
    assert (min(sizes), max(sizes)) == (0.5, 1.19)
    assert {choose_operation(h, 100, DeformationOptions(u=1)).amount for h in range(256)} == {0.0}


def test_layers_are_moved_as_often_as_asked(pebbles, result):
    def log(operations):
        asked = DeformationOptions(operations=operations)
        made = texrs.design(pebbles, (160, 192), seed=1, copies=1, deformation=asked, method="paper")
        return [entry["operations"] for entry in made.report["operations"][0]]

    drawn = [choose_operation(h, min(pebbles.shape[:2])).describe() for h in iterate(START, count=6)]
    assert log(3) == [drawn[:3], drawn[3:]]
    assert log(None) == log(1)
    assert log(0) == [[], []]


def test_the_first_variant_starts_as_printed_and_others_elsewhere():
    assert choose_start(None, 2.0, 5, 0, 0) == START
    assert choose_start(0.3, 2.0, 5, 0, 0) == 0.3
    others = {choose_start(None, 2.0, seed, 0, number) for seed in range(3) for number in range(1, 4)}
    assert len(others | {START}) == 10


# --- layers ----------------------------------------------------------------------------------------------------------


def test_layers_are_moved_whole():
    picture = np.random.default_rng(0).random((40, 40, 3)).astype(np.float32)
    layers = np.zeros((40, 40), np.int32)
    layers[15:25, 15:25] = 1
    whole = stitch_layers(picture, layers, WEAK)
    assert whole.covered.all()
    np.testing.assert_array_equal(whole.colours, picture)
    np.testing.assert_array_equal(whole.label, layers)
    moved = stitch_layers(picture, layers, START)
    # T4 moves the background by 8 pixels to the right. R1 rotates the square by 9 degrees, into the gap of the
    # background.
    assert (~moved.covered[:, :8]).all()
    assert 0 < (moved.label == 1).sum() <= 100


def test_a_layer_over_others_altogether_is_lost():
    """The minimum cut may remove it. This is the reason for the hard constraints of the default."""
    picture = np.random.default_rng(0).random((40, 40, 3)).astype(np.float32)
    layers = np.zeros((40, 40), np.int32)
    layers[4:10, 15:25] = 1
    # M of the background along columns leaves its hole in place. M of the square along rows puts it over the
    # background.
    starts = np.random.default_rng(1).uniform(-1, 1, 4000)
    wanted = [("M", 1), ("M", 0)]
    found = [x for x in starts if [(o.kind, o.axis) for o in chosen(x)] == wanted]
    assert (stitch_layers(picture, layers, float(found[0])).label == 0).all()


def chosen(start):
    return [choose_operation(h, 40) for h in iterate(start, count=2)]


def test_whole_layers_leave_large_holes(result, pebbles):
    assert result.report["holes"][0] > 0.2
    assert all(0.0 < share < 0.6 for share in result.report["holes"])
    assert [entry["element"] for entry in result.report["operations"][0]] == [0, 1]
    assert result.report["method"] == "paper"
    assert texrs.design(pebbles, 64, copies=1).report["method"] == "default"


def test_it_can_hand_back_its_input_and_the_default_does_not(pebbles):
    unit = to_unit(pebbles)
    literal = texrs.design(pebbles, 128, seed=1, copies=1, deformation=DeformationOptions(start=WEAK), method="paper")
    assert nearest(literal.stages["completed"], unit) < 0.01
    for start in (None, WEAK, 0.3, -0.61):
        options = DeformationOptions(start=start)
        default = texrs.design(pebbles, 128, seed=1, copies=1, deformation=options, way="move")
        # In a heap few stones move, so a single variant keeps much of its input, but the texture does not.
        assert nearest(default.stages["completed"], unit) > 0.05
        assert nearest(default.image, pebbles) >= 0.4


def test_options_of_elements_play_no_part(pebbles, result):
    other = texrs.design(
        pebbles,
        (160, 192),
        seed=1,
        copies=2,
        method="paper",
        elements=ElementOptions(segmentation="grid"),
        deformation=DeformationOptions(translate=0.0, rotate=10.0, allow_mirror=False),
        screening=0.5,
    )
    np.testing.assert_array_equal(other.image, result.image)


# --- completion ------------------------------------------------------------------------------------------------------


def test_completion_takes_the_best_match_of_a_centred_window():
    random = np.random.default_rng(3)
    image = random.random((30, 34, 2)).astype(np.float32)
    picture = random.random((20, 24, 2)).astype(np.float32)
    known = np.ones((20, 24), bool)
    known[11, 9] = False
    window = (slice(11 - 4, 11 + 5), slice(9 - 4, 9 + 5))
    weight = known[window][..., np.newaxis]
    costs = np.array(
        [
            [((image[r : r + 9, c : c + 9] - picture[window]) ** 2 * weight).sum() for c in range(34 - 8)]
            for r in range(30 - 8)
        ]
    )
    best = np.unravel_index(costs.argmin(), costs.shape)
    filled = inpaint(picture, known, PatchIndex([image], max_patch=9), patch_size=9, count=1, paper=True)
    np.testing.assert_array_equal(filled.coordinates[11, 9], np.array(best) + 4)


# --- the result ------------------------------------------------------------------------------------------------------


def test_the_composite_is_what_the_source_map_shows(pebbles, result):
    assert result.image.shape == (160, 192, 3)
    np.testing.assert_array_equal(view(result.source_map, pebbles), result.stages["before_blending"])


def test_unscreened_poisson_acts_and_keeps_the_border(result):
    before, after = result.report["seams"]["before"], result.report["seams"]["after"]
    assert after["outliers"] < before["outliers"]
    assert after["mean"] < before["mean"]
    composite = result.stages["before_blending"]
    for axis in range(2):
        for line in (0, -1):
            np.testing.assert_array_equal(np.take(result.image, line, axis), np.take(composite, line, axis))
    image = samples.pebbles((128, 128)).image
    plain = texrs.blend(result.source_map, image, wrap=False, screening=0, outlines=False)
    np.testing.assert_array_equal(result.image, plain)


def test_screening_keeps_the_colours(result, pebbles):
    """Without a weight of the values, colours drift."""
    from scipy.ndimage import gaussian_filter

    def drift(image):
        shift = image.astype(float) - result.stages["before_blending"]
        return np.abs(gaussian_filter(shift, (12, 12, 0))).max()

    screened = texrs.blend(result.source_map, pebbles, wrap=False)
    assert drift(screened) < 0.5 * drift(result.image)


def test_other_seeds_give_other_textures(pebbles, result):
    other = texrs.design(pebbles, (160, 192), seed=2, copies=2, method="paper")
    assert (other.image != result.image).mean() > 0.5
    assert other.report["operations"][0] == result.report["operations"][0]


def test_layers_by_hand_and_several_exemplars(pebbles):
    labels = (samples.pebbles((128, 128)).labels > 0).astype(int)
    made = texrs.design(pebbles, 96, elements=ElementOptions(labels=labels), copies=1, method="paper")
    assert len(made.report["operations"][0]) == 2
    two = texrs.design([pebbles, 255 - pebbles], 96, copies=1, method="paper")
    assert min(two.report["pixel_counts"]) > 0
