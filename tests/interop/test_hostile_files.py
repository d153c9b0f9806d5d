"""Models from strangers: no other file is opened, nothing grows, nothing is left behind, nothing impossible is read."""

import os
import resource

import numpy as np
import pytest

from omnidyn.errors import InputError, OmnidynError
from omnidyn.interop.kinds import import_robot
from omnidyn.interop.mjcf import _compiled, robot_of_mjcf
from omnidyn.interop.mjcf_parts import MOST_PARTS
from omnidyn.interop.robot_json import robot_of_json
from omnidyn.interop.urdf import robot_of_urdf
from tests.interop.test_imports import kiwi, model_wheels
from tests.support.cases import case
from tests.support.growth import LINEAR, growth, linear

GOOD = model_wheels()


@pytest.fixture(autouse=True)
def _mujoco():
    pytest.importorskip("mujoco")


def with_asset(asset):
    return GOOD.replace("<worldbody>", f"{asset}<worldbody>")


def with_part(part):
    return GOOD.replace('mass="3"/>', f'mass="3"/>{part}')


@pytest.mark.parametrize(
    "text",
    [
        with_asset('<asset><texture name="t" type="2d" builtin="flat" width="17000" height="17000"/></asset>'),
        with_asset('<asset><hfield name="h" nrow="20000" ncol="20000" size="1 1 1 1"/></asset>'),
        with_asset('<size memory="1G"/>'),
        with_asset('<size njmax="2000000000" nconmax="2000000000"/>'),
        with_asset('<asset><model name="x" content_type="text/xml"/></asset>'),
        with_asset('<visual><global offwidth="60000" offheight="60000"/></visual>'),
        with_part('<site name="s"/><camera name="c" resolution="60000 60000"/><light name="l"/>'),
        GOOD.replace("</worldbody>", "</worldbody><sensor><user name='a' dim='2000000000' needstage='acc'/></sensor>"),
        with_asset('<option timestep="1e-300" noslip_iterations="2000000000"/>'),
    ],
)
def test_what_says_nothing_of_masses_is_not_made(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    robot, plain = robot_of_mjcf(text), robot_of_mjcf(GOOD)
    assert (robot.body, robot.wheels) == (plain.body, plain.wheels)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    "text, words",
    [
        (with_asset('<asset><texture type="cube" name="t" fileright="pipe.png"/></asset>'), "got pipe.png"),
        (with_asset('<asset><texture type="cube" name="t" fileback="/etc/hosts"/></asset>'), "got /etc/hosts"),
        (with_asset('<asset><mesh name="m" file="a.stl"/></asset>'), "takes from other files; got a.stl"),
        (with_asset('<asset><hfield name="h" file="a.png"/></asset>'), "takes from other files"),
        (with_asset('<include file="pipe.png"/>'), "takes from other files"),
        (with_part('<replicate count="300000"><geom size=".01"/></replicate>'), "not read; got <replicate>"),
        (with_part('<attach model="x" prefix="a"/>'), "not read; got <attach>"),
        (with_part('<composite type="grid" count="300 300 300"/>'), "not read; got <composite>"),
        (with_part('<flexcomp type="grid" count="300 300 300" name="f"/>'), "not read; got <flexcomp>"),
        (with_part('<plugin plugin="mujoco.elasticity.cable"/>'), "not read; got <plugin>"),
        (with_asset('<extension><plugin plugin="a"/></extension>'), "not read; got <extension>"),
        (with_part('<geom type="mesh" mesh="m"/>'), "shape of this geom is not in the model; got m"),
        (with_part('<geom size="0.01"/>' * MOST_PARTS), f"too large.*at most {MOST_PARTS}"),
        (with_part("<body><geom size='.01'/>" * 200 + "</body>" * 200), "too large.*100 deep"),
        (with_part('<body><inertial pos="0 0 0" mass="1" diaginertia="-1 1 1"/></body>'), "negative mass or inertia"),
        (with_part('<body><inertial pos="0 0 0" mass="-1" diaginertia="1 1 1"/></body>'), "negative mass or inertia"),
        (with_part('<geom size="0.1" density="-1e3"/>'), "negative mass or inertia"),
    ],
)
def test_what_a_model_may_not_ask_for(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.png")  # nobody writes into it: whoever opens it waits for ever
    with pytest.raises(InputError, match=words):
        robot_of_mjcf(text)
    assert os.listdir(tmp_path) == ["pipe.png"]


def test_a_large_model_that_is_allowed_takes_no_contacts(tmp_path, monkeypatch):
    """A thousand geoms in one place; 30 that move on their own are 435 pairs that touch."""
    monkeypatch.chdir(tmp_path)

    def imported(size, number):
        robot = robot_of_mjcf(with_part('<geom size="0.01" mass="0.001"/>' * size))
        assert robot.body.mass == pytest.approx(3.3 + 0.001 * size)

    assert growth(imported, MOST_PARTS - 20) <= LINEAR
    part = '<body><joint type="hinge"/><geom size="0.01" mass="0.001"/></body>'
    mujoco, model, data = _compiled(with_part(part * 30), "robot.xml")
    assert data.ncon == 0
    mujoco.mj_forward(model, data)
    assert data.ncon >= 435
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["attach", "fifo", "good", "hfield", "memory", "other", "replicate", "texture"])
def test_the_cases(name, tmp_path, monkeypatch):
    path = case(f"code/mjcf_import/{name}.xml")
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.png")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    if name in ("fifo", "other", "replicate"):
        with pytest.raises(InputError, match=r"takes from other files|<replicate>"):
            import_robot("mjcf", path)
    else:
        assert import_robot("mjcf", path).body.mass == pytest.approx(5.3)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000
    assert os.listdir(tmp_path) == ["pipe.png"]


@pytest.mark.parametrize("kind", ["json", "urdf", "mjcf"])
def test_a_pipe_is_no_file(kind, tmp_path):
    os.mkfifo(tmp_path / "pipe.xml")
    with pytest.raises(InputError, match="not a regular file"):
        import_robot(kind, tmp_path / "pipe.xml")


@pytest.mark.parametrize(
    "old, new",
    [
        ('ixx="0.1"', 'ixx="-0.1"'),
        ('izz="0.06"', 'izz="-0.06"'),
        ('iyy="0.1"', 'iyy="0.1" ixy="0.3"'),
        ('ixx="1e-4"', 'ixx="-1e-4"'),
        ('mass value="0.2"', 'mass value="-0.2"'),
        ('mass value="1"', 'mass value="-1"'),
    ],
)
def test_a_negative_inertia_is_refused(old, new):
    assert old in kiwi()
    with pytest.raises(InputError, match=r"no body has a negative mass or inertia; got .*; expected 0 or more"):
        robot_of_urdf(kiwi().replace(old, new))


@pytest.mark.parametrize("value", ["1e308", "1e200", "1e10"])
@pytest.mark.parametrize("old", ['mass value="4"', 'ixx="0.1"', 'radius="0.04"', 'xyz="0 0 0.05"'])
def test_huge_numbers_are_refused_in_words(old, value):
    name = old.partition("=")[0]
    text = kiwi().replace(old, f'{name}="{value}"' if "xyz" not in old else f'xyz="0 {value} 0"')
    assert text != kiwi()
    with np.errstate(all="ignore"), pytest.raises(InputError):
        robot_of_urdf(text)


LINK, JOINT = '<link name="a"/>', '<joint name="j"><child link="base"/><parent link="base"/></joint>'
MANY = {  # name -> a size, what reads it, and a file of that size: ms that no cache of the processor makes a few less
    "links": (80_000, robot_of_urdf, lambda n: f"<robot>{LINK * n}</robot>"),
    "joints": (80_000, robot_of_urdf, lambda n: f"<robot>{JOINT * n}</robot>"),
    "a deep tree": (160_000, robot_of_urdf, lambda n: f"<robot>{'<a>' * n}{'</a>' * n}</robot>"),
    "a long name": (200_000, robot_of_urdf, lambda n: f"<robot {'a' * n}='1'/>"),
    "a deep tree of MuJoCo": (160_000, robot_of_mjcf, lambda n: f"<mujoco>{'<a>' * n}{'</a>' * n}</mujoco>"),
}


@pytest.mark.parametrize("name", MANY)
def test_many_links_and_deep_trees_are_refused_in_linear_time(name):
    size, read, make = MANY[name]

    def refused(size, number):
        with pytest.raises(InputError):
            read(make(size))

    # A tree of a large file is 50 MB: a busy neighbour takes the processor's caches, and memory is twice as slow.
    assert growth(refused, size, linear(16), factor=16) <= linear(16)


def test_a_key_that_stands_twice_is_found_in_linear_time():
    def refused(size, number):
        keys = ",".join(f'"key{k}":1' for k in range(size))
        with pytest.raises(InputError, match=f"a key stands twice; got key{size - 1}"):
            robot_of_json(f'{{{keys},"key{size - 1}":2}}')

    assert growth(refused, 40_000) <= LINEAR


def test_models_with_pieces_torn_out_end_in_words(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(1)
    for _ in range(100):
        first, last = sorted(rng.integers(0, len(GOOD), 2))
        try:
            robot_of_mjcf(GOOD[:first] + GOOD[min(last, first + 40) :])
        except OmnidynError:
            continue
    assert os.listdir(tmp_path) == []
