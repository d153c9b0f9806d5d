"""Logs as they come: gaps, several runs, missing rows, duty and supply, latency, outliers; and what is refused."""

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.solve.solver import of_states
from omnidyn.model.keys import BOX
from omnidyn.model.robot import Prior
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, TRUTH, noisy, voltages


@pytest.fixture(scope="module")
def clean(axebot):
    return simulate(axebot, voltages(np.random.default_rng(11)), 0.01)


def holds(fit, many=4.5):
    """Whether all friction numbers are within `many` standard errors of the truth."""
    return all(abs(fit.value[key] - true) <= many * fit.std[key] for key, true in TRUTH.items())


def rows(run, keep):
    return Run(t=run.t[keep], **{name: value[keep] for name, value in run.channels.items()})


def test_a_log_with_gaps_is_split_and_each_piece_starts_where_it_starts(axebot, clean):
    """A quarter of the rows lost in three gaps: the motion goes on unseen, each piece has its own start."""
    log = noisy(clean, 1)
    keep = np.ones(len(log), bool)
    for start, length in ((400, 150), (1300, 300), (2200, 280)):
        keep[start : start + length] = False
    fit = identify(rows(log, keep), axebot, OutputError(nuisances=())).estimate
    assert holds(fit)
    assert fit.covariance == "white"  # a piece that starts wrong would leave a tail


def test_a_last_row_without_inputs_says_nothing_of_a_latency(axebot, clean):
    """Nothing follows it, so that it needs none; its slope by a latency was no number, and the fit broke."""
    log = noisy(clean, 2)
    voltage = log.voltage.copy()
    voltage[-1] = np.nan
    assert holds(
        identify(log.replace(voltage=voltage), axebot, OutputError(nuisances=("latency",)), quick=True).estimate
    )


def test_rows_without_input_split_the_log_too(axebot, clean):
    log = noisy(clean, 2)
    voltage = log.voltage.copy()
    voltage[1000:1040] = np.nan
    fit = identify(log.replace(voltage=voltage), axebot, OutputError(nuisances=())).estimate
    assert holds(fit)
    assert [each.numbers["rows"] for each in fit.warnings if each.code == "split_at_missing_inputs"] == [40]


def test_two_runs_are_worth_two(axebot, clean):
    other = simulate(axebot, voltages(np.random.default_rng(12)), 0.01)
    logs = [noisy(clean, 3), noisy(other, 4)]
    both = identify(logs, axebot, OutputError(nuisances=())).estimate
    assert holds(both)
    single = [identify(log, axebot, OutputError(nuisances=())).estimate for log in logs]
    for key in BOX:
        together = 1.0 / np.sqrt(sum(1.0 / fit.std[key] ** 2 for fit in single))
        assert both.std[key] == pytest.approx(together, rel=0.05)


def test_irregular_steps_and_missing_outputs(axebot):
    rng = np.random.default_rng(5)
    dt = rng.uniform(0.004, 0.02, 2500)
    run = noisy(simulate(axebot, voltages(rng, 25.0)[:2500], dt), 5)
    twist = run.twist.copy()
    twist[rng.random(twist.shape) < 0.3] = np.nan
    assert holds(identify(run.replace(twist=twist), axebot, OutputError(nuisances=())).estimate)


def test_wheel_speeds_alone(axebot, clean):
    rng = np.random.default_rng(6)
    speed = clean.wheel_speed + 0.5 * rng.normal(size=clean.wheel_speed.shape)
    fit = identify(Run(t=clean.t, voltage=clean.voltage, wheel_speed=speed), axebot, OutputError(nuisances=())).estimate
    assert holds(fit)
    assert list(fit.noise) == ["wheel_speed[0]", "wheel_speed[1]", "wheel_speed[2]"]
    assert list(fit.noise.values()) == pytest.approx([0.5] * 3, rel=0.05)


def test_a_heading_alone_gives_the_friction_about_yaw(axebot, clean):
    """Only the heading is measured, to 2 mrad; the axes x and y cannot be seen, and yaw counts from where it was."""
    rng = np.random.default_rng(7)
    pose = np.full(clean.pose.shape, np.nan)
    pose[:, 2] = clean.pose[:, 2] + 0.7 + 0.002 * rng.normal(size=len(clean))
    keys = ["friction.axes.viscous[2]", "friction.axes.coulomb[2]"]
    fit = identify(
        Run(t=clean.t, voltage=clean.voltage, pose=pose), axebot, OutputError(nuisances=(), free=keys)
    ).estimate
    for key in keys:
        assert abs(fit.value[key] - TRUTH[key]) < 4.5 * fit.std[key]
        assert fit.std[key] < 0.05 * TRUTH[key]


def test_a_duty_with_its_supply_is_a_voltage(axebot, clean):
    log = noisy(clean, 8)
    supply = np.linspace(12.6, 11.4, len(log))
    duty = log.voltage / supply[:, None]
    fit = identify(
        Run(t=log.t, duty=duty, supply=supply, twist=log.twist), axebot, OutputError(nuisances=(), start="rest")
    ).estimate
    direct = identify(log, axebot, OutputError(nuisances=(), start="rest")).estimate
    for key in BOX:
        assert fit.value[key] == pytest.approx(direct.value[key], rel=1e-6)


def test_a_nominal_supply_is_uncertain(axebot, clean):
    """The battery has 11 V where the file says 12: the gain finds it, and everything is as uncertain as that."""
    log = noisy(clean, 9)
    robot = axebot.replace(drive=axebot.drive.replace(kind="duty", supply=12.0))
    run = Run(t=log.t, duty=log.voltage / 11.0, twist=log.twist)
    fit = identify(run, robot, OutputError(nuisances=["gain"])).estimate
    assert fit.nuisances["gain"].value == pytest.approx(11.0 / 12.0, rel=0.02)
    assert holds(fit)
    assert [each.numbers["supply"] for each in fit.warnings if each.code == "supply_nominal"] == [12.0]


def test_latency_gain_dead_band_and_outliers_at_once(axebot):
    """13 ms, 0.97, 0.15 V; 2 % of the samples wild, steps as large as the noise: made by simulate on a fine grid."""
    voltage, rng = voltages(np.random.default_rng(13), 40.0), np.random.default_rng(14)
    applied = 0.97 * np.sign(voltage) * np.maximum(np.abs(voltage) - 0.15, 0.0)
    fine = simulate(axebot, np.repeat(applied, 10, axis=0), 0.001)
    seen = np.arange(len(voltage)) * 10 - 13
    twist = np.where((seen >= 0)[:, None], fine.twist[np.maximum(seen, 0)], 0.0)
    twist = twist + rng.normal(size=twist.shape) * NOISE
    twist += rng.normal(size=twist.shape) * (rng.random(twist.shape) < 0.02)
    run = Run(t=np.arange(len(voltage)) * 0.01, voltage=voltage, twist=np.round(twist / NOISE) * NOISE)
    fit = identify(run, axebot, OutputError(nuisances=["latency", "gain", "dead_band"], loss="student-t")).estimate
    assert holds(fit)
    for name, true in (("latency.twist", 0.013), ("gain", 0.97), ("dead_band", 0.15)):
        assert abs(fit.nuisances[name].value - true) < 4.5 * fit.nuisances[name].std
    assert fit.nuisances["latency.twist"].std < 5e-4


def test_a_current_that_comes_late(axebot, clean):
    """1.7 rows late: no descent from 0 crosses the jumps of the voltage; the few latencies tried first do."""
    voltage, rng = clean.voltage[:-1], np.random.default_rng(15)
    fine = simulate(axebot, np.repeat(voltage, 10, axis=0), 0.001)
    seen = np.maximum(np.arange(len(clean)) * 10 - 17, 0)
    current = fine.current[seen] + 0.05 * rng.normal(size=clean.current.shape)
    fit = identify(noisy(clean, 15).replace(current=current), axebot, OutputError(nuisances=["latency"])).estimate
    assert fit.nuisances["latency.current"].value == pytest.approx(0.017, abs=1e-3)
    assert holds(fit)


def test_breakaway_is_bracketed(axebot, clean):
    coulomb = (2.2, 1.5, 0.099)
    axes = axebot.friction.axes.replace(breakaway=(2.75, *coulomb[1:]))
    sticky = axebot.replace(friction=axebot.friction.replace(axes=axes))
    key = "friction.axes.breakaway[0]"
    fit = identify(
        noisy(simulate(sticky, clean.voltage[:-1], 0.01), 16),
        axebot,
        OutputError(nuisances=(), free=[*BOX, key], start="rest"),
    ).estimate
    low, high = fit.ci95[key]
    assert low <= 2.75 <= high
    assert low > 2.25  # told from coulomb
    assert holds(fit)
    assert fit.robot.friction.axes.breakaway[0] == fit.value[key]
    assert fit.robot.friction.axes.breakaway[1:] == fit.robot.friction.axes.coulomb[1:]


def test_an_axis_that_never_moved_is_bounded_from_below(axebot, clean):
    """The yaw part of the voltages shrunk until it is below breakaway: 0.099 N m."""
    voltage = clean.voltage[:-1] - 0.98 * clean.voltage[:-1].mean(axis=1, keepdims=True)
    fit = identify(noisy(simulate(axebot, voltage, 0.01), 17), axebot, OutputError(nuisances=(), start="rest")).estimate
    bound = fit.lower_bound["friction.axes.breakaway[2]"]
    assert 0.0 < bound < 0.099
    assert "friction.axes.coulomb[2]" not in fit.value
    assert ("axis_not_moved", "yaw") in {(each.code, each.subject) for each in fit.warnings}


def test_a_dead_sensor_bounds_nothing(axebot, clean):
    log = noisy(clean, 17)
    fit = identify(
        log.replace(twist=log.twist * [1.0, 1.0, 0.0]), axebot, OutputError(nuisances=(), start="rest")
    ).estimate
    assert not fit.lower_bound
    (still,) = [each for each in fit.warnings if each.code == "axis_not_moved"]
    assert (still.subject, still.numbers["dead"]) == ("yaw", True)


def test_what_has_a_std_is_free_with_it_as_a_prior_but_never_one_of_an_earlier_fit(axebot, clean):
    log, key = noisy(clean, 18), "motor.resistance_ohm"
    robot = axebot.replace(priors={key: Prior(std=0.05, source="datasheet"), BOX[0]: Prior(std=1e-6)})
    plain = identify(log, robot, OutputError(nuisances=(), start="rest", fixed=[key])).estimate
    assert key not in plain.value
    known = identify(log, robot, OutputError(nuisances=(), start="rest")).estimate
    assert abs(known.value[key] - 1.69) < 0.15
    assert known.std[key] < 0.05
    assert known.value[BOX[0]] == pytest.approx(0.94, abs=1e-5)  # its prior is narrow
    assert BOX[0] in known.unidentifiable  # and the logs tell less of it
    loose = identify(
        log, axebot.replace(priors={key: Prior(std=0.05)}), OutputError(nuisances=(), start="rest")
    ).estimate
    alone = identify(log, axebot, OutputError(nuisances=(), start="rest")).estimate
    assert loose.std[BOX[3]] > alone.std[BOX[3]]  # an uncertain resistance makes friction uncertain
    again = identify(log, alone.robot, OutputError(nuisances=(), start="rest")).estimate
    assert again.std[BOX[0]] == pytest.approx(alone.std[BOX[0]], rel=1e-3)


def test_what_is_written_can_be_read_and_says_where_it_comes_from(axebot, clean, tmp_path):
    from omnidyn.model.robot_file import load_robot, save_robot

    fit = identify(
        noisy(clean, 19).replace(source="yard.csv"), axebot, OutputError(nuisances=(), start="rest")
    ).estimate
    robot = load_robot(save_robot(fit.robot, tmp_path / "fit.toml"))
    assert robot.friction == fit.robot.friction
    assert robot.priors[BOX[0]].origin == "identified"
    assert robot.priors[BOX[0]].source.startswith("output error, yard.csv")
    assert robot.priors[BOX[0]].std == pytest.approx(fit.std[BOX[0]])
    assert "friction.axes.viscous[0]" in fit.summary()
    assert fit.to_dict()["covariance"] == "white"


@pytest.mark.parametrize(
    "options, message",
    [
        ({"free": ["body.mass_kg", "body.mass_kg"]}, "asked for twice; got body.mass_kg"),
        ({"free": ["body.mas_kg"]}, "unknown key; got body.mas_kg; did you mean body.mass_kg"),
        ({"free": []}, "nothing is free; got no key; expected at least one"),
        ({"nuisances": ["wind"]}, "no such nuisance; got wind; expected latency, gain, dead_band, fade"),
        ({"nuisances": ["latency.current"]}, "no such channel; got latency.current; expected twist"),
        ({"loss": "huber"}, "unknown loss; got huber; expected gaussian or student-t"),
        ({"covariance": "grey"}, "unknown covariance; got grey"),
        ({"start": "flying"}, "unknown start; got flying; expected auto, rest or free"),
        ({"outputs": ["smell"]}, "no such output; got smell; expected twist, wheel_speed"),
        ({"outputs": ["current"]}, "the log has no output to fit; got voltage, twist; expected current"),
        ({"free": ["body.mass_kg"], "fixed": ["body.inertia_kg_m2"]}, "fixed, but not free; got body.inertia_kg_m2"),
    ],
)
def test_options_that_cannot_be_used(axebot, clean, options, message):
    with pytest.raises(InputError, match=message.replace("[", r"\[")):
        identify(noisy(clean, 1), axebot, OutputError(**{"nuisances": (), **options}))


def test_logs_that_cannot_be_used(axebot, four_wheel, clean):
    log = noisy(clean, 1)
    with pytest.raises(InputError, match="nothing to fit to; got no runs"):
        identify([], axebot, OutputError(nuisances=()))
    with pytest.raises(InputError, match="the log has no input; got twist; expected voltage or duty"):
        identify(Run(t=log.t, twist=log.twist), axebot, OutputError(nuisances=()))
    with pytest.raises(InputError, match="a duty needs a supply"):
        identify(Run(t=log.t, twist=log.twist, duty=log.voltage / 6.0), axebot, OutputError(nuisances=()))
    with pytest.raises(UnsupportedError, match="only set speeds are logged"):
        identify(Run(t=log.t, twist=log.twist, twist_command=log.twist), axebot, OutputError(nuisances=()))
    with pytest.raises(InputError, match="the log has another number of wheels; got 3; expected 4"):
        identify(log, four_wheel, OutputError(nuisances=()))
    fourth = log.replace(voltage=np.column_stack([log.voltage, np.full(len(log), np.nan)]), current=None)
    with pytest.raises(InputError, match=r"wheels without any input; got none for wheel 4; expected one for each of"):
        identify(fourth.replace(wheel_speed=None), four_wheel, OutputError(nuisances=()))
    slips = axebot.replace(wheels=axebot.wheels.replace(traction_mu=0.4, wheel_inertia=2e-5))
    with pytest.raises(UnsupportedError, match=r"does not know all that is asked for; got tilt\.x"):
        identify(log, slips, OutputError(nuisances=["tilt.x"]))
    still = np.random.default_rng(1).normal(size=log.twist.shape) * NOISE
    with pytest.raises(InsufficientDataError, match=r"the robot never visibly moved.*x held 0"):
        identify(log.replace(voltage=log.voltage * 0.01, twist=still), axebot, OutputError(nuisances=()))
    with pytest.raises(InsufficientDataError, match="no stretch of the log has inputs throughout"):
        identify(log.replace(voltage=np.full(log.voltage.shape, np.nan)), axebot, OutputError(nuisances=()))


def test_nuisances_by_default_are_those_that_a_log_supports(axebot, clean):
    """Latency and dead band are fitted where the log tells them; a gain of 0.96 is not, but the diagnosis names it."""
    log = noisy(clean, 20)
    fit = identify(log, axebot, OutputError()).estimate
    assert set(fit.nuisances) == {"latency.twist", "dead_band"}
    assert holds(fit)
    assert not fit.warnings
    wrong = identify(log.replace(voltage=log.voltage / 0.96), axebot, OutputError()).estimate
    remedies = wrong.lack_of_fit.remedies
    assert "gain" in {remedies[0].key, *remedies[0].same_as}
    (gain,) = [remedy for remedy in remedies if remedy.key == "gain"]
    found = dict(zip(gain.cause.numbers["keys"], gain.cause.numbers["values"], strict=True))
    assert found["gain"] == pytest.approx(0.96, abs=0.02)
    again = identify(
        log.replace(voltage=log.voltage / 0.96), axebot, OutputError(nuisances=["latency", "gain"])
    ).estimate
    assert holds(again)


def test_a_start_that_no_row_tells_of_stays_where_it_is():
    """Two states, of which one leaves no trace: the other is solved for, and this one does not move."""
    np.testing.assert_allclose(of_states(np.diag([4.0, 0.0]), np.array([2.0, 0.0])), [0.5, 0.0])
    np.testing.assert_allclose(of_states(np.diag([4.0, 2.0]), np.array([2.0, 1.0])), [0.5, 0.5])
