"""Nobody counts the rows of a run as if they were the samples of a channel: topics have clocks of their own.

What means the usual step of a channel takes it from `omnidyn.clocks` (`Run.step`, `usual_step` of its own samples).
Steps between the rows of a run, a log or a record stand only where all rows are meant: each place with its reason.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache

from tests.support.sources import PACKAGE, trees

ROOMS = ("logs", "findings", "comparison", "identification")
MERGED = ("run", "log", "record", "self", "piece")  # what a `.t` of all clocks belongs to

# file -> (how many steps between rows, why all rows are meant)
ALLOWED = {
    "logs/log.py": (8, "the order and the repeats of stamps, of all rows"),
    "logs/growing.py": (1, "the order of rows as they come, of all rows"),
    "logs/path.py": (1, "an integral over all rows, each filled"),
    "logs/plateaus.py": (2, "rows that were chosen by their channel"),
    "findings/time_base.py": (3, "the order and the repeats of stamps, of all rows"),
    "comparison/replay.py": (1, "steps of the simulation, which stops at every row"),
    "identification/output_error/problem/differences.py": (4, "a run in the rows of its wheels"),
    "identification/output_error/problem/heading.py": (1, "an integral over all rows, each filled"),
    "identification/output_error/memory/whitened.py": (2, "rows of one output"),
    "identification/motors/fit.py": (1, "rows of the only output"),
    "identification/motors/points.py": (1, "a log in the rows of its motors"),
    "identification/output_error/linear/missing_inputs.py": (1, "not asked of clocks of their own"),
    "identification/output_error/problem/decimated.py": (3, "all rows, of which several are taken together"),
    "identification/structure/windows.py": (1, "the rows between which a command holds"),
    "identification/output_error/problem/observation/observation.py": (
        1,
        "steps of the simulation, which stops at every row",
    ),
    "identification/output_error/linear/driven_motion.py": (2, "steps of the simulation, which stops at every row"),
}


def times(node: ast.expr) -> str | None:
    """Whose times an expression is: "run" of run.t[rows], "" of a bare t; None for anything else."""
    while isinstance(node, ast.Subscript):
        node = node.value
    if isinstance(node, ast.Name):
        return "" if node.id == "t" else None
    if not isinstance(node, ast.Attribute) or node.attr != "t":
        return None
    owner = node.value
    return owner.id if isinstance(owner, ast.Name) else owner.attr if isinstance(owner, ast.Attribute) else None


def steps(tree: ast.AST) -> Iterator[ast.Call]:
    """Calls of np.diff of times."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and _name(node) == "diff" and node.args and times(node.args[0]) is not None:
            yield node


def usual_steps(tree: ast.AST) -> int:
    """How often the median of steps of times is taken."""
    medians = (node for node in ast.walk(tree) if isinstance(node, ast.Call) and node.args and _name(node) == "median")
    return sum(isinstance(node.args[0], ast.Call) and node.args[0] in set(steps(tree)) for node in medians)


def _name(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


@cache
def files() -> list[tuple[str, ast.AST]]:
    """(name, tree) of the files that take steps at all."""
    read = [name for name in trees() if name == "run.py" or name.partition("/")[0] in ROOMS]
    return [(name, trees()[name]) for name in read if "diff(" in (PACKAGE / name).read_text("utf-8")]


def test_the_usual_step_comes_from_the_clock_of_a_channel():
    found = [name for name, tree in files() if usual_steps(tree)]
    assert not found, f"take `usual_step` of omnidyn.clocks, or `Run.step`: {found}"


def test_steps_between_rows_stand_only_where_all_rows_are_meant():
    found = Counter(name for name, tree in files() for call in steps(tree) if times(call.args[0]) in MERGED)
    more = [name for name, count in found.items() if count > ALLOWED.get(name, (0, ""))[0]]
    assert not more, (
        f"take the samples of the channel (omnidyn.clocks), or say in ALLOWED why all rows are meant: {more}"
    )


def test_it_sees_what_counts_rows():
    tree = ast.parse("a = np.median(np.diff(run.t))\nb = median(np.diff(t[:9]))\nc = np.diff(x)\nd = np.diff(work.t)")
    assert usual_steps(tree) == 2
    assert {times(call.args[0]) for call in steps(tree)} == {"run", "", "work"}
