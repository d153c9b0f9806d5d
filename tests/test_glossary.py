"""Words of the trade are explained where they occur, and nowhere else."""

import ast

from omnidyn.document import Document, Table
from omnidyn.glossary import GLOSSARY, explained
from tests.support.sources import trees


def texts():
    """All text of the package that is not documentation: what results may say."""
    for name, tree in trees().items():
        if name != "glossary.py":
            nodes = list(ast.walk(tree))
            docs = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
            for node in nodes:
                if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
                    yield node.value


def test_every_word_occurs_in_what_results_say():
    said = {line.partition(":")[0] for text in texts() for line in explained(text)}
    assert said == set(GLOSSARY)


def test_only_what_occurs_is_explained():
    assert [line.partition(":")[0] for line in explained("chi2 of a sandwich covariance")] == ["chi2", "sandwich"]
    assert explained("a number of the robot") == []
    assert explained("the chi2x, sandwiched") == []


def test_a_document_ends_with_the_words_of_its_tables():
    document = Document([Table(("", "white p"), [("vx", "0.2")])], {}, verdict="The model follows vx within 3 %.")
    lines = document.to_text(200).splitlines()
    assert lines[:2] == ["The model follows vx within 3 %.", ""]
    assert lines[-1].startswith("white p: the chance")
    assert Document(["nothing of the trade"]).to_text() == "nothing of the trade"
