"""Table 1 of the paper: friction from steady speeds, with the two ways to treat a robot at rest."""

from pathlib import Path

import omnidyn

TABLE = Path(__file__).parent / "table1.csv"

robot = omnidyn.load_robot("axebot")
data = omnidyn.read_steady_table(TABLE)
for rest in ("line", "bound"):
    fit = omnidyn.identify(data, robot, omnidyn.SteadyState(rest=rest)).estimate
    print(f"rest = {rest}")
    for name, value in fit.value.items():
        low, high = fit.ci95[name]
        print(f"  {name}  {value:.4g}  [{low:.4g}, {high:.4g}]")
