"""A plan: inside its room for robots that it has not seen, from rest to rest, and as good as it says."""

import json
from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.cli import main
from omnidyn.identification.methods import OutputError
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.first_guess import first_guess, with_gear
from omnidyn.model.keys import BOX, Key
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import GIVEN
from omnidyn.model.wheels import Wheels
from tests.support.pages import command

AXEBOT, MECANUM = omnidyn.load_robot("axebot"), omnidyn.load_robot("mecanum")
NOISE = {"twist": (0.02, 0.02, 0.1)}
ROOM = (3.0, 3.0)
RATIOS = ("motor.torque_constant_Nm_A", "motor.emf_constant_Vs_rad", "motor.resistance_ohm", "body.mass_kg")


@cache
def plan_of(preset):
    return omnidyn.plan(omnidyn.load_robot(preset), ROOM, noise=NOISE, free=("friction",))


@pytest.fixture(scope="module", params=["axebot", pytest.param("mecanum", marks=pytest.mark.long)])
def made(request):
    return plan_of(request.param)


def driven(robot, commands):
    return omnidyn.simulate(robot, commands.voltage, dt=float(commands.t[1]))


def off(robot, rng):
    """A robot with friction and resistance up to 30 % off."""
    for key in (*BOX, "motor.resistance_ohm"):
        robot = Key.parse(key).set(robot, rng.uniform(0.7, 1.3) * Key.parse(key).get(robot))
    return robot


def test_at_most_2_of_100_robots_leave_the_room(made, draws):
    rng = np.random.default_rng(17)
    left = 0
    for _ in range(draws(50)):
        robot = off(made.robot, rng)
        places = [np.abs(driven(robot, made.commands(held_out)).pose[:, :2]) for held_out in (False, True)]
        left += max(place.max() for place in places) > 0.5 * ROOM[0]
    assert left <= 2 / 100 * draws(50)


def test_each_move_begins_and_ends_at_rest(made):
    run = driven(made.robot, made.commands())
    for start, _ in made.moves:
        row = round(start / made.dt)
        assert not made.commands().voltage[row - 1].any()
        assert np.abs(run.twist[row]).max() < 0.011
    assert np.abs(run.pose[-1, :2]).max() < 0.05  # each move is followed by its mirror image


def test_it_begins_with_ramps_that_leave_the_time_to_what_tells_more(made):
    """A spin needs no room: it is first. Ramps of 2.4 s took 15 of the 50 s, and all numbers were a tenth less sure."""
    first = [move for _, move in made.moves[:3]]
    assert [(move.direction, move.shape) for move in first] == [
        ("turn", "ramp"),
        ("forward", "ramp"),
        ("sideways", "ramp"),
    ]
    assert max(move.level for move in first) < 0.5
    assert made.moves[3][0] < 0.2 * made.seconds


def test_the_fit_of_its_log_is_as_sure_as_it_was_told(made):
    """Of robots 30 % off: what identify says of each number beside its truth, and beside the prediction."""
    rng = np.random.default_rng(3)
    z, halves = [], []
    for _ in range(20):
        robot = off(made.robot, rng)
        run = driven(robot, made.commands())
        log = omnidyn.Run(
            t=run.t, voltage=run.voltage, twist=run.twist + rng.normal(size=run.twist.shape) * NOISE["twist"]
        )
        question = OutputError(free=BOX, nuisances=())
        start = made.robot.replace(motor=robot.motor)  # its resistance is known
        fit = omnidyn.identify(log, start, question)
        for name in BOX:
            z.append((fit.value[name] - Key.parse(name).get(robot)) / fit.std[name])
            halves.append(2.0 * fit.std[name] / fit.value[name] / made.predicted[name].half)
    assert 0.8 < np.std(z) < 1.25
    assert 0.75 < np.median(halves) < 1.3
    assert all(known.is_learnt for known in made.predicted.values())


def test_it_tells_more_than_ramps_and_steps_do():
    """The geometric mean of the standard errors, from the fit's own intervals, in the same time."""
    made = plan_of("axebot")
    patterns = axis_patterns(AXEBOT)
    up = np.concatenate([np.linspace(0.0, 1.0, 250), np.zeros(50)])
    step = np.concatenate([np.ones(120), np.zeros(130)])
    shapes = [sign * level * shape for shape, level in ((up, 3.0), (step, 4.0)) for sign in (1.0, -1.0)]
    rows = np.concatenate([np.outer(shape, pattern) for pattern in patterns for shape in shapes])
    sure = []
    for voltage in (np.concatenate([rows, rows])[: round(60.0 / 0.01)], made.commands().voltage):
        run = omnidyn.simulate(AXEBOT, voltage, 0.01)
        noisy = run.twist + np.random.default_rng(0).normal(size=run.twist.shape) * NOISE["twist"]
        log = omnidyn.Run(t=run.t, voltage=run.voltage, twist=noisy)
        fit = omnidyn.identify(log, AXEBOT, OutputError(free=BOX, nuisances=()))
        sure.append(np.mean([np.log(fit.std[name] / fit.value[name]) for name in BOX]))
    print(f"geometric means of std: ramps and steps {np.exp(sure[0]):.4f}, plan {np.exp(sure[1]):.4f}")
    assert np.exp(sure[0] - sure[1]) > 1.2


def test_what_speeds_tell_is_no_finer_than_models_are(made):
    assert min(number.half for number in made.predicted.values()) >= 0.005
    assert "plan_finer_than_models" not in {said.code for said in made.statements()}


def test_one_number_is_learnt_better_where_it_is_asked_for(plain_plan):
    name = BOX[2]
    aimed = omnidyn.plan(AXEBOT, ROOM, 30.0, noise=NOISE, free=("friction",), aim=name)
    assert aimed.predicted[name].half < 0.9 * plain_plan.predicted[name].half


def test_what_no_log_of_these_channels_tells_is_said_with_what_would():
    """To speeds, volts and ohms and torques come as ratios only."""
    made = omnidyn.plan(AXEBOT, ROOM, 30.0, noise=NOISE, free=("friction", *RATIOS))
    assert len(made.learnt) < len(made.predicted)
    assert made.blind
    assert "log currents" in str(made)


def test_duties_are_planned_as_duties():
    duty = AXEBOT.replace(drive=AXEBOT.drive.replace(kind="duty", supply=6.0))
    made = omnidyn.plan(duty, ROOM, 30.0, noise=NOISE, free=("friction",))
    commands = made.commands()
    assert commands.voltage is None
    assert 0.1 < np.abs(commands.duty).max() <= 1.0


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"area": (3.0,)}, "not the size of a room"),
        ({"area": (3.0, -1.0)}, "not the size of a room"),
        ({"seconds": 1.0}, "seconds: out of range"),
        ({"rate": 1e6}, "rate: out of range"),
        ({"noise": {"sonar": 0.1}}, "no such channel"),
        ({"noise": {"twist": (0.1, 0.2)}}, "not a noise of twist"),
        ({"noise": {"twist": 0.0}}, "not a noise of twist"),
        ({"noise": {}}, "nothing is recorded"),
        ({"aim": "body.mass_kg"}, "not a number that is free"),
    ],
)
def test_what_cannot_be_planned_is_refused(wrong, words):
    arguments = {"area": ROOM, "seconds": 20.0, "noise": NOISE} | wrong
    with pytest.raises(omnidyn.OmnidynError, match=words):
        omnidyn.plan(AXEBOT, arguments.pop("area"), arguments.pop("seconds"), **arguments)


def test_a_robot_that_does_not_stop_has_no_plan():
    heavy = Key.parse("body.mass_kg").set(AXEBOT, 1000.0)
    heavy = Key.parse("body.inertia_kg_m2").set(heavy, 100.0)
    with pytest.raises(omnidyn.OmnidynError, match="no plan moves the robot visibly"):
        omnidyn.plan(heavy, ROOM, 20.0, noise=NOISE)


def test_the_command_writes_two_programs_that_simulate_reads(tmp_path):
    out = tmp_path / "plan.csv"
    words = ("plan", "axebot", "--time", "20", "--noise", "twist=0.02,0.02,0.1")
    told, code, _ = command(*words, "-o", out, "--picture", tmp_path / "plan.svg", "--json")
    assert code == 0
    assert told["unit"] == "V"
    assert set(told["predicted"]) == set(BOX)
    for path in (out, tmp_path / "plan-check.csv"):
        rows = omnidyn.read_commands(path, 3)
        assert command("simulate", "axebot", path, "-o", tmp_path / f"run-{path.name}")[1] == 0
        assert len(rows.rows) > 100
    again = command(*words, "-o", out)
    assert again[1] == 3
    assert "exists" in again[2]
    assert json.dumps(told)


def test_identify_says_what_was_planned_and_what_it_got(tmp_path, capsys):
    out, log = tmp_path / "plan.csv", tmp_path / "log.csv"
    command("plan", "axebot", "--time", "30", "--noise", "twist=0.02,0.02,0.1", "-o", out)
    run = omnidyn.simulate(AXEBOT, omnidyn.read_commands(out, 3).rows, dt=0.01)
    rng = np.random.default_rng(5)
    twist = run.twist + rng.normal(size=run.twist.shape) * NOISE["twist"]
    omnidyn.write_run(omnidyn.Run(t=run.t, voltage=run.voltage, twist=twist), log)
    words = ("identify", log, "--robot", "axebot", "--free", "friction", "--quick", "--planned", tmp_path / "plan.json")
    said, code, err = command(*words, "--json")
    assert code == 0, err
    planned = said["planned"]["all"]
    assert set(planned) == set(BOX)
    # a dead band, which the fit doubts and the plan does not, widens what a level is within
    assert all(0.75 < number["got"] / number["planned"] < 1.75 for number in planned.values())
    assert main([str(word) for word in words]) == 0
    assert "planned, got +- %" in capsys.readouterr().out
    for other in (out, log.with_name("none.json")):
        _, code, err = command(*words[:-1], other)
        assert code == 3
        assert "--planned" in err or "none.json" in err
    of_others = tmp_path / "others.json"
    of_others.write_text(json.dumps({"predicted": {"body.mass_kg": {"half": 0.1, "worst": None}}}))
    said, code, err = command(*words[:-1], of_others, "--json")
    assert code == 0
    assert "planned" not in said
    assert "speaks of other numbers than this fit: body.mass_kg" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--area", "big"), "such as 3x3"),
        (("--noise", "twist"), "such as twist=0.02"),
        (("--time", "3"), "--time: out of range; got 3.0; expected 20"),
        (("--time", "20", "--for", "body.mass_kg"), "--for: not a number that is free"),
    ],
)
def test_options_that_say_nothing_are_refused(words, said):
    _, code, err = command("plan", "axebot", *words)
    assert code == 3
    assert said in err


def test_an_ordinary_robot_is_as_sure_as_it_was_told():
    """Four wheels, duty with latency, counts, a camera of 30 Hz; a log by small steps, by the defaults of identify."""
    four = omnidyn.load_robot("four-wheel")
    sensors = Sensors(encoder_counts=2048, pose_rate=30.0, pose_noise=0.001, heading_noise=0.002)
    robot = four.replace(drive=four.drive.replace(kind="duty", supply=12.0, latency=0.02), sensors=sensors)
    made, rng, fine = omnidyn.plan(robot, ROOM, 40.0), np.random.default_rng(0), 20
    assert "wheel_angle in counts of 0.0031 rad" in str(made)
    finest = min(number.half for number in made.predicted.values())
    said = [said for said in made.statements() if said.code == "plan_finer_than_models"]
    assert [one.numbers["finest"] for one in said] == ([finest] if finest < 0.005 else [])
    assert finest < 0.005
    run = omnidyn.simulate(robot, duty=np.repeat(made.commands().duty, fine, axis=0), supply=12.0, dt=made.dt / fine)
    turned = np.cumsum(0.5 * (run.wheel_speed[1:] + run.wheel_speed[:-1]), axis=0) * made.dt / fine
    tick, rows = 2.0 * np.pi / 2048, slice(None, None, fine)
    angle = np.floor(np.concatenate([np.zeros((1, 4)), turned])[rows] / tick) * tick
    pose = run.pose[rows] + rng.normal(size=angle[:, :3].shape) * (0.001, 0.001, 0.002)
    pose[np.arange(len(pose)) % 3 > 0] = np.nan
    log = omnidyn.Run(t=run.t[rows], duty=run.duty[rows], supply=run.supply[rows], wheel_angle=angle, pose=pose)
    fit = omnidyn.identify(log, robot)
    ratios = [fit.estimate.half_width(name) / number.half for name, number in made.predicted.items()]
    print(f"got over planned: {np.round(ratios, 2)}")
    assert 0.4 < np.exp(np.mean(np.log(ratios))) < 2.5
    assert max(ratios) < 5.0


def test_the_first_plan_of_a_guess_moves_along_every_axis_and_turns_while_it_drives():
    """A guess of friction is an order of magnitude: no robot that may be meant is without any, which would roll for
    seconds. Turning while it drives tells the mass from the spin of rotors (M omega v), which nothing else does."""
    wheels = Wheels(azimuth_deg=(45.0, 135.0, 225.0, 315.0), wheel_radius=0.04, robot_radius=0.17)
    made = omnidyn.plan(with_gear(first_guess("guess", wheels, 4.2, supply=11.8), 30.0, "", GIVEN))
    directions = {move.direction for _, move in made.moves}
    assert {"forward", "sideways", "turn"} <= directions
    assert made.unit == "duty"
    assert {"motor.rotor_inertia_kg_m2", "body.inertia_kg_m2", "friction.direction.coulomb[1]"} <= set(made.learnt)
    assert made.predicted["friction.direction.coulomb[0]"].half < 0.03
