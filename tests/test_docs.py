"""The pages of the documentation that are generated from the code: `docs/*.py`."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))

import api
import messages


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


def test_the_index_of_messages_has_all_raise_sites() -> None:
    import texrs

    package = Path(texrs.__file__).parent
    found = {message.text: message for message in messages.list_messages(package)}
    page = messages.make_messages(package)
    assert len(found) > 600
    assert page.count("<tr><td>") == len(found)
    assert all(message.cause and message.remedy for message in found.values())
    general = sum(message.cause == messages.REST.cause for message in found.values())
    assert general < len(found) / 8, general


@pytest.mark.parametrize(
    ("text", "cause", "remedy"),
    [
        ("size: each side must be at least 16, got …", "The value or the size is out of its range.", "Give at least 16."),
        ("wrap: cannot be combined with size", "Two arguments contradict each other.", "Leave out one of them."),
        (
            "x: … would be lost; write to another file",
            "The result would replace an existing file.",
            "Write to another file.",
        ),
        ("kind: must be one of …, …; got …", "The value is not one of the allowed words.", "Give one of …, …."),
    ],
)  # fmt: skip
def test_messages_are_explained_by_their_own_words(text: str, cause: str, remedy: str) -> None:
    assert messages.explain(text) == (cause, remedy)
