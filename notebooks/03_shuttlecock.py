# %% [markdown]
# # 3. A shuttlecock, a robot, and a claim that we put to the test
#
# A robot is to kick a shuttlecock back. Two cameras see it 30 times a second with errors of 6 to
# 17 cm. **Where and when will it fall**, and how early can the robot know?
#
# A conference paper filters the positions with a Kalman filter, fits the track to what the filter
# says, and claims two things: the filter reduces the noise of the *positions*, and the *fall point*
# then converges faster and better. We derive its equations, rebuild it, fly 400 times, and see
# which claim the data support. The paper gives no drag coefficient: $k/m$ = 1/s is our assumption.
#
# *Source:* Man Yongkui, Zhao Liang and Hu Jingxin (Northeastern University, China), "Application of
# Kalman Filter in Track Prediction of Shuttlecock", IEEE ROBIO, 2009,
# doi:10.1109/ROBIO.2009.5420475.

# %%
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import display
from scipy.special import lambertw
from scipy.stats import binom, binomtest, bootstrap, chi2
from sympy import Eq, Function, LambertW, Matrix, dsolve, exp, init_printing, solve, symbols

import kfsheet as kf

# %%
from kfsheet.estimation import drag
from kfsheet.exercises.shuttlecock import FORECASTS, exercise, shuttlecock
from kfsheet.exercises.shuttlecock.filters import joint_model
from kfsheet.exercises.shuttlecock.outliers import struck_frames, with_outliers

init_printing(use_latex="mathjax", latex_printer=lambda e, **_: kf.latex_code(e))
CHARTS = {chart.title: chart for chart in exercise.charts}

# %% [markdown]
# ## Linear drag
#
# Drag in proportion to the velocity, $m\ddot{x} = -k\dot{x}$, leaves the three axes independent of
# each other: equation (5) of the paper. We write $k$ for $k/m$ and let SymPy solve all three; the
# height alone feels gravity.

# %%
k, g, T = symbols("k g T", positive=True)
tau, X, v = symbols("tau X v", real=True)
start, pull, solved = symbols("p_x v_x p_y v_y p_z v_z", real=True), {"x": 0, "y": 0, "z": g}, {}
for s, p_0, v_0 in zip(map(Function, "xyz"), start[::2], start[1::2], strict=True):
    law = Eq(s(tau).diff(tau, 2), -k * s(tau).diff(tau) - pull[s.name])
    begin = {s(0): p_0, s(tau).diff(tau).subs(tau, 0): v_0}
    solved[s.name] = dsolve(law, s(tau), ics=begin)
display(*solved.values())

# %% [markdown]
# Is this the paper's equation (6)? We type in what it prints and subtract. For the height it prints
# $v_0$, the *speed*, where $v_{z0}$ must stand; we call it $v$.

# %%
p_x, v_x, p_y, v_y, p_z, v_z = start
printed = {
    "x": -v_x / k * exp(-k * tau) + v_x / k + p_x,
    "y": -v_y / k * exp(-k * tau) + v_y / k + p_y,
    "z": -(g / k**2 + v / k) * exp(-k * tau) - g * tau / k + (g + v * k) / k**2 + p_z,
}
difference = {a: (printed[a] - solved[a].rhs).expand().factor() for a in "xyz"}
difference

# %% [markdown]
# Nothing is left for $x$ and $y$. The height differs unless $v = v_z$, and gives itself away: a
# derivative at the start that is not the velocity upwards.

# %%
printed["z"].diff(tau).subs(tau, 0).simplify()

# %% [markdown]
# The paper says of its kicks that the height stays within 1 m, and the speed therefore within
# 5 m/s. Ours leaves at 0.5 m with 1.5 and 0.8 m/s over the ground and 4 m/s upwards. What would
# the printed height do to it, and how far does it rise?

# %%
speed = np.hypot(np.hypot(1.5, 0.8), 4)
rise = solved["z"].rhs.subs({k: 1, g: 9.80665, v_z: 4, p_z: 0, tau: np.log(1 + 4 / 9.80665)})
print(f"{speed:.2f} m/s in place of 4; from 0.5 m it rises by {float(rise):.2f} m")

# %% [markdown]
# It would start 9 % too fast. Our kick keeps within the paper's limits.
#
# ## The track is a straight line
#
# In the *distorted* time $X = (1 - e^{-k\tau})/k$ the solution becomes linear. These two rows times
# $(p, v, 1)$ are position and velocity after the time $\tau$; they come from a Laplace transform, a
# second derivation that must agree with the first, on every axis.

# %%
track = drag.flight(k, g, tau, X)
track

# %%
height = solved["z"].rhs
for axis, p_0, v_0 in zip("xyz", start[::2], start[1::2], strict=True):
    position = (drag.flight(k, pull[axis], tau, X) * Matrix([p_0, v_0, 1]))[0]
    assert (position.subs(X, drag.distorted(k, tau)) - solved[axis].rhs).expand() == 0
position

# %% [markdown]
# Position is $p + v X$, plus what gravity alone does. Move that term over and fit a straight line:
# equations (7) and (8). Least squares sets the derivative of the sum of squares to zero, one
# equation for each unknown. The sums are all that remains of the data.

# %%
p, y, n, S_X, S_XX, S_y, S_Xy = symbols("p y n S_X S_XX S_y S_Xy", real=True)
sums = {1: n, X: S_X, X**2: S_XX, y: S_y, X * y: S_Xy}
display(*kf.normal_equations(p + v * X, [p, v], y, sums))

# %%
line = kf.least_squares(p + v * X, [p, v], y, sums)
line[v]

# %% [markdown]
# Sums can be kept running. So the fit to *all* frames so far is a recurrence like a filter: five
# sums, updated with each frame, and two divisions. Remember this when filters are said to be what
# makes a fit possible in real time.
#
# ## The filter
#
# The paper's state is position, velocity, acceleration of one axis. Its equation (9) prints
# $x + \dot{x} + \ddot{x}T^2/2$. Metres plus metres per second: let the unit check read it.

# %%
m = kf.Recurrence("printed", title="Equation (9) as printed", rows=3)
dt, v_0 = m.parameter("dt", 1 / 30, "s", "step"), m.parameter("v_0", 4, "m/s", "velocity")
(x_new,) = m.columns("x", section="Printed")
m.define(x_new[kf.t], x_new[kf.t - 1] + v_0 + v_0 * dt, "m", "position", start=[0])
print(*m.check_units(), sep="\n")

# %% [markdown]
# A factor $T$ is lost. With it back, the matrix that the paper prints next is right. Gravity enters
# through a matrix $B$ that the paper never gives. We derive it: the new acceleration is
# $-k\dot{x}_{new} - g$, and whoever knows the acceleration knows gravity already.

# %%
model = joint_model(shuttlecock, "z")
A, (z_, vz_, az_) = model.F, list(model.state)
A

# %%
B = -Matrix(model.transition).diff(shuttlecock["g"])
B

# %% [markdown]
# $B = (0, 0, 1)'$. The customary $(T^2/2, T, 1)'$ would count gravity twice, since the acceleration
# in the state already holds it. One step from the true state tells what that costs:

# %%
truth = {z_: 0.5, vz_: 4, az_: -4 - 9.80665}
numbers = {shuttlecock["dt"]: 1 / 30, shuttlecock["k_fit"]: 1, shuttlecock["g"]: 9.80665}
once = float(model.transition[1].subs(numbers).subs(truth))
exact = float(height.diff(tau).subs({k: 1, g: 9.80665, v_z: 4, p_z: 0.5, tau: 1 / 30}))
print(f"exact {exact:.3f} m/s, B = (0, 0, 1)': {once:.3f}, twice: {once - 9.80665 / 30:.3f}")

# %% [markdown]
# ### What the third row does
#
# It is the second row times $-k$: the new acceleration is a *function* of the new velocity, so the
# matrix has rank 2 and the third state knows nothing of its own.

# %%
display(A.row(2) + shuttlecock["k_fit"] * A.row(1), A.rank())

# %% [markdown]
# How far is $A$ from the exact transition of linear drag? We apply both to a state that obeys the
# law, $\ddot{z} = -k\dot{z} - g$, and expand the difference in $T$. With $g = 0$ that is $x$ or
# $y$.

# %%
A_T = A.subs({shuttlecock["dt"]: T, shuttlecock["k_fit"]: k})
two = drag.flight(k, g, T, drag.distorted(k, T)) * Matrix([p, v, 1])
error = A_T * Matrix([p, v, -k * v - g]) - Matrix([*two, -k * two[1]])
Matrix([e.series(T, 0, 4).removeO().factor() for e in error])

# %%
first = [float(e.subs({k: 1, g: 9.80665, v: 4, T: 1 / 30})) for e in error]
print(f"frame 1, z: {first[0] * 1000:.2f} mm, {first[1] * 1000:.1f} mm/s, {first[2]:.4f} m/s²")

# %% [markdown]
# On every axis the position errs by $T^3$, velocity and acceleration by $T^2$. A tenth of a
# millimetre is harmless beside 17 cm of noise, and 8 mm/s beside the 0.2 m/s that $Q$ allows each
# frame. Two states with the exact transition would do, and we shall try them.
#
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
# ## The noise
#
# "White noise whose signal-to-noise ratio is 25", "R = 0.04". Both say 1/25, if the signal has
# power 1. It has not. The sheet takes the ratio at its word: variance = mean(signal²)/25 on each
# axis.

# %%
scalars = run.attrs["scalars"]
power = {a: (run[f"{a}_true"] ** 2).mean() for a in "xyz"}
noise = {a: scalars[f"var_{a}"] for a in "xyz"}
table = pd.DataFrame({"power (m²)": power, "variance (m²)": noise})
table["standard deviation (m)"] = table["variance (m²)"] ** 0.5
table.round(4)

# %% [markdown]
# These standard deviations are less than the 0.2 m that the filter believes. It trusts the cameras
# too little, and says so itself: its mean NIS should be 3, one for each observation.

# %%
print(f"mean NIS {scalars['mean_NIS']:.2f}, with honest variances {scalars['mean_NIS_ex']:.2f}")

# %% [markdown]
# ## When does it fall?
#
# The height is zero at a moment that no elementary formula gives. SymPy knows the function it
# takes: Lambert's $W$, the inverse of $W e^W$.

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
# ## The sheet
#
# These are cells for the height: filter, fit and fall, in the row of frame 2.

# %%
table = pd.concat([kf.formula_table(shuttlecock, s, rows=3) for s in ("Kalman", "Fit raw")])
shown = ["z_f", "az_f", "d_z", "K_z_z", "z_a", "v_z_raw", "W_2_raw", "t_fall_raw", "x_fall_raw"]
with pd.option_context("display.max_colwidth", None):
    display(table.loc[shown, ["column", "row 6"]])

# %% [markdown]
# IronCalc recalculates the workbook from nothing. We compare the fall points that it finds for the
# fit to the raw positions with ours.

# %%
cells = kf.recalculate("../workbooks/shuttlecock.xlsx")["Fit raw"]
(place,) = [col for (row, col), text in cells.items() if row == 1 and text == "x_fall_raw"]
sheet = pd.Series([cells[row, place] for row in range(5, 31)], index=range(1, 27))
assert (sheet - run["x_fall_raw"]).abs().max() < 1e-11
pd.DataFrame({"sheet": sheet, "NumPy": run["x_fall_raw"][1:]}).iloc[::5].round(6)

# %% [markdown]
# ## One flight
#
# The paper's Figure 4 (a) to (c): truth, cameras, filter. Then its Figure 5: the error of the fall
# point, forecast anew after every frame, from raw and from filtered positions.

# %%
fig, axes = plt.subplots(1, 3, figsize=(15, 4), layout="constrained")
for ax, title in zip(axes, ("Distance ahead", "Distance sideways", "Height"), strict=True):
    kf.draw(CHARTS[title], run, ax)

# %%
_ = kf.draw(CHARTS["The fall point, from fits"], run)

# %% [markdown]
# The filter's positions scatter less. The dashed line is the error that theory expects of the raw
# fit, as a root mean square; one flight may be luckier. The fall points of the two fits take turns
# at being better. From one flight, anybody may conclude anything; the paper shows one.
#
# ## Four hundred flights: claim 1
#
# The same flight with 400 other draws of noise. Where a fit has no fall point, its error counts as
# infinite.

# %%
KINDS = [f"e_fall_{r}" for r in FORECASTS] + [f"e_{a}_{r}" for a in "xyz" for r in ("obs", "a")]


def draws(seed):
    noise = np.random.RandomState(seed).standard_normal((27, 3))
    return dict(zip(("n_x", "n_y", "n_z"), noise.T, strict=True))


def fly(noise=draws, **parameters):
    runs = [kf.evaluate(shuttlecock, noise(s), columns=KINDS, **parameters) for s in range(400)]
    errors = np.nan_to_num(np.array(runs).transpose(2, 0, 1), nan=np.inf)
    return dict(zip(KINDS, errors, strict=True))


# %% [markdown]
# First the positions: root mean square error over all frames and flights.

# %%
flights = fly()
rms = {r: {a: np.sqrt((flights[f"e_{a}_{r}"] ** 2).mean()) for a in "xyz"} for r in ("obs", "a")}
pd.DataFrame(rms).rename(columns={"obs": "cameras (m)", "a": "filter (m)"}).round(3)

# %% [markdown]
# The paper's Figure 4 once more, over all flights: between the edges of a band lie 95 % of the
# positions that the cameras saw, and 95 % of the filter's.

# %%
fig, axes = plt.subplots(1, 3, figsize=(14, 3.8), layout="constrained")
for ax, axis in zip(axes, "xyz", strict=True):
    for kind, label, colour in (("obs", "cameras", "#E69F00"), ("a", "filter", "#0072B2")):
        seen = flights[f"e_{axis}_{kind}"] + run[f"{axis}_true"].to_numpy()
        edges = np.quantile(seen, (0.025, 0.975), axis=0)
        ax.fill_between(run["time"], *edges, alpha=0.35, color=colour, label=f"{label}, 95 %")
        ax.plot(run["time"], seen.mean(axis=0), color=colour, lw=1)
    ax.plot(run["time"], run[f"{axis}_true"], "k", label="truth")
    ax.set(xlabel="time (s)", ylabel=f"{axis} (m)")
    ax.legend(frameon=False)

# %% [markdown]
# The blue band is the narrower one, and its middle stays on the truth after a few frames. How much
# narrower is it, frame by frame? Root mean square errors over the flights, with the band that
# chi-square theory gives for 400 normal errors.

# %%
scatter = np.sqrt(chi2.interval(0.95, 400)) / 20  # of a root mean square of 400
fig, axes = plt.subplots(1, 3, figsize=(14, 3.8), layout="constrained")
for ax, axis in zip(axes, "xyz", strict=True):
    for kind, label, colour in (("obs", "cameras", "#E69F00"), ("a", "filter", "#0072B2")):
        error = np.sqrt((flights[f"e_{axis}_{kind}"] ** 2).mean(axis=0))
        ax.fill_between(range(27), *np.outer(scatter, error), alpha=0.3, color=colour)
        ax.plot(error, label=label, color=colour)
    ax.set(xlabel="frame", ylabel=f"error of {axis} (m)", ylim=(0, None))
    ax.legend()

# %% [markdown]
# The filter errs less from frame 1 on. By what share?

# %%
gain = {
    a: 1 - np.sqrt((flights[f"e_{a}_a"] ** 2).mean(0) / (flights[f"e_{a}_obs"] ** 2).mean(0))
    for a in "xyz"
}
pd.DataFrame(gain, index=pd.RangeIndex(27, name="frame")).iloc[[1, 2, 4, 6, 10, 18, 26]].round(2)

# %% [markdown]
# **Claim 1 holds.** The filter takes away a fifth of the error in the first frames, more than a
# quarter in frame 6, and about a third in the end.
#
# ## Claim 2
#
# Now the fall point: the median of its error over 400 flights, with the band that holds the true
# median in 19 of 20 experiments. That band follows from the ranks of the sorted errors alone.

# %%
low, high = binom.interval(0.95, 400, 0.5)
rank = [int(low) - 1, int(high)]
COLOURS = {"raw": "#D55E00", "kf": "#0072B2", "now": "#CC79A7", "ex": "#009E73"}


def bands(flights, kinds, ax):
    for kind in kinds:
        errors = np.sort(flights[f"e_fall_{kind}"][:, 2:], axis=0)
        ax.fill_between(range(2, 27), *errors[rank], alpha=0.3, color=COLOURS[kind])
        ax.plot(range(2, 27), np.median(errors, axis=0), label=FORECASTS[kind], c=COLOURS[kind])
    ax.set(xlabel="frame", ylabel="error of the fall point (m)", yscale="log")
    ax.set_yticks([0.03, 0.1, 0.3, 1], labels=["0.03", "0.1", "0.3", "1"])
    ax.legend(frameon=False)


# %%
bands(flights, ["raw", "kf"], plt.subplots(figsize=(8, 4.5), layout="constrained")[1])

# %%
AFTER = [6, 10, 14, 18, 22, 26]


def medians(flights, frames=AFTER):
    found = {r: np.median(flights[f"e_fall_{r}"][:, frames], axis=0) for r in FORECASTS}
    return pd.DataFrame(found, index=pd.Index(frames, name="frame"))


medians(flights)[["raw", "kf"]].round(3)

# %% [markdown]
# The curves lie on each other. The two see the same noise, so we can compare them pair by pair: in
# how many of the flights is the fit to filtered positions the better one? By chance it would be 45
# to 55 %.

# %%
better = flights["e_fall_kf"] < flights["e_fall_raw"]
print(*(f"frame {f}: {better[:, f].mean():.0%}" for f in AFTER), sep="\n")

# %% [markdown]
# And by how much? The ratio of the medians, filtered to raw, with a 95 % band: the same 400 flights
# drawn again and again with replacement (the bootstrap), always in pairs.


# %%
def ratio_of_medians(one, other, axis):
    return np.median(one, axis=axis) / np.median(other, axis=axis)


def ratio(one, other, frames=AFTER):
    pair = one[:, frames], other[:, frames]
    options = {"paired": True, "method": "percentile", "rng": np.random.RandomState(1)}
    again = bootstrap(pair, ratio_of_medians, n_resamples=999, **options)
    return np.array([ratio_of_medians(*pair, 0), *again.confidence_interval])


# %%
def show_ratio(ax, one, other, frames, **look):
    mid, low, high = ratio(one, other, frames)
    ax.fill_between(frames, low, high, alpha=0.2, color=look["color"])
    ax.plot(frames, mid, "o-", ms=3, **look)
    ax.axhline(1, color="k", lw=1)
    ax.set(xlabel="frame", ylabel="median error / that of the raw fit")
    ax.label_outer()


medians_apart = ratio(flights["e_fall_kf"], flights["e_fall_raw"])
pd.DataFrame(medians_apart.T, columns=["filtered/raw", "low", "high"], index=AFTER).round(3)

# %%
ax = plt.subplots(figsize=(8, 3.6), layout="constrained")[1]
show_ratio(ax, flights["e_fall_kf"], flights["e_fall_raw"], range(2, 27), color=COLOURS["kf"])

# %% [markdown]
# In the table every ratio is above 1, and every band holds 1. In frame 2 alone the filtered fit is
# clearly ahead. All frames together tell more: the mean logarithm
# of the ratio of errors, frames 6 to 26, is one number for each flight.

# %%
cost = np.log(flights["e_fall_kf"][:, 6:] / flights["e_fall_raw"][:, 6:]).mean(axis=1)
print(f"filtering first changes the error by {cost.mean():+.1%} ± {1.96 * cost.std() / 20:.1%}")

# %% [markdown]
# **Claim 2 does not hold.** From frame 6 on, filtering first does not help the fit; it costs some
# percent.
#
# Does that hang on $k/m$ = 1/s, which we assumed? Two other shuttlecocks, one with a third of the
# drag and one with three times as much, each filtered and fitted with its own:

# %%
drags = {0.3: fly(k_m=0.3), 1: flights, 3: fly(k_m=3)}
rows = {}
for k_m, f in drags.items():
    found = ratio(f["e_fall_kf"], f["e_fall_raw"]).T
    rows[k_m] = [f"{mid:.2f} ({low:.2f} to {high:.2f})" for mid, low, high in found]
    each = np.log(f["e_fall_kf"][:, 6:] / f["e_fall_raw"][:, 6:]).mean(axis=1)
    rows[k_m].append(f"{each.mean():+.1%} ± {1.96 * each.std() / 20:.1%}")
pd.DataFrame(rows, index=[*AFTER, "6 to 26"]).rename_axis(columns="k/m (1/s)")

# %% [markdown]
# The verdict is the same: no band lies below 1, and over all frames filtering first costs two or
# three percent with each drag.
#
# ## What a figure needs to be reproduced
#
# Could somebody who reads our medians find them again? Two things must be known that are easily
# left out: the draws, and what "after six frames" means, the frames 0 to 6, as in our tables, or
# 0 to 5. The raw fit from 400 draws of another generator, and both counts:


# %%
def other_draws(seed):
    noise = np.random.default_rng(seed).standard_normal((27, 3))
    return dict(zip(("n_x", "n_y", "n_z"), noise.T, strict=True))


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
# ## Why it had to be so
#
# With the right model and white noise, least squares on the raw positions is the best linear
# unbiased estimate there is (Gauss and Markov), and theory says how large its error is; the sheet
# has it in the column `e_theory`, to first order. Do the flights agree, in root mean square?

# %%
found = np.sqrt((flights["e_fall_raw"][:, AFTER] ** 2).mean(axis=0))
pd.DataFrame({"theory (m)": run["e_theory"][AFTER], "400 flights (m)": found}).round(3)

# %% [markdown]
# They do, once the errors are small. The filtered positions are sums of raw ones, so a fit to them
# is another linear estimate: it can be better only by what the filter was told beforehand. All is
# linear, so impulses show the weight that each frame gets in the height forecast for the moment of
# the fall.

# %%
silence = {name: np.zeros(27) for name in ("n_x", "n_y", "n_z")}


def late_height(noise, kind):
    last = kf.evaluate(shuttlecock, {**silence, "n_z": noise}).iloc[-1]
    return last[f"p_z_{kind}"] + last[f"v_z_{kind}"] * (1 - np.exp(-scalars["t_fall"]))


weights = {
    kind: np.array([late_height(row, kind) for row in np.eye(27)]) - late_height(np.zeros(27), kind)
    for kind in ("raw", "kf")
}

# %%
ax = plt.subplots(figsize=(8, 3.6), layout="constrained")[1]
for kind, weight in weights.items():
    ax.plot(weight / np.sqrt(noise["z"]), "o-", c=COLOURS[kind], label=FORECASTS[kind])
ax.set(xlabel="frame", ylabel="weight in the forecast height")
_ = ax.legend()

# %% [markdown]
# The raw fit weighs along a line (in $X$); behind the filter, the frame that it started from gets
# more and the last one less, since the filter has not yet taken it at full value. The squares of
# the weights add up to the variance of the forecast, without any simulation:

# %%
spread = {FORECASTS[kind]: np.sqrt((weight**2).sum()) for kind, weight in weights.items()}
bias = {
    FORECASTS[kind]: late_height(np.zeros(27), kind) - late_height(np.zeros(27), "raw")
    for kind in weights
}
pd.DataFrame({"standard deviation (m)": spread, "bias (m)": bias}).round(4)

# %% [markdown]
# A little wider, and a little off: the filter's positions lag, because it starts with velocity 0
# and an $A$ that is not exact.
#
# ## Where a filter does win
#
# Two more forecasts wait in the sheet: the fall point from the *latest state* of the paper's
# filter, without any fit, and from that of a filter with two states, exact transition and honest
# variances. All four:

# %%
bands(flights, FORECASTS, plt.subplots(figsize=(8, 4.5), layout="constrained")[1])

# %%
medians(flights, [2, 3, 4, *AFTER]).round(3)

# %% [markdown]
# **Few frames.** Up to frame 4 both filters beat the raw fit: they were told that velocities are of
# some metres per second, and a line through three noisy points knows nothing. **Many frames.** The
# paper's filter forgets, because its $Q$ lets it; its latest state errs nearly twice as much in the
# end. The exact filter with $Q = 0$ forgets nothing, and becomes the raw fit. Without its prior
# knowledge it *is* the fit:

# %%
blank = kf.evaluate(shuttlecock, var_v=1e9)
pairs = blank[["x_fall_raw", "x_fall_ex", "t_fall_raw", "t_fall_ex"]].iloc[2::8]
assert (blank["x_fall_raw"] - blank["x_fall_ex"])[2:].abs().max() < 1e-5
pairs.round(4)

# %% [markdown]
# Recursive least squares and a Kalman filter without noise are one thing.
#
# ### When the model is wrong: the filter, and its doubt
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
# ### When a frame is wrong: the filter, and its gate
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
# ## What the data support
#
# 1. Filtering improves the **positions**, by 27 to 28 %. The paper's first claim holds.
# 2. It does **not** improve the **fall point**: from frame 6 on the fit to filtered positions errs
#    a few percent *more*. Only in the first frames is it better, by 13 % in frame 2, at errors of a
#    metre.
# 3. A filter wins where it knows what the fit does not. **Which velocities are plausible**: in
#    frame 2 it errs by 0.74 m (the paper's) and 0.88 m (the exact one), the fit by 1.07 m. **That
#    its model may be wrong**, if it is wrong enough: with twice the drag a filter that doubts ends
#    at 0.049 or 0.047 m, the fit at 0.058 m. **That a frame may be wrong**: with a narrow
#    gate it typically ends at 0.047 m, the fit at 0.082 m, but one flight in eight (10 to 17 %)
#    is lost, by metres; a wide gate wins less (0.064 m) and loses 2 to 6 %.
# 4. None of this is the filter as such. Without doubt, prior and gate it is the fit. And doubt has
#    a price: where drag is 30 % too small or quadratic, the fit bends its other parameters, and
#    $\Phi_s$ = 0.5 in the end only costs; $\Phi_s$ = 0.05 is nearly free.
#
# All this holds for this kick, and point 2 for $k/m$ from 0.3 to 3/s. The paper's Figure 5 shows
# one flight of which we know neither; what it claims in general, the experiment does not bear out.
#
# ## What if
#
# Move the sliders: the signal-to-noise ratio, the error of the drag, the doubt.

# %% tags=["interactive", "nbval-ignore-output"]
from ipywidgets import FloatSlider, interact


@interact(
    SNR=FloatSlider(25, min=4, max=100),
    f_k=FloatSlider(1, min=0.5, max=3),
    Phi_s=FloatSlider(0, min=0, max=1, step=0.05),
)
def what_if(SNR, f_k, Phi_s):
    run = kf.evaluate(shuttlecock, SNR=SNR, f_k=f_k, Phi_s=Phi_s)
    _, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
    kf.draw(CHARTS["Velocity upwards"], run, axes[0])
    kf.draw(CHARTS["The fall point, from latest states"], run, axes[1])


# %% [markdown]
# The same without sliders: our cameras, and cameras twice as good.

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), sharey=True, layout="constrained")
for SNR, ax in zip((25, 100), axes, strict=True):
    kf.draw(CHARTS["The fall point, from fits"], kf.evaluate(shuttlecock, SNR=SNR), ax)
    ax.set_title(f"SNR {SNR}")

# %% [markdown]
# Half the noise, and after some frames about half the error, for both fits alike.
#
# ## Exercises
#
# **Routine**
#
# 1. In `workbooks/shuttlecock.xlsx` set `r_obs` to 0.0125, the variance of the noise in $x$. Why
#    does the truer $R$ make `rms_x_a` *worse*? Which other parameter must follow?
# 2. Derive the column `drop` by hand: what is left of the height when $p_z$ and $v_z$ are 0?
#
# **Break it**
#
# 3. Type 15 over one of the draws on the sheet *Camera*. How long do the four forecasts suffer?
#    Then set `gate` to 3, and look for the gain of that frame on the sheet *Exact filter*. What
#    happens if it is the draw of frame 0, and why?
# 4. Set `z_fall` to 1.1 m, a kick with the knee. Why do some forecasts vanish, and which cells say
#    so first?
#
# **Extend it**
#
# 5. The gate made the difference, not the filter. Give the *fit* a gate: leave out positions whose
#    residual is larger than three sigmas (or use `scipy.optimize.least_squares` with
#    `loss="soft_l1"`). Compare the medians, and the 90 % quantiles. Then let the filter start anew
#    when it has ignored four frames in a row.
# 6. Let the fit estimate $k/m$ too. It is no longer linear; how many frames does it need to pay?
