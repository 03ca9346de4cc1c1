"""Limits: of a block, of the process, and from the environment. Every verb checks them before and during its work."""

import asyncio
import contextvars
import threading
import time

import numpy as np
import pytest

import texrs
import texrs.cli
from texrs import limits
from texrs._progress import listen
from texrs.errors import InvalidInput, LimitExceeded, TexrsError

DOTS = texrs.samples.dots((64, 64)).image
HOLE = np.pad(np.ones((16, 16), bool), 24)
VOLUME = texrs.samples.stripes((32, 32, 32)).image
ENTRY = texrs.ElementAnalysis.of_sample(texrs.samples.dots((96, 96)))
VERBS = {
    "design": lambda: texrs.design(DOTS, 96),
    "design_variants": lambda: list(texrs.design_variants(DOTS, 2, 96)),
    "splice": lambda: texrs.splice(ENTRY, ENTRY, 128),
    "self_splice": lambda: texrs.self_splice(ENTRY, "randomise", 128),
    "perspective": lambda: texrs.perspective(DOTS, "front", 96),
    "synthesize": lambda: texrs.synthesize(DOTS, 96),
    "solid": lambda: texrs.solid(VOLUME, 40),
    "tile": lambda: texrs.tile(DOTS),
    "inpaint": lambda: texrs.inpaint(DOTS, HOLE),
    "extend": lambda: texrs.extend(DOTS, right=32),
    "rectify": lambda: texrs.rectify(DOTS, view=texrs.PlaneView(slant=10, fov=50)),
    "remove": lambda: texrs.remove(DOTS, HOLE, view=texrs.PlaneView(slant=10, fov=50)),
    "analyse": lambda: texrs.elements.analyse(DOTS),
    "CornerTiles": lambda: texrs.CornerTiles(DOTS, 32),
}


@pytest.fixture(autouse=True)
def _nothing_is_said(monkeypatch):
    for name in ("PIXELS", "VOXELS", "MEMORY", "SECONDS"):
        monkeypatch.delenv(f"TEXRS_{name}", raising=False)
    yield
    limits.set()


def test_every_verb_that_makes_something_is_here():
    made = {n for n in texrs.__all__ if "progress" in getattr(getattr(texrs, n), "__annotations__", {})}
    assert made - {"apply", "blend"} <= set(VERBS)


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("said", [{"pixels": 4000, "voxels": 60_000}, {"memory": 500_000}], ids=["pixels", "memory"])
def test_every_verb_compares_what_it_needs_before_it_begins(verb, said, monkeypatch):
    if said.get("pixels") and verb == "analyse":
        pytest.skip("makes no pixels but those it is given")
    with limits.context(**said), pytest.raises(LimitExceeded, match="limit of") as told:
        VERBS[verb]()
    assert ":" in str(told.value)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_stops_when_its_time_is_up(verb):
    with (
        limits.context(seconds=1e-9),
        pytest.raises(LimitExceeded, match=r"the time limit of 1e-09 s was reached in the stage"),
    ):
        VERBS[verb]()


def test_the_least_of_what_is_said_holds(monkeypatch):
    assert limits.current() == limits.Limits(memory=limits.current().memory)
    monkeypatch.setenv("TEXRS_PIXELS", "1e6")
    assert limits.current().pixels == 1_000_000
    limits.set(pixels=2_000_000, voxels=5)
    assert (limits.current().pixels, limits.current().voxels) == (1_000_000, 5)
    with limits.context(pixels=1000, memory=1e6):
        with limits.context(pixels=5000, seconds=9):
            # A block allows at most the limits of the block around it.
            assert limits.current().pixels == 1000
            assert limits.current().memory == 1_000_000
            assert 0 < limits.current().seconds <= 9
            with limits.context(seconds=100):
                assert limits.current().seconds <= 9
        assert limits.current().seconds is None
    limits.set(pixels=2**30)
    monkeypatch.delenv("TEXRS_PIXELS")
    # A limit above the default can be set.
    assert limits.current().pixels == 2**30


@pytest.mark.parametrize("name", ["pixels", "voxels", "memory", "seconds"])
def test_what_is_no_limit_is_refused(name, monkeypatch):
    for call in (limits.context(**{name: 10**400}).__enter__, lambda: limits.set(**{name: 10**400})):
        with pytest.raises(InvalidInput, match=f"^{name}: must be a number of"):
            call()
    for text in ("0", "-1", "nan", "inf"):
        monkeypatch.setenv(f"TEXRS_{name.upper()}", text)
        with pytest.raises(InvalidInput, match=f"^TEXRS_{name.upper()}: must be a number of"):
            limits.current()


def test_blocks_are_those_of_a_thread_or_a_task():
    seen = {}

    def look(name):
        seen[name] = limits.current().pixels

    with limits.context(pixels=1000):
        for name, run in {"bare": look, "copied": contextvars.copy_context().run}.items():
            arguments = (name,) if run is look else (look, name)
            thread = threading.Thread(target=run, args=arguments)
            thread.start()
            thread.join()

    async def one(pixels):
        with limits.context(pixels=pixels):
            await asyncio.sleep(0.01)
            return limits.current().pixels

    async def both():
        return await asyncio.gather(one(10), one(20))

    assert seen == {"bare": 2**28, "copied": 1000}
    assert asyncio.run(both()) == [10, 20]


def test_seconds_of_the_environment_are_those_of_each_call(monkeypatch):
    monkeypatch.setenv("TEXRS_SECONDS", "0.05")
    for _ in range(2):
        heed = listen(None)
        heed("begin", 0.0)
        time.sleep(0.06)
        with pytest.raises(LimitExceeded, match="0.05 s was reached in the stage 'end', at 50% of its progress"):
            heed("end", 0.5)


def test_files_are_held_to_the_limits(tmp_path):
    texrs.io.write(tmp_path / "a.png", DOTS)
    texrs.io.write_volume(tmp_path / "v.tif", VOLUME)
    source = texrs.SourceMap.identity((64, 64))
    source.save(tmp_path / "map.npz")
    with limits.context(pixels=4095, voxels=32767):
        for read in (
            lambda: texrs.io.read(tmp_path / "a.png"),
            lambda: texrs.io.read_volume(tmp_path / "v.tif"),
            lambda: texrs.SourceMap.load(tmp_path / "map.npz"),
        ):
            with pytest.raises(LimitExceeded, match="more than the limit of"):
                read()
        assert texrs.io.read(tmp_path / "a.png", limit=4096).shape == DOTS.shape


def test_more_takes_more():
    base = limits.estimate_memory("design", (256, 256, 3), (512, 512))
    assert limits.estimate_memory("design", (256, 256, 3), (1024, 1024)) > base
    assert limits.estimate_memory("design", [(256, 256, 3)] * 2, (512, 512)) > base
    assert limits.estimate_memory("design", (256, 256, 3), (2048, 2048), dtype="f4") > limits.estimate_memory(
        "design", (256, 256, 3), (2048, 2048)
    )
    assert limits.estimate_memory("solid", (64, 64, 64), field=True) > limits.estimate_memory("solid", (64, 64, 64, 1))
    assert limits.estimate_memory("tile", np.shape(DOTS)) == limits.estimate_memory(
        "tile", [list(DOTS.shape)], (64, 64)
    )
    # A machine with 32 GB refuses an image of 16384 x 16000 pixels before the work begins.
    assert limits.estimate_memory("perspective", (512, 512, 3), (16384, 16000)) > 32e9


def test_what_has_no_estimate_is_refused():
    with pytest.raises(TexrsError, match="^exemplar: "):
        limits.estimate_memory("solid", (9, 9))
    with pytest.raises(TexrsError, match="^dtype: "):
        limits.estimate_memory("tile", (9, 9), dtype="no such")


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("--pixel-limit 9000", "--size: 96 x 96 has 9216 pixels, more than the limit of 9000"),
        ("--memory-limit 1M", "--size: needs"),
        ("--time-limit 1e-9", "the time limit of 1e-09 s was reached"),
        ("--time-limit 0", "--time-limit: must be a number of seconds above 0, got 0"),
        ("--pixel-limit 0", "--pixel-limit: must be a number of pixels"),
        ("--memory-limit some", "--memory-limit: must be a number of bytes"),
    ],
)
def test_commands_have_options_of_them(option, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = ["design", "sample:dots", "-o", "out.png", "--size", "96"]
    assert texrs.cli.main([*command, *option.split()]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
