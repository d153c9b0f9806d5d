"""The picture of friction: labels that a person can read."""

from omnidyn.model.robot_file import load_robot
from omnidyn.report.friction_picture import draw_friction
from omnidyn.simulation.friction_study import friction_study


def test_no_label_is_a_formula():
    """matplotlib writes the ticks of a logarithmic axis as TeX, which is shown as it is."""
    drawn = draw_friction({"axebot": friction_study(load_robot("axebot"))})
    drawn.figure.canvas.draw()
    labels = [t.get_text() for panel in drawn.figure.axes for t in panel.get_xticklabels(which="both")]
    assert {"1", "10", "100"} <= set(labels)
    assert not any("$" in label for label in labels)
