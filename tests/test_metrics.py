"""Quality measures on images with a known order: real, whole, crisp and varied over made, torn, blurred and repeated."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

import texrs
from texrs import SourceMap, samples
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather
from texrs.metrics import evaluate

GENERATED = ("pebbles", "beans", "leaves_and_flowers", "dots")
PHOTOGRAPHS = {
    "gravel": (slice(0, 192), slice(0, 192)),
    "brick": (slice(0, 192), slice(0, 192)),
    # This crop shows rows of different coins.
    "coins": (slice(20, 220), slice(20, 220)),
}
NAMES = (*GENERATED, *PHOTOGRAPHS)


def picture(name):
    if name in PHOTOGRAPHS:
        return np.ascontiguousarray(samples.photograph(name).image[PHOTOGRAPHS[name]])
    return samples.load(name, size=(160, 160)).image


def paste(source, mask, shift):
    """Show other places of the exemplar in a mask."""
    there = source.coordinates + np.float32(shift)
    inside = ((there >= 0) & (there <= np.array(source.shapes[0]) - 1)).all(axis=-1) & mask
    coordinates = np.where(inside[..., np.newaxis], there, source.coordinates)
    label = np.where(inside, source.label.max() + 1, source.label).astype(np.uint32)
    return SourceMap(coordinates, source.exemplar, label, None, source.shapes)


def scramble(shape, seed, side=32):
    """Return random blocks, side by side."""
    rng, made = np.random.default_rng(seed), SourceMap.identity(shape)
    for row in range(0, shape[0], side):
        for column in range(0, shape[1], side):
            mask = np.zeros(shape, bool)
            mask[row : row + side, column : column + side] = True
            low = np.array([-row, -column])
            high = np.array(shape) - side - (row, column)
            made = paste(made, mask, rng.integers(low, np.maximum(high, low) + 1))
    return made


@pytest.mark.parametrize("name", NAMES)
def test_real_pieces_are_ranked_over_results(name):
    image = picture(name)
    real = evaluate(image, SourceMap.identity(image.shape[:2]))
    assert real.score == 0
    assert real.coverage == 1
    rows, columns = (np.arange(20, 140, dtype=np.float32) for _ in range(2))
    crop = SourceMap.from_coordinates(np.stack(np.meshgrid(rows, columns, indexing="ij"), -1), image.shape[:2])
    for made in (texrs.design(image, 160), texrs.synthesize(image, 160)):
        result = evaluate(image, made.source_map, made.image)
        assert result.score > evaluate(image, crop).score, result


@pytest.mark.parametrize("name", NAMES)
def test_results_are_ranked_over_blocks_from_anywhere(name):
    image = picture(name)
    result = evaluate(image, texrs.synthesize(image, image.shape[:2]).source_map)
    for seed in range(2):
        blocks = evaluate(image, scramble(image.shape[:2], seed))
        assert result.broken < blocks.broken, (result, blocks)
        assert result.torn + result.broken < blocks.torn + blocks.broken, (result, blocks)


@pytest.mark.parametrize("name", ["pebbles", "beans", "dots"])
@pytest.mark.parametrize("seed", [0, 1])
def test_things_laid_whole_are_ranked_over_torn_ones(name, seed):
    """The same holes are cut twice: along the new elements, and across them."""
    sample = samples.load(name, size=(160, 160))
    rng = np.random.default_rng(seed)
    boxes = ndimage.find_objects(sample.labels)
    inner = [k for k, box in enumerate(boxes, 1) if box and all(s.start > 12 and s.stop < 148 for s in box)]
    whole = torn = SourceMap.identity((160, 160))
    for thing in rng.choice(inner, 6, replace=False):
        shift, box = rng.integers(-30, 31, 2), boxes[thing - 1]
        mask = np.roll(sample.labels == thing, shift, (0, 1))
        half = (box[1].stop - box[1].start) // 2
        whole, torn = paste(whole, mask, -shift), paste(torn, mask, -shift + (0, half))
    a, b = evaluate(sample.image, whole), evaluate(sample.image, torn)
    assert a.broken < b.broken, (a, b)
    assert a.torn + a.broken < b.torn + b.broken, (a, b)


@pytest.mark.parametrize("name", NAMES)
def test_crisp_seams_are_ranked_over_fogged_ones(name):
    image = picture(name)
    made = texrs.synthesize(image, 160)
    crisp = made.image.astype(np.float64)
    soft = ndimage.gaussian_filter(crisp, (2, 2) + (0,) * (crisp.ndim - 2))
    at_seam = np.zeros((160, 160), bool)
    for axis in range(2):
        at_seam |= ~made.source_map.is_coherent(axis)
    near = ndimage.binary_dilation(at_seam, iterations=4)
    near = near if crisp.ndim == 2 else near[..., np.newaxis]
    fogged = np.rint(np.where(near, soft, crisp)).astype(np.uint8)
    clear, dim = evaluate(image, made.source_map, made.image), evaluate(image, made.source_map, fogged)
    assert clear.seam_blur < 0.1, clear
    assert dim.seam_blur > clear.seam_blur + 0.2, dim
    assert replace(dim, seam_blur=clear.seam_blur) == clear


def test_one_place_shown_again_and_again_is_told_from_a_whole_exemplar_shown_again():
    image = picture("pebbles")
    many = np.indices((320, 320)).transpose(1, 2, 0).astype(np.float32)
    whole = evaluate(image, SourceMap.from_coordinates(many % 160, (160, 160)))
    piece = evaluate(image, SourceMap.from_coordinates(many % 40, (160, 160)))
    assert evaluate(image, SourceMap.identity((160, 160))).repetition == 0
    assert 0.6 < whole.repetition < 1
    assert piece.repetition > 5
    assert (whole.coverage, piece.coverage) == (1, 1 / 16)


def test_copies_that_are_mirrored_are_not_alike():
    image = picture("leaves_and_flowers")
    grid = np.indices((160, 320)).transpose(1, 2, 0).astype(np.float32) % 160
    label = np.repeat(np.arange(2, dtype=np.uint32), 160)[np.newaxis].repeat(160, axis=0)
    frames = np.array([np.eye(2), np.diag([1.0, -1.0])], np.float32)
    copied = SourceMap.from_coordinates(grid.copy(), (160, 160), label=label)
    grid[:, 160:, 1] = 159 - grid[:, 160:, 1]
    mirrored = SourceMap.from_coordinates(grid, (160, 160), label=label, jacobian=frames)
    assert evaluate(image, copied).repetition > 0.4
    assert evaluate(image, mirrored).repetition == 0


def test_what_stands_out_counts_for_more():
    image = np.full((160, 160), 0.5, np.float32) + samples.grit((160, 160)).image.mean(axis=-1) / 2550
    image[64:96, 64:96] = 1
    seen = np.indices((160, 160)).transpose(1, 2, 0).astype(np.float32)
    dull, bright = (
        evaluate(image, paste(SourceMap.identity((160, 160)), (seen < 32).all(axis=-1), shift)) for shift in (96, 64)
    )
    assert bright.repetition > 2 * dull.repetition


def test_frames_are_heeded_where_a_picture_is_mirrored():
    """A mirrored copy of the whole has no seam at all, and its lines continue."""
    image = picture("leaves_and_flowers")
    grid = np.indices((160, 160)).transpose(1, 2, 0).astype(np.float32)
    grid[..., 1] = 159 - grid[..., 1]
    mirrored = SourceMap.from_coordinates(
        grid, (160, 160), jacobian=np.diag([1.0, -1.0]).astype(np.float32)[np.newaxis]
    )
    assert evaluate(image, mirrored).score == 0


def test_cyclic_axes_are_looked_at_around_the_end():
    image = picture("pebbles")
    whole = SourceMap.identity((160, 160))
    assert evaluate(image, whole, wrap=(False, False)).broken == 0
    assert evaluate(image, whole, wrap=True).broken > 0


def test_arguments_are_checked():
    image = picture("dots")
    with pytest.raises(InvalidInput, match="source"):
        evaluate(image, SourceMap.identity((100, 100)))
    with pytest.raises(InvalidInput, match="image"):
        evaluate(image, SourceMap.identity((160, 160)), image[:80])


def test_nothing_looked_up_keeps_its_channels():
    assert gather(np.zeros((4, 4, 3)), np.zeros((0, 2))).shape == (0, 3)
