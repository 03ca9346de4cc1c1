"""Moves of elements: random, between places of a heap, and on a lattice."""

from dataclasses import replace

import numpy as np
import pytest

import texrs
from texrs import DeformationOptions, samples
from texrs.errors import InvalidInput
from texrs.papers.design.elements import fit, measure_elements, place
from texrs.papers.design.heaps import Heap
from texrs.papers.design.logistic_map import iterate
from texrs.papers.design.operations import Moves

FREE = Moves(DeformationOptions(rotate=60))


def bars(*angles):
    """Draw a bar of 30 x 10 pixels at each angle, 50 pixels apart."""
    rows, columns = np.mgrid[:60, : 50 * len(angles)]
    labels = np.zeros(rows.shape, np.int32)
    for k, angle in enumerate(np.radians(angles)):
        y, x = rows - 30, columns - 25 - 50 * k
        along, across = x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)
        labels[(np.abs(along) < 15) & (np.abs(across) < 5)] = k + 1
    return labels


# --- the logistic map -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "start", [0, 0.5, -0.5, 1, -1, 0.5**0.5, -(0.5**0.5), 1.5, float("nan"), float("inf"), "half", None]
)
def test_starts_that_lead_nowhere_are_refused(start):
    with pytest.raises(InvalidInput, match="^start"):
        iterate(start)


@pytest.mark.parametrize("growth_rate", [-0.1, 2.001, 4, float("nan"), "strong"])
def test_a_lambda_outside_0_to_2_is_refused(growth_rate):
    with pytest.raises(InvalidInput, match="^growth_rate"):
        iterate(0.3, growth_rate)


@pytest.mark.parametrize("growth_rate", [0, 0.5, 1, 2])
def test_a_lambda_within_0_to_2_is_taken(growth_rate):
    values = iterate(0.3, growth_rate, 100)
    assert values.shape == (100,)
    assert ((values >= 0) & (values <= 255)).all()


# --- heaps -----------------------------------------------------------------------------------------------------------


def test_a_turned_element_takes_the_place_of_its_like():
    labels = bars(0, 40, 90)
    elements = measure_elements(labels)
    assert len(elements) == 3
    heap = Heap.measure(elements, labels)
    for site, element in enumerate(elements):
        taken = heap.take_place(site, FREE, 0, 0)
        assert taken is not None
        other, operations, placement = taken
        assert other is not element
        assert {o.kind for o in operations} <= set("TRS")
        turn = sum(o.amount for o in operations if o.kind == "R")
        assert abs((turn - {1: 0, 2: 40, 3: 90}[element.label] + {1: 0, 2: 40, 3: 90}[other.label] + 90) % 180 - 90) < 3
        assert abs(turn) <= 60
        assert not np.any((placement.distance > 2) & (labels[placement.window] != element.label))


def test_unlike_elements_stay():
    labels = bars(0, 40)
    labels[labels == 2] = 0
    labels[20:40, 65:85] = 2
    heap = Heap.measure(measure_elements(labels), labels)
    assert heap.take_place(0, FREE, 0, 0) is None
    assert heap.take_place(1, FREE, 0, 0) is None


@pytest.mark.parametrize(
    "moves",
    [
        Moves(DeformationOptions(operations=0, rotate=60)),
        Moves(DeformationOptions(translate=0, rotate=60)),
        Moves(DeformationOptions(rotate=0)),
    ],
    ids=["no operations", "no translation", "no rotation"],
)
def test_elements_of_a_heap_do_only_what_they_may(moves):
    labels = bars(0, 60)
    assert Heap.measure(measure_elements(labels), labels).take_place(0, moves, 0, 0) is None


def test_an_element_at_the_border_neither_goes_nor_gives_way():
    labels = bars(0, 0)
    labels[25:35, :12] = 1
    heap = Heap.measure(measure_elements(labels), labels)
    assert [heap.take_place(site, FREE, 0, 0) for site in range(2)] == [None, None]


def test_elements_of_one_pixel_and_of_all_pixels_are_measured():
    for labels in (np.pad([[1]], 5), np.ones((6, 7), int)):
        (element,) = measure_elements(labels.astype(np.int32))
        assert np.isfinite(element.axes).all()
        assert place(element, [], labels.shape) is not None


def test_heaps_move_without_holes_to_speak_of():
    beans = samples.beans((128, 128)).image
    made = texrs.design(beans, 96, copies=2, seed=1, way="move")
    moved = [e for e in made.report["operations"][0][1:] if "place" in e]
    assert len(moved) >= 0.15 * made.report["elements"]
    assert max(made.report["holes"]) < 0.1


def test_operations_are_obeyed_in_heaps():
    beans = samples.beans((128, 128)).image
    made = {
        n: texrs.design(beans, 96, copies=1, seed=1, way="move", deformation=DeformationOptions(operations=n))
        for n in (None, 0, 1, 2, 6)
    }
    assert made[None].report["arrangement"] == ["heap"]
    np.testing.assert_array_equal(made[None].image, made[1].image)
    longest = {
        n: max((len(e["operations"]) for e in result.report["operations"][0][1:] if "place" in e), default=0)
        for n, result in made.items()
    }
    # Stones that exchange places are rotated and scaled to each other's shape, together with stones on top of them.
    assert longest[0] == 0
    assert [longest[n] for n in (1, 2, 6)] == [2, 3, 7]
    assert len({result.image.tobytes() for result in made.values()}) == 4


def test_v_chooses_among_the_first_operations():
    for v, kinds in ((1, {"T"}), (2, {"T", "R"}), (4, {"T", "R", "M", "S"})):
        moves = Moves(DeformationOptions(v=v, rotate=60))
        drawn = [o for e in range(60) for o in moves.draw_operations(moves.draw_values(0, 0, e), (False, False), 99)]
        assert {o.kind for o in drawn} == kinds


# --- lattices --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "side"), [("bricks", 192), ("weave", 160)])
def test_on_a_lattice_periods_go_around_a_whole_number_of_times(name, side):
    """Points at a distance of the texture's side are the same point of the lattice."""
    wall = samples.load(name, size=(side, side)).image
    lattice = texrs.exemplar.segment(wall).lattice
    assert lattice is not None
    made = texrs.design(wall, (200, 232), seed=1, copies=2, way="still")
    [closing] = made.report["lattice_stretch"]
    size = np.diag([200.0, 232.0])
    times = np.linalg.solve(np.array(closing) @ lattice.vectors, size)
    assert np.abs(times - np.rint(times)).max() < 0.02
    # Except for the stretch that closes the lattice, frames are unchanged. Patches repeat in phase, within 1/6 of a
    # period.
    frames = np.abs(made.source_map.jacobians().reshape(-1, 2, 2)) - np.abs(np.linalg.inv(closing))
    assert np.abs(frames).max() < 0.01
    places = np.moveaxis(np.indices((200, 232)), 0, -1).astype(float)
    looked = made.source_map.coordinates @ np.array(closing).T
    plain = np.linalg.det(made.source_map.jacobians()) > 0
    moved = (places - looked)[plain & (made.source_map.jacobians()[..., 0, 0] > 0)]
    phase = np.exp(2j * np.pi * np.linalg.solve(np.array(closing) @ lattice.vectors, moved.T))
    assert (np.abs(phase.mean(axis=1)) > 0.6).all()


def test_a_lattice_is_not_stretched_where_nothing_goes_around():
    wall = samples.bricks((160, 160)).image
    made = texrs.design(wall, (200, 232), seed=1, copies=2, way="still", wrap=False)
    assert made.report["lattice_stretch"] == [None]
    assert (np.abs(made.source_map.jacobians()) == np.eye(2)).all()


def test_on_a_lattice_elements_move_by_its_shifts_alone():
    weave = samples.weave((160, 160)).image
    found = texrs.exemplar.segment(weave)
    assert found.lattice is not None
    made = texrs.design(weave, 96, copies=2, seed=2, way="move")
    assert "lattice" in made.report["reason"]
    assert (made.report["rotate"], made.report["holes"]) == (0, [0, 0])
    lattice = np.array([found.lattice.a, found.lattice.b], float).T
    entries = [entry for log in made.report["operations"] for entry in log[1:] if any(entry.get("place", []))]
    shifts = [entry["place"] for entry in entries]
    assert len(shifts) > 20
    assert not any(entry["operations"] for entry in entries)
    # A lattice with orthogonal periods equals its mirror image along a mirrored axis.
    times = np.linalg.solve(lattice, np.array(shifts).T)
    assert np.abs(times - np.round(times)).max() < 0.1


def test_mirrors_keep_to_the_axes_that_allow_them():
    kinds = {
        axes: {
            (o.kind, o.axis if o.kind == "M" else 0)
            for e in range(99)
            for o in replace(FREE, axes=axes).draw_operations(FREE.draw_values(0, 0, e), (False, False), 99)
        }
        for axes in ((True, True), (False, True), (True, False), (False, False))
    }
    others = {("T", 0), ("R", 0), ("S", 0)}
    assert kinds[True, True] == others | {("M", 0), ("M", 1)}
    assert kinds[False, True] == others | {("M", 1)}
    assert kinds[True, False] == others | {("M", 0)}
    assert kinds[False, False] == others


def test_shifts_are_mirrored_with_the_picture():
    moves = Moves(DeformationOptions(rotate=0, scale=(1, 1), allow_mirror=False), ((3, 5), (-2, 7)))
    assert moves.mirror((True, False)).shifts == ((-3, 5), (2, 7))
    assert moves.mirror((False, True)).shifts == ((3, -5), (-2, -7))
    drawn = {
        tuple((o.kind, o.amount, o.axis) for o in moves.draw_operations(moves.draw_values(0, 0, e), (False, False), 99))
        for e in range(99)
    }
    assert drawn == {(("T", 3.0, 0), ("T", 5.0, 1)), (("T", -2.0, 0), ("T", 7.0, 1))}
    assert moves.draw_operations(moves.draw_values(0, 0, 1), (True, False), 99) == []


def test_elements_keep_out_of_what_others_occupy():
    """This includes the places of elements that have not moved yet, so that an element can always stay."""
    rows, columns = np.mgrid[:96, :96]
    labels = np.zeros((96, 96), np.int32)
    for number, (r, c) in enumerate([(24, 24), (24, 50), (50, 24), (50, 50), (74, 74)], start=1):
        labels[(rows - r) ** 2 + (columns - c) ** 2 < 100] = number
    moves = Moves(DeformationOptions(translate=0.3, rotate=60))
    moved = 0
    for seed in range(8):
        for element in measure_elements(labels):
            fitted = fit(element, labels, moves, seed, 0)
            assert fitted is not None
            operations, placement = fitted
            mine = (placement.distance > 0) & placement.inside
            there = labels[placement.window]
            assert (mine & (there > 0) & (there != element.label)).sum() <= 0.12 * mine.sum()
            moved += bool(operations)
    assert moved >= 20
