"""What a figure shows, and where."""

from matplotlib.text import Text

from omnidyn.report.style import look


def shown_texts(figure):
    """Every text that is drawn, with its box in pixels. What a tick outside the axis would say is not drawn."""
    with look():
        figure.canvas.draw()
        hidden = _hidden_labels(figure)
        texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
        return [(text.get_text(), text.get_window_extent()) for text in texts if id(text) not in hidden]


def _hidden_labels(figure):
    """Labels of ticks that are not drawn: outside the limits, or of axes that are switched off."""
    hidden = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            drawn = {id(tick) for tick in axis._update_ticks()} if axes.axison else set()
            ticks = axis.get_major_ticks() + axis.get_minor_ticks()
            hidden |= {id(label) for tick in ticks if id(tick) not in drawn for label in (tick.label1, tick.label2)}
    return hidden
