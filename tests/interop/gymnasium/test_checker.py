"""The checker of vector environments: clean ones pass, each broken promise is found and named."""

import gymnasium
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from omnidyn.errors import InputError
from omnidyn.interop.gymnasium import check_vector_env
from tests.support.broken_envs import FAULTS, MODES, PARTIAL, Walk


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_a_clean_one_passes(mode):
    check_vector_env(Walk(mode=mode))


@pytest.mark.parametrize("fault", FAULTS)
def test_each_broken_promise_is_found(fault):
    mode = MODES.get(fault.split("_")[0], AutoresetMode.NEXT_STEP)
    with pytest.raises(InputError, match=FAULTS[fault]):
        check_vector_env(Walk(fault, mode))


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("fault", PARTIAL)
def test_a_broken_partial_reset_is_found_in_every_mode(fault, mode):
    with pytest.raises(InputError, match=FAULTS[fault]):
        check_vector_env(Walk(fault, mode))


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_gymnasiums_own_pass(mode):
    make = [lambda: gymnasium.make("CartPole-v1")] * 3
    check_vector_env(SyncVectorEnv(make, autoreset_mode=mode), steps=120)


def test_observations_that_are_no_arrays_are_refused():
    envs = Walk()
    envs.single_observation_space = gymnasium.spaces.Dict(x=envs.single_observation_space)
    with pytest.raises(InputError, match="no arrays"):
        check_vector_env(envs)


@pytest.mark.parametrize("task", ["Velocity", "Pose", "Path"])
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_ours_pass(task, mode):
    envs = gymnasium.make_vec(f"omnidyn/{task}-v0", num_envs=70, duration=0.2, autoreset_mode=mode, threads=2)
    check_vector_env(envs)
    envs.close()
