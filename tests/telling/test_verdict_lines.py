"""A verdict is one line of at most 25 words, then a list: of every code that a verdict may have, with long names."""

import re

import pytest

from omnidyn.document import VERDICT_WORDS, Document, in_clauses, sentence
from omnidyn.statement import ERROR, NOTE, WARNING, Statement


def of(code, subject="", severity=NOTE, **numbers):
    return Statement(code, severity, subject, numbers)


KEYS = tuple(f"friction.axes.{name}[{k}]" for name in ("coulomb", "viscous") for k in range(3))
KNOWN = of("numbers_known", count=9, missing=KEYS[:5], widest=KEYS[5], share=0.213)
LEVELS = {"share": 0.034, "error": 1.234, "unit": "rad/s"}
SIGNALS = tuple(
    of("signal_followed", name, level=level, **LEVELS)
    for name, level in (("speed over the ground", "noise"), ("wheel speeds", "roughly"), ("heading", "not"))
)
FOLLOWS = of("follows", "the model", signals=SIGNALS)
HELD_OUT = of("held_out_misfit", chi2=9.0, fitted_too=True, components=("w1", "w2"))
CAUSE = of("number_off", "motor.torque_constant_Nm_A", change=-0.061)
ALIKE = (of("gain", gain=0.94), of("cause", subject="motor.voltage_drop_V"))
BEYOND = of(
    "beyond_noise",
    "wheel_speed[0]",
    source="repeats",
    residual=0.1,
    level=0.01,
    unit="rad/s",
    of_moves=0.02,
    share=0.9,
    new=0.95,
)
MISFIT = {
    "share": 0.9, "follows": ("the acceleration and the direction of travel", "voltages and currents"), "beyond": None,
    "cause": CAUSE, "explains": 0.6, "rivals": ("turns of the wheels", "sag"), "alike": ALIKE,
}  # fmt: skip
SHAPES = of("shapes", names=("ellipse-plain", "ellipse-plain+wheel"), groups=("gray floor", "green floor"))
STEADY = {
    "levels": (39.3, 35.6), "groups": ("gray floor", "green floor"), "shapes": SHAPES, "share": 0.062,
    "ties": ("disc", "ellipse", "box", "wheels"), "untested": True, "known": KNOWN,
    "cause": "a constant pull, by a floor that is not level or an offset of sensors",
}  # fmt: skip
CHANGE = of("change_in_run", "exp00.csv", change=-0.637, before=34.4, after=12.5, at=8.125)
MOTORS = {"motors": ("motor 1", "motor 2", "motor 3"), "unit": "%", "total": 4}
CHANGED = tuple(of("number_changed", key, values=(0.5, 0.8), fits=("monday.toml", "friday.toml")) for key in KEYS)
TRACKED = of(
    "tracked",
    "feedforward",
    plant="the robot mecanum",
    worst=0.0123,
    path="figure-eight",
    rmse=0.0045,
    size=1.0,
    saturated=0.12,
)
GAINS = {"names": ("kp", "ki", "kd"), "gains": ((1.2, 1.3, 1.4), 0.5, 0.01), "after": 0.003, "heading_after": 0.004,
         "before": 0.009, "heading_before": 0.01, "less": 0.6, "evaluations": 200}  # fmt: skip
ALIGNED = {"offset": 1.2345, "first": "robot.csv", "correlation": 0.98, "components": "vx, vy and omega",
           "overlap": 32.1, "rival_offset": -3.2, "rival": 0.97}  # fmt: skip
VOLTS = {"voltage": 11.2, "voltage_limit": 12.0, "current_limit": 5.0, "current": 4.2, "grip": True}

VERDICTS = [
    of("model_outcome", logs="held out", follows=FOLLOWS, held_out=HELD_OUT, known=KNOWN),
    of("model_outcome", logs="fitted", follows=FOLLOWS, known=None),
    of("not_compared", known=KNOWN),
    of("cut_short"),
    of("failed", severity=ERROR, failures=(of("outputs_missed", names=("w1", "w2"), percents=(3.0, None)), FOLLOWS)),
    of("logs_with_errors", logs=3, of=8, first=of("log_not_read", "exp00.csv", error="no time column")),
    of("of_group", "gray floor", statement=of("misfit_likely_cause", "wheel_speed[0]", **MISFIT)),
    of("misfit_small", "wheel_speed[0]", missed=0.0024),
    *(
        of(f"misfit_{code}", "wheel_speed[0]", WARNING, **(MISFIT | more))
        for code in ("unexplained", "without_law", "with_rivals", "nearest_cause", "likely_cause")
        for more in ({}, {"follows": (), "beyond": BEYOND})
    ),
    of("slow_errors"),
    of("steady_friction", **STEADY, misfit=True),
    of("steady_friction", **STEADY, misfit=False),
    of("force_changes_in_run", changes=(CHANGE, CHANGE)),
    of("forces_unexplained", "ellipse-plain+wheel", error=7.0, size=12.0),
    of("numbers_of_groups", groups=("gray floor", "green floor"), known=(KNOWN, KNOWN)),
    of("no_motor_answers", **MOTORS),
    of(
        "motors_answer",
        parts=(
            of("motors_start", **MOTORS, levels=(12.3, 13.4, 16.7)),
            of("dead_bands_hardly_known", **MOTORS),
            of("motors_without_dead_band", **MOTORS, too=True),
            of("motors_no_line", **MOTORS, low=20.0, high=80.0),
            of("motors_line_misses", **MOTORS),
            of("motors_not_answering", **MOTORS),
        ),
    ),
    of("follows", "mecanum.toml", signals=SIGNALS),
    of("model_does_not_follow", "mecanum.toml", signals=SIGNALS),
    of("models_compared", nearer=(of("nearer", "a.toml", components="x, y and heading"),), models=(FOLLOWS, FOLLOWS)),
    of("numbers_changed", changed=CHANGED, count=9),
    of("no_number_changed", count=9),
    of("fits_differ_together", fits=3),
    *(of(code, "camera.csv", **ALIGNED) for code in ("logs_aligned", "logs_aligned_in_several_ways", "logs_unlike")),
    TRACKED,
    of("best_tracked", best=TRACKED, others=("pid", "mpc", "lqr"), times=(1.5, 2.3, 4.4)),
    of("can_follow", "mecanum", path="figure-eight", corners=4, **VOLTS),
    of("cannot_follow", "mecanum", path="figure-eight", share=0.3, **VOLTS),
    of("gains_tuned", "pid", **GAINS),
    of("gains_kept", "pid", **(GAINS | {"less": -0.2})),
    of("campaign_done", "friction", samples=1000000, shards=64),
    of("campaign_open", "friction", done=3, shards=64),
    of("campaign_failed", "friction", failed=3, done=3, shards=64),
    of("starts_to_move", "lekiwi", ways=("forward", "sideways", "turning"), volts=(1.2, 2.3, 3.4), stuck=("left",)),
    of("does_not_move", "mecanum", ways="forward, sideways or turning"),
    of("not_made", parts="the report", reason="no space left on the device"),
]  # fmt: skip


@pytest.mark.parametrize("verdict", VERDICTS, ids=lambda verdict: verdict.code)
def test_a_verdict_is_a_line_and_then_a_list(verdict):
    words = sentence(str(verdict))
    first, clauses = in_clauses(words)
    assert len(first.split()) <= VERDICT_WORDS, first
    bare = [re.sub("[.;:,]", "", text) for text in (" ".join([first, *clauses]), words)]
    assert bare[0] == bare[1]
    lines = Document((), verdict=verdict).to_text(10_000).rstrip().splitlines()
    assert lines == [first, *(f"- {clause}" for clause in clauses)]


@pytest.mark.parametrize(
    ("words", "first", "clauses"),
    [
        ("Motor 1 starts at 17 %.", "Motor 1 starts at 17 %.", []),
        ("A b (c; d); e. F g.", "A b (c; d); e.", ["F g"]),
        ("Of 2.5 V; v. 3 is one.", "Of 2.5 V.", ["v. 3 is one"]),
        ("A b: c d: e f g h; i.", "A b: c d.", ["e f g h", "i"]),
        ("A b c (d: e), but f g.", "A b c (d: e).", ["but f g"]),
        ("Dry: a b c, d e f; g.", "Dry: a b c.", ["d e f", "g"]),
    ],
)
def test_clauses_end_outside_of_brackets(words, first, clauses):
    assert in_clauses(words, 5) == (first, clauses)
