"""The pages of the documentation that are made from the code: `docs/*.py`."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))

import api


def test_each_public_name_belongs_to_one_task() -> None:
    assert not api.check_tasks()


@pytest.mark.parametrize("guide", api.TABLES)
def test_tables_list_all_parameters(guide: str) -> None:
    import inspect

    for name in api.TABLES[guide]:
        function = api.find(f"texrs.{name}")
        listed = [row[0].strip("`") for row in api.list_rows(function, {})]
        wanted = [p for p in inspect.signature(function).parameters if p not in ("self", "progress")]
        assert listed == wanted, name


def test_tables_state_unit_range_and_default() -> None:
    rows = {row[0]: row[3:] for row in api.list_rows(api.find("texrs.DeformationOptions"), {})}
    assert rows["`rotate`"][:2] == ("degrees", "0 to 180")
    assert rows["`translate`"][1:] == ("0 to 0.5", "`0.12`")
