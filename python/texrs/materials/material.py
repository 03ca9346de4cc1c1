"""Materials, which replace an example in all verbs: aligned maps of one surface, each with its role."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import cast

import numpy as np

from texrs._arrays import as_axes, as_choice, as_float, as_image, as_instance, as_int
from texrs._cache import content_hash
from texrs._notices import Notices, assume, collect
from texrs._progress import listen
from texrs._show import as_png
from texrs._threads import SideBySide
from texrs._typing import Array, Floats, Path, Progress
from texrs.errors import InvalidInput
from texrs.io.files import as_path
from texrs.materials._exports import Exports
from texrs.materials._guide import WEIGHTS, make_guides, take_features
from texrs.materials._labels import REASON, holds_labels
from texrs.materials._map import Map, Space, find_space, split_channels
from texrs.materials._normals import settle_normals
from texrs.materials._roles import Role, as_role
from texrs.materials.applying import look_up
from texrs.materials.conventions import guess_roles, report_guesses
from texrs.source_map import SourceMap

__all__ = ["Material"]

CHANNELS: dict[Role, tuple[int, ...]] = {
    **{role: (2, 3, 4) if role.normal else (3, 4) for role in Role if role.layout},
    Role.METALLIC_SMOOTHNESS: (2, 4),
    Role.VECTOR: (2, 3),
    Role.LABELS: (1,),
}
"""Allowed numbers of channels of maps, by role. Other roles allow any number."""
AT_ONCE = 2
"""Maximum number of maps that are computed in parallel. Each needs up to 0.4 GB in addition to its result."""
SHOWN = 512
"""Maximum length of the longer side of previews in notebooks, in pixels."""


class MissingMap(InvalidInput, KeyError):
    """A material has no map of a name. Methods of `Mapping`, such as ``get``, look for a KeyError."""

    __str__ = Exception.__str__  # A KeyError shows its message in quotes.


class Material(Exports):
    """Maps of one surface by name, such as albedo, normals and heights, aligned pixel by pixel.

    A material can replace an example in `texrs.design`, `texrs.tile`, `texrs.inpaint` and all other verbs. They decide
    from all maps together (`guide`), and apply one source map to every map, so that the maps stay aligned. Colours and
    heights are blended, normals are rotated and normalised, and labels and masks are never mixed.

    Parameters
    ----------
    maps : mapping of str to array or Map
        Maps by name, all of the same size. The name gives the role (see `texrs.materials.guess_role`), unless
        ``roles`` does. Integers that form regions of unrelated values are read as labels if neither gives a role, and
        `notices` reports it.
    roles : mapping of str to Role or str, optional
        Roles of maps whose names give no role or a wrong role. Default: None.
    spaces : mapping of str to {"srgb", "linear"}, optional
        Colour encoding of maps. Default: "srgb" for integer colours and emission, and "linear" for everything else.
    weights : mapping of str to float, optional
        Weights of maps for decisions, 0 to 100. Default: 1 for colours and normals, 0.75 for heights, 0.5 for
        roughness, metallic, occlusion, opacity, emission and masks, 0.25 for other maps, and 0 for labels.
    axes : int
        Number of spatial axes: 2 for images, 3 for volumes. Default: 2.

    Raises
    ------
    InvalidInput
        Maps are missing, sizes differ, a name gives no role, or a map does not fit its role.

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((64, 64)).image
    >>> stones = texrs.Material({"albedo": pebbles, "height": pebbles[..., 1].astype("float32") / 255})
    >>> stones
    <Material of 64 x 64: albedo (colour, uint8), height (height, float32)>
    >>> made = texrs.design(stones, (96, 128)).material
    >>> {name: each.pixels.shape for name, each in made.items()}
    {'albedo': (96, 128, 3), 'height': (96, 128)}

    """

    def __init__(
        self,
        maps: Mapping[str, Array | Map],
        *,
        roles: Mapping[str, Role | str] | None = None,
        spaces: Mapping[str, Space] | None = None,
        weights: Mapping[str, float] | None = None,
        axes: int = 2,
    ) -> None:
        if not isinstance(maps, Mapping) or not maps:
            raise InvalidInput("maps: must be a mapping of names to arrays, with at least one entry")
        self._axes = as_int(axes, "axes", 2, 3)
        for option, given in (("roles", roles), ("spaces", spaces), ("weights", weights)):
            if given is not None and not isinstance(given, Mapping):
                raise InvalidInput(f"{option}: must be a mapping whose keys are names of maps, got {given!r}")
        said, how, share = dict(roles or {}), dict(spaces or {}), dict(weights or {})
        for option, given in (("roles", said), ("spaces", how), ("weights", share)):
            if unknown := given.keys() - maps.keys():
                raise InvalidInput(f"{option}: must name maps ({', '.join(maps)}), got {sorted(unknown)[0]!r}")
        # Arrays get their roles from their names. `Map` objects already have a role.
        new = [name for name, each in maps.items() if not isinstance(each, Map)]
        guessed, why = guess_roles([str(name) for name in new])
        with collect() as self._notices:
            self._maps = {
                name: self._check(name, each, guessed.get(name), said.get(name), how.get(name))
                for name, each in maps.items()
            }
        sizes = {name: each.pixels.shape[: self._axes] for name, each in self._maps.items()}
        self._shape = next(iter(sizes.values()))
        for name, size in sizes.items():
            if size != self._shape:
                raise InvalidInput(
                    f"maps: must all have the same size, but {name} has {size} and {next(iter(sizes))} has {self._shape}"
                )
        with collect() as settled:
            report_guesses(why, guessed, said)
            # The caller named the arrays, so treat their y direction as stated.
            self._settle(new, new)
        self._notices.assumed.extend(settled.assumed)
        self._weights = {name: as_float(w, f"weights[{name!r}]", 0, 100) for name, w in share.items()}
        if len(self) > 1 and not any(self._weights.get(name, WEIGHTS[each.role]) for name, each in self.items()):
            raise InvalidInput("weights: must not all be 0")

    def _check(
        self, name: str, value: Array | Map, guessed: Role | None, role: Role | str | None, space: Space | None
    ) -> Map:
        pixels = value.pixels if isinstance(value, Map) else value
        image = as_image(pixels, name, axes=self._axes)
        known = value.role if isinstance(value, Map) else guessed
        chosen = known if role is None else as_role(role, f"roles[{name!r}]")
        if chosen is None and holds_labels(image, self._axes):
            chosen = Role.LABELS
            assume(f"{name}: read as {REASON}")
        if chosen is None:
            raise InvalidInput(
                f"{name}: the name does not indicate the role of the map; give roles, such as {name!r}: 'other'"
            )
        allowed = CHANNELS.get(chosen)
        if allowed is not None and image.shape[-1] not in allowed:
            counts = re.sub(", (?=.$)", " or ", ", ".join(map(str, allowed)))
            raise InvalidInput(
                f"{name}: a map of role {chosen.value} must have {counts} channels, got {image.shape[-1]}"
            )
        if self._axes == 3 and chosen.normal and (chosen.bare or image.shape[-1] < 3):
            raise InvalidInput(f"{name}: normals of a volume must have x, y and z, got {image.shape[-1]} channels")
        if chosen.normal and image.shape[-1] == 2:
            chosen = Role.NORMAL_DX_XY if chosen.down else Role.NORMAL_XY
        usual = find_space(chosen, image.dtype)
        if isinstance(value, Map) and chosen == value.role:
            usual = value.space
        if space is not None:
            as_choice(space, f"spaces[{name!r}]", ("srgb", "linear"))
        kept = image if np.ndim(pixels) > self._axes else image[..., 0]
        if isinstance(value, Map):
            return replace(value, pixels=kept, role=chosen, space=space or usual)
        return Map(kept, chosen, space or usual)

    def _settle(self, names: Collection[str], said: Collection[str]) -> None:
        """Set the role of normal maps (with or without z, y up or down) according to their values."""
        if self._axes == 2:
            self._maps |= settle_normals(self._maps, names, said)

    @classmethod
    def read(
        cls, path: Path | Sequence[Path], *, roles: Mapping[str, Role | str] | None = None, axes: int = 2
    ) -> Material:
        """Read a material from the files of a folder or the layers of an EXR file, by their usual names.

        Parameters
        ----------
        path : path_like, or a list of path_like
            Folder, list of files of one folder, or EXR file with several layers.
        roles : mapping of str to Role or str, optional
            Roles by file name, with or without the suffix, or by layer name. Default: None, which
            derives the roles from the names.
        axes : int
            Number of spatial axes: 2 for images, 3 for volumes. Default: 2.

        Returns
        -------
        Material
            Material whose maps are named after the files or layers, without their common beginning (``albedo`` for
            ``rock_albedo``). `save` writes the complete names. The values of normals decide whether they are read
            without z or with y down, unless a name or ``roles`` states otherwise. `notices` reports this.

        Raises
        ------
        FileError
            ``path`` is neither a folder nor a list of files nor an EXR file, contains no map, or cannot be read.
        InvalidInput
            Maps differ in size, or ``roles`` names a missing file or layer.

        Warns
        -----
        InputWarning
            Files, subfolders or layers are not used, for example because the name gives no role or the format is not
            supported. `notices` contains the reasons. Hidden files, texts, reports and mipmaps are not reported.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> pebbles = texrs.samples.pebbles((64, 64)).image
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     texrs.io.write(f"{folder}/stones_2k_albedo.png", pebbles)
        ...     texrs.io.write(f"{folder}/stones_2k_height.png", pebbles[..., 1])
        ...     texrs.Material.read(folder)
        <Material of 64 x 64: albedo (colour, uint8), height (height, uint8)>

        """
        from texrs.materials._exr import read_exr
        from texrs.materials.files import read_maps

        axes = as_axes(axes)
        place = None if isinstance(path, list | tuple) else as_path(cast(Path, path))
        if roles is not None and not isinstance(roles, Mapping):
            raise InvalidInput(f"roles: must be a mapping of names to roles, got {roles!r}")
        with collect() as notices:
            if place is not None and place.suffix.lower() == ".exr" and not place.is_dir():
                if axes != 2:
                    raise InvalidInput(f"axes: must be 2, because the layers of {path} are images; got {axes}")
                layers, found, weights = read_exr(place, dict(roles or {}))
                made = cls(layers, roles=found, weights=weights)
            else:
                maps, stated = read_maps(path, dict(roles or {}), axes)
                made = cls(maps, axes=axes)
                made._settle(maps, stated)
        made._notices = notices
        return made

    # --- the maps ----------------------------------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Map:
        """Return a map by its name."""
        try:
            return self._maps[name]
        except (KeyError, TypeError):
            raise MissingMap(f"name: must be one of {', '.join(self._maps)}; got {name!r}") from None

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the maps."""
        return iter(self._maps)

    def __len__(self) -> int:
        """Return the number of maps."""
        return len(self._maps)

    def __repr__(self) -> str:
        """Return a description with the size, and the name, role and dtype of each map."""
        maps = ", ".join(f"{name} ({each.role.value}, {each.pixels.dtype})" for name, each in self.items())
        return f"<Material of {' x '.join(map(str, self._shape))}: {maps}>"

    def _repr_png_(self) -> bytes:
        """Return a PNG preview of the lit material for notebooks, or of the middle plane of a volume."""
        if self._axes == 3:
            return as_png(self.base[self._shape[0] // 2])
        return as_png(self.preview(tiles=(1, 1), side=SHOWN))

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of samples along each spatial axis."""
        return self._shape

    @property
    def axes(self) -> int:
        """Number of spatial axes: 2 for images, 3 for volumes."""
        return self._axes

    @property
    def notices(self) -> Notices:
        """Notices from reading the maps, as sentences in the lists ``ignored`` and ``assumed``."""
        return self._notices

    @property
    def weights(self) -> Mapping[str, float]:
        """Weights of maps for decisions, as given by the caller. Other maps have the default weights of their roles."""
        return MappingProxyType(self._weights)

    @property
    def base(self) -> Array:
        """The map that represents the material: its colour map, or else its first map."""
        return self[self.base_name].pixels

    @property
    def base_name(self) -> str:
        """Name of the map that `base` returns."""
        return self.find(Role.COLOUR) or next(iter(self))

    @cached_property
    def key(self) -> str:
        """Digest of the maps, their roles and their weights."""
        parts = [(name, each.role.value, each.space) for name, each in self.items()]
        return content_hash(self._axes, parts, sorted(self._weights.items()), *(m.pixels for m in self.values())).hex()

    def find(self, role: Role | str) -> str | None:
        """Return the name of the first map with a role, or None.

        Parameters
        ----------
        role : Role or str
            Role of the map.

        Returns
        -------
        str or None

        Raises
        ------
        InvalidInput
            The role does not exist.

        Examples
        --------
        >>> import numpy as np
        >>> import texrs
        >>> texrs.Material({"rock_nor_gl": np.zeros((8, 8, 3), np.uint8)}).find("normal")
        'rock_nor_gl'

        """
        wanted = as_role(role, "role")
        return next((name for name, each in self.items() if each.role is wanted), None)

    def replace(self, **maps: Array) -> Material:
        """Return a copy of the material with new values in some of its maps.

        Parameters
        ----------
        **maps : (H, W), (H, W, C), (D, H, W) or (D, H, W, C) array
            New pixels by name of the map. Roles do not change.

        Returns
        -------
        Material

        Raises
        ------
        InvalidInput
            A map does not exist, or the size of the new pixels differs.

        Examples
        --------
        >>> import numpy as np
        >>> import texrs
        >>> flat = texrs.Material({"height": np.zeros((8, 8), np.float32)})
        >>> float(flat.replace(height=np.ones((8, 8), np.float32))["height"].pixels.max())
        1.0

        """
        for name in maps:
            if name not in self:
                raise InvalidInput(f"maps: must name maps of the material ({', '.join(self)}), got {name!r}")
        changed = {name: replace(each, pixels=maps[name]) if name in maps else each for name, each in self.items()}
        return Material(changed, weights=self._weights, axes=self._axes)

    def flatten_lighting(
        self, amount: float = 1.0, *, wrap: bool | tuple[bool, bool] = False, size: float | None = None
    ) -> Material:
        """Return the material with uneven light removed from its colours. Other maps do not change.

        Parameters
        ----------
        amount : float
            Fraction of the unevenness to remove, 0 to 1. Default: 1.
        wrap : bool or (bool, bool)
            Axes along which the maps are periodic. They remain periodic. Default: False.
        size : float, optional
            Minimum size in pixels, at least 4, of variations that are treated as light (see
            `texrs.materials.flatten_lighting`). Default: a quarter of the shorter side.

        Returns
        -------
        Material

        Raises
        ------
        InvalidInput
            The material is a volume, or ``amount`` or ``size`` is invalid.

        Examples
        --------
        >>> import numpy as np
        >>> import texrs
        >>> ramp = np.tile(np.linspace(100, 180, 64).astype(np.uint8), (48, 1))
        >>> lawn = texrs.Material({"albedo": ramp, "height": ramp}).flatten_lighting()
        >>> int(np.ptp(lawn["albedo"].pixels)) <= 4, int(np.ptp(lawn["height"].pixels))
        (True, 80)

        """
        from texrs._lighting_correction import flatten_lighting

        self._check_flat()
        even = {
            name: flatten_lighting(each.pixels, amount, wrap=wrap, size=size, space=each.space)
            for name, each in self.items()
            if each.role is Role.COLOUR
        }
        return self.replace(**even)

    # --- what is decided on, and what is made --------------------------------------------------------------------------

    @property
    def guide(self) -> Array:
        """Guide image for the decisions of verbs, (..., C) uint16: up to three combinations of all maps.

        If there is only one map, the guide is this map, unchanged.
        """
        return guide_materials([self])[0]

    def features(self) -> list[Floats]:
        """Return the features of each map, multiplied by its weight, on comparable scales.

        Returns
        -------
        list of (..., F) float32
            One array for each map whose weight is above 0, of the size of the material.

        Examples
        --------
        >>> import numpy as np
        >>> import texrs
        >>> flat = np.full((8, 8, 3), (128, 128, 255), np.uint8)
        >>> [f.shape for f in texrs.Material({"albedo": flat, "normal": flat}).features()]
        [(8, 8, 3), (8, 8, 2)]

        """
        found = []
        for name, each in self.items():
            weight = self._weights.get(name, WEIGHTS[each.role])
            if weight > 0:
                parts = [p for p in split_channels(each, self._axes) if p.role is not Role.LABELS or p is each]
                taken = [take_features(p.pixels, p.role, p.space, self._axes) for p in parts]
                found.append(np.float32(weight) * (taken[0] if len(taken) == 1 else np.concatenate(taken, axis=-1)))
        return found

    def apply(self, source: SourceMap, *, progress: Progress | bool | None = None) -> Material:
        """Apply a source map to this material, with the finish that the verb used.

        Parameters
        ----------
        source : SourceMap
            Source map from one exemplar of the size of this material.
        progress : callable or True, optional
            Function that is called as ``progress(stage, share)``, with a share from 0 to 1. An exception that it
            raises stops the work. True shows a progress bar. Default: None.

        Returns
        -------
        Material
            Material with the same names, roles and dtypes of maps.

        Raises
        ------
        InvalidInput
            The source map has several exemplars, or an exemplar of another size.

        Examples
        --------
        >>> import numpy as np
        >>> import texrs
        >>> stones = texrs.Material({"height": np.arange(12, dtype=np.uint16).reshape(3, 4)})
        >>> bool((stones.apply(texrs.SourceMap.identity((3, 4)))["height"].pixels == stones["height"].pixels).all())
        True

        """
        progress = listen(progress)
        return apply_materials([self], as_instance(source, "source", SourceMap), progress)


def guide_materials(materials: Sequence[Material]) -> list[Array]:
    """Return guide images of materials with the same maps, on a common scale."""
    check_alike(materials)
    first = materials[0]
    if len(first) == 1:
        # A single map is its own guide image.
        return [np.asarray(next(iter(m.values())).pixels) for m in materials]
    # Use 16 bits, which need half the memory of floats and give the same values on every processor.
    return [
        np.rint(guide * np.float32(65535)).astype(np.uint16) for guide in make_guides([m.features() for m in materials])
    ]


def apply_materials(materials: Sequence[Material], source: SourceMap, progress: Progress | None = None) -> Material:
    """Apply a source map with one exemplar per material to all of their maps."""
    check_alike(materials)
    first, made = materials[0], dict[str, Map]()
    finish = source.finish
    if finish is not None and finish.flatten_lighting:
        # Remove uneven light from the colours here, because only the maps of a material state which are colours and
        # how they are encoded.
        materials, finish = [m.flatten_lighting() for m in materials], replace(finish, flatten_lighting=False)
    names = list(first)

    def make(name: str, watch: Callable[[float], object]) -> Array:
        return look_up(source, [m[name] for m in materials], finish, watch)

    def tell(number: int, share: float) -> None:
        if progress is not None:
            progress(f"map {names[number]}", (number + share) / len(names))

    with SideBySide(AT_ONCE) as beside:
        for name, pixels in zip(names, beside.do(make, names, tell), strict=True):
            made[name] = replace(first[name], pixels=pixels)
    return Material(made, weights=first._weights, axes=first.axes)


def check_alike(materials: Sequence[Material]) -> None:
    """Check that materials have the same maps with the same roles, dtypes and channels."""
    first = materials[0]
    for other in materials[1:]:
        if list(other) != list(first):
            raise InvalidInput(
                f"exemplars: must be materials with the same maps, got {', '.join(first)} and {', '.join(other)}"
            )
        for name, each in first.items():
            theirs = other[name]
            mine, its = ((m.role.value, str(m.pixels.dtype), m.channels) for m in (each, theirs))
            if mine != its:
                raise InvalidInput(
                    f"exemplars: the map {name!r} must have the same role, dtype and channels in all materials, got "
                    f"{mine} and {its}"
                )
