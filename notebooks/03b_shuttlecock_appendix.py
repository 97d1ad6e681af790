# %% [markdown]
# # 3b. Shuttlecock, appendix: nine states, Lambert's W, doubt and gates
#
# What notebook 3 leaves out of its main line: why three small filters are one large one; how a cell
# finds the moment of the fall; which figures can be reproduced; and where a filter does win, since
# it may doubt its model and its cameras.
#
# **You will be able to** see when a covariance falls apart; solve for a time by Newton's steps in
# cells; say what doubt and a gate cost. **You need** notebook 3. **Time:** 60 minutes.

# %%
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import display
from scipy.special import lambertw
from scipy.stats import binomtest
from sympy import LambertW, Matrix, exp, init_printing, solve, symbols

import kfsheet as kf
from kfsheet.estimation import drag

# %%
from kfsheet.exercises.shuttlecock import FORECASTS, shuttlecock
from kfsheet.exercises.shuttlecock.many_flights import (
    AFTER,
    COLOURS,
    draws,
    fly,
    other_draws,
    ratio,
    show_ratio,
)
from kfsheet.exercises.shuttlecock.outliers import struck_frames, with_outliers

init_printing(use_latex="mathjax", latex_printer=lambda e, **_: kf.latex_code(e))
AFTER, run, flights = list(AFTER), kf.evaluate(shuttlecock), fly()


def medians(flights, frames=AFTER):
    found = {r: np.median(flights[f"e_fall_{r}"][:, frames], axis=0) for r in FORECASTS}
    return pd.DataFrame(found, index=pd.Index(frames, name="frame"))


# %% [markdown]
# ## Nine states fall apart
#
# Three axes at once are nine states and 45 different covariances. We ask the filter builder for the
# *joint* filter and look at which covariances it kept.

# %%
kept = [c for c in shuttlecock.table if c.startswith("P_") and c.endswith("_f")]
print(len(kept), "of 45:", *kept)

# %% [markdown]
# Only pairs within an axis: all others stay 0 for ever, so they have no columns. Are the numbers
# the same? We fly the whole flight with three matrices of 3 x 3 and with one of 9 x 9, both with an
# inverse, and compare them with each other and with the sheet, which has none.

# %%
sys.path.append("../benchmarks")
from shuttlecock_three_by_three import counted, flown

run = kf.evaluate(shuttlecock)
three, nine = flown(run[["x_obs", "y_obs", "z_obs"]].to_numpy())
for what, a, b in zip(("states", "covariances"), three, nine, strict=True):
    assert abs(a - b).max() < 1e-12
    print(f"{what} of three filters and of one differ by less than 1e-12")

# %%
NAMES = [f"{letter}{axis}_a" for axis in "xyz" for letter in ("", "v", "a")]
assert abs(run[NAMES].to_numpy() - nine[0]).max() < 1e-12
last = {"sheet": run[NAMES].iloc[26], "three 3 x 3": three[0][26], "one 9 x 9": nine[0][26]}
pd.DataFrame(last).round(9)

# %% [markdown]
# States and covariances agree in all 27 frames. What the paper saves is arithmetic with zeros. How
# much, if a program does not notice the zeros? SymPy counts the operations of one step in full
# matrices.

# %%
counted()

# %% [markdown]
# Nine times fewer operations: the paper's point, confirmed. Whether that saves time depends on the
# program. `benchmarks/shuttlecock_three_by_three.py` measures it. What it printed, and on what:

# %%
measured = Path("../benchmarks/shuttlecock_three_by_three.txt").read_text()
print(*measured.split("\n\n")[2:4], sep="\n\n")

# %% [markdown]
# In NumPy a call costs more than its arithmetic: three small filters, one after the other, take
# almost three times *longer* than the large one. Compiled loops pay for the arithmetic, and there
# the paper is right: less than half the time, though not a ninth.
#
# ## When does it fall?
#
# The height is zero at a moment that no elementary formula gives. SymPy knows the function it
# takes: Lambert's $W$, the inverse of $W e^W$.

# %%
k, g = symbols("k g", positive=True)
tau, X, p_z, v_z = symbols("tau X p_z v_z", real=True)
position = (drag.flight(k, g, tau, X) * Matrix([p_z, v_z, 1]))[0]
position

# %%
(moment,) = solve(position.subs(X, drag.distorted(k, tau)), tau)
moment

# %% [markdown]
# In shorter words it is $(c + W(w))/k$, with two numbers that the sheet has columns for. SymPy
# confirms that the two say the same.

# %%
c = drag.fall_asymptote(k, g, p_z, v_z)
w_z = drag.fall_argument(k, g, v_z, c)
assert (moment - (c + LambertW(w_z)) / k).simplify() == 0
display(c, w_z)

# %% [markdown]
# A cell has no $W$, so the sheet takes Newton's steps, one column each. In $W = k\tau - c$ the
# height is, but for a factor, $w e^{-W} - W$, and a step becomes short:

# %%
W, w = symbols("W w", real=True)
step = kf.newton_step(w * exp(-W) - W, W)
assert step == drag.lambert_step(W, w)
step

# %% [markdown]
# And where do they start? $W$ has two branches, the way up and the way down, which meet at
# $W = -1$, $w = -1/e$. Weak drag leads there, and a tangent near a maximum is a poor guide. So we
# expand: $1 + e w$ is a parabola in $W + 1$.

# %%
s = symbols("s", real=True)
display((1 + (s - 1) * exp(s)).series(s, 0, 4))
drag.lambert_start(symbols("reach", positive=True))

# %% [markdown]
# The *reach* is $1 + e w$; a flight with a negative one stays below. The sheet's first guess has
# the parabola's root and its next term, and grows like a logarithm, as $W$ does. SciPy knows $W$ to
# all digits. How many steps are needed, from the guess and from 0?

# %%
for slow in (1, 0.01):
    number = float(w_z.subs({k: slow, g: 9.80665, p_z: 0.5, v_z: 4}))
    guesses = [float(drag.lambert_start(1 + np.e * number)), 0.0]
    for steps in range(4):
        off = [abs(guess - lambertw(number).real) / slow for guess in guesses]
        print(f"k = {slow}, {steps} steps: {off[0]:.0e} s off, from 0 {off[1]:.0e} s")
        guesses = [float(step.subs({W: guess, w: number})) for guess in guesses]

# %% [markdown]
# From the guess, two steps leave $10^{-12}$ s at most; from 0, weak drag makes each step halve the
# error, and no more. The sheet takes four, for wild fits. Now every frame: its fall times against
# SciPy's $W$ of the fitted start.

# %%
v_fit, p_fit = run["v_z_raw"][1:], run["p_z_raw"][1:]
c_fit = 1 + v_fit / 9.80665 + p_fit / 9.80665
by_scipy = c_fit + lambertw(-(1 + v_fit / 9.80665) * np.exp(-c_fit)).to_numpy().real
assert (run["t_fall_raw"][1:] - by_scipy).abs().max() < 1e-12
pd.DataFrame({"sheet (s)": run["t_fall_raw"][1:], "Lambert W (s)": by_scipy}).iloc[::5].round(9)

# %% [markdown]
# The truth falls 0.8676 s after the first frame: just after the last of our 27 frames.
#
# ## What a figure needs to be reproduced
#
# Could somebody who reads our medians find them again? Two things must be known that are easily
# left out: the draws, and what "after six frames" means, the frames 0 to 6, as in our tables, or
# 0 to 5. The raw fit from 400 draws of another generator, and both counts:

# %%
sets, rows = {"our draws": flights, "other draws": fly(other_draws)}, {}
for name, f in sets.items():
    for count, frames in (("0 to f", AFTER), ("0 to f - 1", [frame - 1 for frame in AFTER])):
        rows[name, count] = np.median(f["e_fall_raw"][:, frames], axis=0)
pd.DataFrame(rows, index=pd.Index(AFTER, name="f")).T.round(3)

# %% [markdown]
# At $f = 6$ another count moves the median by a fifth to a quarter, other draws by a tenth or less.
# A figure without its draws, their seeds and its count cannot be reproduced. Ours: `RandomState`
# with the seeds 0 to 399, and frame $f$ has seen the frames 0 to $f$.
#
# ## When the model is wrong: the filter, and its doubt
#
# A fit cannot doubt its model; a filter can, by a $\Phi_s > 0$. We keep the two apart: the exact
# filter without doubt ($\Phi_s = 0$), with a little (0.05) and with much (0.5), in worlds where the
# model is right, where $k/m$ is taken 30 % too small or twice too large, and where the truth has
# quadratic drag.

# %%
WORLDS = {
    "believed: right": {},
    "believed: 30 % too little": {"f_k": 0.7},
    "believed: twice as much": {"f_k": 2},
    "true drag quadratic": {"k_2": 0.2},
}
DOUBTS = (0, 0.05, 0.5)
worlds = {w: {D: fly(Phi_s=D, **p) for D in DOUBTS} for w, p in WORLDS.items()}

# %% [markdown]
# Medians of the error of the fall point in an early, a middle and the last frame. The doubt is the
# exact filter's; the other three know none.


# %%
def after(frame):
    rows = {}
    for world, runs in worlds.items():
        others = medians(runs[0], [frame]).loc[frame, ["raw", "kf", "now"]]
        exact = {f"exact, {D}": medians(f, [frame]).loc[frame, "ex"] for D, f in runs.items()}
        rows[world] = {**others, **exact}
    return pd.DataFrame(rows).T


# %%
after(4).round(3)

# %%
after(14).round(3)

# %%
after(26).round(3)

# %% [markdown]
# How sure is that? The ratio of medians, each forecast to the raw fit, with its bootstrap band:
# below 1 the filter wins. Above the exact filter with its doubts; below the other two.

# %%
SHOWN = [2, 3, 4, *AFTER]
GREENS = dict(zip(DOUBTS, ("#66C2A4", "#009E73", "#00441B"), strict=True))
fig, axes = plt.subplots(2, 4, figsize=(15, 7), sharey="row", sharex=True, layout="constrained")
for (upper, lower), (world, runs) in zip(axes.T, worlds.items(), strict=True):
    raw = runs[0]["e_fall_raw"]
    for D, f in runs.items():
        look = {"color": GREENS[D], "label": f"exact filter, doubt {D}"}
        show_ratio(upper, f["e_fall_ex"], raw, SHOWN, **look)
    for kind in ("kf", "now"):
        look = {"color": COLOURS[kind], "label": FORECASTS[kind]}
        show_ratio(lower, runs[0][f"e_fall_{kind}"], raw, SHOWN, **look)
    upper.set_title(world)
_ = [ax.legend(frameon=False) for ax in axes[:, 0]]

# %% [markdown]
# The frames 4 and 6 in numbers, without doubt: ratio to the raw fit, and its band.

# %%
rows = {}
for world, runs in worlds.items():
    for kind in ("ex", "kf", "now"):
        found = ratio(runs[0][f"e_fall_{kind}"], runs[0]["e_fall_raw"], [4, 6]).T
        texts = [f"{mid:.2f} ({low:.2f} to {high:.2f})" for mid, low, high in found]
        rows[world, FORECASTS[kind]] = texts
pd.DataFrame(rows, index=["frame 4", "frame 6"]).T

# %% [markdown]
# **Without doubt** the exact filter ties with the fit from frame 10 on, within 3 %, in every world:
# it is the fit, and as blind to a wrong model. Before, it leads, by up to a fifth; but with twice
# the drag it is behind by 3 % in frame 4, where the band holds 1, and by 4 % in frame 6, where it
# does not. **A little doubt** costs some percent at most, and wins the last frames where the drag
# is twice too large, by 15 %. **Much doubt** wins there from frame 18 on, but in all other worlds
# it ends with a quarter to a third more error than the fit.
#
# The **fit to the filter** is nowhere clearly ahead from frame 6 on; with twice the drag it stays
# 2 to 10 % behind. The **latest state** of the paper's filter depends on the world most: in
# frame 4 it errs a fifth *more* than the fit with twice the drag, a quarter less with too little or
# quadratic drag, and in the end it errs more everywhere.
#
# In how many of the flights does the filter win? 45 to 55 % is chance.


# %%
def share(runs, frames=(4, *AFTER)):
    wins = (runs["e_fall_ex"] < runs["e_fall_raw"])[:, frames].mean(axis=0)
    return pd.Series([f"{win:.0%}" for win in wins], index=pd.Index(frames, name="frame"))


pd.DataFrame({(w, D): share(f) for w, runs in worlds.items() for D, f in runs.items()}).T

# %% [markdown]
# Shares tell who wins, not by how much. With twice the drag the filter without doubt loses more
# than nine flights in ten from frame 10 on, by one or two percent: the velocity 0 that it started
# from pulls its forecasts the wrong way. Where the drag is taken too small, it pulls the right way.
#
# ## When a frame is wrong: the filter, and its gate
#
# Cameras sometimes take something else for the shuttlecock. One frame of ten now gets a second
# error on each axis, normal with eight times the standard deviation, from
# `kfsheet.exercises.shuttlecock.outliers`. The exact filter flies without doubt, and with a gate:
# it ignores innovations beyond eight, or three, of the standard deviations that it expects.


# %%
def outliers(seed):
    return with_outliers(draws(seed), (1, seed))


# %%
gates = {"no gate": fly(outliers), "gate 8": fly(outliers, gate=8), "gate 3": fly(outliers, gate=3)}
others = medians(gates["no gate"], [4, *AFTER])[["raw", "kf", "now"]]
exact = {f"exact, {g}": medians(f, [4, *AFTER])["ex"] for g, f in gates.items()}
pd.concat([others, pd.DataFrame(exact)], axis=1).round(3)

# %% [markdown]
# Without a gate the exact filter suffers as the fit does. How sure are the other differences? Once
# more ratios to the raw fit, in pairs.

# %%
ax = plt.subplots(figsize=(9, 4.2), layout="constrained")[1]
for (gate, f), colour in zip(gates.items(), GREENS.values(), strict=True):
    look = {"color": colour, "label": f"exact filter, {gate}"}
    show_ratio(ax, f["e_fall_ex"], f["e_fall_raw"], SHOWN, **look)
for kind in ("kf", "now"):
    look = {"color": COLOURS[kind], "label": FORECASTS[kind]}
    f = gates["no gate"]
    show_ratio(ax, f[f"e_fall_{kind}"], f["e_fall_raw"], SHOWN, **look)
_ = ax.legend(frameon=False)

# %%
rows = {g: ratio(f["e_fall_ex"], f["e_fall_raw"], [6, 14, 26]).T for g, f in gates.items()}
rows["now"] = ratio(gates["no gate"]["e_fall_now"], gates["no gate"]["e_fall_raw"], [6, 14, 26]).T
texts = {
    name: [f"{mid:.2f} ({low:.2f} to {high:.2f})" for mid, low, high in found]
    for name, found in rows.items()
}
pd.DataFrame(texts, index=["frame 6", "frame 14", "frame 26"]).T

# %% [markdown]
# Against the raw fit, a gate of three sigmas wins in every frame, and ends with little more than
# half the error; a gate of eight is between. The paper's latest state is ahead up to frame 6; from
# frame 10 on its band holds 1. But a median is silent about the worse half of the flights, so we
# look at the last frame's quantiles.

# %%
lines = {"fit to the cameras": gates["no gate"]["e_fall_raw"]}
lines |= {f"exact filter, {gate}": runs["e_fall_ex"] for gate, runs in gates.items()}
levels = [0.5, 0.75, 0.9, 0.95]
pd.DataFrame({n: np.quantile(e[:, 26], levels) for n, e in lines.items()}, index=levels).T.round(3)

# %%
fig, axes = plt.subplots(1, 2, figsize=(13, 4.2), sharey=True, layout="constrained")
for ax, level in zip(axes, (0.5, 0.9), strict=True):
    colours = (COLOURS["raw"], *GREENS.values())
    for (name, errors), colour in zip(lines.items(), colours, strict=True):
        ax.plot(range(2, 27), np.quantile(errors[:, 2:], level, axis=0), color=colour, label=name)
    ax.set(xlabel="frame", title=f"{level:.0%} of the flights err less", yscale="log")
axes[0].set_ylabel("error of the fall point (m)")
axes[0].set_yticks([0.1, 0.3, 1, 3], labels=["0.1", "0.3", "1", "3"])
_ = axes[1].legend(frameon=False)

# %% [markdown]
# The narrow gate loses flights, by metres. How many end more than a metre off, of all 400, and
# between which limits is the true share (binomial, 95 %)?

# %%
for gate, f in gates.items():
    number = int((f["e_fall_ex"][:, 26] > 1).sum())
    limits = binomtest(number, 400).proportion_ci()
    print(f"{gate}: {number} flights, {number / 400:.1%} ({limits.low:.1%} to {limits.high:.1%})")

# %% [markdown]
# One in eight, roughly. Which ones? By the place of a flight's first outlier:

# %%
hit = np.array([struck_frames((1, s), 27) for s in range(400)])
where = pd.cut(np.where(hit.any(axis=1), hit.argmax(axis=1), 27), [-1, 0, 3, 27])
where = where.rename_categories(["frame 0", "frames 1 to 3", "later or never"])
lost = {
    g: pd.Series(f["e_fall_ex"][:, 26] > 1).groupby(where, observed=True).mean()
    for g, f in gates.items()
}
pd.DataFrame(lost).map("{:.0%}".format)

# %% [markdown]
# The filter trusts what it saw first. If that was an outlier, it takes the good frames that follow
# for outliers, and never learns better. A gate of eight sigmas seldom does so: its errors are
# smaller than the fit's at every quantile of the table, if by less; beyond the table are the one
# flight in 27 that it loses.
#
# ## What was learned
#
# Nine states are three times three if no axis hears of another. A fit cannot doubt; a filter with a
# little doubt loses next to nothing, and wins where its model is wrong enough. A narrow gate
# wins in the typical flight, and loses those that begin with an outlier.
#
# ## Exercises
#
# **Routine**
#
# 1. In the sheet, set `Phi_s` to 0.05 and `f_k` to 2. Which of the four forecasts gains?
#
# **Break it**
#
# 2. Set `belief_r` to 0.3: the exact filter thinks the cameras three times as good as they are.
#    What does `mean_NIS_ex` say, and what becomes of its fall points without doubt? Why so little?
#
# **Extend it**
#
# 3. Let the filter start anew when it has ignored four frames in a row. How many of the
#    lost flights come back?
