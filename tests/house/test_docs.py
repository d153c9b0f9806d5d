"""The documentation as a newcomer meets it: nothing that is there is called missing, questions find their page."""

import re
from pathlib import Path

import pytest

import omnidyn
from omnidyn.cli.app import app
from omnidyn.export.features import TABLE
from tests.support.robot_keys import generator

DOCS = Path(__file__).resolve().parents[2] / "docs"
ROOT = DOCS.parent
PAGES = sorted(page for page in DOCS.rglob("*.md") if "_build" not in page.parts)
WITH_LINKS = [*PAGES, *ROOT.glob("*.md"), *ROOT.glob("examples/**/*.md"), *ROOT.glob("benchmarks/results/*.md")]
COMMANDS = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback}
THERE = COMMANDS | set(omnidyn.__all__) | set(TABLE)
ABSENT = re.compile(r"(\w[\w-]*)`?\s+(?:is|are)\s+(?:missing|not yet|not there|not supported|not implemented)\b")
QUESTIONS = generator("questions").QUESTIONS


def prose(text):
    """Sentences, and cells of tables, without blocks of code."""
    text = re.sub(r"^```.*?^```|^(?: {4}.*\n)+", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.split(r"(?<=[.:;!?])\s+|\n\n|\s\|\s", text)


def called_missing(text):
    """Commands, public names and kinds of export of which a sentence says that they are missing."""
    return {word for sentence in prose(text) for word in ABSENT.findall(sentence) if word.lower() in THERE}


def test_nothing_that_is_there_is_called_missing():
    assert {page.name: called_missing(page.read_text("utf-8")) for page in PAGES if page.name != "statements.md"} == {
        page.name: set() for page in PAGES if page.name != "statements.md"
    }


def test_the_column_of_what_is_not_there_names_nothing_that_is():
    rows = re.findall(r"^\| [^|]+ \|[^|]+\|([^|]*)\|$", (DOCS / "what-is-there.md").read_text("utf-8"), re.MULTILINE)
    assert len(rows) >= 8
    for cell in rows[2:]:
        words = set(re.findall(r"[\w-]+", cell))
        assert not words & (COMMANDS | set(TABLE)), cell


def test_it_sees_what_is_called_missing():
    assert called_missing("Soon: `omnidyn plan` is missing.") == {"plan"}
    assert called_missing("Export is not there yet.") == {"Export"}
    assert called_missing("| `simulate` is not supported |") == {"simulate"}
    assert not called_missing("`resume` goes on with what is missing. `omnidyn plan` writes it.")


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question.typed)
def test_the_page_that_answers_a_question_holds_its_words(question):
    """`python docs/questions.py` asks the index of Sphinx itself, after a build."""
    for page in question.pages[:1]:
        text = (DOCS / f"{page}.md").read_text("utf-8").lower()
        lacking = [word for word in question.typed.lower().split() if word.rstrip("s") not in text]
        assert not lacking, page


@pytest.mark.parametrize("page", [page for page in PAGES if page.stat().st_size > 30_000], ids=lambda page: page.stem)
def test_a_long_page_begins_with_an_index(page):
    head = page.read_text("utf-8")[:6000]
    titles = re.findall(r"^## (.+)$", page.read_text("utf-8"), re.MULTILINE)
    assert "<!-- index -->" in head
    links = head[head.index("<!-- index -->") : head.index("<!-- end of index -->")].count("](#")
    assert links >= len(titles) >= 5


def without_code(text):
    """A page without its blocks of code, and without what stands between backticks."""
    return re.sub(r"^```.*?^```|^(?: {4}.*\n)+|`[^`\n]*`", "", text, flags=re.DOTALL | re.MULTILINE)


def anchors(text):
    """What may stand behind # in a link to a page: its headings, as GitHub and Sphinx write them."""
    titles = re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def dead_links(page, text):
    """Links of a page to files, and to headings of pages, that are not there."""
    dead = []
    for link in re.findall(r"\]\(([^)\s]+)\)", without_code(text)):
        name, _, anchor = link.partition("#")
        target = (page.parent / name) if name else page
        there = re.match(r"\w+:", link) or target.exists()
        if not there or (anchor and target.suffix == ".md" and anchor not in anchors(target.read_text("utf-8"))):
            dead.append(link)
    return dead


def test_every_local_link_leads_somewhere():
    """Sphinx is told not to look: README.md links to files that are no pages of the documentation."""
    assert {page.name: dead for page in WITH_LINKS if (dead := dead_links(page, page.read_text("utf-8")))} == {}


def test_it_sees_a_link_that_leads_nowhere():
    page = DOCS / "tested.md"
    links = ("nowhere.md", "robot-file.md#nowhere", "../README.md", "robot-file.md#body", "#missed", "#nowhere")
    text = page.read_text("utf-8") + " ".join(f"[`b`]({link})" for link in links)
    assert dead_links(page, text) == ["nowhere.md", "robot-file.md#nowhere", "#nowhere"]
