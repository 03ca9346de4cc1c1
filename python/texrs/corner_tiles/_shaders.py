"""Short shaders that look tiles up in game engines."""

from __future__ import annotations

from pathlib import Path

from texrs.io import atomic

__all__ = ["write_shaders"]

GLSL = """\
// Unbounded texture of corner tiles. {atlas} contains 9 x 9 tiles, each of which fits its neighbours. index.png selects
// the tile of each cell; read it without filtering. uv counts cells: one tile is 1 x 1.
vec4 endless(sampler2D atlas, sampler2D index, vec2 uv) {{
    ivec2 cells = textureSize(index, 0);
    ivec2 cell = ivec2(mod(floor(uv), vec2(cells)));
    int tile = int(texelFetch(index, cell, 0).r * 255.0 + 0.5);
    vec2 corner = vec2(tile % 9, tile / 9);
    // Use the derivatives of uv, because positions in the atlas jump from tile to tile.
    return textureGrad(atlas, (corner + fract(uv)) / 9.0, dFdx(uv) / 9.0, dFdy(uv) / 9.0);
}}
"""
GODOT = """\
// Unbounded texture of corner tiles for Godot 4. Set atlas ({atlas}) with mipmaps and index (index.png) without filter.
shader_type spatial;
uniform sampler2D atlas : source_color, repeat_enable, filter_linear_mipmap;
uniform sampler2D index : repeat_enable, filter_nearest;
uniform float scale = 8.0;

void fragment() {{
    vec2 uv = UV * scale;
    ivec2 cells = textureSize(index, 0);
    ivec2 cell = ivec2(mod(floor(uv), vec2(cells)));
    int tile = int(texelFetch(index, cell, 0).r * 255.0 + 0.5);
    vec2 corner = vec2(float(tile % 9), float(tile / 9));
    ALBEDO = textureGrad(atlas, (corner + fract(uv)) / 9.0, dFdx(uv) / 9.0, dFdy(uv) / 9.0).rgb;
}}
"""


def write_shaders(folder: Path, atlas: str) -> list[Path]:
    """Write the shaders to a folder, and return the files."""
    files = []
    for name, text in (("tiles.glsl", GLSL), ("tiles.gdshader", GODOT)):
        files.append(folder / name)
        with atomic(files[-1]) as temporary:
            Path(temporary).write_text(text.format(atlas=atlas), encoding="utf-8")
    return files
