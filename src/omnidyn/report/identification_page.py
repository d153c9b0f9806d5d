"""The page of what logs say about a robot: that of the method which said it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.identification.identification import Identification
from omnidyn.identification.methods import MOTOR_METHODS, SteadyState


def render_identification(result: Identification, provenance: Mapping[str, Any]) -> str:
    """The page of an identification, as HTML."""
    study: Any = result.study
    if isinstance(result.method, MOTOR_METHODS):
        from omnidyn.report.motors_page import render_motors  # each imported lazily: slow to load

        return render_motors(study, provenance)
    if isinstance(result.method, SteadyState) and study is not None:
        from omnidyn.report.steady_page import render_study

        return render_study(study, provenance, verdict=result.verdict, verdicts=result.verdicts)
    if isinstance(result.method, SteadyState):
        from omnidyn.report.line_page import render_lines

        return render_lines(result, provenance)
    from omnidyn.report.fit_page import render_fit

    return render_fit(result, provenance)
