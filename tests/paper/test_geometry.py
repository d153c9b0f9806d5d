"""Claims on frames and wheels against the printed (3) and (7)-(9), inverted by numpy alone."""

import numpy as np
import pytest

from omnidyn.paper.geometry import model_eq_3, printed_eq_3
from tests.paper import printed


def test_printed_eq_3_is_what_the_claim_judges(axebot):
    np.testing.assert_allclose(printed_eq_3(axebot), printed.eq_3(+1), rtol=1e-14)


def test_model_is_eq_3_with_the_other_sign(axebot):
    scale = np.array([0.035, 0.035, 0.35])[:, None]
    np.testing.assert_allclose(model_eq_3(axebot) * scale, printed.eq_3(-1), rtol=1e-12, atol=1e-17)


def test_only_the_minus_sign_inverts_eqs_7_to_9():
    """Power: f . rim speed = wrench . twist, so twist from wheel speeds is the inverse of G^T, times r."""
    inverse = np.linalg.inv(printed.eqs_7_to_9().T) * printed.R_WHEEL
    np.testing.assert_allclose(printed.eq_3(-1), inverse, atol=1e-16)
    assert np.abs(printed.eq_3(+1) - inverse).max() == pytest.approx(4 / 3 * printed.R_WHEEL)


def test_claim_on_the_sign(claims):
    """1 m/s to the left turns the wheels by (-1, 1/2, 1/2)/r; the printed row makes -1/3 m/s of it."""
    claim = claims["wheel-1-sign"]
    assert claim.verdict == "reproduced after a correction"
    assert claim.numbers["one_m_s_left_reads"] == pytest.approx(-1 / 3, abs=1e-12)
    assert claim.numbers["round_trip_error"] == pytest.approx(-4 / 3, abs=1e-12)
    assert claim.numbers["round_trip_error_corrected"] < 1e-15
    assert round(claim.numbers["b_of_eq_13"], 4) == -1.2635  # EVIDENCE.md
    assert claim.numbers["direction_of_table_1_as_printed"] == -1.0  # Table 1 drives v_n > 0
    twist, traction = np.array([0.4, 0.7, 2.0]), np.array([1.0, -2.0, 3.0])
    as_printed = printed.eq_3(+1) @ (printed.eqs_7_to_9().T @ twist / printed.R_WHEEL)
    given = [traction @ printed.eqs_7_to_9().T @ twist, printed.eqs_7_to_9() @ traction @ as_printed]
    names = ["power_at_wheels", "power_at_body_as_printed"]
    assert [claim.numbers[name] for name in names] == pytest.approx(given, abs=1e-12)


def test_eight_of_nine_coefficients_agree(claims):
    assert claims["wheel-kinematics"].numbers["agreeing"] == 8
    assert claims["wheel-kinematics"].verdict == "reproduced"


def test_wrench(claims):
    np.testing.assert_allclose(claims["wrench"].numbers["matrix"], printed.eqs_7_to_9(), atol=1e-15)


def test_frames(claims):
    np.testing.assert_allclose(claims["frames"].numbers["forward_at_90_deg"], [0, 1, 0], atol=1e-15)
    assert claims["frames"].verdict == "reproduced"


def test_noise_closed_form(claims):
    """r sqrt(2/3) on v and v_n, r/(sqrt(3) b) on w (EVIDENCE.md), and by drawing a million encoder errors."""
    found = claims["noise"].numbers["std_per_encoder_std"]
    np.testing.assert_allclose(found, [0.035 * np.sqrt(2 / 3)] * 2 + [0.035 / (np.sqrt(3) * 0.1)], rtol=1e-12)
    errors = np.random.default_rng(0).standard_normal((10**6, 3))
    np.testing.assert_allclose((errors @ printed.eq_3(-1).T).std(axis=0), found, rtol=4e-3)


def test_noise_is_weighed_not_waved_through(claims):
    """In SI numbers w is 5 sqrt(2) times noisier; relative to the speeds driven v and v_n are."""
    claim = claims["noise"]
    assert claim.verdict == "reproduced after a correction"
    std, relative = claim.numbers["std_per_encoder_std"], claim.numbers["relative"]
    assert std[2] / std[0] == pytest.approx(5 * np.sqrt(2))
    wanted = [std[k] / np.mean(printed.SPEED[axis][1:]) for k, axis in enumerate(printed.AXES)]
    assert relative == pytest.approx(wanted)
    assert min(relative[:2]) > relative[2]
    assert np.round(claim.numbers["at_rim"], 4).tolist() == [0.0286, 0.0286, 0.0202]  # m/s: r sqrt(2/3), r/sqrt(3)
