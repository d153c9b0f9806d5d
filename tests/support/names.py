"""Names that somebody may give a robot, so that a language takes them for something else than a name."""

from __future__ import annotations

from hypothesis import strategies as st

PIECES = [
    "*/", "/*", "//", "\\", "\\u000a", "\\u002a/", "??/", "?", '"', "'", '"""', "#", "-->", "--", "<", ">", "&", "]]>",
    "\n", "\r", "\t", "\x00", "\x1b", "\x85", "\u2028", "\u2029", "\u202e", "\ufeff", "\ufffe", "\uffff", "\U0001fffe",
    "\ufdd0", "\ud800", "%", "{", "}", "${x}", "$(x)", "`x`", "@STEP@", "@GUID@", "@ABOUT@", "INPUT", "MEMORY", "UNITS",
    "ROWS", "STEP", "coding: utf-7", "coding=raw_unicode_escape", "class", "int", "world", "con", "..", "/", ": ", "- ",
    "Größe", "速度", "a" * 60, "}; int x = 1;", "import os", "|", "\u200b",
]  # fmt: skip
HOSTILE = [
    'mini\nclass Math { static double abs(double x) { throw new Error("code of the robot file runs"); } } //',
    "C:\\users\\me", "coding: raw_unicode_escape \\u000aimport os", "coding: no-such-codec", "*/ int x; /*", "a\\",
    "a??/",
    "*??/", "INPUT", "robot of MEMORY lane", "UNITS and ROWS", "@STEP@ @GUID@", "--><x/>", "\ufffe", '"""', "world",
    "a: b\n- c", "\u2028}", "\ud800", "*" * 400, "\x01" * 66,
]  # fmt: skip

name = st.one_of(
    st.sampled_from(HOSTILE),
    st.lists(st.sampled_from(PIECES), min_size=1, max_size=6).map("".join),
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=40),  # a lone surrogate is no text
)
