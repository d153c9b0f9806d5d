"""A trained policy as a controller: it sees what the environment showed, and its file is plain."""

import io
import zipfile

import numpy as np
import pytest

import omnidyn
from omnidyn.control.controller import BAD_POSE, OK
from omnidyn.control.policy import Policy, load_policy, policy_of, save_policy
from omnidyn.errors import InputError
from omnidyn.model.drive import Drive
from omnidyn.model.log_effects import Sensors
from omnidyn.simulation.environments.environments import Environments, Setting
from omnidyn.simulation.environments.layout import columns_of

AXEBOT = omnidyn.load_robot("axebot")
RANDOM = np.random.default_rng(8)
COLUMNS = {"velocity": 9, "pose": 10, "path": 15}


def network(task, wheels=3):
    columns = COLUMNS[task] + wheels - 3
    layers = [
        (0.5 * RANDOM.normal(size=(8, columns)), RANDOM.normal(size=8)),
        (RANDOM.normal(size=(wheels, 8)), np.zeros(wheels)),
    ]
    return policy_of(layers, task)


@pytest.mark.parametrize("task", COLUMNS)
def test_it_sees_in_a_loop_what_the_environment_shows(task):
    """The environment drives along the same path under the same actions: the observations agree."""
    assert columns_of(list(COLUMNS).index(task), 3) == COLUMNS[task]
    made = network(task)
    path = (
        omnidyn.path("eight:heading=along")
        if task == "path"
        else omnidyn.path("goal:x_m=0.4,heading_rad=0.5,travel_s=0")
    )
    motion = path.at(np.arange(400) * 0.02)
    rows = np.concatenate([motion.pose, motion.velocity], axis=1)
    envs = Environments(AXEBOT, 1, Setting(task, spread=(0.0, 0.0, 0.0)), path=rows, dtype=np.float64)
    seen = envs.reset(seed=1)
    if task == "pose":
        envs.state.goal[0, :, 0] = motion.pose[0]
    policy = Policy(AXEBOT, policy=made)
    last, start = np.zeros(3), float(envs.state.start[0, 0])
    for k in range(30):
        pose = envs.pose[0] if task != "velocity" else np.zeros(3)
        shown = policy.observation((start + k) * 0.02, pose, envs.twist[0], path, last)
        if k or task != "pose":
            assert shown == pytest.approx(seen[0], abs=1e-9)
        last = made(shown)
        seen = envs.step(last[None]).observation


def test_track_takes_it_by_file_and_by_value(tmp_path):
    made = network("path")
    file = save_policy(made, tmp_path / "policy.npz")
    by_file = omnidyn.track(AXEBOT, "eight", str(file), duration=0.6)
    by_value = omnidyn.track(AXEBOT, "eight", Policy(AXEBOT, policy=made), duration=0.6)
    by_spec = omnidyn.track(AXEBOT, "eight", omnidyn.load_controller(file), duration=0.6)
    assert np.array_equal(by_file.run.pose, by_value.run.pose)
    assert np.array_equal(by_file.run.pose, by_spec.run.pose)
    assert by_file.run.pose[-1].any()


def test_a_file_keeps_every_bit(tmp_path):
    made = network("pose")
    again = load_policy(save_policy(made, tmp_path / "policy.npz"))
    assert (again.task, again.dt, again.wheels) == ("pose", 0.02, 3)
    assert all(
        np.array_equal(a, b)
        for one, other in zip(made.layers, again.layers, strict=True)
        for a, b in zip(one, other, strict=True)
    )


def test_duties_are_shares_of_the_supply():
    duty = AXEBOT.replace(drive=Drive(kind="duty", supply=7.4))
    made = network("path")
    volts, shares = Policy(AXEBOT, policy=made), Policy(duty, policy=made)
    for policy in (volts, shares):
        policy.sent = policy.step(0.0, np.zeros(3), np.zeros(3), omnidyn.path("eight"))
        assert policy.info.status == OK
    assert shares.sent * 7.4 == pytest.approx(volts.sent)


def test_what_is_missing_gives_zeros_and_sensors_are_taken_as_they_are():
    policy = Policy(AXEBOT.replace(sensors=Sensors(pose_delay=0.1, twist_filter=0.1)), policy=network("path"))
    assert not policy.step(0.0, None, np.zeros(3), omnidyn.path("eight")).any()
    assert policy.info.status == BAD_POSE
    plain = Policy(AXEBOT, policy=policy.policy)
    for k in range(4):
        seen = np.full(3, 0.001 * k), np.full(3, 0.05)
        sent = [one.step(0.5 + 0.02 * k, *seen, omnidyn.path("eight")) for one in (policy, plain)]
        assert np.array_equal(*sent)


def archive(**values):
    buffer = io.BytesIO()
    np.savez(buffer, **values)
    return buffer.getvalue()


def bomb():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("w_0.npy", bytes(64 * 2**20))
    return buffer.getvalue()


@pytest.mark.parametrize(
    "content, message",
    [
        (b"", "empty"),
        (b"PK\x03\x04 but no zip", "not a policy"),
        (bomb(), "too large"),
        (archive(schema=2), "schema"),
        (archive(schema=1, task="fly", dt=0.02, w_0=np.zeros((3, 9)), b_0=np.zeros(3)), "unknown task"),
        (archive(schema=1, task="velocity", dt=0.02, w_0=np.zeros((3, 8)), b_0=np.zeros(3)), "9 columns"),
        (archive(schema=1, task="velocity", dt=0.02, w_0=np.full((3, 9), np.nan), b_0=np.zeros(3)), "not a layer"),
        (archive(schema=1, task="velocity", dt=0.02, w_0=np.array([{}], dtype=object), b_0=np.zeros(3)), "pickle"),
    ],
)
def test_what_is_no_policy_is_refused(tmp_path, content, message):
    file = tmp_path / "policy.npz"
    file.write_bytes(content)
    with pytest.raises(InputError, match=message):
        omnidyn.track(AXEBOT, "eight", str(file))


def test_other_steps_and_other_drives_are_refused(tmp_path):
    with pytest.raises(InputError, match="other steps"):
        Policy(AXEBOT, policy=network("path"), dt=0.01)
    with pytest.raises(InputError, match="another drive"):
        Policy(omnidyn.load_robot("four-wheel"), policy=network("path"))


def test_a_file_that_is_no_policy_is_refused_when_it_is_loaded(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        omnidyn.load_controller(tmp_path / "nowhere.npz")
    (tmp_path / "bad.npz").write_bytes(b"PK\x03\x04junk")
    with pytest.raises(InputError, match="not a policy"):
        omnidyn.load_controller(tmp_path / "bad.npz")
