"""Transparent volumes: the sums along rays are correct, and equal for any number of threads."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import texrs
from texrs import io, samples, volume
from texrs.cli import main
from texrs.errors import InvalidInput
from texrs.volume.transparent import parse_transfer

PARTICLES = samples.particles((48, 48, 48))
FRONT = {"azimuth": 0.0, "elevation": 0.0}


def add_up(colours: np.ndarray, alpha: np.ndarray) -> tuple[np.ndarray, float]:
    """Return colours times alpha, and alpha, of voxels along one ray, front first."""
    total, light = np.zeros(3), 1.0
    for colour, share in zip(colours, alpha, strict=True):
        total += light * share * colour
        light *= 1 - share
    return total, 1 - light


@pytest.mark.parametrize("alpha", [0.02, 0.3, 1.0])
def test_an_even_block_is_as_opaque_as_it_is_deep(alpha: float) -> None:
    block = np.full((12, 32, 32, 3), 200, np.uint8)
    seen = volume.render_volume(block, 64, **FRONT, transfer=[(0, None, alpha)], shading=False)
    middle = seen[28:36, 28:36].reshape(-1, 4)
    assert_allclose(middle[:, :3], 200, atol=1)
    assert_allclose(middle[:, 3] / 255, 1 - (1 - alpha) ** 12, atol=0.025)
    assert seen[0, 0, 3] == 0


def test_what_lies_in_front_hides_what_is_behind() -> None:
    block = np.zeros((16, 32, 32, 3), np.uint8)
    block[2:5], block[11:14] = (255, 0, 0), (0, 0, 255)
    stops = [(0, None, 0), (0.2, None, 0), (1 / 3, None, 0.4)]
    front = volume.render_volume(block, 64, **FRONT, transfer=stops, shading=False)[32, 32]
    colours = block[:, 16, 16] / 255
    total, alpha = add_up(colours, np.where(colours.any(axis=1), 0.4, 0))
    assert_allclose(front[3] / 255, alpha, atol=0.05)
    assert_allclose(front[:3] / 255, total / alpha, atol=0.08)
    behind = volume.render_volume(block, 64, azimuth=180, elevation=0, transfer=stops, shading=False)[32, 32]
    assert_allclose(behind[:3], front[2::-1], atol=2)
    solid = [(0, None, 0), (0.2, None, 0), (1 / 3, None, 1)]
    assert_array_equal(
        volume.render_volume(block, 64, **FRONT, transfer=solid, shading=False)[32, 32], [255, 0, 0, 255]
    )


def test_by_default_what_stands_out_is_seen() -> None:
    image = PARTICLES.image
    seen = volume.render_volume(image, 96, **FRONT)
    # A pixel is opaque if a particle is behind it, and otherwise nearly transparent.
    column = (PARTICLES.labels > 0).sum(axis=0)
    scale = seen.shape[0] / (48 * 1.04)
    rows, columns = np.mgrid[:48, :48]
    at = [
        np.clip(((a + 0.5 - 24) * scale + s / 2).astype(int), 0, s - 1)
        for a, s in zip((rows, columns), seen.shape, strict=False)
    ]
    alpha = seen[at[0], at[1], 3] / 255
    assert alpha[column >= 5].mean() > 4 * alpha[column == 0].mean()
    assert alpha[column >= 5].mean() > 0.4
    vivid = seen[seen[..., 3] > 150][:, :3].astype(int)
    assert np.ptp(vivid, axis=1).mean() > 40  # The colours are those of particles, not of the grey around them.


@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_any_volume(kind: str, channels: int) -> None:
    given = PARTICLES.image[::2, ::2, ::2]
    given = given[..., 0] if channels == 1 else given
    if channels == 4:
        given = np.concatenate([given, np.where(PARTICLES.labels[::2, ::2, ::2, None] > 0, 255, 0)], -1).astype(
            np.uint8
        )
    given = {"uint8": given, "uint16": given.astype(np.uint16) * 257, "float32": (given / 255).astype(np.float32)}[kind]
    seen = volume.render_volume(given, 32)
    assert seen.dtype == np.uint8
    assert seen.shape[2] == 4
    assert 0 < (seen[..., 3] > 0).mean() < 1


def test_the_same_bytes() -> None:
    pictures = []
    for count in (1, 2, 7):
        with texrs.threads(count):
            pictures.append(volume.render_volume(PARTICLES.image, 64))
    assert all((p == pictures[0]).all() for p in pictures)
    assert_array_equal(volume.render_volume(PARTICLES.image, 64, azimuth=400), pictures[0])


def test_transfer_functions() -> None:
    grey = np.linspace(0, 255, 24).astype(np.uint8)[:, None, None] * np.ones((24, 24, 24), np.uint8)
    text = "0:own:0, 0.5:#f00:0, 0.6:#ff0000:0.5, 0.7:#00f:0"
    stops = [(0, None, 0), (0.5, (255, 0, 0), 0), (0.6, "#f00", 0.5), (0.7, "#0000ff", 0)]
    assert_array_equal(volume.render_volume(grey, 32, transfer=text), volume.render_volume(grey, 32, transfer=stops))
    seen = volume.render_volume(grey, 64, azimuth=90, elevation=0, transfer=text, shading=False)
    covered = np.flatnonzero(seen[32, :, 3])
    assert (covered.max() - covered.min()) < 64 * 0.35  # Only a thin sheet has visible values.
    assert seen[32, covered, 0].max() > 150
    assert parse_transfer("0.5:own:1") == [(0.5, None, 1.0)]


@pytest.mark.parametrize(
    ("transfer", "words"),
    [
        ("0:own", "must be VALUE:COLOUR:ALPHA"),
        ("a:own:1", "must be VALUE:COLOUR:ALPHA"),
        ("0:red:1", "a colour must be #rrggbb"),
        ("0:#12345:1", "a colour must be #rrggbb"),
        ("0:own:2", "transfer"),
        ("2:own:1", "transfer"),
        ("0.5:own:0,0.2:own:1", "must not decrease, got 0.5, 0.2"),
        ([0.5], r"must be \(value, colour, alpha\), got 0.5"),
        ([(0, (1, 2), 1)], "a colour must be #rrggbb"),
        ([(0, (1, 2, 300), 1)], "transfer"),
    ],
)
def test_what_is_no_transfer_function(transfer: object, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        volume.render_volume(PARTICLES.image, 32, transfer=transfer)


def test_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    io.write_volume(tmp_path / "a.npy", PARTICLES.image)
    words = ["slice", f"{tmp_path}/a.npy", "-o", f"{tmp_path}/a.png", "--transparent", "--size", "64", "-q"]
    assert main([*words, "--transfer", "0:own:0,0.3:#ff8800:0.1"]) == 0
    wanted = volume.render_volume(PARTICLES.image, 64, transfer="0:own:0,0.3:#ff8800:0.1")
    assert_array_equal(io.read(tmp_path / "a.png"), wanted)
    assert main([*words, "--transfer", "0.3"]) == 2
    assert "must be VALUE:COLOUR:ALPHA" in capsys.readouterr().err
    assert main([*words, "--cube"]) == 2
    assert main(["slice", f"{tmp_path}/a.npy", "-o", f"{tmp_path}/b.png", "--transfer", "0:own:1"]) == 2
    np.save(tmp_path / "labels.npy", PARTICLES.labels % 50)
    assert main(["slice", f"{tmp_path}/labels.npy", "-o", f"{tmp_path}/c.png", "--labels", "--transparent", "-q"]) == 0
