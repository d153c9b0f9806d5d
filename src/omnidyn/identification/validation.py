"""Validation: the fitted robot as a free run beside the logs it was fitted to, and beside logs it never saw.

A model does not follow its log where it misses a signal that was fitted, by the rule of comparison/verdict.py, on
held-out logs where there are any. Headings and positions count on the logs they were fitted to: a free run drifts.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.comparison.compare import compare
from omnidyn.comparison.errors_from_start import PATH, errors_for_whiteness
from omnidyn.comparison.result import Comparison
from omnidyn.comparison.traces import counts_from_start, unit
from omnidyn.comparison.verdict import is_missed
from omnidyn.document import Document, Points, Table, cell, chance_cell
from omnidyn.identification.lack_of_fit import LINE_SHARE, LackOfFit
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.logs.channels import place
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run, as_list
from omnidyn.sensors import COUNTED
from omnidyn.statement import NOTE, WARNING, Statement
from omnidyn.statistics import difference_noise, find_tick, robust_std

FITTED, HELD_OUT = "fitted", "held out"
POSE = {"x": "position[0]", "y": "position[1]", "heading": "heading[0]"}
CHI2_LIMIT = 1.5  # chi2 of held-out logs beyond which the model misses something there
WHITENESS_LIMIT = 0.01


@dataclass(frozen=True)
class Score:
    """One component of some logs. rmse in SI; fit_percent [%] and whiteness as in comparison.Metrics; chi2: mean square
    of the error over the noise, 1 where the model leaves nothing but noise, None without one. The noise is what the fit
    leaves, or where the log shows without the model that this is more than noise, the less that it shows;
    after a fit by Student's t from the median size of the error, for outliers have no part in that noise. chi2 of what
    counts from the start (a pose, the angle of a wheel) is without what the start was off by; that of a counted angle
    allows for the tick of its encoder, tick^2/12.
    """

    samples: int
    rmse: float
    fit_percent: float | None
    chi2: float | None
    whiteness: float | None
    lag: float | None


def coloured(scores: Mapping[str, Score]) -> list[str]:
    """Components whose errors are not white; one white log in a hundred has any, however many components it has."""
    level = WHITENESS_LIMIT / max(len(scores), 1)
    return [name for name, score in scores.items() if score.whiteness is not None and score.whiteness < level]


@dataclass(frozen=True, eq=False)
class Validation:
    """Comparisons with the fitted robot, and the scores in them: "fitted" and "held out" -> component -> Score.

    held_out is None where no log was held out. All are free runs from the measured start. misfit: component -> share of
    what the fit left there that is no noise, by `Estimate.lack_of_fit`; empty where nothing was found, None where
    nothing was asked.
    """

    fitted: Comparison
    held_out: Comparison | None
    scores: dict[str, dict[str, Score]]
    misfit: Mapping[str, float] | None = None

    def table(self) -> Table:
        """The scores, a row per component."""
        rows = [
            (
                logs_key,
                name,
                unit(name),
                str(s.samples),
                f"{s.rmse:.4g}",
                cell(s.fit_percent, ".1f"),
                cell(s.chi2, ".3g"),
                chance_cell(s.whiteness),
                cell(s.lag, "+.3f"),
            )
            for logs_key, score in self.scores.items()
            for name, s in score.items()
        ]
        head = ("logs", "component", "unit", "samples", "rmse", "fit %", "chi2", "white p", "lag s")
        return Table(head, rows, "<<<>")

    def statement(self) -> Statement:
        """What they say of logs held out."""
        held_out_scores = self.scores.get(HELD_OUT)
        if held_out_scores is None:
            return Statement("nothing_held_out", NOTE)
        far_names = [name for name, s in held_out_scores.items() if s.chi2 is not None and s.chi2 > CHI2_LIMIT]
        if far_names:
            worst_chi2, fitted = max(held_out_scores[name].chi2 or 0.0 for name in far_names), self.scores[FITTED]
            is_far_when_fitted = all(name in fitted and (fitted[name].chi2 or 0.0) > CHI2_LIMIT for name in far_names)
            numbers = {"components": tuple(far_names), "chi2": worst_chi2, "fitted_too": is_far_when_fitted}
            return Statement("held_out_misfit", WARNING, numbers=numbers)
        misfit = self.misfit or {}
        names = [name for name in held_out_scores if misfit.get(name, 0.0) >= LINE_SHARE] or coloured(held_out_scores)
        if not names:
            return Statement("held_out_noise", NOTE)
        share = None if self.misfit is None else max((self.misfit.get(name, 0.0) for name in names), default=0.0)
        numbers = {"components": tuple(names), "share": share, "misfit": bool(self.misfit)}
        return Statement("held_out_colour", NOTE, numbers=numbers)

    def not_followed(self, fitted: Collection[str]) -> dict[str, float]:
        """Component -> fit [%] of what the model does not follow, by the rule above. fitted: names of outputs."""
        logs_key = FITTED if self.held_out is None else HELD_OUT
        missed_outputs = {}
        for name in self.scores[FITTED]:
            score = self.scores[FITTED if name in POSE else logs_key].get(name)
            if score is None or score.fit_percent is None or output_name(name) not in fitted:
                continue
            comparison = self.fitted if name in POSE or self.held_out is None else self.held_out
            if is_missed(1.0 - score.fit_percent / 100.0, score.rmse, _scatter(comparison, name)):
                missed_outputs[name] = score.fit_percent
        return missed_outputs

    def summary(self) -> str:
        """A plain table, for reading."""
        return self.document().to_text()

    def document(self) -> Document:
        """The scores, and what they say."""
        return Document([self.table(), Points([self.statement()])], self.to_dict())

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            logs_key.replace(" ", "_"): {
                "logs": [run.source for run in comparison.measured],
                "components": {name: asdict(s) | {"unit": unit(name)} for name, s in self.scores[logs_key].items()},
            }
            for logs_key, comparison in ((FITTED, self.fitted), (HELD_OUT, self.held_out))
            if comparison is not None
        }


def _scatter(comparison: Comparison, name: str) -> float:
    """What the measured signal scatters by from row to row, in its unit."""
    return difference_noise(
        *(comparison.trace(comparison.robots[0], name, segment).measured for segment in comparison.segments)
    )


def validate(
    fit: OutputErrorEstimate,
    runs: Sequence[Run],
    held_out: Sequence[Run] = (),
    progress: Progress = silent,
) -> Validation:
    """Run the fitted robot freely beside the logs it was fitted to and beside those held out, nuisances included.

    What the diagnosis says of the noise counts in chi2; it is made first, unless the fit has none.

    Raises InputError and InsufficientDataError as `compare` does.
    """
    runs, held_out = as_list(runs), as_list(held_out)
    check_order("validate(fit, runs)", (fit, OutputErrorEstimate), (runs, Run), (held_out, Run))
    if fit.study is not None:
        progress(Report("diagnosing"))
    lack = fit.lack_of_fit
    fitted = _compared(fit, runs, progress)
    held_out_comparison = _compared(fit, held_out, progress) if held_out else None
    scores = {FITTED: _scores(fit, lack, fitted, runs)}
    if held_out_comparison is not None:
        scores[HELD_OUT] = _scores(fit, lack, held_out_comparison, held_out)
    return Validation(fitted, held_out_comparison, scores, _misfit(lack, scores[FITTED]))


def _misfit(lack: LackOfFit | None, components: Collection[str]) -> dict[str, float] | None:
    """Component -> share of what the fit left there that is no noise."""
    if lack is None:
        return None
    return {name: lack.channels.get(output_name(name), 0.0) for name in components} if lack.found else {}


def _compared(fit: OutputErrorEstimate, runs: Sequence[Run], progress: Progress) -> Comparison:
    return compare(fit.robot, list(runs), progress=progress, log=fit.robot.log)


def _scores(
    fit: OutputErrorEstimate, lack: LackOfFit | None, comparison: Comparison, logged: Sequence[Run]
) -> dict[str, Score]:
    """The score of each component. What was not fitted has no noise, and no chi2.

    An encoder at rest repeats what it rounds off: of a counted angle nothing tells whether errors are white.
    """
    scores = {}
    for name, channel_errors in comparison.overall[comparison.robots[0]].items():
        tick = _tick(logged, name)
        chi2, white = _chi2(fit, lack, comparison, name, tick), None if tick else channel_errors.whiteness
        scores[name] = Score(
            channel_errors.samples, channel_errors.rmse, channel_errors.fit_percent, chi2, white, channel_errors.lag
        )
    return scores


def _errors(comparison: Comparison, name: str) -> list[FloatArray]:
    """Errors of each free run; of what counts from the start, without what the start was off by."""
    path_names = PATH if name in PATH else (name,)
    traces = {
        key: [comparison.trace(comparison.robots[0], key, segment) for segment in comparison.segments]
        for key in path_names
        if key in comparison.channels
    }
    if counts_from_start(name):
        return errors_for_whiteness(name, traces)
    return [trace.error for trace in traces[name]]


def _tick(logged: Sequence[Run], name: str) -> float:
    """The largest tick of a counted angle in any log [rad]; 0 for what is not counted.

    logged: as recorded.
    """
    channel, column = place(name) or ("", 0)
    if channel not in COUNTED:
        return 0.0
    values = [counts[:, column] for run in logged if (counts := getattr(run, channel)) is not None]
    return max(map(find_tick, values), default=0.0)


def _chi2(
    fit: OutputErrorEstimate, lack: LackOfFit | None, comparison: Comparison, name: str, tick: float
) -> float | None:
    output = output_name(name)
    noise = fit.noise.get(output)
    if not noise:
        return None
    by_students_t = fit.robust
    if lack is not None and lack.noise and output in lack.beyond and not (tick or by_students_t):
        noise /= max(lack.noise[output].chi2, 1.0) ** 0.5
    errors = np.concatenate(_errors(comparison, name))
    errors = errors[np.isfinite(errors)]
    if not errors.size:
        return None
    square = robust_std(errors, 0.0) ** 2 if by_students_t else np.mean(errors**2)
    return float(square / (noise**2 + tick**2 / 12.0))


def output_name(component: str) -> str:
    """A component by the name that a fit gives its output: "w2" is "wheel_speed[1]"."""
    if component in POSE:
        return POSE[component]
    channel_place = place(component)
    return f"{channel_place[0]}[{channel_place[1]}]" if channel_place else component
