"""A file of the package imports only from files and folders above its own. The order stands here.

An import counts wherever it stands: at the top, inside a function (lazy), under TYPE_CHECKING.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "omnidyn"

# One list for each folder, from what knows nothing to what knows all. A name is a file or a folder.
# `__init__` comes last in its folder unless it is named. A name may be listed before its file exists.
ORDER = {
    "": """errors files units compiled run model simulation logs comparison identification control campaigns
        paper report export interop __init__ cli studio __main__""",
    "compiled": "hearing stamp entries linking kernel",
    "model": """frames value layout wheels motor drive friction robot robot_file starter plant scratch
        forces face holding inclusion rest dynamics statespace deadzone""",
    "model/friction": "law axes direction wheels",
    "simulation": """inputs commands exact_step exact_sensitivity travel exact exact_position
        exact_inductance_step exact_inductance_travel exact_inductance implicit_step speed_loop implicit simulate
        tangent_step tangent_events tangent_look tangent_march tangent_loop tangent tangent_sight""",
    "logs": """channels dialect spaced header points rows text_file table parquet_pages parquet tables run_file
        steady_table command_file words mapping clock stamps guessed guess_time guess_unit guess counters log read_log
        segments average plateaus resolved findings check""",
    "comparison": "start replay traces aligned lag whiteness metrics difference text result compare threshold",
    "logs/check": """robust work codes time_base reference spikes learned stuck values limits wirings frame floor motors
        wiring slip mistakes scale lag energy motion oddities excitation""",
    "identification": """estimate geometry line points doubts steady_state band output_error operating shapes shape_fit
        shape_choice study_parts study_words steady_study steady_lines drive_windows drive_line study_table
        settling identify joint_problem joint_fit as_fitted validation between_axes motor_engine motor_input motor_log
        motor_bend motor_fit motor_run motor_choice fit_words best_so_far""",
    "identification/output_error": """parameters primitives counts doubled outputs record problem kernel axis_kernel
        driver exact_engine sums tangent_engine loop_engine solver onlooker starts motion nuisances loop rounding
        uncertainty support first_point breakaway tied resampling answer conclusion fit""",
    "control": "",
    "campaigns": "",
    "paper": """tables claim steady experiments geometry motion motors friction speeds validation reconcile mismatch
        claims""",
    "report": "style figures html page steady_page fit_page",
    "report/figures": """robot traces friction steps dead_zone dead_zone_map reconcile overlay shapes drive_lines
        raw_log residuals correlation""",
    "export": "",
    "interop": "",
    "cli": """streams numbers session progress log_options init_logs init check plan identify_logs identify_fit
        identify_steady identify_ways identify simulate friction deadzone compare track tune sweep export robots
        demo_folder claims_table demo app outcome""",
    "studio": "",
}

# The skins: whatever stands below them, nobody but `python -m omnidyn` imports them.
SKINS = ("cli", "studio")

Position = tuple[int, ...]


def position(module: str) -> Position:
    """Where a module ("model/friction/law") stands: its rank in each folder on the way down."""
    ranks: list[int] = []
    folder = ""
    for name in module.split("/"):
        names = order_of(folder)
        if name not in [*names, "__init__"]:
            raise LookupError(
                f"omnidyn/{module}: {name!r} has no place in the order. Add it to ORDER[{folder!r}] in "
                f"tests/house/test_import_direction.py, above everything that imports it."
            )
        ranks.append(names.index(name) if name in names else len(names))
        folder = f"{folder}/{name}".lstrip("/")
    return tuple(ranks)


def order_of(folder: str) -> list[str]:
    if folder not in ORDER:
        raise LookupError(
            f"omnidyn/{folder} is a new folder. Add ORDER[{folder!r}], the order of its files, in "
            f"tests/house/test_import_direction.py."
        )
    return ORDER[folder].split()


def resolve(package: Path, dotted: str) -> str:
    """The module that "omnidyn.a.b" names: a file, else the `__init__` of the nearest folder."""
    parts = dotted.split(".")[1:]
    if parts and package.joinpath(*parts).with_suffix(".py").is_file():
        return "/".join(parts)
    if package.joinpath(*parts).is_dir():
        return "/".join([*parts, "__init__"])
    return resolve(package, dotted.rpartition(".")[0])  # a name defined in the module


def absolute(module: str, node: ast.ImportFrom) -> str:
    """The dotted name of `from X import`, relative or not."""
    if not node.level:
        return node.module or ""
    folders = ["omnidyn", *module.split("/")[: -node.level]]
    return ".".join([*folders, node.module] if node.module else folders)


def imported(module: str, tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every dotted name that a module imports, with its line."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            origin = absolute(module, node)
            yield from ((node.lineno, f"{origin}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called == "import_module" and isinstance(node.args[0].value, str):
                yield node.lineno, node.args[0].value


def faults(package: Path) -> list[str]:
    """Every import that goes against the order, and every file without a place, in words."""
    found: list[str] = []
    for path in sorted(package.rglob("*.py")):
        module = path.relative_to(package).with_suffix("").as_posix()
        try:
            own = position(module)
        except LookupError as unknown:
            found.append(unknown.args[0])
            continue
        tree = ast.parse(path.read_text("utf-8"), str(path))
        ours = [(line, name) for line, name in imported(module, tree) if name.split(".")[0] == "omnidyn"]
        for line, target in sorted({(line, resolve(package, name)) for line, name in ours}):
            found += judge(module, own, line, target)
    return found


def judge(module: str, own: Position, line: int, target: str) -> list[str]:
    where = f"omnidyn/{module}.py, line {line}"
    skin = target.split("/")[0]
    if skin in SKINS and module.split("/")[0] not in (skin, "__main__"):
        return [f"{where}: imports {target}; nobody imports a skin ({', '.join(SKINS)})"]
    try:
        above = position(target) < own
    except LookupError:
        return []  # reported once, at the file itself
    return [] if above else [f"{where}: imports {target}, which does not stand above it"]


def test_every_file_imports_only_from_above():
    found = faults(PACKAGE)
    assert not found, "\n" + "\n".join(found)


# A small package to break.
SMALL = {
    "__init__.py": "",
    "errors.py": "",
    "units.py": "",
    "model/__init__.py": "",
    "model/frames.py": "",
    "model/robot.py": "",
    "model/friction/__init__.py": "",
    "model/friction/law.py": "",
    "model/friction/axes.py": "",
    "simulation/__init__.py": "",
    "simulation/exact.py": "",
    "report/__init__.py": "",
    "report/page.py": "",
    "cli/__init__.py": "",
    "studio/__init__.py": "",
}


def tree(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = root / "omnidyn" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root / "omnidyn"


@pytest.mark.parametrize(
    "name, text",
    [
        ("model/frames.py", "from omnidyn.errors import OmnidynError"),
        ("model/friction/axes.py", "from omnidyn.model.friction.law import Law"),
        ("model/friction/axes.py", "from .law import Law\nfrom . import law\nfrom .. import frames"),
        ("model/friction/__init__.py", "from omnidyn.model.friction import law"),
        ("model/robot.py", "import omnidyn.model.friction"),
        ("simulation/exact.py", "from omnidyn.model import Robot, frames\nimport numpy"),
        ("cli/__init__.py", "import omnidyn\nfrom omnidyn import report"),
        ("__main__.py", "from omnidyn.cli import main"),
        ("__init__.py", "from omnidyn.report import page"),
    ],
)
def test_what_goes_up_is_right(tmp_path, name, text):
    assert faults(tree(tmp_path, SMALL | {name: text})) == []


@pytest.mark.parametrize(
    "name, text",
    [
        ("errors.py", "from omnidyn.units import metres"),
        ("errors.py", "import omnidyn"),
        ("model/frames.py", "from omnidyn.model import Robot"),
        ("model/frames.py", "from omnidyn.model.robot import Robot"),
        ("model/friction/law.py", "from .axes import Axes"),
        ("model/friction/law.py", "from ..robot import Robot"),
        ("model/friction/law.py", "def f():\n    from omnidyn.model.friction import axes"),
        ("model/robot.py", "import importlib\nimportlib.import_module('omnidyn.simulation.exact')"),
        ("model/robot.py", "if TYPE_CHECKING:\n    from omnidyn.simulation.exact import step"),
        ("__init__.py", "from omnidyn.cli import main"),
        ("studio/__init__.py", "from omnidyn.cli import main"),
    ],
)
def test_what_goes_down_is_found(tmp_path, name, text):
    assert len(faults(tree(tmp_path, SMALL | {name: text}))) == 1


@pytest.mark.parametrize(
    "name, place",
    [("brake.py", "ORDER['']"), ("model/brake.py", "ORDER['model']"), ("new/law.py", "ORDER['']")],
)
def test_a_file_without_a_place_is_told_where_to_go(tmp_path, name, place):
    (fault,) = faults(tree(tmp_path, {name: ""}))
    assert place in fault
    assert "tests/house/test_import_direction.py" in fault
