"""Groups fitted together: shared and own numbers against simulated floors, and against what must be equal to it."""

from functools import partial

import numpy as np
import pytest

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.prepare import expand_keys
from omnidyn.model.keys import BOX, Key
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw
from tests.support.grouped import shared

AXEBOT = load_robot("axebot")
TORQUE, EMF, COULOMB, MASS = (
    "motor.torque_constant_Nm_A",
    "motor.emf_constant_Vs_rad",
    "friction.axes.coulomb[0]",
    "body.mass_kg",
)
MAGNET, ROUGH = 0.0062, 2.6
FREE = ["friction", TORQUE]


@pytest.fixture(scope="module")
def clean():
    """15 s on a smooth and a rough floor; the magnet is stronger than the robot file says."""
    found = {}
    for k, (name, level) in enumerate((("smooth", 2.2), ("rough", ROUGH))):
        robot = Key.parse(EMF).set(Key.parse(TORQUE).set(Key.parse(COULOMB).set(AXEBOT, level), MAGNET), MAGNET)
        found[name] = simulate(robot, excitation(15.0, seed=k), 0.01)
    return found


def fitted(clean, seed, **options):
    runs = [noisy_draw(run, 10 * seed + k) for k, run in enumerate(clean.values())]
    return runs, identify(runs, AXEBOT, OutputError(free=FREE, nuisances=(), start="rest", **options), groups=[*clean])


def test_differences_and_shared_numbers_hold_the_truth(clean):
    """20 draws of noise, 7 x 20 intervals of 95 %: 126 or more hold with probability 0.99."""
    held = coulomb = 0
    for seed in range(20):
        _, study = fitted(clean, seed)
        for d in study.differences:
            true = ROUGH - 2.2 if d.key == COULOMB else 0.0
            held += d.low <= true <= d.high
            coulomb += d.key == COULOMB and d.differs
        ends = {group: e.ci95[TORQUE] for group, e in study.groups.items()}
        assert ends["smooth"] == ends["rough"]
        held += ends["smooth"][0] <= MAGNET <= ends["smooth"][1]
    assert held >= 126
    assert coulomb == 20


def test_with_nothing_shared_it_is_two_fits(clean):
    """Independent: each group alone. The noise is common, so that the weights, hence the last digits, differ."""
    runs = [noisy_draw(run, k) for k, run in enumerate(clean.values())]
    study = identify(runs, AXEBOT, OutputError(nuisances=(), start="rest", covariance="white"), groups=[*clean])
    for run, estimate in zip(runs, study.groups.values(), strict=True):
        alone = identify(run, AXEBOT, OutputError(nuisances=(), start="rest", covariance="white")).estimate
        for key in BOX:
            assert abs(estimate.value[key] - alone.value[key]) < 0.02 * alone.std[key]
            assert estimate.std[key] == pytest.approx(alone.std[key], rel=0.05)
    assert shared(study) == set()


def test_with_everything_shared_it_is_one_fit(clean):
    """All but one number shared between two logs of the same floor: the shared ones are those of one fit to both."""
    runs = [noisy_draw(clean["smooth"], k) for k in range(2)]
    both = identify(runs, AXEBOT, OutputError(free=[*BOX, TORQUE], nuisances=(), start="rest")).estimate
    study = identify(
        runs,
        AXEBOT,
        OutputError(free=FREE, per_free=["friction.axes.viscous[2]"], nuisances=(), start="rest"),
        groups=["a", "b"],
    )
    for name in shared(study):
        assert abs(study.groups["a"].value[name] - both.value[name]) < 0.3 * both.std[name]
    assert shared(study) == {*BOX, TORQUE} - {"friction.axes.viscous[2]"}


def test_sharing_makes_the_motor_surer(clean):
    runs, study = fitted(clean, 3)
    alone = [
        identify(run, AXEBOT, OutputError(free=[*BOX, TORQUE], nuisances=(), start="rest")).estimate for run in runs
    ]
    expected = sum(a.std[TORQUE] ** -2 for a in alone) ** -0.5  # independent logs, to first order
    assert study.groups["smooth"].std[TORQUE] == pytest.approx(expected, rel=0.05)


def test_a_load_is_a_mass_of_its_own():
    """Friction is the same, the second log carries 0.3 kg more."""
    runs = []
    for k, mass in enumerate((1.5, 1.8)):
        runs.append(noisy_draw(simulate(Key.parse(MASS).set(AXEBOT, mass), excitation(20.0, seed=k), 0.01), k))
    study = identify(
        runs,
        AXEBOT,
        OutputError(free=["friction", MASS], per_free=[MASS], nuisances=(), start="rest"),
        groups=["empty", "loaded"],
    )
    (difference,) = study.differences
    assert difference.key == MASS
    assert difference.differs
    assert abs(difference.difference - 0.3) < 4.0 * difference.std


def test_automatic_nuisances_are_those_that_every_group_supports(clean):
    runs = [noisy_draw(run, k) for k, run in enumerate(clean.values())]
    study = identify(runs, AXEBOT, OutputError(free=FREE, start="rest"), groups=[*clean])
    for estimate in study.groups.values():
        late = estimate.nuisances["latency.twist"]
        assert abs(late.value) < 4.0 * late.std
        assert late.std < 5e-3


def test_keys_that_stand_for_several():
    assert expand_keys(["friction"], AXEBOT) == expand_keys("friction", AXEBOT) == BOX
    assert expand_keys(["friction.axes.coulomb", TORQUE], AXEBOT) == (*BOX[3:], TORQUE)


def test_refusals(clean):
    runs = [*clean.values()]
    with pytest.raises(InputError, match="the logs have only one group; got a; expected two or more"):
        identify(runs, AXEBOT, OutputError(), groups=["a", "a"])
    with pytest.raises(InputError, match=r"not free, so no group can have its own; got body\.mass_kg"):
        identify(runs, AXEBOT, OutputError(per_free=[MASS]), groups=["a", "b"])
    with pytest.raises(InputError, match="nothing differs between the groups"):
        identify(runs, AXEBOT, OutputError(free=[TORQUE], nuisances=()), groups=["a", "b"])
    slips = AXEBOT.replace(wheels=AXEBOT.wheels.replace(traction_mu=0.4, wheel_inertia=2e-5))
    with pytest.raises(InputError, match=r"an engine which does not know all that is asked for; got tilt\.x"):
        identify(runs, slips, OutputError(nuisances=["tilt"]), groups=["a", "b"])
    with pytest.raises(UnsupportedError, match="holds no voltage"):
        identify([np_free(run) for run in runs], AXEBOT, OutputError(), groups=["a", "b"])


def np_free(run):
    """Without inputs."""
    return run.replace(voltage=None, current=np.asarray(run.current))


def test_a_held_number_that_the_file_knows_only_so_far_moves_all_groups_at_once():
    """Against fits of the same logs with the number moved by its std in the file, up and down: of the numbers and of
    what is between groups."""
    plain, keys = AXEBOT.replace(priors={}), ("motor.gear_ratio", MASS)
    size = {key: float(Key.parse(key).get(plain)) for key in keys}
    std = {key: share * size[key] for key, share in zip(keys, (0.02, 0.04), strict=True)}
    floors = (Key.parse(COULOMB).set(plain, level) for level in (2.2, ROUGH))
    runs = [noisy_draw(simulate(own, excitation(15.0, seed=k), 0.01), k) for k, own in enumerate(floors)]
    fit = partial(identify, runs, groups=["a", "b"], method=OutputError(free="friction", nuisances=(), start="rest"))
    told, alone = fit(plain.replace(priors={key: Prior(std=std[key], origin="measured") for key in keys})), fit(plain)

    def each(study, of):
        values = [getattr(own, of)[name] for own in study.groups.values() for name in BOX]
        between = [d.std if of == "std" else d.difference for d in study.differences]
        return np.array(values + between)

    variance = each(alone, "std") ** 2
    for key in keys:
        up, down = (each(fit(Key.parse(key).set(plain, size[key] + way * std[key])), "value") for way in (1.0, -1.0))
        variance += (0.5 * (up - down)) ** 2
    np.testing.assert_allclose(each(told, "std"), np.sqrt(variance), rtol=0.15)  # a whole std goes over kinks
    wider = each(told, "std") / each(alone, "std")
    assert wider[:2].min() > 2.0
    assert wider[-6:].max() < 0.6 * wider[:2].min()  # both groups go the same way
    for own, before in zip(told.groups.values(), alone.groups.values(), strict=True):
        for name in BOX:
            assert own.log_alone[name] == pytest.approx(before.ci95[name], rel=1e-6)
        assert not any("exact" in str(each) for each in own.warnings)
