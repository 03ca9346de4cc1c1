"""A folder of analysed textures, and what can be spliced from it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path as FilePath
from typing import Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from texrs import io
from texrs._arrays import as_bool, as_image, as_int, as_items
from texrs._cache import Cache
from texrs._calls import check_call
from texrs._progress import answering, listen
from texrs._typing import Array, Path, Progress
from texrs.database._contact_sheet import ContactSheet
from texrs.database._folder import NAME, Folder, Record, check_free, restore_option
from texrs.elements import FORMAT, ElementAnalysis, ElementSearch, Layout, LayoutName, analyse, hash_image, load
from texrs.errors import FileError, InvalidInput, LimitExceeded, TexrsError
from texrs.io._files import as_path
from texrs.papers.splice import splice
from texrs.synthesis import Synthesis

KEPT = 256 << 20
"""Bytes of entries that are kept while all are spliced with all, about."""


class AnalyseOptions(TypedDict, total=False):
    """What `texrs.elements.analyse` takes, and an entry is remade with."""

    box: Sequence[float] | None
    mask: object
    background: object
    layout: Layout | LayoutName | None
    points: object
    search: ElementSearch
    method: Literal["paper"] | None
    wrap: bool | Sequence[bool]
    seed: int
    corrections: Sequence[Mapping[str, object]] | None


class SpliceOptions(TypedDict, total=False):
    """What `texrs.splice` takes besides two textures and a size."""

    seed: int
    method: Literal["paper", "preview"] | None
    strength: float
    align: bool
    snap_rows: bool
    use_cells: bool | None
    use_nets: bool | None
    allow_rotation: bool | None
    refine: bool
    screening: float | None


@dataclass(frozen=True, slots=True, eq=False)
class Matrix:
    """Splices of several textures with each other."""

    rows: tuple[str, ...]
    """Those that give their elements."""
    columns: tuple[str, ...]
    """Those that give their arrangement."""
    results: Mapping[tuple[str, str], Synthesis]
    """All of them, but for those that were passed on as they were made."""
    sheet: NDArray[np.uint8]
    """All of them in a picture, the textures themselves along its left and its upper edge."""
    failed: Mapping[tuple[str, str], str]
    """Why some could not be made; their places on the sheet are grey."""


class TextureDatabase:
    """A folder with a manifest and one file a texture.

    An entry is remade when its image has changed, when it is of another version, and when it is damaged, which is said.
    Several processes may use a folder at once: files take their names when they are whole, and one process at a time
    writes a texture. Of several that add different images by one name the first to write keeps it.

    Parameters
    ----------
    path : path_like
        The folder; if it is not there it is made, in a folder that is, when the first texture is kept.
    log : callable, optional
        Called with a sentence when something had to be remade; by default a warning is given.

    Raises
    ------
    FileError
        It is no folder and cannot be made, or is of a later version.

    Examples
    --------
    >>> import tempfile
    >>> from texrs import TextureDatabase, samples
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     textures = TextureDatabase(folder)
    ...     dots = samples.load("dots", size=(96, 96))
    ...     _ = textures.add(dots.image, "dots", mask=dots.mask, layout="disjoint")
    ...     [(record.name, str(record.layout)) for record in textures.list()]
    [('dots', 'disjoint')]

    """

    def __init__(self, path: Path, *, log: Callable[[str], object] | None = None) -> None:
        self.path = as_path(path)
        self._folder = Folder(self.path, log)
        self._folder.read()

    def __repr__(self) -> str:
        return f"TextureDatabase({str(self.path)!r}, {len(self)} textures)"

    def __len__(self) -> int:
        return len(self._folder.read())

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._folder.read()))

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self._folder.read()

    def __getitem__(self, name: str) -> ElementAnalysis:
        """Return an entry, remade if it has to be."""
        return self.analyse(name)

    def list(self) -> list[Record]:
        """Return what the manifest says of all textures, by name.

        Returns
        -------
        list of Record

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     shelf = texrs.TextureDatabase(folder)
        ...     _ = shelf.add(texrs.samples.dots((96, 96)).image, "dots", layout="disjoint")
        ...     [record.name for record in shelf.list()]
        ['dots']

        """
        found = self._folder.read()
        return [found[name] for name in sorted(found)]

    def add(
        self,
        image: object,
        name: str | None = None,
        *,
        replace: bool = False,
        similarity: bool = False,
        progress: Progress | bool | None = None,
        **options: Unpack[AnalyseOptions],
    ) -> ElementAnalysis:
        """Analyse a texture and keep it.

        Parameters
        ----------
        image : path_like or (H, W[, C]) array
            A file, which stays where it is, or pixels, of which a copy is kept.
        name : str, optional
            Letters, digits, ``.``, ``_`` and ``-``; by default that of the file.
        replace : bool
            Whether another texture of that name may be replaced.
        similarity : bool
            Whether the similarity sets are made now and kept too: refinements then need not make them.
        progress : callable or True, optional
            Called as ``progress(stage, share)``; raising stops the work. True shows a bar.
        **options
            What `texrs.elements.analyse` takes: ``box`` (row, column, height, width) around one element; ``mask`` (H, W) bool,
            the foreground; ``background``, points or (H, W) bool between the elements; ``layout`` ("disjoint", "connected"
            or "jointed"); ``points`` (n, 2), the elements; ``search``, an `ElementSearch`; ``method`` (None or "paper");
            ``wrap``, whether the texture repeats; ``seed``; ``corrections``, as `texrs.elements.correct` takes them. They are
            kept, and an entry is made anew with them.

        Returns
        -------
        ElementAnalysis

        Raises
        ------
        InvalidInput
            A name that is taken or cannot be that of a file, or what `texrs.elements.analyse` refuses.
        FileError
            The file cannot be read, or the entry not written.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     shelf = texrs.TextureDatabase(folder)
        ...     str(shelf.add(texrs.samples.dots((96, 96)).image, "dots", layout="disjoint").layout)
        'disjoint'

        """
        progress = listen(progress)
        unknown = sorted(set(options) - AnalyseOptions.__annotations__.keys())
        if unknown:
            raise InvalidInput(
                f"{unknown[0]}: is not an option; must be one of {', '.join(sorted(AnalyseOptions.__annotations__))}"
            )
        file = os.path.abspath(os.fspath(image)) if isinstance(image, str | os.PathLike) else None
        if name is None:
            if file is None:
                raise InvalidInput("name: is needed for an array")
            name = FilePath(file).stem
            if not NAME.fullmatch(name):
                raise InvalidInput(
                    f"image: {name!r} cannot be the name of a texture, which has letters, digits, '.', '_' and '-'; "
                    "give a name"
                )
        if not isinstance(name, str) or not NAME.fullmatch(name):
            raise InvalidInput(f"name: letters, digits, '.', '_' and '-' are allowed, up to 100; got {name!r}")
        pixels = as_image(image) if file is None else io.read(file)
        if not as_bool(replace, "replace"):
            check_free(self._folder.read(), name, hash_image(pixels))
        entry = analyse(pixels, progress=progress, **options)
        if similarity:
            entry = entry.with_similarity()
        return self._folder.keep(
            name,
            entry,
            f"{name}.npy" if file is None else file,
            {**options, "similarity": similarity} if similarity else options,
            pixels=pixels if file is None else None,
            replace_other=replace,
        )

    def remove(self, name: str) -> None:
        """Forget a texture: its entry, and the copy of pixels that were given as an array; image files stay.

        Parameters
        ----------
        name : str
            What it is called.

        Raises
        ------
        InvalidInput
            There is no such texture.
        FileError
            The folder cannot be written to.

        Examples
        --------
        >>> import tempfile
        >>> from texrs import TextureDatabase, samples
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     textures = TextureDatabase(folder)
        ...     dots = samples.load("dots", size=(96, 96))
        ...     _ = textures.add(dots.image, "dots", mask=dots.mask, layout="disjoint")
        ...     textures.remove("dots")
        ...     len(textures)
        0

        """
        try:
            gone = self._folder.drop(self._find_record(name).name)
        except OSError as error:
            raise FileError(f"{self.path}: {name} cannot be removed ({error.strerror})") from None
        if not gone:
            # Another process was quicker.
            self._find_record(name)

    def analyse(self, name: str, *, progress: Progress | bool | None = None) -> ElementAnalysis:
        """Return an entry, made anew if its image or the version is another one, or if it is damaged.

        Parameters
        ----------
        name : str
            Of the texture.
        progress : callable or True, optional
            Called as ``progress(stage, share)``; raising stops the work. True shows a bar.

        Returns
        -------
        ElementAnalysis

        Raises
        ------
        InvalidInput
            There is no such texture.
        FileError
            The entry cannot be made anew either, because its image is gone.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     shelf = texrs.TextureDatabase(folder)
        ...     _ = shelf.add(texrs.samples.dots((96, 96)).image, "dots", layout="disjoint")
        ...     shelf.analyse("dots").image.shape
        (96, 96, 3)

        """
        progress = listen(progress)
        record = self._find_record(name)
        entry: ElementAnalysis | None = None
        reason = ""
        if record.version != FORMAT:
            reason = f"is of version {record.version}, this is {FORMAT}"
        else:
            try:
                entry = load(self.path / record.file)
            except TexrsError as error:
                reason = str(error).removeprefix(f"{self.path / record.file}: ")
        image = self._read_image(record)
        if image is None:
            if entry is None:
                raise FileError(f"{self.path / record.file}: {reason}, and its image {record.image} is gone")
            return entry
        if entry is not None and hash_image(image) == hash_image(entry.image):
            return entry
        self._folder.warn(f"{name}: made anew, for the entry {reason or 'is of another image'}")
        options = {k: restore_option(v) for k, v in record.options.items()}
        similar = bool(options.pop("similarity", False))
        entry = analyse(image, progress=progress, **options)
        return self._folder.keep(name, entry.with_similarity() if similar else entry, record.image, record.options)

    def splice(
        self,
        elements: str,
        layout: str,
        size: Sequence[int] | None = None,
        *,
        progress: Progress | bool | None = None,
        **options: Unpack[SpliceOptions],
    ) -> Synthesis:
        """Return the elements of one texture in the arrangement of another.

        Parameters
        ----------
        elements : str
            Name of the texture whose elements are shown.
        layout : str
            Name of the texture whose layout they take.
        size : (rows, columns), optional
            Of the result, in pixels; that of ``elements`` by default.
        progress : callable or True, optional
            Called as ``progress(stage, share)``; raising stops the work. True shows a bar.
        **options
            What `texrs.splice` takes: ``seed``, ``method`` (None, "paper" or "preview"), ``strength``,
            ``align``, ``snap_rows``, ``use_cells``, ``use_nets``, ``allow_rotation``, ``refine``, ``screening``.

        Returns
        -------
        Synthesis

        Raises
        ------
        InvalidInput
            There is no such texture, or what `texrs.splice` refuses.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     shelf = texrs.TextureDatabase(folder)
        ...     for name in ("dots", "pebbles"):
        ...         _ = shelf.add(texrs.samples.load(name, size=(96, 96)).image, name, layout="disjoint")
        ...     shelf.splice("dots", "pebbles", seed=1).image.shape
        (96, 96, 3)

        """
        progress = listen(progress)
        return splice(self.analyse(elements), self.analyse(layout), size, progress=progress, **options)

    def matrix(
        self,
        rows: Sequence[str] | None = None,
        columns: Sequence[str] | None = None,
        *,
        size: Sequence[int] | None = None,
        cell: int = 160,
        each: Callable[[str, str, Synthesis], object] | None = None,
        progress: Progress | bool | None = None,
        **options: Unpack[SpliceOptions],
    ) -> Matrix:
        """Splice textures with each other, as figure 8 of the paper shows it.

        Parameters
        ----------
        rows : sequence of str, optional
            Names of the textures whose elements are shown. By default all.
        columns : sequence of str, optional
            Names of the textures whose arrangement they take. By default all.
        size : (rows, columns), optional
            Of each result.
        cell : int
            Side of a picture on the sheet, 16 to 1024.
        each : callable, optional
            Called as ``each(a, b, result)`` with each splice when it is made, to write it, say: then none is kept, and memory
            is that of one and of about 256 MB of entries, however many there are.
        progress : callable or True, optional
            Called as ``progress("matrix", share)``; raising stops the work. True shows a bar.
        **options
            What `texrs.splice` takes: ``seed``, ``method`` (None, "paper" or "preview"), ``strength``,
            ``align``, ``snap_rows``, ``use_cells``, ``use_nets``, ``allow_rotation``, ``refine``, ``screening``.

        Returns
        -------
        Matrix
            What could not be spliced is named with the reason, and grey on the sheet.

        Raises
        ------
        InvalidInput
            There is no such texture, or an option that `texrs.splice` has not.
        Cancelled
            The work was stopped.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     shelf = texrs.TextureDatabase(folder)
        ...     for name in ("dots", "pebbles"):
        ...         _ = shelf.add(texrs.samples.load(name, size=(96, 96)).image, name, layout="disjoint")
        ...     sorted(shelf.matrix(["dots"], ["pebbles"], cell=32, seed=1).results)
        [('dots', 'pebbles')]

        """
        progress = listen(progress)
        if each is not None:
            if not callable(each):
                raise InvalidInput(f"each: needs a function to call, or None; got {each!r}")
            check_call(each, "each", "a", "b", "result")
        side = as_int(cell, "cell", 16, 1024)
        down, across = (self._choose(names, which) for names, which in ((rows, "rows"), (columns, "columns")))
        kept: Cache[str, ElementAnalysis] = Cache(KEPT, count_bytes)
        read = partial(self._read_entry, kept)
        results: dict[tuple[str, str], Synthesis] = {}
        failed: dict[tuple[str, str], str] = {}
        sheet = ContactSheet(len(down), len(across), side)
        for j, b in enumerate(across, start=1):
            with answering(progress, "matrix", 0.0):
                sheet.put(0, j, read(b).image)
        for i, a in enumerate(down, start=1):
            with answering(progress, "matrix", (i - 1) / len(down)):
                sheet.put(i, 0, read(a).image)
            for j, b in enumerate(across, start=1):
                share = ((i - 1) * len(across) + j - 1) / (len(down) * len(across))
                if progress is not None:
                    progress("matrix", share)
                try:
                    with answering(progress, "matrix", share):
                        made = splice(read(a), read(b), size, **options)
                except LimitExceeded:
                    raise
                except InvalidInput as error:
                    failed[a, b] = str(error)
                    sheet.put(i, j, None)
                    continue
                sheet.put(i, j, made.image)
                if each is None:
                    results[a, b] = made
                else:
                    each(a, b, made)
        return Matrix(down, across, results, sheet.picture, failed)

    # --- the folder ----------------------------------------------------------------------------------------------

    def _find_record(self, name: str) -> Record:
        found = self._folder.read()
        if not isinstance(name, str) or name not in found:
            there = ", ".join(sorted(found)[:8]) or "none"
            raise InvalidInput(f"name: there is no texture {name!r} in {self.path}; there are {there}")
        return found[name]

    def _choose(self, names: Sequence[str] | None, which: str) -> tuple[str, ...]:
        """Return names that are there; all by default."""
        if isinstance(names, str):
            raise InvalidInput(f"{which}: needs several names, got {names!r}")
        chosen = []
        for name in self if names is None else as_items(names, which):
            self._find_record(name)
            chosen.append(name)
        if not chosen:
            raise InvalidInput(f"{which}: no textures to splice")
        return tuple(chosen)

    def _read_entry(self, kept: Cache[str, ElementAnalysis], name: str) -> ElementAnalysis:
        return kept.get_or_make(name, partial(self.analyse, name))

    def _read_image(self, record: Record) -> Array | None:
        try:
            return as_image(io.read(self.path / record.image))
        except TexrsError:
            return None


def count_bytes(entry: ElementAnalysis) -> int:
    """Return the bytes of the arrays of an entry."""
    arrays = (entry.image, entry.points, entry.mask, entry.scores, entry.angles, entry.scales, entry.sets)
    return sum(array.nbytes for array in arrays if array is not None)
