"""`--processor-times FILE`: what each test takes of the processors [s], with the commands that it starts, as JSON.

Processor time does not depend on what else runs on the machine. A fixture counts for the test that asks for it first.
`python -m tests.support.processor_times FILE ...` prints the sum of each folder and the 30 slowest tests.
"""

import json
import os
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

OPTION, PROPERTY = "--processor-times", "processor_s"
SLOWEST = 30


def processor_s() -> float:
    """[s] of this process and of its children that ended."""
    return sum(os.times()[:4])


class ProcessorTimes:
    """A plugin: the worker of a test notes the times of its phases, the process that hears all reports sums them up."""

    def __init__(self, file: Path):
        self.file = file
        self.sums: Counter[str] = Counter()
        self.begun = processor_s()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Iterator[None]:
        """Setup, call and teardown follow one another; what is between belongs to the next of them."""
        report, now = (yield), processor_s()
        report.user_properties = [(PROPERTY, now - self.begun)]
        self.begun = now
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.sums[report.nodeid] += dict(report.user_properties)[PROPERTY]

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if not hasattr(session.config, "workerinput"):  # a worker of pytest-xdist
            self.file.write_text(json.dumps({name: round(time, 4) for name, time in self.sums.most_common()}, indent=0))


def table(times: dict[str, float]) -> str:
    """Sums by folder, then the slowest tests."""
    folders: Counter[str] = Counter()
    for name, time in times.items():
        folders["/".join(name.partition("::")[0].split("/")[:-1][:3])] += time
    lines = [f"{time:8.1f} s  {folder}" for folder, time in folders.most_common()]
    lines += [f"{sum(times.values()):8.1f} s  all {len(times)} tests", ""]
    return "\n".join(lines + [f"{time:8.1f} s  {name}" for name, time in Counter(times).most_common(SLOWEST)])


if __name__ == "__main__":
    print(table({name: time for file in sys.argv[1:] for name, time in json.loads(Path(file).read_text()).items()}))
