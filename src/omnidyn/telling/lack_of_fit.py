"""What a fit leaves: misfit, noise, numbers that are not the same throughout the logs, predictions of held-out logs."""

from __future__ import annotations

from omnidyn.document import all_of, short
from omnidyn.identification.lack_of_fit import HOLDS, NEIGHBOURS, REPEATS, REST, ROUNDING
from omnidyn.model.keys import in_words
from omnidyn.statement import Statement
from omnidyn.telling.causes import UNOFFERED
from omnidyn.telling.sentence import Sentence

NAMED = 4  # numbers that a sentence names
LARGE_CHI2 = 100.0  # chi2 of which nobody needs decimals
MAJORITY_SHARE = 0.5  # of the variance of errors that is not noise, from which on most of it is
WORTHWHILE_SHARE = 0.01  # and from which on any is
WHERE = {  # how a log shows its noise, and what more than that is
    REPEATS: ("repeats within", "not noise"),
    HOLDS: ("scatters, while commands are held, by", "not noise"),
    NEIGHBOURS: ("scatters from row to row by", "misfit, or slower noise"),
    ROUNDING: ("is rounded within", "misfit, or noise beside what the encoder rounds"),
    REST: ("scatters at rest by", "misfit, or noise that comes with motion"),
}


def names_of(names: tuple[str, ...], most: int = NAMED) -> str:
    """Keys in words, the first few of them."""
    words = [*map(in_words, names[:most])]
    return all_of([*words, *([f"{len(names) - most} more"] if len(names) > most else [])])


def _lead(statement: Statement) -> str:
    """That the model leaves something out, and what that follows, or by how much it is beyond the noise."""
    numbers, worst = statement.numbers, statement.subject
    words = "the model leaves something out"
    if numbers["follows"]:
        share = f" ({100.0 * numbers['share']:.0f} % of the variance of {worst} is not noise)" if worst else ""
        return f"{words}: the residual follows {all_of([*numbers['follows']])}{share}"
    return f"{words}: {numbers['beyond']}" if numbers["beyond"] is not None else words


def _unexplained(statement: Statement) -> str:
    """A misfit without any cause."""
    return f"{_lead(statement)}; no known cause explains it"


def _unoffered(statement: Statement) -> str:
    """A misfit whose best cause no robot file holds."""
    return f"{_lead(statement)}; it looks like {statement.numbers['cause']}, which no law of a robot file holds"


def _rivals(statement: Statement) -> str:
    """A misfit whose best cause is not distinguishable from one that no robot file holds."""
    rivals = " or ".join(UNOFFERED[key] for key in statement.numbers["rivals"])
    return f"{_lead(statement)}; it may be {statement.numbers['cause']}, or {rivals}"


def _weak(statement: Statement) -> str:
    """A misfit whose best cause explains only a part of it."""
    cause, share = statement.numbers["cause"], 100.0 * statement.numbers["explains"]
    return f"{_lead(statement)}; no known cause explains it: the nearest, {cause}, explains {share:.0f} % of it"


def _likely(statement: Statement) -> str:
    """A misfit with a cause that explains most of it."""
    alike = ", ".join(map(str, statement.numbers["alike"]))
    same = f", or what this log cannot tell from it ({alike})" if alike else ""
    return f"{_lead(statement)}; most likely {statement.numbers['cause']}{same}"


def _noise_level(statement: Statement) -> str:
    """How large the noise is by what the logs show without the model, and chi2 of the residuals by that."""
    numbers = statement.numbers
    levels = ", ".join(
        f"{name} {level:.2g} {unit}"
        for name, level, unit in zip(numbers["outputs"], numbers["levels"], numbers["units"], strict=True)
    )
    chi2 = " to ".join(dict.fromkeys(f"{x:.2f}" if x < LARGE_CHI2 else short(x, ".3g") for x in numbers["chi2"]))
    return (
        f"noise: the log {WHERE[statement.subject][0]} {levels}, at most {short(100.0 * numbers['of_moves'])} % of "
        f"what moves; chi2 of the residuals by that: {chi2}"
    )


def _beyond_noise(statement: Statement) -> str:
    """The residual of an output is larger than the noise that the log shows."""
    numbers = statement.numbers
    where, more = WHERE[numbers["source"]]
    share = f"{100.0 * numbers['share']:.0f} % of its variance"
    new = (
        f", {100.0 * numbers['new']:.0f} % of what is new from row to row," if numbers["new"] > numbers["share"] else ""
    )
    return (
        f"the residual of {statement.subject} is {numbers['residual']:.2g} {numbers['unit']} where the log {where} "
        f"{numbers['level']:.2g} {numbers['unit']} ({short(100.0 * numbers['of_moves'])} % of what moves): {share}"
        f"{new} is {more}"
    )


def _heavy_tails(statement: Statement) -> str:
    """Outliers hold much of the squared error."""
    numbers, more = statement.numbers, statement.numbers["others"]
    return (
        f"outliers: {100.0 * numbers['share']:.2g} % of the samples of {statement.subject}"
        f"{f', and of {more} more outputs,' if more else ''} are far beyond the noise and hold "
        f"{100.0 * numbers['held']:.0f} % of its squared error; `loss` student-t counts them little"
    )


def _differ(statement: Statement) -> str:
    keys = statement.numbers["keys"]
    what = names_of(keys) or "no number by itself, but what they do together"
    return f"{what} {'differs' if len(keys) <= 1 else 'differ'}"


def _between_logs(statement: Statement) -> str:
    """Numbers differ from log to log."""
    return f"{_differ(statement)} from log to log by more than their errors allow"


def _in_time(statement: Statement) -> str:
    """Numbers differ before and after a moment."""
    numbers, of = statement.numbers, f" of {statement.subject}" if statement.subject else ""
    if numbers["at"] is None:
        when = f"{100.0 * numbers['share']:.0f} % into the logs"
    else:
        low, high = numbers["between"]
        when = f"at {numbers['at']:.4g} s{of} (between {low:.4g} and {high:.4g} s)"
    return f"{_differ(statement)} before and after a moment, most likely {when}, by more than their errors allow"


def _held_out_misfit(statement: Statement) -> str:
    """Errors on held-out logs are larger than noise."""
    numbers = statement.numbers
    where = ", on the fitted logs too" if numbers["fitted_too"] else " that differs between the logs"
    return (
        f"on held-out logs the errors of {', '.join(numbers['components'])} are larger than noise (chi2 up to "
        f"{numbers['chi2']:.3g}): the model misses something{where}"
    )


def _held_out_colour(statement: Statement) -> str:
    """Errors on held-out logs are no larger than on fitted ones, but not white."""
    numbers = statement.numbers
    names, share = ", ".join(numbers["components"]), numbers["share"]
    words = f"on held-out logs the errors of {names} are no larger than on the fitted ones"
    if share is None:
        return f"{words}, but not white: autocorrelated noise, or something that the model misses"
    if share < WORTHWHILE_SHARE:
        no = "are not what the model misses" if numbers["misfit"] else "follow nothing that the model should know"
        return f"{words}; they are not white, but {no}: autocorrelated noise"
    most = "most of them" if share > MAJORITY_SHARE else "some of them"
    return (
        f"{words}, but {most} is not noise (up to {100.0 * share:.0f} % of their variance): the model misses that much"
    )


SENTENCES = {
    "slow_errors": Sentence(
        "the errors last so long that no test in these logs tells them from what the model leaves out; record longer "
        "logs"
    ),
    "only_noise": Sentence("the residuals hold nothing but noise, as far as these logs tell"),
    "unrelated_residuals": Sentence("the residuals follow nothing that a model should know, as far as these logs tell"),
    "misfit_unexplained": Sentence(_unexplained),
    "misfit_small": Sentence(
        "a free run misses {missed:%.2g} % of the spread on held-out rows; more than noise is in the residual of "
        "{subject}, and no known cause explains it"
    ),
    "misfit_without_law": Sentence(_unoffered),
    "misfit_with_rivals": Sentence(_rivals),
    "misfit_nearest_cause": Sentence(_weak),
    "misfit_likely_cause": Sentence(_likely),
    "misfit_of_output": Sentence("{subject}: {size:.2g} of its residual is not noise, {percent:.0f} % of the variance"),
    "noise_level": Sentence(_noise_level),
    "noise_unknown": Sentence(
        "this log cannot tell its noise from misfit: repeat a command, or let the robot rest for a second"
    ),
    "beyond_noise": Sentence(_beyond_noise),
    "rounding_may_hide": Sentence(
        "rounding of the inputs, or rows that are missing where they change, may explain {percent:.0f} % of the "
        "variance of the residual of {subject}, and hide a misfit: log every row, with more digits"
    ),
    "heavy_tails": Sentence(_heavy_tails),
    "differ_between_logs": Sentence(_between_logs),
    "differ_in_time": Sentence(_in_time),
    "nothing_held_out": Sentence(
        "nothing was held out: how well the model predicts logs that it never saw is not known (`hold_out`)"
    ),
    "held_out_misfit": Sentence(_held_out_misfit),
    "held_out_colour": Sentence(_held_out_colour),
    "held_out_noise": Sentence("held-out logs are predicted as well as the noise allows"),
}
