# %% [markdown]
# # 5. Ten thousand flights: is this filter honest?
#
# A workbook shows one flight, and one flight can be lucky. **Does the filter of the cannon-ball err
# as much as it says, at every moment, in every direction?** If not, where, by how much, and why? We
# fly ten thousand times, each time with other noise, and ask the statistics.

# %%
from itertools import combinations_with_replacement, product

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.optimize import minimize
from scipy.stats import chi2, norm
from sympy import Piecewise, diag, init_printing, log, pi, sqrt

import kfsheet as kf
from kfsheet.exercises.cannonball import DYNAMICS, build_model

init_printing(use_latex="mathjax", latex_printer=lambda e, **_: kf.latex_code(e))
m, t, STATE = build_model(), kf.t, ("x", "vx", "y", "vy")

# %% [markdown]
# ## The ensemble
#
# The model is that of exercise 2. It gets four more columns, one for each element of the state: 1
# where the error lies within the band of two sigma that the filter claims, 0 elsewhere. Their mean
# over the flights is the *coverage*.

# %%
for name in STATE:
    (inside,) = m.columns(f"inside_{name}", section="Study")
    error, variance = m[f"e_{name}_a"][t], m[f"P_{name}{name}_a"][t]
    rule = Piecewise((1, abs(error) < 2 * sqrt(variance)), (0, True))
    m.define(inside[t], kf.when_observed(error, rule), "", "1 within the 2 sigma band")
rule

# %% [markdown]
# A fifth column serves the end of this notebook: the logarithm of the likelihood of each echo. Angle
# and range are assimilated one after the other, each innovation with its own variance $S$, so the
# likelihood of an echo is a product of two normal densities.

# %%
d, S, d_r, S_r = (m[name][t] for name in ("d_theta", "S_theta", "d_r_left", "S_r"))
(loglik,) = m.columns("loglik", section="Study")
rule = -(log(2 * pi * S) + d**2 / S + log(2 * pi * S_r) + d_r**2 / S_r) / 2
m.define(loglik[t], kf.when_observed((d, d_r), rule), "", "log-likelihood", start=[kf.Missing])
rule

# %% [markdown]
# Each member of the ensemble is a flight with draws of its own. Statistics are added up on the way,
# so that no flight is kept. `fly` asks for errors, claimed variances, coverage, NIS and NEES.

# %%
KINDS = ("e_{0}_a", "P_{0}{0}_a", "inside_{0}")
ASKED = {"columns": [kind.format(name) for kind in KINDS for name in STATE] + ["NIS"]}
ASKED |= {"nees": {"NEES": kf.NEES(STATE)}, "quantiles": (0.05, 0.5, 0.95)}


def fly(members, seed=1, **changes):
    return kf.evaluate(
        m, kf.Draws("n_theta", "n_r", seed=seed), members=members, **ASKED, **changes
    )


# %% [markdown]
# Ten thousand flights, with the parameters of the workbook. First their size: how large is the root
# mean square error of a flight, in the middle and at both ends of the luck?

# %%
study = fly(10_000)
study.scalars.loc[["rms_x_a", "rms_y_a", "mean_NIS"], "0.05 quantile":].round(2)

# %% [markdown]
# A typical flight errs by 12 m in $x$ and 23 m in $y$; one in twenty by more than 16 and 37 m. Is
# that what the filter claims? We compare the root mean square over all flights and sweeps, the
# velocities too.


# %%
def overall(column):
    return float(np.sqrt((study.rows[column]["rms"][1:] ** 2).mean()))


real = [overall(f"e_{name}_a") for name in STATE]
claimed = [float(study.rows[f"P_{n}{n}_a"]["mean"][1:].mean() ** 0.5) for n in STATE]
pd.DataFrame({"real": real, "claimed": claimed}, index=STATE).round(2)

# %% [markdown]
# READ Over the whole flight the two agree to a few percent. But a mean over 132 s can hide what happens
# in one of them.
#
# ## Sweep by sweep
#
# Four questions for every sweep. How large is the real error (rms), in multiples of the claimed one?
# How many flights lie within two sigma? What are the mean NIS and NEES?


# %%
def measured(study):
    rows = study.rows
    found = {}
    for n in STATE:
        found[f"error {n}"] = rows[f"e_{n}_a"]["rms"] / rows[f"P_{n}{n}_a"]["mean"] ** 0.5
        found[f"coverage {n}"] = rows[f"inside_{n}"]["mean"]
    found |= {name: rows[name]["mean"] for name in ("NIS", "NEES")}
    return pd.DataFrame(found)[1:]


found = measured(study)
found.loc[[1, 17, 33, 67, 100, 600, 1319]].T.round(3)

# %% [markdown]
# An honest filter would have 1, 0.954, 2 and 4, up to chance. How much is chance? The
# deviation of each figure follows from the normal and the chi-square distributions, and shrinks
# with the root of the number of flights.

# %%
INSIDE = float(norm.cdf(2) - norm.cdf(-2))


def chance(members):
    one = {"error": (1, 0.5), "coverage": (INSIDE, INSIDE * (1 - INSIDE))}
    one |= {"NIS": (2, 4), "NEES": (4, 8)}
    table = pd.DataFrame(one, index=["expected", "deviation"]).T
    table["deviation"] = (table["deviation"] / members) ** 0.5
    return table


chance(10_000).round(4)

# %% [markdown]
# So an error ratio is known to 0.7 %. We take the bounds that only one sweep in a thousand passes
# by chance, 3.3 deviations on either side, and list for each figure its extremes, and the first and
# the last sweep outside.


# %%
def judged(found, members):
    kind = [name.split()[0] for name in found]
    mean, deviation = chance(members).loc[kind].to_numpy().T
    out = (found - mean).abs() > 3.3 * deviation
    sweep = found.index.to_series()
    table = {"lowest": found.min(), "at": found.idxmin()}
    table |= {"highest": found.max(), "at ": found.idxmax(), "outside": out.sum()}
    table |= {
        "first": out.apply(lambda c: sweep[c].min()),
        "last": out.apply(lambda c: sweep[c].max()),
    }
    return pd.DataFrame(table).astype({"first": "Int64", "last": "Int64"}).round(3)


judged(found, 10_000)

# %% [markdown]
# READ

# %%
time, EARLY = 0.1 * found.index, 7
COLOURS = dict(zip(STATE, ("#0072B2", "#56B4E9", "#D55E00", "#E69F00"), strict=True))


def panel(ax, found, names, label, members=10_000):
    for name in names:
        ax.semilogx(
            0.1 * found.index, found[name], lw=1, color=COLOURS.get(name.split()[-1]), label=name
        )
    mean, deviation = chance(members).loc[names[0].split()[0]]
    ax.axhspan(mean - 3.3 * deviation, mean + 3.3 * deviation, color="0.9")
    ax.axhline(mean, color="k", lw=0.6)
    ax.set(xlabel="time (s)", ylabel=label)
    ax.legend(frameon=False)


# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
panel(axes[0], found, [f"error {n}" for n in STATE], "real error / claimed error")
panel(axes[1], found, [f"coverage {n}" for n in STATE], "share within 2 sigma")

# %% [markdown]
# READ

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
for ax, name in zip(axes, ("NIS", "NEES"), strict=True):
    panel(ax, found, [name], f"mean {name}")
    ax.axvspan(0.1, EARLY, color="#F0E442", alpha=0.3)

# %% [markdown]
# READ

# %%
narrow = [float(bound) / 10_000 for bound in chi2.interval(0.95, 4 * 10_000)]
high = found.index[found["NEES"] > narrow[1]]
assert list(high) == list(range(1, len(high) + 1))
print(f"NEES above {narrow[1]:.3f}: sweeps {high[0]} to {high[-1]}, and in no other")

# %% [markdown]
# ## Is it the curvature?
#
# An extended filter takes the tangent for the curve. If that were the reason, a better start must
# mend it: with a tenth of the error, in the world and in the claim, the curvature has a hundredth of
# the effect.

# %%
START = pd.DataFrame(
    {kind: [m.parameters[f"{kind}_{n}"].value for n in STATE] for kind in "es"}, index=STATE
)


def start(factor, error=START["e"]):
    changes = {f"e_{n}": factor * error[n] for n in STATE}
    return changes | {f"s_{n}": factor * START.loc[n, "s"] for n in STATE}


START

# %%
tenth = measured(fly(4000, **start(0.1)))
judged(tenth, 4000).loc[["error y", "error vy", "coverage y", "NIS", "NEES"]]

# %% [markdown]
# READ On the contrary.
#
# ## Is it the start?
#
# Look at the table of the start: every flight begins with *the same* error $b$, one sigma in each
# direction. The filter was told of errors with the covariance $P_0$; the world's is $b b'$. What
# that does is linear algebra: an update leaves $P_a P_f^{-1}$ of an error.

# %%
one = kf.evaluate(m)


def covariance(stage):
    P = np.empty((m.rows, 4, 4))
    for (i, a), (j, b) in combinations_with_replacement(enumerate(STATE), 2):
        P[:, i, j] = P[:, j, i] = one[f"P_{a}{b}_{stage}"]
    return P


P_a, P_f = covariance("a"), covariance("f")

# %% [markdown]
# So after $k$ sweeps $A_k b$ is left of the start, where $A_k$ is the product of these matrices
# with the transition. The noise of the radar adds nothing to the *mean* error over the flights: it
# should be $A_k b$, and it is measured.

# %%
F, A = np.array(kf.transition_matrix(DYNAMICS, 0.1), dtype=float), [np.eye(4)]
for k in range(1, m.rows):
    A.append(P_a[k] @ np.linalg.inv(P_f[k]) @ F @ A[-1])
A, b = np.array(A), START["e"].to_numpy()
left = pd.DataFrame(A @ b, columns=STATE).add_suffix(", A b")
mean = pd.DataFrame({n: study.rows[f"e_{n}_a"]["mean"] for n in STATE})
left.join(mean).loc[[1, 17, 33, 67, 200], ["x", "x, A b", "y", "y, A b", "vy", "vy, A b"]].round(1)

# %% [markdown]
# READ

# %% [markdown]
# The covariance of the real errors is then $P_a + A (b b' - P_0) A'$, and every figure of an error
# and of the NEES follows from it without a single flight. We set them beside those of the ten
# thousand.


# %%
def expected(b):
    C = P_a + A @ (np.outer(b, b) - P_a[0]) @ A.swapaxes(1, 2)
    found = {f"error {n}": (C[:, i, i] / P_a[:, i, i]) ** 0.5 for i, n in enumerate(STATE)}
    found["NEES"] = np.trace(np.linalg.solve(P_a, C), axis1=1, axis2=2)
    return pd.DataFrame(found)[1:]


theory = expected(b)
both = {"expected": theory, "measured": found[theory.columns]}
pd.concat({k: f.agg(["min", "max"]).T for k, f in both.items()}, axis=1).round(3)

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
panel(axes[0], found, [f"error {n}" for n in STATE], "real error / claimed error")
panel(axes[1], found, ["NEES"], "mean NEES")
for ax, names in zip(axes, ([f"error {n}" for n in STATE], ["NEES"]), strict=True):
    ax.semilogx(0.1 * theory.index, theory[names], "k--", lw=0.8)

# %% [markdown]
# READ
#
# Why may each axis alone look modest where all four together look overconfident? It depends on the
# signs of $b$. Here are the correlations that the filter expects after four seconds, and the NEES
# then for the eight starts that are one sigma off in every direction.

# %%
deviation = np.sqrt(np.diagonal(P_a[40]))
pd.DataFrame(P_a[40] / np.outer(deviation, deviation), STATE, STATE).round(2)

# %%
signs = [(1, *rest) for rest in product((1, -1), repeat=3)]
table = pd.DataFrame([expected(START["s"] * s).loc[40] for s in signs])
table.index = ["".join("+-"[s < 0] for s in line) for line in signs]
assert np.isclose(table["NEES"].mean(), 4)
table.round(3)

# %% [markdown]
# READ
#
# ## A fair experiment
#
# So we give the world what the filter was promised: starts that are drawn, flight by flight, from
# the normal distribution with the covariance $P_0$. Parameters may be arrays, one value a flight.


# %%
def drawn(members, seed=7):
    normal = np.random.RandomState(seed).standard_normal((4, members))
    return {n: START.loc[n, "s"] * normal[i] for i, n in enumerate(STATE)}


fair = measured(fly(10_000, **start(1, drawn(10_000))))
judged(fair, 10_000)

# %%
fig, axes = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
panel(axes[0], fair, [f"error {n}" for n in STATE], "real error / claimed error")
panel(axes[1], fair, [f"coverage {n}" for n in STATE], "share within 2 sigma")
panel(axes[2], fair, ["NEES"], "mean NEES")

# %% [markdown]
# READ
#
# ## Where the curvature does show
#
# An error of $\delta$ across the line of sight makes the range longer by $\delta^2/2r$. The
# filter, which knows tangents only, blames that on something else. It matters where it is no longer
# small beside the radar's error of 30.48 m:

# %%
reach, FACTORS = m.parameters["x_R"].value, (1, 2, 3, 5, 10)
arc = {k: k**2 * START.loc["y", "s"] ** 2 / (2 * reach) for k in FACTORS}
pd.Series(arc, name="sagitta (m)").round(1)

# %%
wide = {k: measured(fly(2000, **start(k, drawn(2000)))) for k in FACTORS}
table = {
    k: [f["NEES"][1], f["NEES"].max(), f["NEES"][1319], f["NIS"].max()] for k, f in wide.items()
}
names = ["NEES, sweep 1", "NEES, highest", "NEES, last", "NIS, highest"]
pd.DataFrame(table, index=names).T.round(2)

# %% [markdown]
# READ
#
# ## What matters
#
# Which of the seventeen parameters matters? Each is raised by a tenth of itself; the two that are
# zero by a step of sensible size. The same draws are used before and after, so that luck cancels;
# four sets of 200 flights say how much of it is left.

# %%
STEPS = {name: p.value / 10 for name, p in m.parameters.items()} | {"y_R": 1000, "Phi_s": 0.1}


def figures(**changes):
    lines = []
    for seed in range(4):
        s = fly(200, seed=seed, **changes)
        nees = s.rows["NEES"]["mean"][1:68].mean()
        lines.append([*s.scalars.loc[["rms_x_a", "rms_y_a"], "mean"], nees])
    return np.array(lines)


# %%
basis = figures()


def effect(name):
    changed = figures(**{name: m.parameters[name].value + STEPS[name]})
    percent = 100 * (changed / basis - 1)
    return [*percent.mean(axis=0), percent.std(axis=0, ddof=1).max() / 2]


# %% [markdown]
# Eight parameters belong to the filter *and* to the world: a radar that is worse is also known to be
# worse. Changes in percent of the mean error of a flight, and of the NEES in the first 6.7 s; the
# last column is the largest standard error of the three.

# %%
SHOWN = ["x (%)", "y (%)", "early NEES (%)", "±"]


def effects(*names):
    table = pd.DataFrame([[STEPS[n], *effect(n)] for n in names], names, ["step", *SHOWN])
    return table.round({"step": 3} | dict.fromkeys(SHOWN, 1))


effects("v_0", "angle", "g", "dt", "x_R", "y_R", "sigma_theta", "sigma_r")

# %% [markdown]
# READ Four belong to the world alone: how wrong the start really is.

# %%
effects("e_x", "e_vx", "e_y", "e_vy")

# %% [markdown]
# READ Five belong to the filter alone: what it was told of the start, and how much it distrusts its model.

# %%
effects("s_x", "s_vx", "s_y", "s_vy", "Phi_s")

# %% [markdown]
# READ
#
# ## Choosing q and r by likelihood
#
# A real radar comes without a label, and no truth tells errors. But a filter with wrong variances
# has unlikely innovations. We let an optimiser look for the most likely $q$ ($\Phi_s$) and $r$
# ($\sigma_\theta$, $\sigma_r$), by their logarithms. To keep the echoes while the deviations
# change, the draws are scaled the other way.

# %%
TRUE, DRAWS = np.array([0.01, 30.48]), kf.Draws("n_theta", "n_r", seed=1)
BOUNDS = np.log([(1e-6, 1e3), (1e-4, 1), (1, 1e4)])


def likelihood(echoes, q, *r):
    kept = dict(zip(DRAWS.columns, (echoes.T * TRUE / r).T, strict=True))
    deviations = dict(zip(("sigma_theta", "sigma_r"), r, strict=True))
    return kf.evaluate(m, kept, columns=["loglik", "NIS"], Phi_s=q, **deviations)


def fitted(echoes):
    def unlikely(logs):
        return -float(likelihood(echoes, *np.exp(logs))["loglik"].sum())

    found = minimize(unlikely, np.log([0.1, 0.05, 100]), method="L-BFGS-B", bounds=BOUNDS)
    assert found.success
    return np.exp(found.x)


# %% [markdown]
# Twenty flights, each fitted by itself, from a first guess that is wrong by a factor of 5 and 3. The
# world has no noise of motion, so the best $q$ is zero: a logarithm that would run away. We stop it
# at $10^{-6}$.

# %%
kf.warm_up(m, ["loglik", "NIS"])
PARAMETERS = ["Phi_s", "sigma_theta", "sigma_r"]
calm = pd.DataFrame([fitted(DRAWS.of(k, m.rows)) for k in range(20)], columns=PARAMETERS)
calm[["sigma_theta", "sigma_r"]].agg(["mean", "std"]).round(5)

# %% [markdown]
# READ

# %%
print(
    f"q below 1e-4 in {(calm['Phi_s'] < 1e-4).sum()} of 20 flights, largest {calm['Phi_s'].max():.4f}"
)

# %% [markdown]
# READ
#
# A world with a known $q$ must be recognised too. Gusts push the ball about, white noise of
# $\Phi_s = 1$ m²/s³ in both directions. The draws then hold the echo of where the ball really is;
# the likelihood needs no truth.

# %%
q = kf.discrete_noise(DYNAMICS, diag(0, 1, 0, 1), 0.1)
ROOT = np.linalg.cholesky(np.array(q, dtype=float))
place = one["x_true"].to_numpy() - reach + 1j * one["y_true"].to_numpy()


def gusty(member):
    pushes = np.random.RandomState((2, member)).standard_normal((m.rows, 4)) @ ROOT.T
    path = np.zeros((m.rows, 4))
    for k in range(1, m.rows):
        path[k] = F @ path[k - 1] + pushes[k]
    blown = place + path[:, 0] + 1j * path[:, 2]
    moved = np.angle(blown / place), abs(blown) - abs(place)
    return DRAWS.of(member, m.rows) + moved / TRUE[:, None]


# %%
windy = pd.DataFrame([fitted(gusty(k)) for k in range(20)], columns=PARAMETERS)
windy.agg(["median", "min", "max", "std"]).round(4)

# %% [markdown]
# READ
#
# ## Likelihood beside NIS
#
# The usual test of a filter without a truth is the mean NIS. Can it choose $q$? For 400 flights of
# the calm world, four filters that suspect noise against the one that does not.

# %%
SUSPECTED, lines = (0, 0.01, 0.1, 1), []
for k in range(400):
    runs = [likelihood(DRAWS.of(k, m.rows), q, *TRUE) for q in SUSPECTED]
    lines.append([[run["loglik"].sum(), run["NIS"].mean()] for run in runs])
L, NIS = np.array(lines).transpose(2, 1, 0)

# %%
table = {"log L, mean change": (L - L[0]).mean(axis=1), "log L falls": (L < L[0]).mean(axis=1)}
table |= {"mean NIS": NIS.mean(axis=1), "its spread": NIS.std(axis=1)}
pd.DataFrame(table, index=pd.Index(SUSPECTED, name="Phi_s")).round(3)

# %% [markdown]
# READ
#
# ## The workbook among the flights
#
# The sheet's flight is one of the many. Where do its figures, as an independent spreadsheet engine
# computes them, lie among the others'?

# %%
sheet = kf.recalculate("../workbooks/cannonball.xlsx")["Parameters"]
names = {text: (row, column) for (row, column), text in sheet.items() if isinstance(text, str)}
shown = ["rms_x_a", "rms_y_a", "rms_x_lin", "rms_y_lin", "mean_NIS"]
table = study.scalars.loc[shown, ["0.05 quantile", "0.5 quantile", "0.95 quantile"]]
table["sheet"] = [sheet[names[name][0], names[name][1] + 1] for name in shown]
table.round(2)

# %% [markdown]
# READ All within the middle nine tenths: a flight like others.
#
# ## So, is it honest?
#
# ANSWER
#
# ## Exercises
#
# **Routine**
#
# 1. Fly 1,000 times at 30 degrees. Which statistics lose rows, and what does `count` say?
# 2. How many flights does it take to notice that errors are 2 % larger than claimed, with bounds of
#    3.3 deviations? And a NEES that is 1 % too large?
#
# **Break it**
#
# 3. Tell the filter that the radar errs half as much as it does (scale the draws, as above). What
#    do NIS, NEES and coverage say, and which of them would you have on a real range?
# 4. Start every flight with the signs `++++` or `+---` of the table. Is a filter with a NEES below 4
#    a better one?
#
# **Extend it**
#
# 5. Estimate $\Phi_s$ by likelihood for the football's or the shuttlecock's filter. Profile the
#    likelihood: fix $q$ on a grid, fit the rest.
# 6. `evaluate` takes any executor: with `concurrent.futures.ProcessPoolExecutor() as pool`, give it
#    `executor=pool`, and fly a hundred thousand times. Is the result the same to the last bit?
