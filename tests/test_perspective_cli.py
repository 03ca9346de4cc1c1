"""The commands texrs perspective, and texrs inpaint with a scale map."""

import numpy as np
import pytest

import texrs
from plane_checks import look_twice
from texrs import SourceMap, io, samples
from texrs.cli import main


@pytest.fixture
def files(tmp_path):
    floor = samples.tilted_discs((64, 64))
    io.write(tmp_path / "floor.png", floor.image)
    io.write(tmp_path / "scale.npy", floor.scale_map.astype(np.float32))
    hole = np.zeros((64, 64), np.uint8)
    hole[20:40, 20:44] = 255
    io.write(tmp_path / "hole.png", hole)
    clear = np.concatenate([floor.image, 255 - hole[..., np.newaxis]], axis=-1)
    io.write(tmp_path / "clear.png", clear)
    return tmp_path


def run(folder, text):
    words = [str(folder / w[1:]) if w.startswith("@") else w for w in text.split()]
    return main(words)


def test_a_picture_is_grown(files):
    assert (
        run(files, "perspective @floor.png --scale-map @scale.npy -o @out.png --size 80x48 --source-map @map.npz -q")
        == 0
    )
    assert io.read(files / "out.png").shape == (48, 80, 3)
    assert SourceMap.load(files / "map.npz").shape == (48, 80)


def test_targets_and_sizes(files):
    small = np.full((40, 40), 0.4, np.float32)
    io.write(files / "target.npy", small)
    line = "perspective @floor.png --scale-map @scale.npy --target @target.npy -o @out.png --augment-scales 0.5:0.8 -q"
    assert run(files, line) == 0
    assert io.read(files / "out.png").shape == (40, 40, 3)


def test_a_mask_is_measured_as_is_said(files):
    io.write(files / "discs.png", samples.tilted_discs((128, 128)).image)
    line = "perspective @discs.png -o @out.png --min-feature-size 2 --trend linear --foreshortened --size 48 -q"
    assert run(files, line) == 0
    how = texrs.scale_maps.Measuring(min_feature_size=2, trend="linear", foreshortened=True)
    made = texrs.perspective(io.read(files / "discs.png"), size=48, scale_measurement=how)
    np.testing.assert_array_equal(io.read(files / "out.png"), made.image)


def test_a_target_is_stretched_to_the_size(files):
    io.write(files / "target.npy", np.full((8, 10), 0.6, np.float32))
    line = "perspective @floor.png --scale-map @scale.npy --target @target.npy -o @out.png --size 64x40 -q"
    assert run(files, line) == 0
    assert io.read(files / "out.png").shape == (40, 64, 3)


def test_holes_are_filled_by_scale(files):
    for given in ("--scale-map @scale.npy", "--scale-map auto", "--method optimise --scale-map @scale.npy"):
        assert run(files, f"inpaint @floor.png @hole.png -o @out.png {given} -q") == 0
        made, floor, hole = (io.read(files / n) for n in ("out.png", "floor.png", "hole.png"))
        np.testing.assert_array_equal(made[hole == 0], floor[hole == 0])
    assert (
        run(
            files,
            "inpaint @floor.png @hole.png -o @out.png --method optimise --scale-map @scale.npy --boundary-width 4 -q",
        )
        == 0
    )
    changed = (io.read(files / "out.png") != floor).any(axis=-1)
    assert changed[hole == 0].any()
    assert run(files, "inpaint @clear.png alpha -o @new.png --scale-map @scale.npy -q") == 0
    assert (io.read(files / "new.png")[..., 3] == 255).all()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("perspective @floor.png --scale-map @hole.png -o @out.png --size 0", "--size"),
        (
            "perspective @floor.png --scale-map @scale.npy -o @out.png --method best",
            "--method: must be one of default, paper",
        ),
        (
            "perspective @floor.png --scale-map @scale.npy -o @out.png --augment-scales big",
            "--augment-scales: must be auto",
        ),
        ("perspective @floor.png --scale-map @scale.npy -o @out.png --wrap xy", "wrap"),
        (
            "perspective @floor.png --scale-map @scale.npy -o @out.png --scale-weight 99",
            "--scale-weight: must be a number",
        ),
        ("perspective @floor.png --min-feature-size 0 -o @out.png", "--min-feature-size: must be a number between 0.5"),
        ("perspective @floor.png --trend steep -o @out.png", "--trend: must be one of none, plane, linear, quadratic"),
        (
            "perspective @floor.png --scale-map @scale.npy --min-feature-size 3 --foreshortened -o @out.png",
            "--min-feature-size and --foreshortened: cannot be combined with a scale map",
        ),
        ("inpaint @floor.png alpha -o @out.png", "MASK: 'alpha' needs an image with an alpha channel"),
        ("inpaint @floor.png @hole.png -o @out.png --method heal", "--method: must be one of"),
        (
            "inpaint @floor.png @hole.png -o @out.png --method optimise --patch-size 9",
            "--patch-size: cannot be combined with method='optimise'",
        ),
    ],
)
def test_bad_input_is_named(files, capsys, line, words):
    assert run(files, line) == 2
    assert words in capsys.readouterr().err
    assert not (files / "out.png").exists()


def test_a_picture_is_enough(files, capsys):
    """The plane is found. An image that does not show a plane is reported as doubtful."""
    io.write(files / "discs.png", texrs.samples.tilted_discs((128, 128)).image)
    assert run(files, "perspective @discs.png -o @out.png --size 160x96 --seed 1") == 0
    assert "no plane" not in capsys.readouterr().err
    discs = texrs.samples.tilted_discs((128, 128)).image
    made = texrs.perspective(discs, texrs.planes.find(discs).scale_map(), (96, 160), seed=1)
    np.testing.assert_array_equal(io.read(files / "out.png"), made.image)
    io.write(files / "torn.png", look_twice())
    assert run(files, "perspective @torn.png -o @twice.png") == 0
    assert "no plane was found with confidence" in capsys.readouterr().err
    assert io.read(files / "twice.png").shape[:2] == tuple(2 * n for n in io.read(files / "torn.png").shape[:2])


def test_the_name_of_a_target_says_where_its_y_grows(files, capsys):
    rows, columns = np.indices((64, 64)) / 63 * 1.2 - 0.6
    up = np.dstack([columns * 0.3, rows, np.sqrt(np.maximum(1 - 0.09 * columns**2 - rows**2, 0))])
    whole = np.rint((up + 1) * 127.5).astype(np.uint8)
    io.write(files / "ball_normal_gl.png", whole)
    io.write(files / "ball_normal_dx.png", np.dstack([whole[..., 0], 255 - whole[..., 1], whole[..., 2]]))
    line = "perspective @floor.png --scale-map front --size 64x64 -q -o @{}.png --target @ball_normal_{}.png".format
    assert run(files, line("gl", "gl")) == 0
    assert run(files, line("dx", "dx").replace("-q ", "")) == 0
    said = capsys.readouterr().err
    assert "ball_normal_dx.png: read with y down, because of its name" in said
    assert "ball_normal_dx.png: read as normals of a surface" in said
    assert (io.read(files / "gl.png") == io.read(files / "dx.png")).all()
    assert run(files, line("told", "dx") + " --target-green up") == 0
    assert run(files, line("other", "gl") + " --target-green down") == 0
    assert (io.read(files / "told.png") == io.read(files / "other.png")).all()
    assert (io.read(files / "told.png") != io.read(files / "gl.png")).any()
