"""The index of messages: each `raise` in the sources, with its cause and its remedy."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path

NOTICE = "% Made by docs/messages.py.\n\n"
ERRORS = {"InvalidInput", "FileError", "LimitExceeded"}
VERBS = (
    "add|ask|check|choose|convert|copy|crop|draw|enlarge|give|increase|install|leave|look|lower|make|"
    "mark|move|name|pass|put|raise|read|reduce|remove|rename|repeat|run|save|say|see|set|start|state|"
    "take|tell|try|unpack|use|wait|write"
)
"""Words that a remedy begins with."""
REMEDY = re.compile(rf"[;.(] ?(?:or |so |then |please )?((?:{VERBS})\b.*?)\)?$")
VALUE = "…"


@dataclass(frozen=True)
class Kind:
    """A form of messages, with its cause, and the remedy of messages that do not contain one."""

    pattern: re.Pattern[str]
    cause: str
    remedy: str


def kind(pattern: str, cause: str, remedy: str) -> Kind:
    """Return a kind of message."""
    return Kind(re.compile(pattern, re.IGNORECASE), cause, remedy)


KINDS = (
    kind(r"pip install", "An optional package is missing.", "Install it with the command in the message."),
    kind(
        r"limit|memory|would take|allows? ",
        "The work needs more than a limit allows.",
        "Reduce the size, or raise the limit (`texrs.limits`).",
    ),
    kind(
        r"exists|is there already|already (?:there|has)|overwrite|--force|would be lost",
        "The result would replace an existing file.",
        "Write to another name, or use `--force`.",
    ),
    kind(
        r"is (?:only )?for|not for use|needs? (?:method|quality|a volume|a picture|an image)"
        r"|only (?:with|for|where)|without|for use with|does not (?:take|apply)",
        "The argument does not apply to this call.",
        "Leave it out, or change the other argument in the message.",
    ),
    kind(
        r"no such|not found|cannot be (?:read|opened|written)|does not exist|is not there|missing|lacks?\b|has no ",
        "A required file, value or package is missing.",
        "Check the name and the path.",
    ),
    kind(
        r"damaged|truncated|broken|not a (?:valid )?\w+ file|corrupt|ends (?:early|before)",
        "The file is damaged, or has another format.",
        "Read it with another program and save it again.",
    ),
    kind(
        r"combined with|not both|either|only one of|together|excludes|instead",
        "Two arguments contradict each other.",
        "Leave out one of them.",
    ),
    kind(
        r"\bone of\b|allowed (?:is|are)|unknown|knows? (?:no|only)|known (?:is|are)|choose from",
        "The value is not one of the allowed words.",
        "Use one of the words in the message.",
    ),
    kind(
        r"at least|at most|between|from .* to|out of|beyond|outside|within|too (?:small|large|many|few)"
        r"|larger|smaller|more than|fewer|less than|greater|positive|sides? ",
        "The value or the size is out of its range.",
        "Give a value in the range of the message.",
    ),
    kind(
        r"shape|axes|dimensions?|channels?|rows|columns|planes|size",
        "The array has the wrong shape.",
        "Check the order of axes in [Conventions](../conventions.md).",
    ),
    kind(
        r"dtype|integers?|float|bool|numbers?|finite|NaN|type|got a|must be a|needs? an? |is not an? ",
        "The value has the wrong type.",
        "Give a value of the type in the message.",
    ),
    kind(
        r"marks (?:nothing|all|no)|nothing|empty|covers",
        "The mask or the selection is empty or complete.",
        "Check it. If it marks pixels in black, invert it (`--invert`).",
    ),
    kind(
        r"cannot (?:hold|store|contain|be kept|keep)|is (?:not )?written|are (?:not )?written|format",
        "The format cannot contain these data.",
        "Use a format from the message, or convert the data.",
    ),
    kind(
        r"is no |holds? no|not (?:an?|the) |cut off|are missing|not packed|not JSON",
        "The file or the value is of the wrong kind.",
        "Give one of the kind in the message.",
    ),
    kind(
        r"twice|differ|contradicts|reach|several results|two (?:maps|frames)|of another length",
        "Two parts of the input do not agree.",
        "Make them agree, or leave one out.",
    ),
    kind(
        r"not read|are read|reads? |decoded|encoding|holds|content|Pillow|compressed",
        "The file contains data that texrs does not read.",
        "Convert it with another program to a format in [Files](../guides/files.md).",
    ),
    kind(
        r"version|made by|made again|SHA-256|says how",
        "The file is from another version, or its inputs changed.",
        "Generate it again with this version.",
    ),
    kind(
        r"folder|suffix|locked|other processes|write-protected|removed|gone",
        "The file system, or another process, prevents it.",
        "Choose another path, or end the other process.",
    ),
    kind(r"up to|allowed", "The value or the size is out of its range.", "Give a value in the range of the message."),
    kind(r"is needed|belongs", "An argument is missing.", "Give the argument that the message names."),
    kind(
        r"field|function|steps?|corrections|points?",
        "A part of the argument cannot be used.",
        "Change the part that the message names.",
    ),
    kind(
        r"needs? |must |belongs? ",
        "A requirement in the message is not met.",
        "Give everything that the message names.",
    ),
    kind(
        r"found|shows|measur|unsure|plane|horizon|lattice|elements?",
        "texrs did not find the required elements, plane or lattice in the image.",
        "Give them by hand, with the argument in the message.",
    ),
)
REST = Kind(
    re.compile(""), "A condition in the message is not met.", "Read the description of the argument in the reference."
)


@dataclass(frozen=True)
class Message:
    """A message, the module that raises it, its cause and its remedy."""

    text: str
    module: str
    cause: str
    remedy: str

    @property
    def argument(self) -> str:
        """Name of the argument that the message begins with, or an empty string."""
        found = re.match(r"([\w., -]{1,40}?): ", self.text)
        return "" if found is None else found.group(1)


def list_messages(package: Path) -> Iterator[Message]:
    """Return the messages of a package, except messages whose text is not in the ``raise`` statement."""
    for file in sorted(package.rglob("*.py")):
        module = ".".join(file.relative_to(package.parent).with_suffix("").parts)
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            call = node.exc if isinstance(node, ast.Raise) else None
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in ERRORS and call.args:
                text = read_text(call.args[0])
                # Skip a message that consists of values only.
                if len(re.sub(r"\W|…", "", text)) > 6:
                    yield Message(text, module, *explain(text))


def read_text(node: ast.expr) -> str:
    """Return the text of a literal, with a mark for each value in it."""
    if isinstance(node, ast.BinOp):
        return read_text(node.left) + read_text(node.right)
    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
    return "".join(p.value if isinstance(p, ast.Constant) and isinstance(p.value, str) else VALUE for p in parts)


def explain(text: str) -> tuple[str, str]:
    """Return the cause and the remedy of a message. If the message contains a remedy, return this one."""
    found = next((k for k in KINDS if k.pattern.search(text)), REST)
    own = REMEDY.search(text)
    if own:
        remedy = own.group(1).strip()
        return found.cause, f"{remedy[0].upper()}{remedy[1:]}."
    wanted = re.search(r": (?:each \w+ )?(?:must be|needs?) (?!to |given\b)([^;:]+?)(?:, (?:got|not) .*|; .*)?$", text)
    if wanted and wanted.group(1) != VALUE:
        return found.cause, f"Give {wanted.group(1).strip()}."
    return found.cause, found.remedy


def make_messages(package: Path) -> str:
    """Return the page of messages."""
    messages = {m.text: m for m in list_messages(package)}
    groups: dict[str, list[Message]] = {}
    for message in messages.values():
        name = message.argument
        title = "Options" if name.startswith("-") else name[:1].upper() or "Any argument"
        groups.setdefault(title, []).append(message)
    text = f"{NOTICE}# Messages\n\n"
    text += (
        f"All {len(messages)} error messages, in the order of their argument. `{VALUE}` stands for a value or a name.\n"
        "Messages about any argument are at the end. On the command line, a message names the option or the file instead of\n"
        "the argument. Search this page for words of your message that are not values.\n"
    )
    for title, some in sorted(groups.items(), key=lambda group: (group[0] == "Any argument", group[0])):
        text += f"\n## {title}\n\n```{{raw}} html\n{tabulate(some)}\n```\n"
    return text


def tabulate(messages: list[Message]) -> str:
    """Return a table of messages."""
    rows = ""
    for each in sorted(messages, key=lambda m: m.text.lower()):
        remedy = re.sub(r"\[([^]]+)\]\(([^)]+)\.md\)", r'<a href="\2.html">\1</a>', escape(each.remedy, quote=False))
        remedy = re.sub(r"`([^`]+)`", r"<code>\1</code>", remedy)
        rows += f"<tr><td>{escape(each.text, quote=False)}</td><td>{each.cause}</td><td>{remedy}</td></tr>\n"
    head = "<thead><tr><th>message</th><th>cause</th><th>remedy</th></tr></thead>"
    return f'<table class="table messages">\n{head}\n<tbody>\n{rows}</tbody></table>'
