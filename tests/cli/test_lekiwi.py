"""Commands over datasets of LeRobot, and over URDF files whose wheels are meshes."""

from omnidyn import load_robot, read_log
from tests.support.lerobot_set import ROWS, lerobot_episode, write_dataset
from tests.support.mesh_robot import urdf_robot


def test_commands_take_the_folder_and_a_folder_of_datasets(call, here):
    write_dataset(here / "both" / "one", [lerobot_episode(1)])
    write_dataset(here / "both" / "two", [lerobot_episode(2)])
    code, out, _ = call("check", "both", "--robot", "lekiwi")
    assert code == 0
    assert {line.split()[0] for line in out.splitlines() if line.endswith("  whole logs")} == {"one", "two"}
    assert "tasks" not in out
    assert call("convert", "both/one", "one.csv")[0] == 0
    assert read_log(here / "one.csv").twist.shape == (ROWS, 3)


def test_the_command_asks_for_the_radius_and_its_remedy_works(call, here):
    (here / "bot.urdf").write_text(urdf_robot((60, 180, 300)))
    code, _, err = call("import", "urdf", "bot.urdf", "-o", "bot.toml")
    assert code == 3
    assert "give it, such as --wheel-radius 0.05" in err
    assert call("import", "urdf", "bot.urdf", "-o", "bot.toml", "--wheel-radius", "0.05")[0] == 0
    assert load_robot(here / "bot.toml").wheels.wheel_radius == 0.05
    code, _, err = call("import", "urdf", "bot.urdf", "--wheel-radius", "50")
    assert code == 3
    assert "say --wheel-radius 0.05 if that is meant" in err
    code, _, err = call("import", "json", "bot.urdf", "--wheel-radius", "0.05")
    assert code == 3
    assert "json holds the radius of its wheels" in err
