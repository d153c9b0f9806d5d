"""Questions of newcomers and where the search of the documentation leads: `python docs/questions.py`, after
`python3 dev.py docs`, asks the index that Sphinx made as its page does, and shows at which place the answer stands.

A click opens a page of the results, a second one a link on it.
"""

import json
import re
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).parent
INDEX = HERE / "_build" / "html" / "searchindex.js"
FIRST = 5  # results that a reader looks at


class Question(NamedTuple):
    """What is asked, what a newcomer types for it, and the pages that answer."""

    words: str
    typed: str
    pages: tuple[str, ...]


QUESTIONS = (
    Question(
        "My motors hum but the robot does not start: how large is the dead zone, can I compensate it?",
        "motors hum not start",
        ("how-to/dead-zone",),
    ),
    Question(
        "I have a rosbag with /joint_states and /odom but no voltages. What can I identify?",
        "rosbag no voltages",
        ("how-to/ros2-bag",),
    ),
    Question(
        "My encoders give ticks at the motor shaft behind a gear. How do I say that?",
        "ticks motor shaft gear",
        ("how-to/encoders",),
    ),
    Question(
        "How long must I drive, and how, to get friction within 5 %?",
        "how long drive",
        ("how-to/plan-a-drive", "how-to/watch-a-drive"),
    ),
    Question(
        "Why does it say 'not determined' for viscous friction, and is my model useless then?",
        "not determined viscous",
        ("how-to/how-sure",),
    ),
    Question(
        "The same robot on carpet and on tiles: one file or two?",
        "carpet tiles",
        ("how-to/groups", "how-to/loads-and-floors"),
    ),
    Question(
        "How do I use the fitted robot in Gazebo, MuJoCo, on my STM32?",
        "STM32",
        ("how-to/microcontroller",),
    ),
    Question(
        "My LeKiwi drifts to one side when it goes straight. What should I measure?",
        "lekiwi drifts side",
        ("how-to/lekiwi",),
    ),
    Question(
        "Can I trust a simulated controller on the real robot? Where do I see how sure it is?",
        "trust controller real robot",
        ("how-to/controller", "control", "how-to/from-log-to-motion"),
    ),
    Question(
        "I want to train a policy with randomised friction: how do I get the ranges from my log?",
        "policy randomised friction",
        ("how-to/train-a-policy",),
    ),
)


def found(index: dict[str, Any], typed: str) -> list[str]:
    """The pages that hold all the words, the best first: words of titles count 15, of text 5, parts of words less."""
    from sphinx.search.en import SearchEnglish

    english, scores = SearchEnglish({}), []
    plain = [word for word in english.split(typed.lower()) if word not in english.stopwords and not word.isdecimal()]
    for k, page in enumerate(index["docnames"]):
        total = 0
        for word in plain:
            stem = english.stem(word)
            best = max(
                15 * holds(index["titleterms"], stem, k),
                5 * holds(index["terms"], stem, k),
                7 * part(index["titleterms"], word, k),
                2 * part(index["terms"], word, k),
            )
            if not best:
                break
            total += best
        else:
            scores.append((-total, page))
    return [page for _, page in sorted(scores)]


def holds(terms: dict[str, Any], word: str, page: int) -> bool:
    """Whether a page is among those of a word."""
    pages = terms.get(word, [])
    return page in (pages if isinstance(pages, list) else [pages])


def part(terms: dict[str, Any], word: str, page: int) -> bool:
    """Whether a page has a word of which this one is a part."""
    return len(word) > 2 and any(holds(terms, each, page) for each in terms if word in each)


def clicks(index: dict[str, Any], question: Question) -> tuple[str, int, int]:
    """The page that answers, its place among the results (from 1), and the clicks to it; 0 where there is none."""
    pages = found(index, question.typed)
    for page in pages[:FIRST]:
        if page in question.pages:
            return page, pages.index(page) + 1, 1
    for page in pages[:FIRST]:
        links = re.findall(r"\]\(([\w/.-]+)\.md", (HERE / f"{page}.md").read_text("utf-8"))
        for link in links:
            for target in question.pages:
                if (HERE / page).parent.joinpath(link).resolve() == (HERE / target).resolve():
                    return target, pages.index(page) + 1, 2
    return "none", 0, 0


def main() -> int:
    """The table; 1 where a question has no answer."""
    text = INDEX.read_text("utf-8")
    index = json.loads(text[text.index("(") + 1 : text.rindex(")")])
    answers = [clicks(index, question) for question in QUESTIONS]
    for question, (page, place, count) in zip(QUESTIONS, answers, strict=True):
        print(f"{question.typed:30} {page:28} place {place}, clicks {count}")
    return int(any(count == 0 for _, _, count in answers))


if __name__ == "__main__":
    raise SystemExit(main())
