"""Manifest: what makes a campaign this one; ShardRecord: what a shard was when it was written."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from omnidyn.campaigns.spec import RANDOM, SOBOL
from omnidyn.files import sha256

WORD = "omnidyn campaign"


class Manifest(NamedTuple):
    """What makes a campaign this one: two of the same manifest have the same results.

    spec: its tables, files by their copies. inputs: copy -> sha256. task: "track", "simulate" or "module:function".
    task_sha256: of the source of a function. samples; shard_rows: samples of a shard.
    """

    omnidyn: str
    spec: dict[str, Any]
    inputs: dict[str, str]
    task: str
    task_sha256: str
    samples: int
    shard_rows: int

    @property
    def sha256(self) -> str:
        """Of what was computed, from what, and by what: of all of it but the number of samples, which may grow."""
        return sha256(self.with_samples(0).to_json())

    def with_samples(self, samples: int) -> Manifest:
        """The same with another number of samples."""
        spec = {**self.spec, "samples": samples} if "samples" in self.spec else self.spec
        return self._replace(samples=samples, spec=spec)

    def can_grow_to(self, other: Manifest) -> bool:
        """Whether another campaign is this one with more samples, of which the first are those of this one."""
        goes_on = self.spec.get("sampling", SOBOL) in (SOBOL, RANDOM) and not self.spec.get("robot_draws")
        return goes_on and other.samples > self.samples and not self.differences(other.with_samples(self.samples))

    @property
    def shards(self) -> int:
        """How many shards there are."""
        return -(-self.samples // self.shard_rows)

    def rows(self, shard: int) -> tuple[int, int]:
        """The samples of a shard: from, to."""
        start = shard * self.shard_rows
        return start, min(start + self.shard_rows, self.samples)

    def to_json(self) -> str:
        """The text of its file."""
        return json.dumps({"kind": WORD, **self._asdict()}, indent=1, ensure_ascii=False, allow_nan=False) + "\n"

    def differences(self, other: Manifest) -> list[str]:
        """What differs in another campaign, in words; the rows of a shard are no difference."""
        pairs = {name: (getattr(self, name), getattr(other, name)) for name in self._fields if name != "shard_rows"}
        spec = pairs.pop("spec")
        pairs |= dict(_leaves("", *({key: v for key, v in tables.items() if key != "shard_rows"} for tables in spec)))
        inputs = pairs.pop("inputs")
        changed = [
            f"{name} has changed" for name in inputs[0] if inputs[1].get(name, inputs[0][name]) != inputs[0][name]
        ]
        return [f"{name}: {_text(old)} -> {_text(new)}" for name, (old, new) in pairs.items() if old != new] + changed


def _leaves(path: str, old: Any, new: Any) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Path of a key -> what it was and is, of two trees of tables."""
    if not isinstance(old, Mapping) or not isinstance(new, Mapping):
        yield path, (old, new)
        return
    for key in dict.fromkeys([*old, *new]):
        yield from _leaves(f"{path}.{key}" if path else key, old.get(key), new.get(key))


def _range(samples: tuple[int, int]) -> str:
    return f"{samples[0]} to {samples[1] - 1}"


def _text(value: Any) -> str:
    return "none" if value is None else json.dumps(value, ensure_ascii=False)[:60]


class ShardRecord(NamedTuple):
    """What a shard was when it was written.

    sha256: of its file. samples: from, to. manifest_sha256: of the manifest, which has the hashes of the inputs.
    """

    sha256: str
    samples: tuple[int, int]
    manifest_sha256: str

    def to_json(self) -> str:
        """The text of its file."""
        return json.dumps(self._asdict()) + "\n"

    def fault(self, path: Path) -> tuple[str, str, str] | None:
        """(what, got, expected) where the record in a file is not this one, which is that of the shard as it is."""
        try:
            written = ShardRecord(**json.loads(path.read_bytes()))
            first, last = map(int, written.samples)
        except (ValueError, TypeError):
            return "the record of this shard is damaged", path.name, "as a sweep wrote it"
        if written.manifest_sha256 != self.manifest_sha256:
            what, name = "this shard belongs to another manifest", "manifest of SHA-256"
            return what, f"{name} {self.manifest_sha256}", f"{name} {written.manifest_sha256}"
        if (first, last) != self.samples:
            return "this shard holds other samples", _range((first, last)), _range(self.samples)
        if written.sha256 != self.sha256:
            return "this shard has changed since it was written", f"SHA-256 {self.sha256}", written.sha256
        return None
