"""Fills the tables of docs/statements.md from `omnidyn.telling`: run it after a sentence was added or changed."""

import re
from pathlib import Path

from omnidyn.telling.codes import ROOMS, sentences
from omnidyn.telling.sentence import Wording

PAGE = Path(__file__).with_name("statements.md")


def filled(page: str) -> str:
    """The page with the table of each room behind its mark, and an index of its sections."""
    page = re.sub(
        r"(<!-- codes of (\w+) -->\n).*?(?=\n## |\Z)", lambda mark: mark[1] + table(mark[2]), page, flags=re.DOTALL
    )
    index = rf"\g<1>{index_of(page)}\g<2>"
    return re.sub(r"(<!-- index -->\n).*?(<!-- end of index -->)", index, page, flags=re.DOTALL)


def index_of(page: str) -> str:
    """The sections of the page, with how many codes each has."""
    lines = ["| section | codes |", "| --- | --- |"]
    for title, body in re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", page, flags=re.DOTALL | re.MULTILINE):
        codes = re.findall(r"^\| `(\w+)` \|", body, flags=re.MULTILINE)
        anchor = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        lines.append(f"| [{title}](#{anchor}) | {len(codes)} |")
    return "\n".join(lines) + "\n"


def table(room: str) -> str:
    """The codes of a room: what is said, and what to do."""
    rows = []
    (name,) = [name for name in ROOMS if name.replace(".", "_") == room]
    for code, sentence in sentences(name).items():
        remedies = [_cell(remedy) for remedy in (sentence.remedy, *sentence.remedies.values()) if remedy]
        rows.append(f"| `{code}` | {_cell(sentence.text)} | {'; '.join(remedies)} |")
    return "\n".join(["| code | sentence | remedy |", "| --- | --- | --- |", *rows]) + "\n"


def _cell(wording: Wording) -> str:
    """A template with the names of its numbers; of a function, what its docstring says."""
    text = wording if isinstance(wording, str) else " ".join((wording.__doc__ or "").split()).rstrip(".")
    text = re.sub(r"\{\w+:[^}|]*\|([^}]*)\}", r"\1", text)  # the plural of two words
    return re.sub(r"\{(\w+)[^}]*\}", r"*\1*", text).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text("utf-8")), "utf-8")
