"""check_vector_env: whether a vector environment, of anybody, keeps what Gymnasium promises. Gymnasium has no such.

Two runs of one environment are compared to the last bit:

1. spaces: batched ones are those of one environment, repeated; what is given lies in them, of the right shape and type
2. seeds: one seed gives one start, another seed another one, and no two environments one, where starts are random
3. determinism: one seed and the same actions give the same run
4. data: what was given is not written into later
5. autoreset, by its mode: NEXT_STEP ignores the action after an end, gives a start, reward 0 and no end; SAME_STEP
   gives a start, and the end in infos["final_obs"] with its mask; DISABLED begins where `reset_mask` says
6. partial reset, in every mode: others go on as if nothing had been; what begins forgets all that came before; the
   options of the caller stay as they are (Gymnasium's own classes take the mask out, and are let off)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from omnidyn.errors import InputError


class Transition(NamedTuple):
    """What one step gave, copied; actions: what it was given."""

    actions: Any
    observation: Any
    reward: Any
    terminated: Any
    truncated: Any
    infos: Any

    @property
    def over(self) -> Any:
        """Which episodes ended. Shape (num_envs,)."""
        return self.terminated | self.truncated


def check_vector_env(envs: Any, steps: int = 500, seed: int = 0) -> None:
    """Raises InputError for the first promise of Gymnasium that a VectorEnv breaks; nothing where it keeps all.

    envs: a VectorEnv, of any kind; it is reset several times, and stays open. steps: for which it is driven by random
    actions, or until an episode has ended in it and begun anew; without an end, resets are not checked. Arrays as
    observations only.
    """
    _check_spaces(envs)
    envs.action_space.seed(seed)
    actions = [envs.action_space.sample() for _ in range(steps)]
    _check_seeds(envs, seed)
    first = _run(envs, seed, actions)
    _compare("not deterministic", first, _run(envs, seed, actions[: len(first)]))
    _check_reuse(envs, seed, actions[0])
    mode = envs.metadata["autoreset_mode"]
    if mode == AutoresetMode.NEXT_STEP:
        _check_next_step(envs, seed, first)
    elif mode == AutoresetMode.SAME_STEP:
        _check_same_step(envs, first)
    _check_partial_reset(envs, seed, actions)


def _broken(promise: str, got: object, expected: str, remedy: str = "") -> InputError:
    return InputError(promise, got=got, expected=expected, remedy=remedy, where="vector environment")


def _check_spaces(envs: Any) -> None:
    mode = envs.metadata.get("autoreset_mode")
    if not isinstance(mode, AutoresetMode):
        raise _broken("no autoreset mode in its metadata", mode, "an AutoresetMode", "set it in metadata")
    if envs.single_observation_space.shape is None:
        raise _broken("observations are no arrays", envs.single_observation_space, "arrays: others are not compared")
    for name in ("observation", "action"):
        single, batched = getattr(envs, f"single_{name}_space"), getattr(envs, f"{name}_space")
        if batched != batch_space(single, envs.num_envs):
            expected = f"batch_space(single_{name}_space, num_envs)"
            raise _broken(f"{name}_space is not that of one environment, repeated", batched, expected)


def _check_values(envs: Any, step: Transition) -> None:
    """Spaces, shapes and types of what a step gave."""
    if step.observation not in envs.observation_space:
        raise _broken("an observation is not in its space", step.observation, f"in {envs.observation_space}")
    count = (envs.num_envs,)
    for name in ("terminated", "truncated"):
        flags = getattr(step, name)
        if flags.shape != count or flags.dtype != np.bool_:
            raise _broken(f"{name} is no mask", f"{flags.dtype} of shape {flags.shape}", f"bool of shape {count}")
    if step.reward.shape != count or not np.issubdtype(step.reward.dtype, np.floating):
        raise _broken("not a reward for each", f"{step.reward.dtype} of shape {step.reward.shape}", f"floats, {count}")
    if not np.isfinite(step.reward).all():
        raise _broken("a reward is no number", step.reward, "finite numbers")
    if not isinstance(step.infos, dict):
        raise _broken("infos are no dict", type(step.infos).__name__, "a dict")


def _start(envs: Any, seed: int | None, mask: Any = None) -> Any:
    """The observation after a reset, copied."""
    options = None if mask is None else {"reset_mask": mask.copy()}
    given = envs.reset(seed=seed, options=options)
    left = {} if options is None else options
    kept = mask is None or ("reset_mask" in left and np.array_equal(left["reset_mask"], mask))
    if not kept and not type(envs).__module__.startswith("gymnasium."):
        got, expected = left.get("reset_mask", "no reset_mask in them"), "the options as they were given"
        raise _broken("a reset changes the options of its caller", got, expected, "read `reset_mask`, do not pop it")
    if not (isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], dict)):
        raise _broken("reset gives something else", type(given).__name__, "(observations, infos)")
    if given[0] not in envs.observation_space:
        raise _broken("the start is not in its space", given[0], f"in {envs.observation_space}")
    return np.array(given[0])


def _step(envs: Any, actions: Any) -> Transition:
    observation, reward, terminated, truncated, infos = envs.step(np.array(actions))
    kept = {key: np.array(value) if isinstance(value, np.ndarray) else value for key, value in infos.items()}
    step = Transition(actions, np.array(observation), np.array(reward), np.array(terminated), np.array(truncated), kept)
    _check_values(envs, step)
    return step


def _run(envs: Any, seed: int, actions: list[Any]) -> list[Transition]:
    """A run: from a seed on, by these actions, until two steps after the first end."""
    _start(envs, seed)
    run, disabled = [], envs.metadata["autoreset_mode"] == AutoresetMode.DISABLED
    for action in actions:
        run.append(_step(envs, action))
        if run[-1].over.any() and disabled:
            break
        if any(step.over.any() for step in run[:-2]):
            break
    return run


def _compare(promise: str, first: list[Transition], second: list[Transition], robots: Any = slice(None)) -> None:
    """Raises InputError where two runs differ, of some of the environments."""
    for k, (one, other) in enumerate(zip(first, second, strict=True)):
        for name in ("observation", "reward", "terminated", "truncated"):
            left, right = getattr(one, name)[robots], getattr(other, name)[robots]
            if not np.array_equal(left, right):
                raise _broken(promise, f"another {name} in step {k}", "the same bits")


def _until_end(run: list[Transition]) -> list[Transition]:
    """The steps of a run to its first end; what follows depends on the mode."""
    end = next((k for k, step in enumerate(run) if step.over.any()), len(run) - 1)
    return run[: end + 1]


def _check_seeds(envs: Any, seed: int) -> None:
    first, again, other = _start(envs, seed), _start(envs, seed), _start(envs, seed + 1)
    if not np.array_equal(first, again):
        raise _broken("one seed gives two starts", f"seed {seed}", "the same start", "draw from the seed alone")
    unseeded = [_start(envs, None) for _ in range(2)]
    if all(np.array_equal(first, start) for start in unseeded):
        return  # a start that is always the same
    if np.array_equal(first, other):
        raise _broken("two seeds give one start", f"seeds {seed} and {seed + 1}", "two starts", "use the seed")
    if envs.num_envs > 1 and len(np.unique(first, axis=0)) == 1:
        raise _broken("all environments start alike", f"seed {seed}", "starts of their own", "give each its seed")


def _check_reuse(envs: Any, seed: int, actions: Any) -> None:
    """What was given stays as it is; an environment that says `copy = False` is free of that."""
    if not getattr(envs.unwrapped, "copy", True):
        return
    _start(envs, seed)
    given = envs.step(actions)[:4]
    kept = [np.array(column) for column in given]
    envs.step(-actions if np.issubdtype(np.asarray(actions).dtype, np.floating) else actions)
    _start(envs, seed + 1)
    if not all(np.array_equal(column, copy) for column, copy in zip(given, kept, strict=True)):
        raise _broken("what a step gave is written into later", "other values", "a copy each time", "copy, or say copy")


def _check_next_step(envs: Any, seed: int, run: list[Transition]) -> None:
    """After an end: a start, whatever the action."""
    ends = [k for k, step in enumerate(run[:-1]) if step.over.any()]
    if not ends:
        return
    over, after = run[ends[0]].over, run[ends[0] + 1]
    if after.over[over].any():
        raise _broken("a step that resets ends an episode", "terminated or truncated", "neither")
    if (after.reward[over] != 0.0).any():
        raise _broken("a step that resets has a reward", after.reward[over], "0, for nothing was done")
    _start(envs, seed)
    other = [_step(envs, step.actions) for step in run[: ends[0] + 1]]
    changed = np.array(after.actions)
    changed[over] = envs.action_space.sample()[over]
    other.append(_step(envs, changed))
    _compare("the action after an end does something", run[: len(other)][-1:], other[-1:], over)
    if np.array_equal(after.observation[over], run[ends[0]].observation[over]):
        raise _broken("nothing begins after an end", "the last observation again", "a start")


def _check_same_step(envs: Any, run: list[Transition]) -> None:
    """At an end: a start, and the end in the infos."""
    for step in run:
        over, infos = step.over, step.infos
        if not over.any():
            continue
        for key in ("final_obs", "final_info"):
            if key not in infos or not np.array_equal(infos.get(f"_{key}"), over):
                raise _broken(f"no {key} of an end", sorted(infos), f"{key} and its mask _{key}")
        for robot in np.flatnonzero(over):
            final = infos["final_obs"][robot]
            if final is None or np.asarray(final) not in envs.single_observation_space:
                raise _broken("final_obs is no observation", final, f"in {envs.single_observation_space}")
            if np.array_equal(final, step.observation[robot]):
                raise _broken("nothing begins at an end", "the last observation", "a start, the end in final_obs")


def _check_partial_reset(envs: Any, seed: int, actions: list[Any]) -> None:
    """Some begin anew, before any end: the others do not notice, and those that do forget."""
    run = _until_end(_run(envs, seed, actions))
    half = max(1, min(len(run), len(actions) - 1) // 2)
    mask = np.arange(envs.num_envs) % 2 == 0
    after = actions[half : half + max(1, half - 1)]

    def resumed(before: list[Any]) -> tuple[Any, Any, list[Transition]]:
        _start(envs, seed)
        last = [_step(envs, action) for action in before][-1]
        return last, _start(envs, seed + 5, mask), [_step(envs, action) for action in after]

    last, start, some = resumed(actions[:half])
    if not np.array_equal(start[~mask], last.observation[~mask]):
        raise _broken("a partial reset moves others", "another observation of theirs", "the one they had")
    if np.array_equal(start[mask], last.observation[mask]):
        raise _broken(
            "a partial reset does nothing", "the last observation", "a start", "look at options['reset_mask']"
        )
    _compare("a partial reset changes the way of others", run[half : half + len(after)], some, ~mask)
    _, again, others = resumed(actions[half : 2 * half])  # another way there
    if not np.array_equal(start[mask], again[mask]):
        raise _broken("a start remembers", "another start of the same seed", "the same one")
    some, others = _until_end(some), _until_end(others)
    common = min(len(some), len(others))  # where nothing began anew by itself
    _compare("an episode remembers the one before", some[:common], others[:common], mask)
    ended = run[-1].over
    if ended.any():
        _start(envs, seed)
        for step in run:
            _step(envs, step.actions)
        _start(envs, None, ended)
        if _step(envs, actions[0]).over[ended].any() and len(run) > 1:
            raise _broken("an episode that was reset is over at once", "terminated or truncated", "neither")
