"""What commands and pages say: strict JSON, the tags and text of HTML, progress."""

import json
import time
from html.parser import HTMLParser
from typing import Any

VOID = {"meta", "link", "img", "br", "input"}


def strict(text: str) -> Any:
    """What this JSON holds; NaN and Infinity, which are no JSON, are refused."""

    def refuse(name):
        raise AssertionError(f"{name} in JSON")

    return json.loads(text, parse_constant=refuse)


PATIENCE_S = 120.0  # for words that never come


def hear(capsys: Any, words: str, so_far: str = "") -> str:
    """Waits for words on stderr; returns all that was said. Nothing may stand on stdout."""
    end = time.monotonic() + PATIENCE_S
    while words not in so_far and time.monotonic() < end:
        time.sleep(0.01)
        out, err = capsys.readouterr()
        assert out == ""
        so_far += err
    assert words in so_far
    return so_far


class Reader(HTMLParser):
    """Checks that tags are closed, and keeps attributes, ids and text."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.values, self.text = [], [], [], ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.values += [(tag, name, value or "") for name, value in attributes]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def all(self, name):
        return [value for _, each, value in self.values if each == name]
