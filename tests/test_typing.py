"""Type checks of calls: verbs refuse options that they do not have, and values of other types."""

import subprocess
import sys
from pathlib import Path

import pytest

CALLS = {
    "design": "texrs.design(image, 128",
    "design_variants": "texrs.design_variants(image, 2, 128",
    "splice": "texrs.splice(image, image, 128",
    "self_splice": "texrs.self_splice(image, 'regularise'",
    "perspective": "texrs.perspective(image, image, 128",
    "solid": "texrs.solid(image, 128",
    "synthesize": "texrs.synthesize(image, 128",
    "tile": "texrs.tile(image",
    "rectify": "texrs.rectify(image",
    "extend": "texrs.extend(image",
    "remove": "texrs.remove(image, image",
    "Plane": "texrs.Plane((32, 32), 45",
    "PlaneView": "texrs.PlaneView(",
    "inpaint": "texrs.inpaint(image, image",
    "blend": "texrs.blend(source, image, wrap=True",
    "analyse": "texrs.elements.analyse(image",
    "segment": "texrs.exemplar.segment(image",
    "SolidTexture": "texrs.SolidTexture(image",
    "PlaneTexture": "texrs.PlaneTexture(image",
    "ElementOptions": "texrs.ElementOptions(",
    "DeformationOptions": "texrs.DeformationOptions(",
    "ElementSearch": "texrs.elements.ElementSearch(",
    "Constraints": "texrs.Constraints(mask=image",
    "Guide": "texrs.Guide(exemplar=image, output=image",
    "Exemplar": "texrs.Exemplar(image",
}
"""Calls of each verb and each group of options, without the last bracket."""
HEAD = "import numpy as np\nimport texrs\nimage = np.zeros((32, 32), np.uint8)\nsource = texrs.SourceMap.identity((32, 32))\n"


@pytest.fixture(scope="module")
def complaints(tmp_path_factory: pytest.TempPathFactory) -> dict[int, str]:
    """Return mypy's errors by line. Each call has two lines, and the second misspells an option."""
    file = tmp_path_factory.mktemp("typing") / "calls.py"
    lines = [
        line
        for call in CALLS.values()
        for line in (f"{call})", f"{call.rstrip('(')}{'(' if call.endswith('(') else ', '}sede=3)")
    ]
    file.write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")
    root = Path(__file__).resolve().parents[1]
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(root / "pyproject.toml"), str(file)]
    output = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False).stdout
    found = {}
    for line in output.splitlines():
        name, _, rest = line.partition(":")
        if name.endswith(file.name):
            number, _, words = rest.partition(":")
            if words.lstrip().startswith("error"):
                found[int(number)] = words.strip()
    assert found, output
    return found


@pytest.mark.parametrize("name", CALLS)
def test_a_misspelt_option_is_refused(name: str, complaints: dict[int, str]) -> None:
    right = len(HEAD.splitlines()) + 1 + 2 * list(CALLS).index(name)
    assert right not in complaints, complaints[right]
    assert 'Unexpected keyword argument "sede"' in complaints.get(right + 1, "nothing")
