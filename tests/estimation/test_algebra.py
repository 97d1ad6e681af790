"""The analysis equation, specialised: derived, not stated."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sympy import Matrix, Piecewise, Symbol, diag, fraction, lambdify, simplify, symbols, zeros

from kfsheet import analysis, correlated_covariance, diagonal_analysis, gain_limits, sequential_gain
from kfsheet.errors import ModelError

x, z, i, j = symbols("x z i j", real=True)
a, j_0, b_x, b_z, r_i, r_j = symbols("a j_0 b_x b_z r_i r_j", positive=True)
rho = Symbol("rho", real=True)
CAMERA = [a * x, j_0 - a * z]


def camera(B):
    return analysis([x, z], CAMERA, [i, j], B, diag(r_i, r_j))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_diagonal_matrices_give_one_scalar_gain_per_quantity(n):
    K = diagonal_analysis(n).K
    for row in range(n):
        b, r = (Symbol(f"{letter}_{row + 1}", positive=True) for letter in "br")
        h = Symbol(f"a_{row + 1}", real=True)
        assert simplify(K[row, row] - b * h / (r + h**2 * b)) == 0
    assert all(K[p, q] == 0 for p in range(n) for q in range(n) if p != q)


def test_every_intermediate_matrix_can_be_shown():
    A = camera(diag(b_x, b_z))
    assert Matrix([[a, 0], [0, -a]]) == A.H
    assert A.c == Matrix([0, j_0])
    assert A.BHt == diag(a * b_x, -a * b_z)
    assert A.HBHt == diag(a**2 * b_x, a**2 * b_z)
    assert diag(r_i + a**2 * b_x, r_j + a**2 * b_z) == A.S
    assert simplify(A.S * A.S_inverse) == diag(1, 1)


def test_an_affine_operator_enters_the_innovation_whole_and_the_gain_by_its_slope():
    A = camera(diag(b_x, b_z))
    assert simplify(A.innovation - Matrix([i - a * x, j - (j_0 - a * z)])) == zeros(2, 1)
    assert simplify(A.K[1, 1] + a * b_z / (r_j + a**2 * b_z)) == 0
    assert A.K[1, 1].is_negative


def test_a_correlated_forecast_falls_back_to_the_scalar_gains_at_rho_0():
    correlated = camera(correlated_covariance(b_x, b_z, rho)).K
    assert simplify(correlated.subs(rho, 0) - camera(diag(b_x, b_z)).K) == zeros(2, 2)
    assert correlated[0, 1] != 0


numbers = st.floats(0.01, 100)


@cache
def correlated_in_numpy():
    A = camera(correlated_covariance(b_x, b_z, rho))
    return lambdify([(a, b_x, b_z, r_i, r_j, rho)], [A.B, A.R, A.H, A.K])


@given(st.tuples(*[numbers] * 5, st.floats(-0.95, 0.95)))
def test_the_closed_form_gain_is_the_one_numpy_inverts(values):
    B, R, H, K = correlated_in_numpy()(values)
    expected = B @ H.T @ np.linalg.inv(R + H @ B @ H.T)
    assert np.allclose(K, expected, rtol=1e-7, atol=1e-12)


def test_the_covariance_after_the_analysis_is_the_josephs_form():
    A = camera(correlated_covariance(b_x, b_z, rho))
    shrink = diag(1, 1) - A.K * A.H
    joseph = shrink * A.B * shrink.T + A.K * A.R * A.K.T
    at = {a: 2, b_x: 3, b_z: 5, r_i: 7, r_j: 11, rho: 0.5}
    assert np.allclose(np.array(A.P_a.subs(at), float), np.array(joseph.subs(at), float))


def test_limits_a_perfect_camera_a_blind_camera_and_an_ignorant_model():
    K = camera(diag(b_x, b_z)).K[0, 0]
    assert gain_limits(K, r_i, b_x) == {"r -> 0": 1 / a, "r -> oo": 0, "b -> oo": 1 / a}


def test_observations_one_after_the_other_equal_the_joint_update():
    """The scalar divisions of a spreadsheet, against the matrix inverse."""
    A = camera(correlated_covariance(b_x, b_z, rho))
    P, state = A.B, A.x_f
    for row in range(2):
        h, r = A.H[row, :], A.R[row, row]
        K, P = sequential_gain(P, h, r)
        state = state + K * (A.y[row] - A.c[row] - (h * state)[0])
    at = {a: 2, b_x: 3, b_z: 5, r_i: 7, r_j: 11, rho: 0.5, j_0: 13, x: 17, z: 19, i: 23, j: 29}
    assert np.allclose(np.array(state.subs(at), float), np.array(A.x_a.subs(at), float))
    assert np.allclose(np.array(P.subs(at), float), np.array(A.P_a.subs(at), float))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: analysis([x], [a * x**2], [i], diag(b_x), diag(r_i)), "not affine"),
        (lambda: analysis([x], [a * x], [i, j], diag(b_x), diag(r_i)), "1 observed"),
        (lambda: analysis([x, z], [x], [i], diag(b_x), diag(r_i)), "2 x 2"),
        (lambda: analysis([x, z], [x], [i], Matrix([[1, 2], [3, 4]]), diag(r_i)), "symmetric"),
        (
            lambda: analysis([x], [Piecewise((1, x > 0), (0, True))], [i], diag(b_x), diag(r_i)),
            "not",
        ),
        (lambda: analysis([x], [a * x], [i], diag(0), diag(0)).K, "no inverse"),
        (lambda: diagonal_analysis(0), "whole number from 1"),
        (lambda: sequential_gain(diag(b_x), Matrix([[1, 2]]), r_i), "1 x 1"),
    ],
)
def test_what_does_not_fit_is_refused(call, message):
    with pytest.raises(ModelError, match=message):
        call()


def test_a_fraction_of_correlated_errors_has_its_sign_in_front():
    """With a positive correlation a pixel that counts down lowers x, whatever the numbers are."""
    B = correlated_covariance(b_x, b_z, rho)
    K = camera(B).K
    oracle = B * diag(a, -a) * (diag(r_i, r_j) + diag(a, -a) * B * diag(a, -a)).inv()
    assert (K - oracle).applyfunc(simplify).is_zero_matrix
    for entry, sign in zip(K, (1, -1, 1, -1), strict=True):
        above, below = fraction(entry)
        assert not below.could_extract_minus_sign()
        assert above.could_extract_minus_sign() == (sign < 0)
        assert [f for f in above.args if f.is_Add and f.could_extract_minus_sign()] == []
