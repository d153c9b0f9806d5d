"""A small vector environment in NumPy that keeps what Gymnasium promises; told to, it breaks one promise."""

from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

FAULTS = {
    "metadata": "no autoreset mode",
    "space": "observation_space",
    "range": "not in its space",
    "flags": "no mask",
    "reward_shape": "reward for each",
    "nan_reward": "no number",
    "seed_ignored": "one seed gives two starts",
    "seed_constant": "two seeds give one start",
    "alike": "start alike",
    "random_step": "not deterministic",
    "reused": "written into later",
    "next_reward": "has a reward",
    "next_end": "ends an episode",
    "next_acts": "action after an end",
    "next_nothing": "nothing begins after an end",
    "same_no_final": "no final_obs",
    "same_final_is_start": "nothing begins at an end",
    "all_reset": "moves others",
    "none_reset": "does nothing",
    "shared_random": "way of others",
    "leak": "remembers",
    "pops": "changes the options of its caller",
}
MODES = {"next": AutoresetMode.NEXT_STEP, "same": AutoresetMode.SAME_STEP}
PARTIAL = ("all_reset", "none_reset", "shared_random", "leak", "pops")  # faults of partial resets, in any mode
MODES |= dict.fromkeys((fault.split("_")[0] for fault in PARTIAL), AutoresetMode.DISABLED)


class Walk(VectorEnv):
    """x += action/10, from a random start; 7 steps, or as many as its number says."""

    def __init__(self, fault="", mode=AutoresetMode.NEXT_STEP, count=4):
        self.fault, self.mode, self.num_envs = fault, mode, count
        self.metadata = {} if fault == "metadata" else {"autoreset_mode": mode}
        self.single_observation_space, self.single_action_space = Box(-9, 9, (2,), float), Box(-1, 1, (1,), float)
        self.action_space = batch_space(self.single_action_space, count)
        self.observation_space = batch_space(self.single_observation_space, count + (fault == "space"))
        self.x, self.steps, self.over = np.zeros((count, 2)), np.zeros(count, int), np.zeros(count, bool)
        self.generators = [np.random.default_rng(k) for k in range(count)]
        self.memory, self.wild = np.zeros(count), np.random.default_rng()

    def _begin(self, who):
        for k in np.flatnonzero(who):
            source = self.wild if self.fault == "seed_ignored" else self.generators[0 if self.fault == "alike" else k]
            self.x[k] = source.random(2)
        if self.fault == "alike":
            self.x[:] = self.x[0]
        self.steps[who], self.over[who] = 0, False
        if self.fault != "leak" or who.all():
            self.memory[who] = 0

    def reset(self, *, seed=None, options=None):
        who = np.ones(self.num_envs, bool) if not options else options["reset_mask"]
        if self.fault == "pops" and options:
            del options["reset_mask"]
        if self.fault == "all_reset":
            who = np.ones(self.num_envs, bool)
        if seed is not None:
            base = 3 if self.fault == "seed_constant" else seed
            for k in np.flatnonzero(who):
                self.generators[k] = np.random.default_rng([base, k])
        if not (self.fault == "none_reset" and options):
            self._begin(who)
        return self.x.copy(), {}

    def step(self, actions):
        fault, before, infos = self.fault, self.over.copy(), {}
        self.x = self.x + 0.1 * np.asarray(actions) + 0.01 * self.memory[:, None]
        self.memory += np.asarray(actions)[:, 0] if fault == "leak" else 0.0
        if fault == "random_step":
            self.x += 1e-9 * self.wild.random()
        if fault == "shared_random":
            self.x[1] += 1e-3 * self.generators[0].random()
        self.steps += 1
        over = self.steps >= 7
        reward: Any = -np.abs(self.x).sum(axis=1)
        if self.mode == AutoresetMode.NEXT_STEP and before.any() and fault != "next_nothing":
            moved = self.x.copy()
            self._begin(before)
            if fault == "next_acts":
                self.x[before] += 1e-3 * (moved[before] - np.floor(moved[before]))
            reward = np.where(before, 1.0 if fault == "next_reward" else 0.0, reward)
            over = np.where(before, fault == "next_end", over)
        elif before.any() and fault == "next_nothing":
            self.x[before], self.steps[before] = self.last[before], 0
            reward, over = np.where(before, 0.0, reward), over & ~before
        if self.mode == AutoresetMode.SAME_STEP and over.any():
            final = np.full(self.num_envs, None, dtype=object)
            last = self.x.copy()
            self._begin(over)
            for k in np.flatnonzero(over):
                final[k] = (self.x if fault == "same_final_is_start" else last)[k].copy()
            infos = {"final_obs": final, "_final_obs": over, "final_info": {}, "_final_info": over}
            if fault == "same_no_final":
                infos = {}
        self.over, self.last = over.copy(), self.x.copy()
        if fault == "nan_reward":
            reward[0] = np.nan
        if fault == "reused":
            self.shown = getattr(self, "shown", np.zeros_like(self.x))
            self.shown[:] = self.x
            return self.shown, reward, np.zeros_like(over), over, infos
        shown = self.x + 99.0 * (fault == "range")
        ended = over.astype(int) if fault == "flags" else over
        return shown, reward[:, None] if fault == "reward_shape" else reward, np.zeros_like(over), ended, infos
