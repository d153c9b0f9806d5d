"""Pictures of environments: the robot stands where its pose is; RecordVideo makes a film of a LeKiwi under a policy."""

import sys
from types import ModuleType

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo

import omnidyn
from omnidyn.control.policy import policy_of
from omnidyn.interop.gymnasium import RobotEnv, RobotVectorEnv
from omnidyn.interop.gymnasium.drawing import BODY, GOAL, SIZE, Scene

ROBOT = omnidyn.load_robot("lekiwi")


def middle(image, colour):
    """Column and row of the middle of all pixels of a colour."""
    rows, columns = np.nonzero((image == colour).all(axis=2))
    return columns.mean() + 0.5, rows.mean() + 0.5


def test_the_robot_and_its_goal_are_drawn_where_they_are():
    scene = Scene(ROBOT, np.zeros(2), 1.0)
    image = scene.draw(np.array([0.5, 0.25, 0.0]), np.array([-0.5, -0.5, 0.0]))
    assert image.shape == (SIZE, SIZE, 3)
    assert image.dtype == np.uint8
    x, y = middle(image, BODY)
    assert abs(x - 0.75 * SIZE) < 3.0  # x to the right, y up
    assert abs(y - 0.375 * SIZE) < 3.0
    assert np.allclose(middle(image, GOAL), (0.25 * SIZE, 0.75 * SIZE), atol=3.0)
    covered = (image == BODY).all(axis=2).sum() * (2.0 / SIZE) ** 2
    assert 0.6 < covered / (np.pi * 0.125**2) < 1.0  # wheels and the mark of its front cover the rest
    far = scene.draw(np.array([50.0, 0.0, 0.0]))
    assert not (far == BODY).all(axis=2).any()


def test_the_picture_turns_with_the_robot():
    scene = Scene(ROBOT, np.zeros(2), 0.3)
    image, turned = (scene.draw(np.array([0.0, 0.0, angle])).astype(int) for angle in (0.0, 0.5 * np.pi))
    assert (np.abs(np.rot90(image) - turned).max(axis=2) > 90).mean() < 0.02
    assert (np.abs(image - turned).max(axis=2) > 90).mean() > 0.02


@pytest.mark.parametrize("task", ["velocity", "pose", "path"])
def test_every_task_has_a_picture_of_each_robot(task):
    envs = RobotVectorEnv(3, "lekiwi", task, render_mode="rgb_array")
    envs.reset(seed=1)
    envs.step(np.full((3, 3), 0.5))
    pictures = envs.render()
    assert len(pictures) == 3
    assert all((picture == BODY).all(axis=2).any() for picture in pictures)
    assert RobotEnv("axebot").render() is None


@pytest.fixture
def films(monkeypatch):
    """The films that were written: frames by the name of the file. A stand-in of moviepy, which is not installed."""
    written = {}

    class Clip:
        def __init__(self, frames, fps):
            self.frames, self.fps = np.array(frames), fps

        def write_videofile(self, path, logger=None):
            written[path] = self.frames, self.fps

    for name in ("moviepy", "moviepy.video", "moviepy.video.io", "moviepy.video.io.ImageSequenceClip"):
        module = ModuleType(name)
        module.ImageSequenceClip = Clip
        monkeypatch.setitem(sys.modules, name, module)
    return written


def test_record_video_makes_a_film_of_a_lekiwi_under_a_policy(films, tmp_path):
    rims = ROBOT.wheels.wrench_matrix.T / ROBOT.wheels.radii[:, None] / 4.7
    weight = np.zeros((3, 10))
    weight[:, 3:5], weight[:, 5] = 1.5 * rims[:, :2], 1.5 * rims[:, 2]  # wheel speeds in proportion to the way to go
    policy = policy_of([(weight, np.zeros(3))], "pose", dt=0.02)
    env = RecordVideo(
        gymnasium.make("omnidyn/Pose-v0", robot="lekiwi", render_mode="rgb_array", disable_env_checker=True),
        str(tmp_path / "films"),
        episode_trigger=lambda episode: True,
    )
    seen, _ = env.reset(seed=1, options={"goal": (0.6, -0.4, 0.0)})
    for _ in range(300):
        seen, _, terminated, truncated, infos = env.step(policy(seen).astype(np.float32))
        if terminated or truncated:
            break
    env.close()
    ((frames, fps),) = films.values()
    assert fps == 50
    assert infos["success"]
    assert len(frames) > 30
    first, last = (middle(frame, BODY) for frame in (frames[0], frames[-1]))
    scale = SIZE / (2.0 * (1.0 + 3 * 0.125))
    moved = (np.array(last) - first) / scale
    assert np.allclose(moved, [0.6, 0.4], atol=0.05)  # to the goal: rows of a picture go down
