"""Makes table_3.npz: Table 3's robot over `table_3_voltages`, 10,000 steps of 1 ms, in 50 digits.

    python -m tests.reference.make          # from the root of the repository; about 3 s

For each ratio of breakaway to coulomb (1.0, 1.25, 1.5): `twist_*` and `pose_*`, every tenth sample, rounded once to
double; `rest_*`: which samples of which axis are exactly at rest, all 10,001 of them, as packed bits.
`millivolts`: the voltages. The same bytes every time, on any machine with the same last bit of sine and cosine.
"""

from pathlib import Path

import numpy as np

from tests.reference.reference import Truth, reference
from tests.support.robots import TABLE_3, table_3_voltages, with_breakaway

FILE = Path(__file__).with_name("table_3.npz")
RATIOS = (1.0, 1.25, 1.5)
EVERY = 10
DT = 1e-3


def table_3_truth(ratio: float) -> Truth:
    """The 50-digit run at one ratio of breakaway to coulomb."""
    voltage = table_3_voltages()
    return reference(with_breakaway(TABLE_3, ratio), voltage, [DT] * len(voltage))


def stored(truth: Truth, ratio: float) -> dict[str, np.ndarray]:
    """What the file keeps of a run."""
    return {
        f"twist_{ratio}": truth.twist[::EVERY],
        f"pose_{ratio}": truth.pose[::EVERY],
        f"rest_{ratio}": np.packbits(truth.twist == 0.0),
    }


if __name__ == "__main__":
    content = {"millivolts": np.round(table_3_voltages() * 1000).astype(np.int16)}
    for ratio in RATIOS:
        content |= stored(table_3_truth(ratio), ratio)
    np.savez(FILE, **content)
    print(f"{FILE}: {FILE.stat().st_size} bytes")
