"""python -m benchmarks.twins [--only NAME ...] [--seeds N] [--json]"""

from __future__ import annotations

import argparse
import json

from benchmarks.twins import HELD_OUT, SEEDS, measure
from benchmarks.twins.lines import TWINS

parser = argparse.ArgumentParser(prog="python -m benchmarks.twins")
parser.add_argument("--only", nargs="+", default=[], choices=[*TWINS, HELD_OUT], help="these alone")
parser.add_argument("--seeds", type=int, default=SEEDS, help="logs of each twin")
parser.add_argument("--json", action="store_true", help="the table as JSON")
asked = parser.parse_args()
found = measure(asked.only, asked.seeds)
print(json.dumps(found.as_dict(), indent=1) if asked.json else found.as_text())
