"""All data on the same footing: other clocks, one camera, a shadow, a misread photo (3.5.2, 3.5.4).

The path of the ball is known from views; these functions say how well, and what errs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from kfsheet.exercises.tennis.methods.arguments import Array
from kfsheet.exercises.tennis.methods.cameras import PIXELS
from kfsheet.exercises.tennis.methods.dynamics import GRAVITY, Ball
from kfsheet.exercises.tennis.methods.reprojection import (
    fit_views,
    start_from_overlap,
    views_covariance,
)
from kfsheet.exercises.tennis.methods.shots import SIGMA, Shot
from kfsheet.exercises.tennis.methods.views import Pixels, View, photograph, views_of

LAMP = (0.4, 0.2, -1.5)
"""Direction of a light from above and behind camera 1: the shadow runs ahead of the ball."""


def path_rms(shot: Shot, views: Sequence[View], **known: Any) -> Array:
    """How well views tell the path at the times of a shot: rms (3,) by theory, m.

    Parameters
    ----------
    shot : Shot
        Gives the true ball, and the times.
    views : sequence of View
        What there is to be seen.
    **known
        What is known and what is free, as for
        :func:`kfsheet.exercises.tennis.methods.reprojection.views_covariance`.
    """
    C = views_covariance(views, shot.scene.ball, **known)
    times = np.unique(np.concatenate([view.times for view in views]))
    variance = np.diagonal(C, axis1=1, axis2=2)[:, np.isin(times, shot.times)]
    return np.sqrt(variance.mean(axis=1))


def worth(shot: Shot) -> dict[str, float]:
    """What cameras, clocks, a shadow and known quantities are worth: rms of the depth x1, mm."""
    both, shadow = views_of(shot), shadow_of(shot)
    drag = {"kappa": shot.scene.ball.kappa}
    cases = {
        "two cameras": (both, {}),
        "the same, photos in turns, at known times": (between(shot), {}),
        "the same, clock of camera 2 unknown": (with_clock(shot, None), {}),
        "two cameras and a shadow": ([*both, shadow], {}),
        "two cameras, drag known": (both, drag),
        "one camera, drag and g known": (both[:1], drag),
        "one camera, spin known as well": (both[:1], {**drag, "spin": shot.scene.ball.spin}),
        "one camera and a shadow": ([both[0], shadow], {}),
    }
    return {
        what: 1e3 * float(path_rms(shot, views, **known)[0])
        for what, (views, known) in cases.items()
    }


def drawn(views: Sequence[View], ball: Ball, seed: int, sigma: float = SIGMA) -> list[View]:
    """The same views of the ball, with errors of ``sigma`` pixels."""
    dice = np.random.RandomState(seed)
    return [photograph(v, ball, sigma * dice.standard_normal(v.pixels.shape)) for v in views]


def path_errors(shot: Shot, views: Sequence[View], told: Sequence[View], **known: Any) -> Array:
    """Path of a fit minus the truth, (n, 3), m; ``told`` are the views as the fit knows them."""
    given = [replace(claim, pixels=real.pixels) for claim, real in zip(told, views, strict=True)]
    ball = fit_views(given, start=shot.scene.ball, **known).ball
    return ball.fly(shot.times) - shot.scene.ball.fly(shot.times)


def with_clock(shot: Shot, late: float | None) -> list[View]:
    """Both views of a shot, camera 2's taken ``late`` seconds later than its clock says."""
    one, two = views_of(shot)
    return [one, replace(two, late=late)]


def between(shot: Shot, share: float = 0.5) -> list[View]:
    """Both views of a shot, camera 2's taken a share of a step later, at times that are known."""
    one, two = views_of(shot)
    step = shot.times[1] - shot.times[0]
    return photographs(shot, [one, replace(two, times=two.times + share * step)])


def photographs(shot: Shot, views: Sequence[View]) -> list[View]:
    """What the views show of the true ball, without errors."""
    return [photograph(view, shot.scene.ball) for view in views]


def shadow_of(shot: Shot, light: ArrayLike = LAMP) -> View:
    """Camera 1's view of the shadow on the floor, in the images in which it has it; no errors."""
    camera = shot.scene.camera_1
    everywhere = View(camera, shot.times, np.zeros((len(shot.times), 2)), light=light)
    pixels = photograph(everywhere, shot.scene.ball).pixels
    inside = ((pixels > 0) & (pixels < PIXELS)).all(axis=1)
    return replace(everywhere, pixels=np.where(inside[:, None], pixels, np.nan))


def misread(shot: Shot, image: int, error: ArrayLike) -> Shot:
    """The shot, with the photo of one image in camera 2 misread by (2,) pixels."""
    pixels = shot.pixels_2.copy()
    pixels[image] += np.asarray(error, float)
    return replace(shot, pixels_2=pixels)


def dead_reckoning(shot: Shot) -> Array:
    """Positions (n, 3) by the law from the overlap's first and last points alone, m.

    The mean velocity between both is that of their middle, and true drag and spin carry it on: the
    errors of two points accumulate with time.
    """
    first, last = shot.overlap[[0, -1]]
    points, t, true = shot.triangulated(), shot.times, shot.scene.ball
    middle = (t[first] + t[last]) / 2
    speed = (points[last] - points[first]) / (t[last] - t[first])
    back = true.state(middle)
    # A chord's middle lies beside the path by its sagitta, which the true path tells.
    sagitta = back.X - (true.fly([t[first]])[0] + true.fly([t[last]])[0]) / 2
    start = replace(true, X=(points[first] + points[last]) / 2 + sagitta, V=speed)
    return start.state(-middle).fly(t)


def fit_with_distances(
    shot: Shot, *, weigh: bool = True, kappa: float | None = None, g: float = GRAVITY
) -> Ball:
    """Recommendation (1) of section 3.5.4 to the letter: the distances are unknowns as well.

    For each photo, the point at the distance s on its line of sight is compared with the ball:
    three equations and one unknown more. The best s is that of the foot of the perpendicular, so
    that the unknowns can be eliminated, and what is left of the three equations is the way from
    the line to the ball.

    Parameters
    ----------
    shot : Shot
        The photos.
    weigh : bool
        Whether each way counts over its distance: the error of a line grows with it.
    kappa, g : float
        As for :func:`kfsheet.exercises.tennis.methods.reprojection.fit_pixels`.
    """
    views = views_of(shot)
    model = Pixels.of(views, kappa, "full", g)

    def ways(p: Array) -> Array:
        x = model.positions(p[None])[0]
        return np.concatenate([_from_lines(view, x, weigh) for view in views])

    start = model.unknowns.vector(start_from_overlap(shot))
    return model.unknowns.ball(least_squares(ways, start, method="lm").x)


def _from_lines(view: View, x: Array, weigh: bool) -> Array:
    """From each line of sight to the ball, flat; over the distance if ``weigh``."""
    seen = view.seen.all(axis=1)
    line, to = view.camera.rays(view.pixels[seen]), x[seen] - np.array(view.camera.position)
    distance = (to * line).sum(axis=1, keepdims=True)
    return ((to - distance * line) / (distance if weigh else 1.0)).ravel()
