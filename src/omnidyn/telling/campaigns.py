"""What a campaign of many simulations says."""

from __future__ import annotations

from omnidyn.document import all_of
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence
from omnidyn.telling.small_words import counted


def _of(statement: Statement) -> str:
    return f"the campaign{f' {statement.subject}' if statement.subject else ''}"


def _done(statement: Statement) -> str:
    """All shards of a campaign are there."""
    numbers = statement.numbers
    return f"{_of(statement)} is complete: {numbers['samples']} samples in {counted(numbers['shards'], 'shard')}"


def _open(statement: Statement) -> str:
    """Some shards of a campaign are not there yet."""
    numbers = statement.numbers
    return f"{_of(statement)} is not complete: {numbers['done']} of {counted(numbers['shards'], 'shard')} are there"


def _failed(statement: Statement) -> str:
    """Some shards of a campaign failed."""
    numbers = statement.numbers
    failed, done = counted(numbers["failed"], "failed shard"), numbers["done"]
    return f"{_of(statement)} has {failed}; {done} of {numbers['shards']} are there"


def _fits_failed(statement: Statement) -> str:
    """All fits of a campaign are there, and some do not stand."""
    n = statement.numbers
    return f"{_of(statement)} is complete: {n['failed']} of {counted(n['samples'], 'fit')} do not stand"


def _tolerance(statement: Statement) -> str:
    """The largest box of the variables within which every sample keeps the limit."""
    n = statement.numbers
    ranges = zip(n["keys"], n["low"], n["high"], strict=True)
    box = all_of([f"{key} from {low:.4g} to {high:.4g}" for key, low, high in ranges])
    return f"with {box}, all {n['inside']} samples have {statement.subject} of at most {n['limit']:.4g}"


SENTENCES = {
    "tolerance": Sentence(_tolerance),
    "no_tolerance": Sentence("no part of the ranges keeps {subject} of at most {limit:.4g}"),
    "campaign_done": Sentence(_done),
    "campaign_open": Sentence(_open, "go on with omnidyn sweep resume"),
    "campaign_failed": Sentence(_failed, "read their tracebacks, then omnidyn sweep resume runs them again"),
    "fits_failed": Sentence(_fits_failed, "read the columns `verdict` and `words` of the table"),
    "fit_of_part": Sentence("{subject} is not whole, and the fit is of what is there: {why}", "copy the log again"),
    "shard_failed": Sentence("{subject}: {error}"),
    "log_not_read": Sentence("{subject} cannot be read: {error}"),
    "log_not_fitted": Sentence("{subject} cannot be fitted: {error}"),
    "within_limit": Sentence(
        "{share:%.3g} % of the samples have {subject} of at most {limit:.4g} (95 %: {low:%.3g} to {high:%.3g} %)"
    ),
}
