# %% [markdown]
# # 5. Ten thousand flights: is this filter honest?
#
# A workbook shows one flight. One flight can be lucky. **Does the filter of the cannon-ball err as
# much as it says, at every moment, in every direction?** To answer that we fly ten thousand times,
# each time with other noise, and look at the statistics.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.optimize import minimize
from scipy.stats import chi2
from sympy import Piecewise, log, pi, sqrt

import kfsheet as kf
from kfsheet.exercises.cannonball import build_model, cannonball

# %% [markdown]
# ## The ensemble
#
# A few columns are added to the model of the exercise: whether the error of $x$ lies within the
# band that the filter claims, the same for $y$, and, for later, the logarithm of the likelihood of
# each innovation.

# %%
m = build_model()
inside_x, inside_y, loglik = m.columns("inside_x", "inside_y", "loglik", section="Study")
for inside, e, P in ((inside_x, "e_x_a", "P_xx_a"), (inside_y, "e_y_a", "P_yy_a")):
    error, variance = m[e][kf.t], m[P][kf.t]
    within = Piecewise((1, abs(error) < 2 * sqrt(variance)), (0, True))
    m.define(inside[kf.t], kf.when_observed(error, within), "", "1 within the 2 sigma band")

# %% [markdown]
# The innovations of the two observations are assimilated one after the other, each with its own
# variance $S$. So the likelihood of a flight is a product of normal densities, and its logarithm a
# sum.

# %%
d, S, d_r, S_r = m["d_theta", "S_theta", "d_r_left", "S_r"]
t, seen = kf.t, (m["d_theta"][kf.t], m["d_r_left"][kf.t])
density = -(log(2 * pi * S[t]) + d[t] ** 2 / S[t] + log(2 * pi * S_r[t]) + d_r[t] ** 2 / S_r[t]) / 2
m.define(loglik[t], kf.when_observed(seen, density), "", "log-likelihood", start=[kf.Missing])
L = m.summary("L", kf.Sum(loglik), "", "log-likelihood of the flight")

# %% [markdown]
# Ten thousand members, with draws that belong to each of them. The statistics are added up on the
# way, so no flight is kept.

# %%
MEMBERS, STATE = 10_000, ("x", "vx", "y", "vy")
wanted = ["e_x_a", "e_y_a", "P_xx_a", "P_yy_a", "NIS", "inside_x", "inside_y"]
options = {"columns": wanted, "quantiles": (0.05, 0.5, 0.95), "nees": {"NEES": kf.NEES(STATE)}}
study = kf.evaluate(m, kf.Draws("n_theta", "n_r", seed=1), members=MEMBERS, **options)
study.scalars.loc[["rms_x_a", "rms_y_a", "mean_NIS"]].round(2)

# %% [markdown]
# A typical flight errs by 12 m in $x$ and 23 m in $y$; nineteen of twenty stay below the last
# column.
#
# ## Claimed and real error
#
# At every sweep, the root mean square error over the flights should be the deviation that the
# filter claims, the root of its variance.

# %%
time = 0.1 * np.arange(m.rows)
fig, axes = plt.subplots(1, 2, figsize=(12, 3.6), layout="constrained")
for axis, ax in zip("xy", axes, strict=True):
    ax.semilogy(time, study.rows[f"e_{axis}_a"]["rms"], label="real")
    claimed = np.sqrt(study.rows[f"P_{axis}{axis}_a"]["mean"])
    ax.semilogy(time, claimed, "k--", label="claimed")
    ax.set(xlabel="time (s)", ylabel=f"error of {axis} (m)")
    ax.legend(frameon=False)

# %%
ratio = {a: study.rows[f"e_{a}_a"]["rms"] / study.rows[f"P_{a}{a}_a"]["mean"] ** 0.5 for a in "xy"}
pd.DataFrame(ratio).iloc[[0, 1, 10, 100, 600, 1319]].round(3)

# %% [markdown]
# Row 0 is the start, where every flight errs by exactly what it claims. From the first echo on the
# two agree to one percent, but for the first second in $y$, where the filter is a little modest.
#
# ## Coverage
#
# If so, about 95.4 % of the flights should lie within two sigma at any time.

# %%
coverage = {a: study.rows[f"inside_{a}"]["mean"] for a in "xy"}
pd.DataFrame(coverage).iloc[[1, 10, 100, 600, 1319]].round(4)

# %% [markdown]
# ## NIS and NEES, with narrow bounds
#
# Ten thousand flights make the chi-square bounds narrow: whatever is wrong with the linearisation
# now has to show.

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.6), layout="constrained")
for ax, name, k in zip(axes, ("NIS", "NEES"), (2, 4), strict=True):
    ax.plot(time[1:], study.rows[name]["mean"][1:], lw=0.8)
    for bound in chi2.interval(0.95, MEMBERS * k):
        ax.axhline(bound / MEMBERS, color="k", linestyle="--")
    ax.set(xlabel="time (s)", ylabel=f"mean {name}")

# %%
for name, k in (("NIS", 2), ("NEES", 4)):
    low, high = (float(bound) / MEMBERS for bound in chi2.interval(0.95, MEMBERS * k))
    mean = study.rows[name]["mean"][1:]
    share = mean.between(low, high).mean()
    print(
        f"{name}: mean {mean.mean():.3f}, within {low:.3f} to {high:.3f} in {share:.0%} of sweeps"
    )

# %% [markdown]
# ## What matters
#
# Which of the parameters matters? We change one at a time by half of itself, in the filter *and* in
# the world, and look at the median error of $y$ over a thousand flights.

# %%
draws, rms = kf.Draws("n_theta", "n_r", seed=1), {}
for name in ("sigma_theta", "sigma_r", "s_x", "s_y", "s_vx", "e_x", "e_y", "x_R"):
    changed = {name: 1.5 * cannonball.parameters[name].value}
    s = kf.evaluate(cannonball, draws, members=1000, quantiles=(0.5,), **changed).scalars
    rms[name] = s.loc[["rms_x_a", "rms_y_a"], "0.5 quantile"]
basis = kf.evaluate(cannonball, draws, members=1000, quantiles=(0.5,)).scalars["0.5 quantile"]
(pd.DataFrame(rms).T / basis[["rms_x_a", "rms_y_a"]]).round(2)

# %% [markdown]
# The radar's errors and its place matter, and how wrong the start is (it counts in the first
# sweeps). What the filter was *told* about the start, `s_x`, `s_y`, `s_vx`, hardly does: the radar
# soon knows better.
#
# ## Choosing r by likelihood
#
# A real radar comes without a label. But a filter with wrong variances has unlikely innovations. We
# give the *filter's* deviations to an optimiser and let it look for the most likely ones, from a
# single flight and without any truth. To keep the echoes while the deviations change, the draws are
# scaled the other way.

# %%
N = {name: np.array(cannonball.table[name].values) for name in ("n_theta", "n_r")}


def unlikely(logs):
    theta, r = np.exp(logs)
    kept = {"n_theta": N["n_theta"] * 0.01 / theta, "n_r": N["n_r"] * 30.48 / r}
    run = kf.evaluate(m, kept, sigma_theta=theta, sigma_r=r)
    return -run.attrs["scalars"]["L"]


found = minimize(unlikely, np.log([0.05, 100]), method="Nelder-Mead", options={"xatol": 1e-4})
print("sigma_theta {:.5f} rad, sigma_r {:.2f} m".format(*np.exp(found.x)))

# %% [markdown]
# From a guess that was wrong by a factor of 5 and 3 it finds 0.01 rad and 30.5 m to a few percent:
# 1,319 echoes determine a deviation to about 2 %. And the noise of the model? We let $\Phi_s$
# compete with its true value, zero.

# %%
density = [kf.evaluate(m, Phi_s=Phi).attrs["scalars"]["L"] for Phi in (0, 0.01, 0.1, 1, 10)]
pd.Series(density, index=pd.Index([0, 0.01, 0.1, 1, 10], name="Phi_s"), name="log L").round(1)

# %% [markdown]
# The likelihood falls as soon as the filter suspects noise that is not there. So it *can* tell,
# where the mean NIS could not.
#
# ## The workbook among the flights
#
# The sheet's flight is one of the many. Where do its figures, as the spreadsheet engine computes
# them, lie among the others'?

# %%
sheet = kf.recalculate("../workbooks/cannonball.xlsx")["Parameters"]
names = {text: (row, column) for (row, column), text in sheet.items() if isinstance(text, str)}
shown = ["rms_x_a", "rms_y_a", "rms_x_lin", "rms_y_lin", "mean_NIS"]
table = study.scalars.loc[shown, ["0.05 quantile", "0.5 quantile", "0.95 quantile"]]
table["sheet"] = [sheet[names[name][0], names[name][1] + 1] for name in shown]
table.round(2)

# %% [markdown]
# All within the middle nine tenths: a flight like others.
#
# ## Exercises
#
# **Routine**
#
# 1. Fly 1,000 times at 30 degrees. Which statistics lose rows, and what does `count` say?
# 2. How wide are the chi-square bounds of the NEES for 100 flights? How many flights does it take
#    to notice an error of 5 %?
#
# **Break it**
#
# 3. Tell the filter that the radar errs half as much as it does (scale the draws, as above). What
#    do NIS, NEES and coverage say, and which of them would you have on a real range?
# 4. Start the filter 3,000 m off instead of 305 m, with `s_x` and `s_y` unchanged. Which sweeps
#    betray it?
#
# **Extend it**
#
# 5. Estimate $\Phi_s$ by likelihood for the football's or the shuttlecock's filter.
# 6. Give `evaluate` the executor of a cluster (`executor=`) and fly a million times.
