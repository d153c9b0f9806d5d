"""A fit whose sentences are all replaced by their codes: every number, remedy and code is the same."""

import numpy as np

from omnidyn import shown
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.robot_file import load_robot, robot_to_toml
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw

AXEBOT = load_robot("axebot")
HEAVY = AXEBOT.replace(body=AXEBOT.body.replace(inertia=4.0 * AXEBOT.body.inertia))


def identified():
    """All that the fit of a robot with a wrong inertia says in numbers and codes."""
    run = noisy_draw(simulate(AXEBOT, excitation(8.0), 0.01), 1)
    found = identify(run, HEAVY, OutputError(nuisances=()))
    fit = found.fits["all"]
    lack = fit.lack_of_fit
    assert lack is not None
    values = {
        "value": fit.value,
        "std": fit.std,
        "ci95": fit.ci95,
        "rests_on": fit.rests_on,
        "robot": robot_to_toml(fit.robot),
        "noise": lack.noise,
        "gain": [each.gain for each in lack.remedies],
        "changes": [each.changes for each in lack.remedies],
        "failed": bool(found.failures),
    }
    values["scores"] = {group: each.scores for group, each in (found.validations or {}).items()}
    told = [*fit.warnings, *lack.statements(), *found.advice, *found.outcome(), *found.failures]
    keys = [(each.key, each.cause.code, each.same_as) for each in lack.remedies]
    return values, keys, [(each.code, each.severity, each.subject, each.remedy) for each in told], str(found.verdict)


def test_no_number_of_a_fit_depends_on_a_sentence(monkeypatch):
    values, keys, said, verdict = identified()
    assert keys, "the model is wrong, and nothing is found missing"
    for maker in (shown.SENTENCE, shown.REMEDY):
        monkeypatch.setitem(shown._MAKERS, maker, lambda statement: statement.code)
    other_values, other_keys, other_said, other_verdict = identified()
    np.testing.assert_equal(other_values, values)
    assert other_keys == keys
    assert other_said == said
    assert other_verdict != verdict
