"""A state-space model -> the columns of a (linear or extended) Kalman filter.

    x_f = f(x_a)                  forecast
    P_f = F P_a F' + Q            F = df/dx at x_a
    d   = y - h(x_f)              innovation
    S   = H P H' + r              H = dh/dx at x_f; one observation at a time
    K   = P H' / S
    x  <- x + K (d - H (x - x_f))
    P  <- P - K S K'

Because the errors of the observations are independent, they are assimilated one after the other:
every gain is a scalar division and every formula is short. All of them are linearised at the
forecast, so the result equals that of the joint update with its matrix inverse, to rounding. Of
each covariance only the upper triangle has columns; it is symmetric by construction.

Source: P. Zarchan, H. Musoff, Fundamentals of Kalman Filtering, chapters 4, 7 and 9; the
sequential update: A. H. Jazwinski, Stochastic Processes and Filtering Theory, section 7.3.
"""

from __future__ import annotations

from kfsheet.estimation.filter_columns import FilterColumns
from kfsheet.estimation.state_space import StateSpace
from kfsheet.model.expressions import t
from kfsheet.model.recurrence import Recurrence


def add_filter(m: Recurrence, model: StateSpace, *, section: str, suffix: str = "") -> None:
    """Add the columns of a Kalman filter to a recurrence, on a worksheet of their own.

    For a state with the element ``x`` and an observation ``theta`` the columns are, in this
    order: ``x_f`` and ``P_xx_f`` (forecast), ``d_theta`` (innovation), ``H_theta_x`` (unless it is
    a constant), ``S_theta``, ``K_x_theta``, then ``x_1``, ``P_xx_1`` after the first of several
    observations, ..., and ``x_a``, ``P_xx_a`` (analysis); at the end ``NIS``, the normalised
    innovation squared, d' S^-1 d. From the second observation on there are also ``d_r_left``, what
    the observations before it have left of the innovation, and ``S_r_f``, the variance of ``d_r``
    itself. Intermediates come first of all, each with its derivatives ``D_w_x``. Row 0 holds the
    start values; assimilation begins in row 1.

    Parameters
    ----------
    m : Recurrence
        It gets the columns.
    model : StateSpace
        The state, its transition and what is observed.
    section : str
        Worksheet.
    suffix : str
        Put behind every name, ``"_lin"``, so that two filters can live in one recurrence.

    Raises
    ------
    ModelError
        If a name is taken, or an expression reads what the recurrence does not know.
    """
    definitions = list(FilterColumns(m, model, suffix))
    # All are announced before any is defined: a gain reads the analysis of the row before, which
    # stands further right.
    m.columns(*(d.name for d in definitions), section=section)
    for d in definitions:
        m.define(m[d.name][t], d.rule, d.unit, d.words, start=[d.start])
