"""The fit of pixels, against theory, independent fits and the truth; the impact it foretells."""

from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest
from scipy.stats import chi2
from scipy.stats import f as fisher

from kfsheet.errors import DataError
from kfsheet.exercises.tennis import read_drive, read_toss
from kfsheet.exercises.tennis.methods.dynamics import MASS, impact
from kfsheet.exercises.tennis.methods.reprojection import fit_pixels, path_covariance
from kfsheet.exercises.tennis.methods.shots import TRUE_DRAG, TRUE_SPIN, simulate

SHOTS = {"A": read_drive(), "B": read_toss()}


@pytest.fixture(params=SHOTS)
def name(request):
    return request.param


@pytest.fixture
def shot(name):
    return SHOTS[name]


@pytest.mark.parametrize(
    ("name", "c_D", "where"), [("A", 0.001249, (30.573, 6.998)), ("B", 0.001204, (11.547, 6.218))]
)
def test_an_independent_fit_of_the_given_pixels_agrees(name, c_D, where):
    fit = fit_pixels(SHOTS[name])
    assert fit.ball.kappa * MASS == pytest.approx(c_D, abs=5e-7)
    assert impact(fit.ball)[1][:2] == pytest.approx(where, abs=5e-4)
    assert fit.rms == pytest.approx(0.2, rel=0.05)


def test_the_fit_finds_the_truth_without_noise(name, shot):
    exact = replace(shot, truth=shot.scene.ball.fly(shot.times))  # the table has six decimals
    clean = simulate(exact, 0, sigma=1e-9)
    for options in ({}, {"g": None}, {"kappa": TRUE_DRAG}, {"spin": TRUE_SPIN}):
        ball = fit_pixels(clean, **options).ball
        assert np.abs(ball.fly(shot.times) - exact.truth).max() < 1e-6
        assert [ball.c_D, ball.g] == pytest.approx([0.0012, 9.8], rel=1e-4)


SEEDS = 40
WHAT = {"free": {}, "known": {"kappa": TRUE_DRAG}}


@pytest.fixture(scope="module")
def fits():
    """Fits of forty photographed flights, with drag free and known."""
    draws = {name: [simulate(shot, k) for k in range(SEEDS)] for name, shot in SHOTS.items()}
    return {
        (name, what): [fit_pixels(draw, **options) for draw in draws[name]]
        for name in SHOTS
        for what, options in WHAT.items()
    }


def rms_mm(shot, fits):
    errors = [fit.ball.fly(shot.times) - shot.truth for fit in fits]
    return 1e3 * np.sqrt(np.mean(np.square(errors), axis=(0, 1)))


def theory_mm(shot, what):
    """Root mean square along the path, and the degrees of freedom of its square for one draw.

    The square is a sum of chi-squares, weighted by the eigenvalues of the covariance C;
    Satterthwaite: as one of tr(C)^2/tr(C^2) degrees of freedom, which has its mean and variance.
    """
    C = path_covariance(shot, shot.scene.ball, **WHAT[what])
    trace = np.trace(C, axis1=1, axis2=2)
    return 1e3 * np.sqrt(trace / len(shot.times)), trace**2 / (C**2).sum(axis=(1, 2))


def scatter(free, p):
    """Quantile of a root mean square of forty draws over its expectation."""
    return np.sqrt(chi2.ppf(p, SEEDS * free) / (SEEDS * free))


def half_a_digit(figures):
    """By how much rounding may have moved figures of a source."""
    return np.array([0.5 * 10.0 ** Decimal(str(f)).as_tuple().exponent for f in figures]) + 1e-9


@pytest.mark.parametrize("what", WHAT)
def test_the_fit_errs_as_much_as_its_jacobian_says(fits, name, shot, what):
    """Forty draws within the band that chi-square leaves them in 999 of 1000 cases."""
    theory, free = theory_mm(shot, what)
    ratio = rms_mm(shot, fits[name, what]) / theory
    assert (scatter(free, 0.0005) < ratio).all()
    assert (ratio < scatter(free, 0.9995)).all()


@pytest.mark.parametrize(
    ("name", "what", "expected", "found"),
    [
        ("A", "free", (66.5, 3.45, 1.37), (75, 4, 1.5)),
        ("A", "known", (5.23, 0.66, 0.51), (5.8, 0.8, 0.5)),
        ("B", "free", (23.9, 1.79, 1.17), (26, 1.9, 1.3)),
        ("B", "known", (3.46, 0.34, 0.26), (4.1, 0.4, 0.3)),
    ],
)
def test_the_theory_agrees_with_an_independent_one_and_explains_independent_draws(
    name, what, expected, found
):
    """Errors in mm that another program's Jacobian expects, and those of fits to its 40 draws."""
    theory, free = theory_mm(SHOTS[name], what)
    assert (np.abs(theory - expected) <= half_a_digit(expected)).all()
    low, high = (theory * scatter(free, p) for p in (0.0005, 0.9995))
    assert (low < found + half_a_digit(found)).all()
    assert (high > found - half_a_digit(found)).all()


def test_measured_drag_is_worth_a_factor_of_five_in_depth_at_least(fits, name, shot):
    free, known = (rms_mm(shot, fits[name, what])[0] for what in WHAT)
    assert known < free / 5


def test_the_errors_that_a_fit_claims_are_those_it_makes(fits, name):
    """Parameter by parameter, the variance of forty draws over the mean of what they claim."""
    some = fits[name, "free"]
    made = np.var([np.r_[f.ball.X, f.ball.V, f.ball.kappa, f.ball.spin] for f in some], 0, ddof=1)
    parts = ("X", "V", "kappa", "spin")
    claimed = np.mean([np.concatenate([f.sigma[p] for p in parts]) ** 2 for f in some], axis=0)
    assert (made / claimed > chi2.ppf(0.0005, SEEDS - 1) / (SEEDS - 1)).all()
    assert (made / claimed < chi2.ppf(0.9995, SEEDS - 1) / (SEEDS - 1)).all()


def misses(shot, draws, **options):
    """Errors (x1, x2) of the impact, foretold from the first 30 images."""
    fits = (fit_pixels(simulate(shot, k).first(30), **options) for k in range(draws))
    return np.array([impact(fit.ball)[1] - impact(shot.scene.ball)[1] for fit in fits])[:, :2]


@pytest.mark.parametrize(("name", "free", "known"), [("A", 0.20, 0.08), ("B", 0.10, 0.03)])
def test_thirty_images_foretell_how_far_out_the_impact_is(name, free, known):
    """In x1, with spin across V only: an independent calculation's 40 draws against 40 of ours.

    One direction dominates the error, so a ratio of two mean squares is F(40, 40).
    """
    most = np.sqrt(fisher.ppf(0.9995, SEEDS, SEEDS))
    for figure, options in ((free, {}), (known, {"kappa": TRUE_DRAG})):
        ours = np.sqrt(np.mean(misses(SHOTS[name], SEEDS, spin="across", **options)[:, 0] ** 2))
        (rounding,) = half_a_digit([figure])
        assert (figure - rounding) / most < ours < (figure + rounding) * most


def test_spin_along_the_flight_spoils_the_early_impact_and_so_does_no_spin(shot):
    """A component along V makes the fit miss sideways; none at all, by many times the noise."""
    draws, known = 12, {"kappa": TRUE_DRAG}
    across, full, none = (
        misses(shot, draws, spin=spin, **known) for spin in ("across", "full", "none")
    )
    assert np.std(full[:, 1]) > 5 * np.std(across[:, 1])
    assert np.linalg.norm(none, axis=1).min() > np.linalg.norm(across, axis=1).max()


def test_a_fit_refuses_what_it_cannot_do(shot):
    with pytest.raises(DataError, match="must be one of"):
        fit_pixels(shot, spin="sideways")
    with pytest.raises(DataError, match="unknowns"):
        fit_pixels(shot.first(7).first(2), start=shot.scene.ball)
    with pytest.raises(DataError, match="two images"):
        fit_pixels(shot.first(5))
