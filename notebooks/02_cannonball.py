# %% [markdown]
# # 2. A cannon-ball, a radar, and a filter for what is not linear
#
# A ball is fired at 915 m/s and 45 degrees. A radar 30 km downrange measures its angle (error
# 0.01 rad) and its range (error 30 m) ten times a second. **Where is the ball**, and how well do we
# know it? Angle and range are no linear functions of the position, so the plain Kalman filter does
# not fit. And is a filter that looks good also *honest*?
#
# The exercise follows a blog article of 2025 that follows Zarchan and Musoff. The article contains
# misprints; we shall meet eight of them, and prove each.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import display
from scipy.stats import chi2
from sympy import Matrix, atan, diag, init_printing, symbols

import kfsheet as kf
from kfsheet.exercises.cannonball import DYNAMICS, build_model, cannonball, exercise, extended_model

init_printing(use_latex="mathjax", latex_printer=lambda e, **_: kf.latex_code(e))
CHARTS = {chart.title: chart for chart in exercise.charts}

# %% [markdown]
# ## The motion
#
# The state is $(x, v_x, y, v_y)$. Without drag its rate of change is $\dot{x} = F x$, plus gravity.
# Over a step the state is multiplied by $\Phi = I + F\,dt + F^2 dt^2/2! + \dots$, a series without
# end, unless some power of $F$ is zero.

# %%
display(DYNAMICS, DYNAMICS**2)

# %% [markdown]
# It is, so two terms are exact. The inverse Laplace transform of $(sI - F)^{-1}$, the way for
# any $F$, must give the same.

# %%
dt, Phi_s = symbols("dt Phi_s", positive=True)
Phi = kf.transition_matrix(DYNAMICS, dt)
assert kf.transition_matrix_laplace(DYNAMICS, dt) == Phi
Phi

# %% [markdown]
# The article prints another $F$, with the 1 of its third row one place further left. Its square:

# %%
printed_F = Matrix([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]])
printed_F**2

# %% [markdown]
# Not zero: **misprint 1**. That $F$ says $\dot{y} = y$, a height that grows exponentially and
# knows nothing of a velocity. Laplace shows it:

# %%
kf.transition_matrix_laplace(printed_F, dt)

# %% [markdown]
# ### What the model does not know
#
# White noise of spectral density $\Phi_s$ on both accelerations adds, during a step,
# $Q_k = \int_0^{dt} \Phi(\tau)\, Q\, \Phi(\tau)'\, d\tau$:

# %%
kf.discrete_noise(DYNAMICS, diag(0, Phi_s, 0, Phi_s), dt)

# %% [markdown]
# ## The radar
#
# The radar sees $\theta = \mathrm{atan2}(y - y_R, x - x_R)$ and
# $r = \sqrt{(x - x_R)^2 + (y - y_R)^2}$. The extended filter replaces both by their tangents at the
# forecast: the Jacobian $H$. SymPy takes the derivatives.

# %%
model = extended_model(cannonball)
H = model.H
H

# %% [markdown]
# The article prints the first entry without its minus, which its own list of derivatives has, and
# labels one of that list $\partial\theta/\partial\dot{x}$ (**misprints 2 and 3**).
# A sign can be checked without algebra: move the ball a metre to the right
# and look whether the angle falls.

# %%
x, _, y, _ = model.state
numbers = {x: 10_000, y: 8_000, cannonball["x_R"]: 30_480, cannonball["y_R"]: 0}
theta = model.observations[0].predicted
moved = theta.subs({**numbers, x: 10_001}) - theta.subs(numbers)
print(f"moved {float(moved):.3e}, derivative {float(H[0, 0].subs(numbers)):.3e} rad/m")

# %% [markdown]
# It falls. The article also calls $y_T$, in one place, the height of the radar (**misprint 4**). If
# it were, the angle would be zero, or $\pi$, wherever the ball is:

# %%
theta.subs(y, cannonball["y_R"]).subs({x: 40_000, cannonball["x_R"]: 30_480})

# %% [markdown]
# ## The sheet
#
# Angle and range have independent errors, so they are assimilated one after the other. Every gain
# is then a division, and no cell needs a matrix. These are the columns for the angle, in the first
# row that has a radar echo.

# %%
table = kf.formula_table(cannonball, "EKF", rows=2)
shown = ["d_theta", "H_theta_x", "H_theta_y", "S_theta", "K_x_theta", "x_1", "P_xx_1"]
with pd.option_context("display.max_colwidth", None):
    display(table.loc[shown, ["column", "row 5"]])

# %% [markdown]
# Does the sheet compute what NumPy computes? IronCalc recalculates all of it, 1,320 sweeps, from
# nothing. We compare the analysis of the height in every row.

# %%
run = kf.evaluate(cannonball)
cells = kf.recalculate("../workbooks/cannonball.xlsx")["EKF"]
(y_a,) = [column for (row, column), text in cells.items() if row == 1 and text == "y_a"]
sheet = pd.Series([cells[row, y_a] for row in range(4, 1324)])
assert (sheet - run["y_a"]).abs().max() < 1e-12 * run["y_a"].abs().max()
pd.DataFrame({"sheet": sheet, "NumPy": run["y_a"]}).iloc[::330].round(6)

# %% [markdown]
# ## Two filters, one radar
#
# The linear filter of the sheet *Linear* is given positions computed from angle and range, one axis
# at a time. First the whole flight, then the residuals with the bands that theory claims.

# %%
_ = kf.draw(CHARTS["The flight"], run)

# %% [markdown]
# The radar's positions scatter widely; the filter lies on the path. Now the innovations: range
# and angle, observed minus forecast. Nineteen of twenty should lie inside.

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
kf.draw(CHARTS["Range"], run, axes[0])
_ = kf.draw(CHARTS["Angle"], run, axes[1])

# %%
inside = [(run[d].abs() < run[f"{d}_high"])[1:].mean() for d in ("d_r", "d_theta")]
print(f"inside: {inside[0]:.1%} of the ranges, {inside[1]:.1%} of the angles")

# %% [markdown]
# As theory wants: 95.4 %. And the errors in $x$ and $y$, which only a simulation shows:

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
kf.draw(CHARTS["Distance"], run, axes[0])
_ = kf.draw(CHARTS["Height"], run, axes[1])

# %% [markdown]
# The filter's error is a thin line among the radar's. Close up, with the band that it claims:

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
kf.draw(CHARTS["Distance, close up"], run, axes[0])
_ = kf.draw(CHARTS["Height, close up"], run, axes[1])


# %%
def rms(run, rows=slice(None)):
    who = {"radar alone": "obs", "linear filter": "lin", "EKF": "a"}
    square = {w: (run[[f"e_x_{k}", f"e_y_{k}"]].iloc[rows] ** 2).mean() for w, k in who.items()}
    return pd.DataFrame({w: np.sqrt(s.to_numpy()) for w, s in square.items()}, index=["x", "y"]).T


pd.concat({"flight": rms(run), "last 100": rms(run, slice(-100, None))}, axis=1).round(1)

# %% [markdown]
# Near the end the radar alone errs by 500 m in height; the filter by 2 m in this flight, and by
# about 10 m over many: the article's "600 m to 10 m". The linear filter does well too; it pays for
# the correlation that it neglects.
#
# But with which radar? The article prints `R_ERROR = 30_500.0`. Try it.

# %%
far = kf.evaluate(cannonball, sigma_r=30_500)
rms(far, slice(-100, None)).round(0)

# %% [markdown]
# A radar that errs by 30 km, and a filter that is off in $x$ by 200 m: not the article's result.
# 30,500 is **misprint 5**; 30.48 m (100 feet) it must be.
#
# ## Misprints that 45 degrees hides
#
# The article takes the sine for $v_x$ and the cosine for $v_y$ (**misprint 6**). At 45 degrees both
# are equal. At 30 degrees the flight tells:

# %%
flights = {angle: kf.evaluate(cannonball, angle=angle) for angle in (30, 45)}
pd.DataFrame({a: f.loc[0, ["vx_true", "vy_true"]] for a, f in flights.items()}).round(1)

# %% [markdown]
# A barrel at 30 degrees sends the ball out rather than up: $v_x > v_y$. The article's code would
# have it the other way round.
#
# ## An update that mixes units
#
# The filter measures angle and range; the article's update multiplies its gains with residuals of
# *position* (**misprint 7**). The first gain turns radians into metres. What would the first sweep
# do?

# %%
first = run.loc[1]
right = first["x_a"] - first["x_f"]
wrong = first["K_x_theta"] * (first["x_obs"] - first["x_f"])
print(f"right: {right:.0f} m; as printed: {wrong / 1000:.0f} km")

# %% [markdown]
# And the list of equations ends without an update of the covariance (**misprint 8**). Without it
# the filter would never learn that it has learnt. How much does a radian move the state in the
# sweeps 1, 10, 100 and 1000?

# %%
gains = run[["K_x_theta", "K_y_theta"]]
gains.iloc[[1, 10, 100, 1000]].round(1)

# %% [markdown]
# The gain of the height falls from 15 km a radian to less than a hundredth of it. With the first
# gain for ever, the height would jump by $0.01 \cdot 15{,}000 = 150$ m in every sweep: hardly
# better than the radar alone.
#
# ## The angle jumps
#
# $\tan^{-1}(b/a)$ of *one* argument lies between $-\pi/2$ and $\pi/2$. As the ball passes over the
# radar it falls from one end to the other. Two arguments mend that, but make another trap: the
# filter starts *below* the horizon, where the angle is near $-\pi$, and the first echo says $+\pi$.

# %%
VARIANTS = {
    "one argument": build_model(arctangent=lambda y, x: atan(y / x)),
    "two, not wrapped": build_model(wrap=False),
    "two, wrapped": cannonball,
}
variants = {name: kf.evaluate(m) for name, m in VARIANTS.items()}
pd.DataFrame({n: f["theta"].iloc[::220] for n, f in variants.items()}).round(2)

# %%
pd.DataFrame({n: f["d_theta"].iloc[1:4] for n, f in variants.items()}).round(3)

# %% [markdown]
# Without wrapping, the first innovation is a whole turn, and the filter believes it. Ten flights
# with other draws; the error of $x$ in metres:


# %%
def draws(seed):
    both = np.random.RandomState(seed).standard_normal((1320, 2))
    return {"n_theta": both[:, 0], "n_r": both[:, 1]}


many = {
    name: [kf.evaluate(m, draws(seed)).attrs["scalars"]["rms_x_a"] for seed in range(10)]
    for name, m in VARIANTS.items()
}
pd.DataFrame(many).round(0).astype(int).T

# %%
pd.Series({name: np.sqrt(np.mean(np.square(e))) for name, e in many.items()}).round(0)

# %% [markdown]
# With one argument some flights do not suffer and others are thrown off by 80 m, as the noise of
# one moment has it: an error that a single test run does not show. Without wrapping all are lost.
#
# ## Is the filter honest?
#
# A filter says how well it knows. Two numbers test that. $\mathrm{NIS} = d' S^{-1} d$ compares
# innovations with their claimed variance; it needs no truth. $\mathrm{NEES} = e' P^{-1} e$ compares
# errors with theirs. If all is well they have chi-square distributions with 2 and 4 degrees of
# freedom. We fly 200 times, each with draws of its own.

# %%
RUNS, STATE = 200, ("x", "vx", "y", "vy")
flights = kf.Draws("n_theta", "n_r", seed=2)
spec = {"NEES": kf.NEES(STATE)}
study = kf.evaluate(cannonball, flights, members=RUNS, columns=["NIS"], nees=spec)
NIS, NEES = (study.rows[name]["mean"][1:] for name in ("NIS", "NEES"))
print(f"mean NIS {NIS.mean():.3f} (2 expected), mean NEES {NEES.mean():.2f} (4 expected)")

# %% [markdown]
# The mean over 200 flights should lie, 19 times of 20, within the chi-square bounds of
# $200 \cdot 2$ and $200 \cdot 4$ degrees of freedom, sweep by sweep.

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.6), layout="constrained")
for ax, name, values, k in zip(axes, ("NIS", "NEES"), (NIS, NEES), (2, 4), strict=True):
    ax.plot(run["time"][1:], values, lw=0.7)
    for bound in chi2.interval(0.95, RUNS * k):
        ax.axhline(bound / RUNS, color="k", linestyle="--")
    ax.set(xlabel="time (s)", ylabel=f"mean {name} over {RUNS} flights")

# %%
for name, values, k in (("NIS", NIS, 2), ("NEES", NEES, 4)):
    low, high = (bound / RUNS for bound in chi2.interval(0.95, RUNS * k))
    share = values.between(low, high).mean()
    print(f"{name}: between {low:.2f} and {high:.2f} in {share:.0%} of the sweeps")

# %% [markdown]
# Both pass. The curve of the NIS is noise about 2. That of the NEES wanders within its band: a
# flight that errs, errs for long, so neighbouring sweeps tell the same story again, and 200 flights
# are 200 samples, not 260,000. Notebook 5 asks ten thousand.
#
# ## What $\Phi_s$ does
#
# With $\Phi_s = 0$ the filter believes its model without reserve and in the end hardly listens.
# That is right here, since the motion is exactly the model's. A filter that distrusts it:

# %%
SPECTRAL = (0, 1, 10, 100)
runs = {Phi: kf.evaluate(cannonball, Phi_s=Phi) for Phi in SPECTRAL}
table = pd.DataFrame({Phi: rms(f, slice(-600, None)).loc["EKF"] for Phi, f in runs.items()})
table.loc["mean NIS"] = [f.attrs["scalars"]["mean_NIS"] for f in runs.values()]
table.round(2)

# %% [markdown]
# The more noise it suspects, the more it follows the radar's. And the mean NIS hardly moves: an
# innovation is mostly the radar's error, so it cannot tell a good filter from a nervous one. Use
# the errors for that, where there is a truth. See exercise 5 for the other direction.
#
# ## What if
#
# Move the sliders: the barrel, the radar, the distrust.

# %% tags=["interactive", "nbval-ignore-output"]
from ipywidgets import FloatLogSlider, FloatSlider, interact


@interact(
    angle=FloatSlider(45, min=10, max=45),
    sigma_theta=FloatLogSlider(0.01, min=-3, max=-1),
    Phi_s=[0, 1, 10, 100],
)
def what_if(angle, sigma_theta, Phi_s):
    run = kf.evaluate(cannonball, angle=angle, sigma_theta=sigma_theta, Phi_s=Phi_s)
    _, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
    kf.draw(CHARTS["The flight"], run, axes[0])
    kf.draw(CHARTS["Height"], run, axes[1])


# %% [markdown]
# The same without sliders: a radar whose angle errs by 0.03 rad, beside ours.

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), sharey=True, layout="constrained")
for sigma, ax in zip((0.01, 0.03), axes, strict=True):
    kf.draw(CHARTS["Height"], kf.evaluate(cannonball, sigma_theta=sigma), ax)
    ax.set_title(f"angle error {sigma} rad")

# %% [markdown]
# The radar alone errs three times as much, and so, on its own scale, does the filter.
#
# ## Exercises
#
# **Routine**
#
# 1. In `workbooks/cannonball.xlsx` set `angle` to 35. Where do the grey rows begin, and what do the
#    columns `K_x_theta` and `P_xx_a` do there? Why?
# 2. Derive $\partial r/\partial y$ by hand and compare it with the column `H_r_y`.
#
# **Break it**
#
# 3. In the sheet, take the minus out of `H_theta_x` in *one* row. How long does the filter
#    remember it? Then in all rows.
# 4. Set `s_x` and `s_y` to 1 m: the filter is now sure of a start that is wrong by 305 m. What
#    happens to the first innovations, and to `mean_NIS`?
#
# **Extend it**
#
# 5. Give the truth a drag (in a file of your own, start from this exercise). By how much must
#    `Phi_s` grow until the NIS is 2 again, and what do you lose?
# 6. The linear filter neglects the correlation between the errors of `x_obs` and `y_obs`. Add it:
#    rotate the observations so that their errors are independent again.
