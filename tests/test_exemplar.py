"""texrs.Exemplar: facts about an example, computed once and cached by content."""

import numpy as np
import pytest

import texrs
from texrs import samples
from texrs.errors import FileError, InvalidInput
from texrs.exemplar import as_exemplar

STRIPES = samples.stripes((32, 32, 32)).image
WEAVE = samples.weave((48, 48)).image
CLASSES = (np.indices((32, 40)).sum(axis=0) % 3).astype(np.uint8)


def test_pixels_are_kept_as_they_were_given():
    given = WEAVE.copy()
    exemplar = texrs.Exemplar(given)
    given[...] = 0
    np.testing.assert_array_equal(exemplar.image, WEAVE)
    np.testing.assert_array_equal(exemplar.normalized, (WEAVE / np.float32(255)).astype(np.float32))
    assert not exemplar.pixels.flags.writeable
    grey = texrs.Exemplar(WEAVE[..., 0])
    assert (grey.image.shape, grey.pixels.shape, grey.shape) == ((48, 48), (48, 48, 1), (48, 48))
    assert repr(grey) == "<Exemplar of 48 x 48, 1 channel of uint8>"


def test_labels_and_repeats_are_as_said_or_measured():
    assert texrs.Exemplar(CLASSES).labels
    assert not texrs.Exemplar(CLASSES, labels=False).labels
    assert len(np.unique(texrs.Exemplar(CLASSES).colours.reshape(-1, 3), axis=0)) == 3
    particles = samples.particles().image
    assert texrs.Exemplar(particles, axes=3).repeat == (True, True, True)
    assert texrs.Exemplar(particles, axes=3, repeat=False).repeat == (False, False, False)
    assert texrs.Exemplar(particles[:, :, 9:], axes=3).analyse().wrap == (True, True, False)


def test_facts_are_worked_out_once_and_kept_by_content():
    first, again = texrs.Exemplar(STRIPES, axes=3), texrs.Exemplar(STRIPES.copy(), axes=3)
    assert first.analyse() is first.analyse()
    assert again.analyse() is first.analyse()
    assert first.similarity(0, k=2) is again.similarity(-2, k=2)
    other = STRIPES.copy()
    other[0, 0, 0, 0] ^= 1
    assert texrs.Exemplar(other, axes=3).key != first.key
    assert texrs.Exemplar(STRIPES, axes=3, repeat=False).key != first.key
    assert texrs.Exemplar(STRIPES, axes=3, labels=False).key != first.key
    assert first.analyse(radii=(3, 2)).levels[0].radius == 3


def test_a_fact_of_any_kind_is_remembered():
    exemplar, made = texrs.Exemplar(np.random.default_rng(7).random((20, 20))), []

    def make():
        made.append(1)
        return None

    assert exemplar.cached(("nothing", 1), make) is None
    exemplar.cached(("nothing", 1), make)
    assert made == [1]
    exemplar.cached(("nothing", 2), make)
    assert made == [1, 1]


@pytest.mark.parametrize(("labels", "repeat"), [(None, None), (False, True), (True, (False, True))])
def test_exemplars_are_saved_and_taken_back(tmp_path, labels, repeat):
    first = texrs.Exemplar(CLASSES, labels=labels, repeat=repeat)
    first.save(tmp_path / "a.npz")
    again = texrs.Exemplar.load(tmp_path / "a.npz")
    assert (again.key, again.shape, again.repeat, again.labels) == (first.key, (32, 40), first.repeat, first.labels)
    assert again.analyse() is not first.analyse()
    for mine, theirs in zip(first.analyse().levels, again.analyse().levels, strict=True):
        for name, value in mine.arrays().items():
            np.testing.assert_array_equal(theirs.arrays()[name], value)


def test_damaged_files_are_refused(tmp_path):
    path = tmp_path / "a.npz"
    texrs.Exemplar(STRIPES, axes=3).save(path)
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    whole = path.read_bytes()
    damages = {
        "cut off": lambda: path.write_bytes(whole[: len(whole) // 2]),
        "of another version": lambda: np.savez(path, **{**arrays, "format": np.array(99)}),
        "without an array": lambda: np.savez(path, **{k: v for k, v in arrays.items() if k != "0/basis"}),
        "of other sizes": lambda: np.savez(path, **{**arrays, "1/features": arrays["1/features"][:-24]}),
        "out of range": lambda: np.savez(path, **{**arrays, "0/colours": arrays["0/colours"] * 0 + 30000}),
        "without levels": lambda: np.savez(path, **{k: v for k, v in arrays.items() if "/" not in k}),
        "of another image": lambda: np.savez(path, **{**arrays, "image": STRIPES[:16, :16, :16]}),
        "not an image": lambda: np.savez(path, **{**arrays, "image": STRIPES[0, 0]}),
        "not one": lambda: path.write_bytes(b"nothing of the kind"),
    }
    for damage in damages.values():
        damage()
        with pytest.raises(FileError) as caught:
            texrs.Exemplar.load(path)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)
    with pytest.raises(FileError):
        texrs.Exemplar.load(tmp_path / "none.npz")


def test_bad_input_gets_a_sentence():
    with pytest.raises(InvalidInput, match="^labels: must have one channel, got 3"):
        texrs.Exemplar(WEAVE, labels=True)


def test_verbs_take_either():
    exemplar = texrs.Exemplar(WEAVE)
    assert as_exemplar(exemplar) is exemplar
    assert as_exemplar(WEAVE).key == exemplar.key
    for value, options, says in (
        (exemplar, {"axes": 3}, "exemplar: must be an Exemplar with axes=3, got one with axes=2"),
        (exemplar, {"minimum": 64}, "exemplar: each side must be at least 64, got shape (48, 48)"),
        (np.array("weave"), {}, "exemplar: must contain integers, floats or bool"),
        (texrs.Exemplar(WEAVE[:12]).image, {"minimum": 16}, "exemplar: each side must be at least 16"),
    ):
        with pytest.raises(InvalidInput) as caught:
            as_exemplar(value, **options)
        assert says in str(caught.value)
    with pytest.raises(InvalidInput, match="exemplar: each side must be at least 16"):
        texrs.Exemplar(WEAVE[:12]).analyse()
