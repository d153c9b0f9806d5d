"""Words of the trade are explained where they occur, and nowhere else."""

from omnidyn.document import Document, Table
from omnidyn.glossary import explained


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
