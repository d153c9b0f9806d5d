"""What the model leaves out: residuals in bins, against speed, acceleration, time and heading."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.identification.lack_of_fit import Binned
from omnidyn.report.style import BLUE, GREY, WIDTH, Picture, look, new_figure, picture, thin_out

HEIGHT = 4.6  # inch


def draw_misfit(pictures: Sequence[Binned], name: str = "misfit") -> Picture:
    """A panel for each of what the residuals of one output may follow. Noise alone stays within the bars at 0."""
    with look():
        figure = new_figure(WIDTH, HEIGHT)
        figure.subplots(2, 2, squeeze=False, sharey=True)
        figure.subplots_adjust(left=0.11, right=0.975, top=0.95, bottom=0.12, hspace=0.42, wspace=0.1)
        for panel, binned in zip(figure.axes, pictures, strict=False):
            panel.axhline(0.0, color=GREY, linewidth=0.8)
            panel.errorbar(binned.at, binned.mean, binned.error, color=BLUE, marker="o", markersize=4.0, linewidth=1.2)
            panel.set_xlabel(binned.against)
            thin_out(panel, y=4)
        for panel in figure.axes[len(pictures) :]:
            panel.set_visible(False)
        first = pictures[0]
        figure.supylabel(f"residual of {first.output} [{first.unit}]", fontsize=11.0)
        caption = (
            f"Mean residual of {first.output}, the output that holds most that is not noise, with two standard errors "
            "(as of white noise). A model that is right leaves points about 0 in every panel; a curve is what it "
            "leaves out."
        )
        return picture(name, f"What the model leaves out of {first.output}", caption, figure)
