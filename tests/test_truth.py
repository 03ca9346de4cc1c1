"""The same bytes as before: results compared with their stored digests (see `truth`)."""

import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.fft
import skimage.color

import texrs
from truth import elements, grown, pictures, table  # noqa: F401  # The cases enter the table.
from truth.table import CASES, differences, witness

# Use one thread and several, in both orders. Analyses are cached by content, so the first run of a case computes them.
# Runs with one thread and with several therefore also take turns as the first.
COUNTS = ((1, 2), (7, 1), (2, 1), (1, 7))
RUNS = [(name, count) for i, name in enumerate(sorted(CASES)) for count in COUNTS[i % 4]]
HOW = "if that is meant, run REGENERATE=1 python -m pytest tests/test_truth.py, and look at the diff of digests.json"


SINGLE = (np.float32, np.complex64)
FUNCTIONS = {
    np: "exp exp2 expm1 log log2 log10 log1p power sin cos tan tanh arcsin arccos arctan arctan2 hypot cbrt einsum dot matmul",
    np.fft: "fft2 ifft2 rfft2 irfft2 fftn ifftn rfftn irfftn",
    scipy.fft: "fft2 ifft2 rfft2 irfft2 fftn ifftn rfftn irfftn",
    skimage.color: "rgb2lab lab2rgb",
}
"""Functions whose last bit differs between processors: of 53, which is never visible, or of 24, which is."""


@pytest.fixture(autouse=True)
def functions_in_double(monkeypatch):
    """Refuse single-precision calls of these functions by texrs."""
    own = os.path.dirname(texrs.__file__)

    def watched(name, function):
        def call(*args, **kwargs):
            out = function(*args, **kwargs)
            caller = sys._getframe(1).f_code.co_filename
            assert getattr(out, "dtype", None) not in SINGLE or not caller.startswith(own), (
                f"{name} of single precision"
            )
            return out

        # Replace methods of ufuncs too, such as np.subtract.outer.
        call.__dict__.update(
            {key: getattr(function, key) for key in ("outer", "reduce", "at") if hasattr(function, key)}
        )
        return call

    for module, names in FUNCTIONS.items():
        for name in names.split():
            monkeypatch.setattr(module, name, watched(name, getattr(module, name)))


@pytest.fixture(scope="module")
def stored():
    """Return the stored table. With REGENERATE=1 in the environment, write it first."""
    if os.environ.get("REGENERATE") == "1":
        table.write({name: witness(make()) for name, make in CASES.items()})
    return table.read()


@pytest.mark.parametrize(("name", "count"), RUNS)
def test_results_are_the_stored_ones(name, count, stored):
    assert name in stored, f"{name}: nothing is stored of this case; {HOW}"
    with texrs.threads(count):
        found = witness(CASES[name]())
    changed = differences(stored[name], found)
    assert not changed, "\n  ".join([f"{name} differs with {count} threads; {HOW}:", *changed])


def test_a_simpler_processor_gives_the_same_bytes():
    """Disable wide registers in NumPy and OpenBLAS, whose sums and functions differ in the last bits."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    wide = [name for name in __cpu_dispatch__ if __cpu_features__.get(name)]
    if not wide:
        pytest.skip("NumPy knows nothing here that this processor could do without")
    names = ("inpaint_with_a_scale_map", "perspective", "removed", "scale_maps_edited", "self_splice_made_regular")
    chosen = " or ".join(f"{name}-1" for name in names)
    plain = {
        **os.environ,
        "NPY_DISABLE_CPU_FEATURES": " ".join(wide),
        "OPENBLAS_CORETYPE": "Nehalem",
        "REGENERATE": "0",
    }
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", __file__, "-k", chosen]
    ran = subprocess.run(command, env=plain, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr[-1000:]
    assert f"{len(names)} passed" in ran.stdout


def test_all_that_is_stored_has_a_case(stored):
    assert stored.keys() <= CASES.keys(), f"cases that are no more: {stored.keys() - CASES.keys()}; {HOW}"


def test_a_digest_is_of_values_type_and_shape():
    image = np.arange(12, dtype=np.uint16).reshape(3, 4)
    other = image.copy()
    other[2, 3] ^= 1
    kinds = [image, other, image.astype(np.int16), image.reshape(4, 3), image.T]
    digests = {table.line(each).split(table.BAR)[0] for each in kinds}
    assert len(digests) == len(kinds)
    assert table.line(image) == table.line(np.asfortranarray(image)) == table.line(image.astype(">u2"))
    assert table.line(image).endswith(" | uint16 3x4 mean 5.500000")


def test_what_differs_is_named():
    stored = witness({"image": np.zeros(2), "report shares": (0.25, 0.75), "label": np.ones(2), "frame": None})
    found = witness({"image": np.ones(2), "report shares": [0.25, 0.5], "label": np.ones(2), "stage": None})
    assert differences(stored, stored) == []
    sentences = differences(stored, found)
    assert [sentence.split(":")[0] for sentence in sentences] == ["frame", "image", "report shares", "stage"]
    assert "mean 0.000000, now" in sentences[1]
    assert sentences[2].endswith("stored [0.25, 0.75], now [0.25, 0.5]")
    # A digest covers all of a long value, and all of an array, whatever mean is printed.
    first, second = (witness({"log": [*range(100), last]}) for last in (1, 2))
    assert len(differences(first, second)) == 1
    assert differences({"image": "ab | mean 0.1"}, {"image": "ab | mean 0.2"}) == []
