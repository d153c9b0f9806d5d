"""Words of the trade, each explained in a line; a result shows the lines of those that occur in it."""

from __future__ import annotations

import re

GLOSSARY = {
    "fit %": "100 (1 - rms error / spread of what was measured): 100 is perfect, 0 no better than its mean.",
    "VAF %": "variance accounted for: 100 (1 - var error / var measured); it forgives a constant offset.",
    "white p": "the chance that errors without a memory look so unlike noise; below 0.05 they have a memory.",
    "chi2": "mean square of the error over that of the noise: 1 where the model leaves nothing but noise.",
    "std error": "how far the value would scatter if the same were recorded again.",
    "sandwich": "intervals that hold for errors with a memory too: from their own products, not from white noise.",
    "autoregression": "errors of which each is a share of the last ones and something new.",
    "nuisance": "a number of the log, not of the robot: a latency, a dead band of the driver.",
    "jackknife": "standard errors from fits that leave out one direction, or run, at a time.",
    "bootstrap": "standard errors from fits to stretches drawn again at random.",
    "left-out error": "rms error of the force in a direction that was not fitted.",
    "not noise": "follows speeds, voltages, the time or the like by more than chance; a memory alone is not counted.",
    "held-out error": "squared error on blocks of the log that were not fitted to.",
    "free run": "the model gets the inputs only, never what was measured after the start.",
}

_TERMS = {term: re.compile(rf"(?<![\w-]){re.escape(term)}(?:s|(?![\w-]))") for term in GLOSSARY}


def explained(text: str) -> list[str]:
    """The lines of the words that occur in a text, in the order of the glossary."""
    return [f"{term}: {GLOSSARY[term]}" for term, form in _TERMS.items() if form.search(text)]
