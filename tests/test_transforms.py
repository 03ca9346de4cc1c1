"""Training images, with their labels and boxes."""

import multiprocessing
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import texrs
from texrs.errors import InvalidInput
from texrs.transforms import TextureAugment, follow_boxes

SIDE = 96
SAMPLE = texrs.samples.load("dots", size=(SIDE, SIDE))
IMAGE, LABELS = SAMPLE.image, SAMPLE.labels
ROWS, COLUMNS = np.indices((SIDE, SIDE)).astype(np.int32)
# Each row has left, top, right, bottom, and the label that the box surrounds.
BOXES = np.array(
    [
        [
            COLUMNS[n == LABELS].min(),
            ROWS[n == LABELS].min(),
            COLUMNS[n == LABELS].max() + 1,
            ROWS[n == LABELS].max() + 1,
            n,
        ]
        for n in range(1, LABELS.max() + 1)
    ],
    float,
)
AUGMENT = TextureAugment()


def work(seed: int) -> tuple[bytes, bytes, bytes]:
    made = AUGMENT(IMAGE, LABELS, BOXES, seed)
    return made.image.tobytes(), made.mask.tobytes(), made.boxes.tobytes()


def test_labels_and_everything_else_follow():
    made = AUGMENT(IMAGE, LABELS, BOXES, seed=3)
    assert made.image.shape == IMAGE.shape
    assert made.image.dtype == IMAGE.dtype
    assert not np.array_equal(made.image, IMAGE)
    # Transformed maps of coordinates give the source of each pixel.
    rows, columns = (AUGMENT(IMAGE, each, seed=3).mask for each in (ROWS, COLUMNS))
    assert np.array_equal(made.image, IMAGE[rows, columns])
    assert np.array_equal(made.mask, LABELS[rows, columns])
    assert np.array_equal(made.source_map.render(LABELS, interpolation="nearest"), made.mask)


def test_boxes_are_around_what_is_seen_of_them():
    whole, seen = 0, 0
    for seed in range(3, 7):
        made = AUGMENT(IMAGE, LABELS, BOXES, seed=seed)
        assert len(made.boxes) > 3
        assert np.array_equal(BOXES[made.which, 4], made.boxes[:, 4])
        seen += len(made.boxes)
        for left, top, right, bottom, label in made.boxes:
            assert 0 <= left < right <= SIDE
            assert 0 <= top < bottom <= SIDE
            own = made.mask[int(top) : int(bottom), int(left) : int(right)] == label
            size = (BOXES[int(label) - 1, 2:4] - BOXES[int(label) - 1, :2])[::-1]
            whole += own.shape == tuple(size) and own.sum() == (label == LABELS).sum()
            assert own.any()
    # Most boxes contain whole elements and are as tight as the original boxes.
    assert whole >= seen / 2


@pytest.mark.parametrize("name", ["bricks", "pebbles", "weave"])
def test_the_picture_itself_is_no_other_one(name):
    image = getattr(texrs.samples, name)((64, 64)).image
    found = [AUGMENT(image, seed=seed).image for seed in range(3)]
    assert all((made == image).all(axis=-1).mean() < 0.5 for made in found)
    assert not np.array_equal(found[0], found[1])


def test_a_box_is_left_out_where_too_little_of_it_is_seen():
    places = texrs.SourceMap.identity((40, 40)).coordinates.copy()
    cut = np.concatenate([places[:, :18], places[:, 30:]], axis=1)
    source = texrs.SourceMap.from_coordinates(cut, (40, 40))
    boxes = [[10, 5, 20, 15], [14, 5, 24, 15], [28, 5, 38, 15], [20, 5, 28, 15]]
    found, which = follow_boxes(source, boxes)
    assert found.tolist() == [[10, 5, 18, 15], [18, 5, 26, 15]]
    assert which.tolist() == [0, 2]
    found, which = follow_boxes(source, boxes, 0.4)
    assert found.tolist() == [[10, 5, 18, 15], [14, 5, 18, 15], [18, 5, 26, 15]]
    twice = texrs.SourceMap.from_coordinates(np.concatenate([places, places], axis=1), (40, 40))
    found, which = follow_boxes(twice, [[10, 5, 20, 15, 9]])
    assert found.tolist() == [[10, 5, 20, 15, 9], [50, 5, 60, 15, 9]]
    assert which.tolist() == [0, 0]
    mirrored = texrs.SourceMap.from_coordinates(places[:, ::-1], (40, 40), jacobian=np.float32([[[1, 0], [0, -1]]]))
    assert follow_boxes(mirrored, [[10, 5, 20, 15]])[0].tolist() == [[20, 5, 30, 15]]
    assert follow_boxes(source, [])[0].shape == (0, 4)


def test_a_seed_says_what_comes():
    assert work(5) == work(5)
    assert work(5)[0] != work(6)[0]
    with texrs.threads(1):
        assert work(5) == work(5)


def draw(_: int) -> tuple[int, bytes]:
    made = AUGMENT(IMAGE)
    return made.seed, made.image.tobytes()


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_without_a_seed_each_sample_differs_in_this_process_and_in_forked_workers():
    made = [draw(0) for _ in range(2)]
    if "fork" in multiprocessing.get_all_start_methods():
        with multiprocessing.get_context("fork").Pool(2) as pool:
            made += pool.map(draw, range(4), chunksize=1)
    assert len({seed for seed, _ in made}) == len(made)
    assert len({image for _, image in made}) == len(made)
    assert AUGMENT(IMAGE, seed=made[0][0]).image.tobytes() == made[0][1]


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_every_pixel_is_a_copy_for_all_types(dtype: str):
    sample = texrs.samples.dots((160, 150))
    image = sample.image.astype(dtype) * np.dtype(dtype).type(257 if dtype == "uint16" else 1)
    made = texrs.transforms.TextureAugment()(image, sample.labels, seed=2)
    assert made.image.dtype == image.dtype
    assert (made.image == image[tuple(np.moveaxis(made.source_map.coordinates.astype(int), -1, 0))]).all()


@pytest.mark.parametrize("start", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_workers_make_the_same_however_they_are_started(start: str):
    if start not in multiprocessing.get_all_start_methods():
        pytest.skip(f"this system cannot {start}")
    # Compute here first, so that the thread pool exists when workers are forked.
    expected = [work(seed) for seed in range(3)]
    with multiprocessing.get_context(start).Pool(2) as pool:
        assert pool.map(work, range(3)) == expected


def test_threads_make_the_same_and_others_go_on_meanwhile():
    expected = [work(seed) for seed in range(4)]
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(work, range(4))) == expected
    counted, done = [0], threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            done.wait(0.0005)

    other = threading.Thread(target=count)
    other.start()
    AUGMENT(texrs.samples.pebbles((256, 256)).image, seed=1)
    done.set()
    other.join()
    assert counted[0] > 20


def test_it_can_be_sent_to_a_worker():
    sent = pickle.loads(pickle.dumps(TextureAugment(0.25)))
    assert sent.min_visible == 0.25
    assert repr(sent) == "TextureAugment(min_visible=0.25)"


def test_what_cannot_be_taken_is_said():
    with pytest.raises(InvalidInput, match=r"mask: must have the size of the image, \(96, 96\), got \(95, 96\)"):
        AUGMENT(IMAGE, LABELS[1:])
    with pytest.raises(InvalidInput, match="min_visible: must be a number between 0 and 1"):
        TextureAugment(1.5)


def test_in_a_pipeline_of_albumentations():
    alb = pytest.importorskip("albumentations", reason="is no dependency, for it brings OpenCV")
    from texrs.transforms.albumentations import TextureAugment as Transform

    def pipe() -> object:
        return alb.Compose(
            [Transform(p=1), alb.HorizontalFlip(p=0.5)],
            bbox_params=alb.BboxParams(format="pascal_voc", label_fields=["classes"]),
            seed=7,
        )

    given = {"image": IMAGE, "mask": LABELS, "bboxes": BOXES[:, :4], "classes": BOXES[:, 4]}
    made, again = pipe()(**given), pipe()(**given)
    for name in given:
        assert np.array_equal(made[name], again[name])
    assert not np.array_equal(made["image"], IMAGE)
    assert made["mask"].shape == LABELS.shape
    assert len(made["bboxes"]) == len(made["classes"]) > 3
    for (left, top, right, bottom), label in zip(made["bboxes"], made["classes"], strict=True):
        assert (made["mask"][round(top) : round(bottom), round(left) : round(right)] == label).any()
    both = alb.Compose([Transform(p=1)], seed=1)(image=IMAGE, mask=np.dstack([ROWS, COLUMNS]).astype(np.int32))
    assert np.array_equal(both["image"], IMAGE[both["mask"][..., 0], both["mask"][..., 1]])
    assert Transform(p=1).to_dict()["transform"]["min_visible"] == 0.5


def ask_albumentations(pipe: object, results: object) -> None:
    results.put(pipe(image=IMAGE)["image"].tobytes())


@pytest.mark.parametrize("seed", [None, 5])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_workers_of_albumentations_differ_and_a_seed_repeats_them(seed: int | None):
    alb = pytest.importorskip("albumentations", reason="is no dependency, for it brings OpenCV")
    from texrs.transforms.albumentations import TextureAugment as Transform

    pipe, context = alb.Compose([Transform(p=1)], seed=seed), multiprocessing.get_context("fork")
    found = []
    for name in ("first", "second", "first"):
        results = context.SimpleQueue()
        worker = context.Process(target=ask_albumentations, args=(pipe, results), name=name)
        worker.start()
        found.append(results.get())
        worker.join()
    assert found[0] != found[1]
    assert found[0] == found[2]


def test_in_a_pipeline_of_torchvision():
    torch = pytest.importorskip("torch", reason="is no dependency, for its size")
    pytest.importorskip("torchvision", reason="is no dependency, for its size")
    from PIL import Image
    from torchvision import tv_tensors
    from torchvision.transforms import v2

    from texrs.transforms.torchvision import TextureAugment as Transform

    image = tv_tensors.Image(torch.from_numpy(IMAGE).permute(2, 0, 1))
    corners = torch.from_numpy(BOXES[:, :4].astype(np.float32))
    boxes = tv_tensors.BoundingBoxes(corners, format="XYXY", canvas_size=(SIDE, SIDE))
    boxes = v2.functional.convert_bounding_box_format(boxes, new_format="XYWH")
    target = {
        "boxes": boxes,
        "labels": torch.from_numpy(BOXES[:, 4].astype(np.int64)),
        "masks": tv_tensors.Mask(torch.from_numpy(LABELS)),
        "name": "dots",
    }
    pipe = v2.Compose([Transform(), v2.RandomHorizontalFlip(0.5), v2.ToDtype(torch.float32, scale=True)])
    runs = []
    for _ in range(2):
        torch.manual_seed(4)
        runs.append(pipe(image, target))
    (made, found), (made_again, found_again) = runs
    assert torch.equal(made, made_again)
    assert torch.equal(found["boxes"], found_again["boxes"])
    assert isinstance(made, tv_tensors.Image)
    assert isinstance(found["masks"], tv_tensors.Mask)
    assert found["boxes"].format == tv_tensors.BoundingBoxFormat.XYWH
    assert made.shape == image.shape
    assert found["name"] == "dots"
    assert len(found["boxes"]) == len(found["labels"]) > 3
    for (left, top, width, height), label in zip(found["boxes"].tolist(), found["labels"].tolist(), strict=True):
        part = found["masks"][round(top) : round(top + height), round(left) : round(left + width)]
        assert (part == label).any()
    torch.manual_seed(4)
    picture = Transform()(Image.fromarray(IMAGE))
    assert isinstance(picture, Image.Image)
    torch.manual_seed(4)
    assert np.array_equal(np.asarray(picture), Transform()(image).permute(1, 2, 0).numpy())
