# %% [markdown]
# # 3. A shuttlecock, a robot, and a claim that we put to the test
#
# A robot is to kick a shuttlecock back. Two cameras see it 30 times a second with errors of 6 to
# 17 cm. **Where and when will it fall**, and how early can the robot know?
#
# A conference paper filters the positions, fits the track to what the filter says, and claims that
# the filter reduces the noise of the *positions*, obtains velocities, and that the *fall point*
# converges faster and better. We rebuild it, fly 400 times, and see which claims the data support.
#
# **You will be able to** turn a track into a straight line and fit it by running sums; write a
# filter of three states; judge a published claim by many flights, in pairs. **You need** notebook 1
# and least squares. **Time:** 90 minutes; what goes further is notebook 3b.
#
# *Source:* Man Yongkui, Zhao Liang and Hu Jingxin (Northeastern University, China), "Application of
# Kalman Filter in Track Prediction of Shuttlecock", IEEE ROBIO, 2009,
# doi:10.1109/ROBIO.2009.5420475.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import display
from scipy.stats import chi2
from sympy import Eq, Function, Matrix, cos, dsolve, exp, init_printing, sin, symbols

import kfsheet as kf
from kfsheet.estimation import drag
from kfsheet.exercises.shuttlecock import FORECASTS, exercise, shuttlecock
from kfsheet.exercises.shuttlecock.filters import joint_model

# %%
from kfsheet.exercises.shuttlecock.many_flights import (
    AFTER,
    COLOURS,
    cost,
    fly,
    improvement,
    ratio,
    show_medians,
    show_ratio,
    velocity_errors,
)
from kfsheet.exercises.shuttlecock.sketch import draw_angles, draw_setup

init_printing(use_latex="mathjax", latex_printer=lambda e, **_: kf.latex_code(e))
CHARTS = {chart.title: chart for chart in exercise.charts}

# %%
_ = draw_setup(plt.subplots(figsize=(8, 4.5), layout="constrained")[1])

# %% [markdown]
# Move what the cameras *do* (the signal-to-noise ratio) and what the exact filter is *told* of it,
# and watch the error of the fall point.

# %% tags=["interactive", "nbval-ignore-output"]
from ipywidgets import FloatSlider, interact


@interact(
    SNR=FloatSlider(25, min=4, max=100, description="SNR"),
    belief_r=FloatSlider(1, min=0.2, max=5, description="told/true"),
)
def first_look(SNR, belief_r):
    run = kf.evaluate(shuttlecock, SNR=SNR, belief_r=belief_r)
    kf.draw(CHARTS["The fall point, from latest states"], run, plt.subplots(figsize=(8, 3))[1])


# %% [markdown]
# ## Linear drag
#
# Position is the integral of velocity, velocity of acceleration (1). The paper's drag is
# $f = -k_1 v - k_2 v^2$ (2), of which it keeps the first term (3): the height stays within 1 m, so
# the speed within 5 m/s, "much smaller than a low-speed bullet"; and $k_2 \ll k_1$ by measurement.
# Is slowness a reason? What matters is $k_2 v^2 / (k_1 v)$. If the terminal velocity is 6.8 m/s:

# %%
for name, share in (("all linear", 0), ("all quadratic", 1)):
    k_1, k_2 = 9.80665 * (1 - share) / 6.8, 9.80665 * share / 6.8**2
    print(
        f"{name}: drag {k_1 * 4.35 + k_2 * 4.35**2:.1f} m/s² at 4.35 m/s, {k_1 + k_2:.2f} at 1 m/s"
    )

# %% [markdown]
# At 4.35 m/s, the speed of our kick, the two laws differ by half; at 1 m/s by a factor of seven.
# The argument would need a Reynolds number below 1, not a slow bullet: a shuttlecock of 6 cm at 4
# m/s has 16,000, where drag is quadratic. The measurement would decide; we test the claims with
# both laws below.
#
# Equation (5) resolves the drag by two angles, $\varphi$ from the vertical and $\theta$ over the
# ground (its Fig. 3). A drag $-k v$ times the cosines and sines is $-k$ times the component:

# %%
_ = draw_angles(plt.figure(figsize=(5, 4)).add_subplot(projection="3d"))

# %%
k, speed, theta, phi = symbols("k v theta phi", positive=True)
direction = Matrix([cos(theta) * sin(phi), sin(theta) * sin(phi), cos(phi)])
assert (direction.dot(direction)).simplify() == 1
-k * speed * direction

# %% [markdown]
# With $v_x = v\cos\theta\sin\varphi$ and so on, the angles cancel and the axes do not meet again. A
# *quadratic* drag would keep the factor $v$, which all three share.
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
# The paper's state is position, velocity, acceleration of one axis. Its equations (10) to (14) are
#
# $$X_f = A X_a + B U, \quad P_f = A P_a A' + Q, \quad K = P_f H' / (H P_f H' + R),$$
#
# $$X_a = X_f + K (Z - H X_f), \quad P_a = (I - K H) P_f, \quad H = (1, 0, 0),$$
#
# with $U = -g$ on the $z$ axis alone, times the Boolean `X_Y_OR_Z`. $A$ comes from (9), which
# prints $x + \dot{x} + \ddot{x}T^2/2$. Metres plus metres per second: let the unit check read it.

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
# ## The noise
#
# "White noise whose signal-to-noise ratio is 25", "R = 0.04". Both say 1/25, if the signal has
# power 1. It has not. The sheet takes the ratio at its word: variance = mean(signal²)/25 on each
# axis.

# %%
run = kf.evaluate(shuttlecock)
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
# The same flight with 400 other draws of noise (`fly`). Where a fit has no fall point, its error
# counts as infinite. First the positions: root mean square error over all frames and flights.

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
show_medians(plt.subplots(figsize=(8, 4.5), layout="constrained")[1], flights, ["raw", "kf"])

# %% [markdown]
# The curves lie on each other. The two see the same noise, so we can compare them pair by pair: in
# how many of the flights is the fit to filtered positions the better one? By chance it would be 45
# to 55 %.

# %%
better = flights["e_fall_kf"] < flights["e_fall_raw"]
frames = list(AFTER)
print(*(f"frame {f}: {better[:, f].mean():.0%}" for f in frames), sep="\n")

# %% [markdown]
# And by how much? The ratio of the medians, filtered to raw, with a 95 % band: the same 400 flights
# drawn again and again with replacement (the bootstrap), always in pairs.

# %%
ax = plt.subplots(figsize=(8, 3.6), layout="constrained")[1]
show_ratio(ax, flights["e_fall_kf"], flights["e_fall_raw"], range(2, 27), color=COLOURS["kf"])

# %% [markdown]
# The line lies above 1 from frame 6 on, its band mostly holds 1. In frame 2 alone the filtered fit
# is clearly ahead. All frames together tell more: the mean logarithm
# of the ratio of errors, frames 6 to 26, is one number for each flight.

# %%
mean, error = cost(flights)
assert mean > 0
print(f"filtering first changes the error by {mean:+.1%} ± {error:.1%}")

# %% [markdown]
# **Claim 2 does not hold.** From frame 6 on, filtering first does not help the fit; it costs some
# percent.
#
# Does that hang on what we assumed: the drag, the reading of "SNR 25" (a ratio of powers, or 25
# dB?) and of "Q = 0.04" (on all three states, or on the acceleration alone), a world of linear
# drag? A *purely quadratic* one, with the terminal velocity 6.8 m/s of a badminton shuttlecock, is
# one line.

# %%
READINGS = {"as above": {}, "k/m = 0.3/s": {"k_m": 0.3}, "k/m = 3/s": {"k_m": 3}}
READINGS |= {"25 dB": {"SNR": 10**2.5}, "Q on the acceleration": {"f_q": 0}}
READINGS |= {"25 dB, and Q so": {"SNR": 10**2.5, "f_q": 0}}
READINGS |= {"quadratic drag": {"f_lin": 0, "k_2": 9.80665 / 6.8**2}}
read = {name: fly(**changed) for name, changed in READINGS.items()}

# %%
fig, axes = plt.subplots(1, 2, figsize=(13, 4), sharey=True, layout="constrained")
for level, f in enumerate(read.values()):
    axes[0].plot([100 * v for v in improvement(f).values()], [level] * 3, "o", alpha=0.7)
    mean, error = cost(f)
    axes[1].errorbar(100 * mean, level, xerr=100 * error, fmt="o", capsize=4)
    assert mean > -error
axes[0].set(xlabel="positions err less by (%); x, y, z", yticks=range(7), yticklabels=[*read])
axes[0].set_xlim(0, None)
axes[1].axvline(0, color="k", lw=1)
_ = axes[1].set_xlabel("fall point from filtered positions errs more by (%), frames 6 to 26")

# %%
table = {name: ratio(f["e_fall_kf"], f["e_fall_raw"])[0] for name, f in read.items()}
pd.DataFrame(table, index=frames).T.round(2)

# %% [markdown]
# Ratios of medians, by frame. **Both verdicts survive every reading.** With $Q$ on the acceleration
# the filter is smoother: positions improve by 45 %, and the fall point gets *worse*, by a sixth to
# a third. A filter that makes the positions look better makes the forecast worse.
#
# ## Claim 3: velocity and acceleration
#
# "Velocity and acceleration of shuttlecock motion are obtained." They are. How well, and is there
# no other way? The fit implies a velocity too: $v_z e^{-k\tau} - g X$.

# %%
moves = fly(columns=["vz_true", "vz_a", "v_z_raw", "az_a"])
ax = plt.subplots(figsize=(8, 3.6), layout="constrained")[1]
late = {}
for who, e in velocity_errors(moves).items():
    ax.plot(range(2, 27), np.sqrt((e[:, 2:] ** 2).mean(axis=0)), label=who)
    late[who] = np.sqrt((e[:, 26] ** 2).mean())
ax.set(xlabel="frame", ylabel="rms error of $v_z$ (m/s)", yscale="log")
_ = ax.legend()

# %%
assert late["fit"] < late["filter"] / 2
print(*(f"frame 26: {who} {error:.2f} m/s" for who, error in late.items()), sep="\n")

# %% [markdown]
# **Claim 3 holds, but says little**: up to frame 4 the filter's velocity is the better one, at the
# end it errs three times as much as that of the fit. The acceleration is $-k v_z - g$ of the same
# velocity, so with $k$ = 1/s it errs by the same number, with the sign changed:

# %%
off = moves["az_a"] + moves["vz_true"] + 9.80665
assert np.allclose(off[:, 1:], -velocity_errors(moves)["filter"][:, 1:])

# %% [markdown]
# ## Why it had to be so
#
# With the right model and white noise, least squares on the raw positions is the best linear
# unbiased estimate there is (Gauss and Markov), and theory says how large its error is; the sheet
# has it in the column `e_theory`, to first order. Do the flights agree, in root mean square?

# %%
found = np.sqrt((flights["e_fall_raw"][:, frames] ** 2).mean(axis=0))
pd.DataFrame({"theory (m)": run["e_theory"][frames], "400 flights (m)": found}).round(3)

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
show_medians(plt.subplots(figsize=(8, 4.5), layout="constrained")[1], flights, FORECASTS)

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
# Two things a fit cannot know: that its model may be wrong, and that a frame may be. Notebook 3b
# flies worlds with other drag, filters that doubt, and cameras that take something else for the
# shuttlecock; the next section says what comes of it.
#
# ## What was learned: what the data support
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
# 4. A **velocity** is obtained, but the fit's is three times as good in the end.
# 5. None of this is the filter as such. Without doubt, prior and gate it is the fit. And doubt has
#    a price: where drag is 30 % too small or quadratic, the fit bends its other parameters, and
#    $\Phi_s$ = 0.5 in the end only costs; $\Phi_s$ = 0.05 is nearly free.
#
# Points 1, 2 and 4 are shown here, the others in notebook 3b. Point 2 holds for $k/m$ from 0.3 to
# 3/s, for both readings of the paper's figures, and for quadratic drag. The paper's Figure 5 shows
# one flight of which we know neither; what it claims in general, the experiment does not bear out.
#
# ## What if
#
# Move the sliders: the signal-to-noise ratio, the error of the drag, the doubt.


# %% tags=["interactive", "nbval-ignore-output"]
@interact(
    SNR=FloatSlider(25, min=4, max=100, description="SNR"),
    f_k=FloatSlider(1, min=0.5, max=3, description="drag told/true"),
    Phi_s=FloatSlider(0, min=0, max=1, step=0.05, description="Φ_s (m²/s³)"),
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
