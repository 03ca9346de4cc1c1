"""Display of results: on one line, and as images in notebooks."""

import io
from base64 import b64decode
from typing import Any

import numpy as np
import pytest
from PIL import Image

import texrs
from texrs.errors import InvalidInput

PEBBLES = texrs.samples.pebbles((64, 64)).image
DOTS = texrs.samples.load("dots", size=(96, 96))
MADE = texrs.tile(PEBBLES)
VOLUME = texrs.samples.stripes((32, 36, 40)).image
STONES = texrs.Material({"albedo": PEBBLES, "height": PEBBLES[..., 0]})
THINGS = {
    "Synthesis": MADE,
    "SourceMap": MADE.source_map,
    "RenderOptions": MADE.source_map.finish,
    "Exemplar": texrs.Exemplar(PEBBLES),
    "ElementAnalysis": texrs.elements.ElementAnalysis.of_sample(DOTS),
    "layout": texrs.layouts.points([(20, 20), (40, 40), (20, 50)], 64),
    "Plane": texrs.Plane((64, 64), 45),
    "PlaneView": texrs.PlaneView(slant=45, ground=np.ones((64, 64), bool)),
    "Field": texrs.fields.circular(axes=2),
    "field of frames": texrs.fields.from_array(np.tile(np.eye(2), (8, 8, 1, 1))),
    "Segmentation": texrs.exemplar.segment(PEBBLES),
    "Analysis": texrs.Exemplar(PEBBLES).analyse(),
    "Constraints": texrs.Constraints(mask=DOTS.mask, values=DOTS.image),
    "Guide": texrs.Guide(exemplar=PEBBLES[..., 0], output=PEBBLES[..., 1]),
    "ElementOptions": texrs.ElementOptions(labels=DOTS.labels),
    "Comparison": texrs.volume.compare(VOLUME, VOLUME),
    "ComponentStatistics": texrs.volume.component_statistics(VOLUME[..., 0] > 100),
    "Material": STONES,
    "Map": STONES["height"],
    "ScaleMap": texrs.scale_maps.from_angles((64, 64), 40, 90),
    "Sample": DOTS,
    "list": [MADE] * 3,
    "ResultList": texrs.ResultList([MADE] * 3),
    "long ResultList": texrs.ResultList([MADE] * 30),
}


@pytest.mark.parametrize("name", THINGS)
def test_everything_says_what_it_is_on_one_short_line(name: str):
    text = repr(THINGS[name])
    assert "\n" not in text
    assert len(text) < 420
    assert "array(" not in text


def test_a_scale_map_is_shown_with_its_contours():
    seen = THINGS["ScaleMap"]
    assert repr(seen) == f"<ScaleMap of width, 64 x 64, {seen.min():.4g} to {seen.max():.4g}>"
    assert open_png(seen._repr_png_()).shape == texrs.scale_maps.picture(seen).shape
    # Parts that are not maps are displayed like other arrays.
    assert repr(seen[0])[:10] == "ScaleMap(["
    assert seen[0]._repr_png_() is None


def test_what_is_as_by_default_is_not_said():
    assert repr(texrs.ElementOptions(segmentation="grid")) == "ElementOptions(segmentation='grid')"
    assert repr(MADE) == f"<Synthesis of {MADE.image.shape[0]} x {MADE.image.shape[1]}, 3 channels of uint8>"
    assert repr(texrs.ResultList([MADE] * 30)).endswith("... 30 in all])")


def open_png(data: bytes) -> Any:
    return np.asarray(Image.open(io.BytesIO(data)))


@pytest.mark.parametrize(
    ("thing", "shape"),
    [
        (MADE, MADE.image.shape),
        (MADE.source_map, MADE.image.shape),
        (texrs.SourceMap.identity((5, 6, 7)), (6, 7, 3)),
        (THINGS["Exemplar"], (64, 64, 3)),
        (texrs.Exemplar(VOLUME, axes=3), (36, 40, 3)),
        (THINGS["ElementAnalysis"], (96, 96, 3)),
        (THINGS["layout"], (64, 64, 3)),
        (STONES, (64, 64, 3)),
        (texrs.Material({"albedo": VOLUME}, axes=3), (36, 40, 3)),
        (DOTS, (96, 96, 3)),
        (texrs.samples.stripes((32, 36, 40)), (36, 40, 3)),
        (THINGS["Field"], (240, 240, 3)),
        (texrs.fields.circular(), (240, 240, 3)),
        (THINGS["field of frames"], (240, 240, 3)),
    ],
    ids=lambda value: repr(value)[:24],
)
def test_a_notebook_shows_a_picture(thing: Any, shape: tuple[int, ...]):
    picture = open_png(thing._repr_png_())
    assert picture.shape == shape
    assert picture.std() > 1


def test_a_source_map_is_shown_by_where_it_looks():
    shown = open_png(texrs.SourceMap.identity((11, 21))._repr_png_())
    assert shown[0, 0, :2].tolist() == [0, 0]
    assert shown[10, 20, :2].tolist() == [255, 255]
    assert shown[5, 0, :2].tolist() == [128, 0]


def test_arrows_go_where_the_axes_go():
    straight = open_png(texrs.fields.identity()._repr_png_())
    red = (straight == (200, 40, 40)).all(axis=-1)
    # The exemplar's rows go down, so the shaft of each red arrow is a column.
    assert red.sum(axis=0).max() > 5 * np.median(red.sum(axis=1)[red.any(axis=1)]) / 2


def test_a_gallery_shows_all_that_it_holds():
    gallery = texrs.ResultList(each for each in (MADE, PEBBLES, PEBBLES[..., 0], MADE.source_map))
    pictures = [open_png(b64decode(part.split('"')[0])) for part in gallery._repr_html_().split("base64,")[1:]]
    assert [p.shape[:2] for p in pictures] == [MADE.image.shape[:2], (64, 64), (64, 64), MADE.image.shape[:2]]
    assert np.array_equal(pictures[0], MADE.image)
    with pytest.raises(InvalidInput, match="results: "):
        texrs.ResultList([{"no": "picture"}])._repr_html_()
