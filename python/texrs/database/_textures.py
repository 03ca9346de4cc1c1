"""Provide `TextureDatabase`: a folder of analysed textures that can be spliced with each other."""

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
from texrs.io.files import as_path
from texrs.papers.splice import splice
from texrs.synthesis import Synthesis

KEPT = 256 << 20
"""Approximate size limit, in bytes, for entries kept in memory during a matrix."""


class AnalyseOptions(TypedDict, total=False):
    """Options of `texrs.elements.analyse`. They are stored, so that an entry can be analysed again."""

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
    """Options of `texrs.splice`, except the two textures and the size."""

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
    """Names of the textures that supply the elements, one for each row of the sheet."""
    columns: tuple[str, ...]
    """Names of the textures that supply the arrangement, one for each column of the sheet."""
    results: Mapping[tuple[str, str], Synthesis]
    """Splices by (row name, column name), or no splices if they were passed to ``each``."""
    sheet: NDArray[np.uint8]
    """Image with thumbnails of all splices, and of the textures along its left and upper edges."""
    failed: Mapping[tuple[str, str], str]
    """Reasons for missing splices, by (row name, column name). Their cells on the sheet are grey."""


class TextureDatabase:
    """A folder with a manifest and one file per texture.

    An entry is analysed again, with a warning, if its image has changed, if it has another version, or if it is
    damaged. Several processes may use a folder at once: files get their names when they are complete, and one process
    at a time writes a texture. If several processes add different images under one name, the first one keeps it.

    Parameters
    ----------
    path : path_like
        Folder. If it is missing, it is created with the first texture, but its parent must exist.
    log : callable, optional
        Function that is called with a sentence if a damaged or outdated file was rebuilt. Default: a Python warning.

    Raises
    ------
    FileError
        The path is not a folder and cannot be created, or the folder has another version.

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
        """Return the analysis of a texture. An outdated or damaged analysis is computed again."""
        return self.analyse(name)

    def list(self) -> list[Record]:
        """Return the records of all textures, sorted by name.

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
        """Analyse a texture and store it.

        Parameters
        ----------
        image : path_like or (H, W[, C]) array
            Image: a path, whose file stays where it is, or pixels, which are copied to the folder.
        name : str, optional
            Name of the texture: up to 100 letters, digits, ``.``, ``_`` and ``-``. Default: the name of the file.
        replace : bool
            If True, an existing texture of this name is replaced. Default: False.
        similarity : bool
            If True, also compute and store the similarity sets, which save time in later refinements. Default: False.
        progress : callable or True, optional
            Function called as ``progress(stage, share)``. If it raises an exception, the work stops. True shows a bar.
        **options
            Options of `texrs.elements.analyse`. They are stored, so that an entry can be analysed again.

            - ``box``: (row, column, height, width) around one element.
            - ``mask``: (H, W) bool, the foreground.
            - ``background``: points, or (H, W) bool, between the elements.
            - ``layout``: "disjoint", "connected" or "jointed".
            - ``points``: (n, 2), the elements.
            - ``search``: an `ElementSearch`.
            - ``method``: None or "paper".
            - ``wrap``: if True, the texture is tileable.
            - ``seed``: seed of the random choices.
            - ``corrections``: corrections, as for `texrs.elements.correct`.

        Returns
        -------
        ElementAnalysis

        Raises
        ------
        InvalidInput
            The name is taken or cannot be a file name, or `texrs.elements.analyse` refuses the image.
        FileError
            The file cannot be read, or the entry cannot be written.

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
        # If no name is given, use the name of the file if it is valid.
        file = os.path.abspath(os.fspath(image)) if isinstance(image, str | os.PathLike) else None
        if name is None:
            if file is None:
                raise InvalidInput("name: is required for an array")
            name = FilePath(file).stem
            if not NAME.fullmatch(name):
                raise InvalidInput(
                    f"image: its file name must consist of letters, digits, '.', '_' and '-', got {name!r}; pass a name"
                )
        if not isinstance(name, str) or not NAME.fullmatch(name):
            raise InvalidInput(f"name: must consist of 1 to 100 letters, digits, '.', '_' and '-', got {name!r}")
        # Reject a taken name before the analysis, which is slow.
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
        """Remove a texture and, if it was added as an array, its pixels. Image files stay.

        Parameters
        ----------
        name : str
            Name of the texture.

        Raises
        ------
        InvalidInput
            The database does not contain the texture.
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
            # Another process removed the texture first, so report that it is missing.
            self._find_record(name)

    def analyse(self, name: str, *, progress: Progress | bool | None = None) -> ElementAnalysis:
        """Return the analysis of a texture.

        The analysis is computed again if its image or version has changed, or if the entry is damaged.

        Parameters
        ----------
        name : str
            Name of the texture.
        progress : callable or True, optional
            Function called as ``progress(stage, share)``. If it raises an exception, the work stops. True shows a bar.

        Returns
        -------
        ElementAnalysis

        Raises
        ------
        InvalidInput
            The database does not contain the texture.
        FileError
            The entry is damaged or outdated, and cannot be analysed again because its image is missing.

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
            reason = f"has version {record.version}, not {FORMAT}"
        else:
            try:
                entry = load(self.path / record.file)
            except TexrsError as error:
                reason = str(error).removeprefix(f"{self.path / record.file}: ")
        # If the image is missing, a valid entry can still be used.
        image = self._read_image(record)
        if image is None:
            if entry is None:
                raise FileError(f"{self.path / record.file}: {reason}, and its image {record.image} is missing")
            return entry
        if entry is not None and hash_image(image) == hash_image(entry.image):
            return entry
        self._folder.warn(f"{name}: analysed again, because its entry {reason or 'belongs to another image'}")
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
        """Splice the elements of one texture into the arrangement of another.

        Parameters
        ----------
        elements : str
            Name of the texture whose elements are shown.
        layout : str
            Name of the texture whose layout the elements take.
        size : (rows, columns), optional
            Size of the result in pixels. Default: the size of ``elements``.
        progress : callable or True, optional
            Function called as ``progress(stage, share)``. If it raises an exception, the work stops. True shows a bar.
        **options
            Options of `texrs.splice`: ``seed``, ``method`` (None, "paper" or "preview"), ``strength``, ``align``,
            ``snap_rows``, ``use_cells``, ``use_nets``, ``allow_rotation``, ``refine``, ``screening``.

        Returns
        -------
        Synthesis

        Raises
        ------
        InvalidInput
            The database does not contain a texture, or `texrs.splice` refuses an argument.

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
        """Splice textures with each other, as in figure 8 of the paper.

        Parameters
        ----------
        rows : sequence of str, optional
            Names of the textures that supply the elements. Default: all.
        columns : sequence of str, optional
            Names of the textures that supply the arrangement. Default: all.
        size : (rows, columns), optional
            Size of each result in pixels. Default: the size of the texture that supplies the elements.
        cell : int
            Side of a thumbnail on the sheet in pixels, 16 to 1024. Default: 160.
        each : callable, optional
            Function called as ``each(a, b, result)`` after each splice, for example to write it. Results are then not
            kept. Memory is limited to one result and about 256 MB of entries, for any number of splices.
        progress : callable or True, optional
            Function called as ``progress("matrix", share)``. If it raises an exception, the work stops. True shows a
            bar.
        **options
            Options of `texrs.splice`: ``seed``, ``method`` (None, "paper" or "preview"), ``strength``, ``align``,
            ``snap_rows``, ``use_cells``, ``use_nets``, ``allow_rotation``, ``refine``, ``screening``.

        Returns
        -------
        Matrix
            Splices, their contact sheet, and the reasons for missing splices, whose cells on the sheet are grey.

        Raises
        ------
        InvalidInput
            The database does not contain a texture, or `texrs.splice` does not have an option.
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
                raise InvalidInput(f"each: must be a function or None, got {each!r}")
            check_call(each, "each", "a", "b", "result")
        side = as_int(cell, "cell", 16, 1024)
        down, across = (self._choose(names, which) for names, which in ((rows, "rows"), (columns, "columns")))
        kept: Cache[str, ElementAnalysis] = Cache(KEPT, count_bytes)
        read = partial(self._read_entry, kept)
        results: dict[tuple[str, str], Synthesis] = {}
        failed: dict[tuple[str, str], str] = {}
        sheet = ContactSheet(len(down), len(across), side)
        # Draw the textures along the left and upper edges of the sheet.
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
                # A limit on time or memory stops the whole matrix. A pair that cannot be spliced is only reported.
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
            if not found:
                raise InvalidInput(
                    f"name: texture {name!r} is not in {self.path}, because this database has no textures"
                )
            there = ", ".join(sorted(found)[:8]) + (", ..." if len(found) > 8 else "")
            raise InvalidInput(f"name: texture {name!r} is not in {self.path}; must be one of {there}")
        return found[name]

    def _choose(self, names: Sequence[str] | None, which: str) -> tuple[str, ...]:
        """Check a list of names of textures. By default, return all names."""
        if isinstance(names, str):
            raise InvalidInput(f"{which}: must be a sequence of names, got {names!r}")
        chosen = []
        for name in self if names is None else as_items(names, which):
            self._find_record(name)
            chosen.append(name)
        if not chosen:
            raise InvalidInput(f"{which}: must contain at least one name, got none")
        return tuple(chosen)

    def _read_entry(self, kept: Cache[str, ElementAnalysis], name: str) -> ElementAnalysis:
        return kept.get_or_make(name, partial(self.analyse, name))

    def _read_image(self, record: Record) -> Array | None:
        try:
            return as_image(io.read(self.path / record.image))
        except TexrsError:
            return None


def count_bytes(entry: ElementAnalysis) -> int:
    """Return the size of an entry's arrays in bytes."""
    arrays = (entry.image, entry.points, entry.mask, entry.scores, entry.angles, entry.scales, entry.sets)
    return sum(array.nbytes for array in arrays if array is not None)
