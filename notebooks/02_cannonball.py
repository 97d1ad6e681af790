# %% [markdown]
# # 2. A cannon-ball, a radar, and a filter for what is not linear
#
# A ball is fired at 915 m/s and 45 degrees. A radar 30 km downrange measures its angle (error
# 0.01 rad) and its range (error 30 m) ten times a second. **Where is the ball**, and how well do we
# know it? Angle and range are no linear functions of the position, so the plain Kalman filter does
# not fit. And is a filter that looks good also *honest*?
#
# The article that the exercise follows contains misprints; we shall meet eleven of them, and see
# what each does.
#
# **You will be able to** linearise an observation and write its filter in scalar columns; find a
# misprint by its unit, its limit or its effect; test whether a filter errs as much as it says.
# **You need** notebook 1, derivatives, and what a covariance is. **Time:** 90 minutes.
#
# *Source:* I. Curnick, *Kalman Filtering a Cannon Ball*, article in the blog indigocurnick.xyz,
# 2025; it follows P. Zarchan and H. Musoff, *Fundamentals of Kalman Filtering: A Practical
# Approach*, 3rd edition, American Institute of Aeronautics and Astronautics, 2009.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import display
from scipy.stats import chi2
from sympy import Matrix, atan, diag, eye, init_printing, lambdify, symbols

import kfsheet as kf
from kfsheet.exercises.cannonball import DYNAMICS, build_model, cannonball, exercise, extended_model
from kfsheet.exercises.cannonball.matrices import echoes_of, fly
from kfsheet.exercises.cannonball.sketch import draw_setup

init_printing(use_latex="mathjax", latex_printer=lambda e, **_: kf.latex_code(e))
CHARTS = {chart.title: chart for chart in exercise.charts}

# %%
_ = draw_setup(plt.subplots(figsize=(9, 3.6), layout="constrained")[1])

# %% [markdown]
# The radar sees the ball at an angle $\theta$ and a distance $r$. Move what the radar *does* (its
# errors) and what the filter is *told* of it: the factor `belief` is the claimed over the true
# error. Watch the band: it is the filter's word, the line its error.

# %% tags=["interactive", "nbval-ignore-output"]
from ipywidgets import FloatLogSlider, FloatSlider, interact


@interact(
    angle_error=FloatLogSlider(0.01, min=-3, max=-1, description="σ_θ (rad)"),
    range_error=FloatLogSlider(30.48, min=0.5, max=3, description="σ_r (m)"),
    belief=FloatSlider(1, min=0.2, max=4, step=0.2, description="told/true"),
)
def first_look(angle_error, range_error, belief):
    told = {"belief_theta": belief, "belief_r": belief}
    run = kf.evaluate(cannonball, sigma_theta=angle_error, sigma_r=range_error, **told)
    kf.draw(CHARTS["Height, close up"], run, plt.subplots(figsize=(9, 3))[1])


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
# The series is printed as $I + F + F^2 t^2/2! + \dots$; its second term lacks the time
# (**misprint 2**). A step of no length must change nothing. Ours does not; the printed one?

# %%
display(Phi.subs(dt, 0), eye(4) + DYNAMICS)

# %% [markdown]
# The printed series lets the ball fly for a second in no time.
#
# ### What the model does not know
#
# White noise of spectral density $\Phi_s$ on both accelerations adds, during a step,
# $Q_k = \int_0^{dt} \Phi(\tau)\, Q\, \Phi(\tau)'\, d\tau$. First what is under the integral:

# %%
tau, noise = symbols("tau", positive=True), diag(0, Phi_s, 0, Phi_s)
integrand = Phi.subs(dt, tau) * noise * Phi.subs(dt, tau).T
integrand

# %% [markdown]
# In the article its second row has three entries, "$\tau * 1 \quad 0 \quad 0$": a product where
# two entries should stand apart (**misprint 11**). A matrix of 4, 3, 4 and 4 entries is none. The
# integral, entry by entry, and the library's:

# %%
Q_k = integrand.applyfunc(lambda e: e.integrate((tau, 0, dt)))
assert Q_k == kf.discrete_noise(DYNAMICS, noise, dt)
Q_k

# %% [markdown]
# "Notice how $Q_k$ is that of the constant velocity example, but twice", says the article. Is it?
# We take that example's own $F$ and $\Phi_s$, two states, and set its blocks side by side.

# %%
speed = Matrix([[0, 1], [0, 0]])
block = kf.discrete_noise(speed, diag(0, Phi_s), dt)
assert diag(block, block) == Q_k
assert diag(speed, speed) == DYNAMICS
block

# %% [markdown]
# It is: two independent problems of constant velocity, in $F$ and in $Q_k$. Would a filter that
# sees $x$ and $y$ themselves be two filters? The sheet's linear one has no covariance between the
# axes; the extended one has, since each of its observations looks at both:

# %%
{
    s: sum(c.startswith(("P_xy_a", "P_xvy_a")) for c in cannonball.table if c.endswith(e))
    for s, e in (("extended", "_a"), ("linear", "_a_lin"))
}

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
# The article's list of derivatives calls $-(y - y_R)/r^2$ the derivative
# $\partial\theta/\partial\dot{x}$ (**misprint 4**). Here is what that label names, and what
# $\partial\theta/\partial x$ is:

# %%
x, vx, y, _ = model.state
theta = model.observations[0].predicted
display(theta.diff(vx), theta.diff(x))

# %% [markdown]
# No angle depends on a velocity: the label was meant to say $x$. In $H$ itself that entry is
# printed without its minus (**misprint 3**). A sign can be checked without algebra: move the ball a
# metre to the right and look whether the angle falls.

# %%
numbers = {x: 10_000, y: 8_000, cannonball["x_R"]: 30_480, cannonball["y_R"]: 0}
moved = theta.subs({**numbers, x: 10_001}) - theta.subs(numbers)
print(f"moved {float(moved):.3e}, derivative {float(H[0, 0].subs(numbers)):.3e} rad/m")

# %% [markdown]
# It falls. What a filter does that believes the contrary, we shall see below. The article also
# calls $y_T$, in one place, the height of the radar (**misprint 5**). If it were, the angle would
# be zero, or $\pi$, wherever the ball is:

# %%
theta.subs(y, cannonball["y_R"]).subs({x: 40_000, cannonball["x_R"]: 30_480})

# %% [markdown]
# ## The Riccati equations, and the sheet
#
# The article's equations for the covariance, with the update that it leaves out, are
#
# $$M_k = \Phi_k P_{k-1} \Phi_k' + Q_k, \quad K_k = M_k H' [H M_k H' + R_k]^{-1}, \quad
# P_k = M_k - K_k H M_k.$$
#
# The first, with symbols for $P$, is what the columns `P_xx_f`, `P_xvx_f`, ... hold: SymPy carries
# it out for one axis.

# %%
P_sym = Matrix(2, 2, symbols("P_xx P_xvx P_xvx P_vxvx"))
M = Phi[:2, :2] * P_sym * Phi[:2, :2].T + block
M.applyfunc(lambda e: e.expand())

# %%
forecasts = kf.formula_table(cannonball, "EKF", rows=2).loc[["P_xx_f", "P_xvx_f", "P_vxvx_f"]]
with pd.option_context("display.max_colwidth", None):
    display(forecasts[["column", "row 5"]])

# %% [markdown]
# The same terms. The gain needs the inverse of a 2 x 2 matrix, unless angle and range, whose errors
# are independent, are assimilated one after the other: every gain is then a division. SymPy shows
# that this is no approximation: two scalar updates against the printed matrices, with any $H$.

# %%
a, b, q, w = symbols("a b q w", positive=True)
B, both = Matrix([[q, w], [w, q + 1]]), Matrix([[a, b], [b, -a]])
_, P_1 = kf.sequential_gain(B, both[0, :], 2)
_, P_2 = kf.sequential_gain(P_1, both[1, :], 3)
K_k = B * both.T * (both * B * both.T + diag(2, 3)).inv()
assert (P_2 - (B - K_k * both * B)).applyfunc(lambda e: e.simplify()).is_zero_matrix

# %% [markdown]
# Nothing is left of the difference. These are the columns for the angle, in the first row that has
# a radar echo.

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
# The filter is a thin line among the radar. (Here and below the *error of a flight* is the
# root mean square over its echoes, sweep 1 to the landing: the start is given, no filter's doing.)
# Close up, with the band that it claims:

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
kf.draw(CHARTS["Distance, close up"], run, axes[0])
_ = kf.draw(CHARTS["Height, close up"], run, axes[1])

# %% [markdown]
# How wide are the bands (m), and when is that of the height narrowest?

# %%
bands = run.set_index("time")[["e_x_a_high", "e_y_a_high"]]
print(f"y: narrowest at {bands['e_y_a_high'].idxmin():.1f} s")
bands.iloc[[1, 10, 100, 300, 471, 514, 900, 1319]].round(1)

# %% [markdown]
# The filter knows the height best soon after the ball has passed over the radar (47 s), while the
# precise range still measures the height. The band of $x$ is flat there, at 23 m: only the
# imprecise angle tells about $x$. It shrinks as the ball flies away and the range takes over. The
# filter also infers the velocities, which nobody measures. How soon?

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
kf.draw(CHARTS["Horizontal velocity"], run, axes[0])
_ = kf.draw(CHARTS["Vertical velocity"], run, axes[1])

# %% [markdown]
# The vertical velocity takes longer: until the ball has climbed, the range hardly depends on its
# height. And the linear filter?

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
kf.draw(CHARTS["Distance, extended or linear?"], run, axes[0])
_ = kf.draw(CHARTS["Height, extended or linear?"], run, axes[1])


# %%
def rms(run, rows=slice(None)):
    who = {"radar alone": "obs", "linear filter": "lin", "EKF": "a"}
    square = {w: (run[[f"e_x_{k}", f"e_y_{k}"]].iloc[rows] ** 2).mean() for w, k in who.items()}
    return pd.DataFrame({w: np.sqrt(s.to_numpy()) for w, s in square.items()}, index=["x", "y"]).T


pd.concat({"flight": rms(run), "last 100": rms(run, slice(-100, None))}, axis=1).round(1)

# %% [markdown]
# The linear filter does well too; it pays for the correlation that it neglects. Near the end the
# radar alone errs by 500 m in height, the extended filter by 2 m. That is one flight. Now 200, each
# with draws of its own; the mean is taken over the squares.

# %%
FLIGHTS, RUNS = kf.Draws("n_theta", "n_r", seed=2), 200
ERRORS = ["e_x_obs", "e_y_obs", "e_x_a", "e_y_a"]


def figures(model=cannonball, **parameters):
    study = kf.study(model, RUNS, FLIGHTS, columns=ERRORS, **parameters)
    square = pd.DataFrame({e: study.rows[e]["rms"] ** 2 for e in ERRORS})
    return pd.DataFrame({"flight": square.mean(), "last 100": square[-100:].mean()}) ** 0.5


figures().round(1)

# %% [markdown]
# Near the end 519 m become 8.8 m: the article's "600 m to 10 m". But it prints
# `R_ERROR = 30_500.0`, a radar that errs by 30 km. Try that.

# %%
figures(sigma_r=30_500).round(0)

# %% [markdown]
# An error of 30.5 km in range is one of $30.5 \cos\theta$ in $x$ and $30.5 \sin\theta$ in $y$:
# 23 and 20 km over the flight, 30 and 2 km near its end, where the ball is low. The filter is off
# by 100 m in $x$. Not the article's result: 30,500 is **misprint 6**; 30.48 m (100 feet) must be
# meant.

# %% [markdown]
# ## A misprint that 45 degrees hides
#
# The article takes the sine for $v_x$ and the cosine for $v_y$ (**misprint 7**). At 45 degrees both
# are equal. What would its code do with a barrel at 30 degrees? Start with these velocities:

# %%
vx_0, vy_0 = 915 * np.sin(np.radians(30)), 915 * np.cos(np.radians(30))
flights = {angle: kf.evaluate(cannonball, angle=angle, dt=0.13) for angle in (30, 60)}
assert np.allclose(flights[60].loc[0, ["vx_true", "vy_true"]], [vx_0, vy_0])

# %% [markdown]
# They are those of a barrel at 60 degrees. (A longer `dt` lets the steeper ball land within the
# table.) The right flight, and the printed one:

# %%
flown = [f[f["in_flight"] == 1] for f in flights.values()]
table = pd.DataFrame(f[["time", "x_true", "y_true"]].max() for f in flown)
table.columns, table.index = ["flies (s)", "lands at (m)", "top (m)"], ["right", "as printed"]
table.round(0).astype(int)

# %% [markdown]
# Both land at 73.9 km, since $\sin 2\alpha$ is the same, so the place of the landing does not
# betray the mistake. But the printed ball is three times as high and flies 162 s instead of 93 s.
#
# ## An update that mixes units
#
# The filter measures angle and range; the article's update multiplies its gains with residuals of
# *position* (**misprint 8**). The first gain turns radians into metres. If we add the printed
# update to the sheet, do the units still agree?

# %%
mixed, t = build_model(), kf.t
x_f, K_x_theta, x_obs = mixed["x_f", "K_x_theta", "x_obs"]
step = kf.when_observed(x_obs[t], K_x_theta[t] * (x_obs[t] - x_f[t]), 0)
(x_printed,) = mixed.columns("x_printed", section="EKF")
mixed.define(x_printed[t], x_f[t] + step, "m", "the printed update", start=[kf.Missing])
print(*mixed.check_units(), sep="\n")

# %% [markdown]
# Square metres. What would the first sweep do? We need the article's matrices, all made from the
# same SymPy objects as the sheet.

# %%
values = {"x_R": 30_480, "y_R": 0, "dt": 0.1, "g": 9.80665}
known = {cannonball[name]: value for name, value in values.items()}
slope = lambdify([*model.state], H.subs(known))
F = np.array(Phi.subs(dt, 0.1), float)
R, P_0 = np.diag([0.01, 30.48]) ** 2, np.diag([304.8, 30.48] * 2) ** 2


# %%
def gain(x_f, P_f, slope=slope):
    A = slope(*x_f)
    return P_f @ A.T @ np.linalg.inv(A @ P_f @ A.T + R), A


# %%
STATE, first = ("x", "vx", "y", "vy"), run.loc[1]
K, _ = gain(first[[f"{name}_f" for name in STATE]], F @ P_0 @ F.T)
right = first["x_a"] - first["x_f"]
printed = K[0] @ [first["x_obs"] - first["x_f"], first["y_obs"] - first["y_f"]]
print(f"right: {right:.0f} m; as printed: {printed / 1000:.0f} km")

# %% [markdown]
# The start is 305 m too far to the right. The filter mends that; the printed update would not.
#
# ## A covariance that never learns
#
# The list of equations ends without an update of the covariance (**misprint 9**). We run it as
# listed: $P$ is forecast, used in the gain, and carried on. `fly` is that list in matrices, for one
# flight or many; with the update it must be the sheet.

# %%
truth = run[[f"{name}_true" for name in STATE]].to_numpy()
echo = run[["theta_obs", "r_obs"]].to_numpy()[None, 1:]
right, listed = (fly(echo, truth, learns=learns) for learns in (True, False))
assert np.allclose(right.error[0, :, 0], run["e_x_a"][1:], atol=1e-6)

# %%
table = {"radar alone": run[["e_x_obs", "e_y_obs"]].to_numpy()[1:]}
table |= {"as listed": listed.error[0][:, [0, 2]], "with the update": right.error[0][:, [0, 2]]}
errors = {k: np.sqrt(np.nanmean(e**2, axis=0)) for k, e in table.items()}
pd.DataFrame(errors, index=["x", "y"]).T.round(1)

# %%
late, claims = np.sqrt(np.mean(listed.error[0, -100:, 2] ** 2)), listed.claimed[0, -1, 2] ** 0.5
print(f"as listed, y over the last 100: errs by {late:.0f} m, claims {claims:.0f} m")

# %%
ax = plt.subplots(figsize=(8, 3.6), layout="constrained")[1]
ax.plot(run["time"], run["e_y_obs"], "o", ms=2, color="#E69F00", label="radar alone")
ax.plot(run["time"][1:], listed.error[0, :, 2], lw=0.6, color="#D55E00", label="as listed")
ax.plot(run["time"][1:], right.error[0, :, 2], color="#0072B2", label="with the update")
ax.set(xlabel="time (s)", ylabel="error of y (m)")
_ = ax.legend()

# %% [markdown]
# With the update the matrices give what the sheet gives. Without it the filter hardly betters the
# radar: it claims ever more kilometres of ignorance, so it believes every echo and remembers none.
# The update is how a filter learns that it has learnt.
#
# ## A filter that corrects to the wrong side
#
# With the same matrices we can run misprint 3, the $H$ without its minus, on the same echoes.

# %%
wrong = fly(echo, truth, minus=False)
table = {"without the minus": wrong.error[0][:, [0, 2]], "with it": right.error[0][:, [0, 2]]}
errors = {k: np.sqrt(np.mean(e**2, axis=0)) for k, e in table.items()}
pd.DataFrame(errors, index=["x", "y"]).T.round(1)

# %%
ax = plt.subplots(figsize=(8, 3.6), layout="constrained")[1]
ax.plot(run["time"][1:], wrong.error[0, :, 0], color="#D55E00", label="without the minus")
ax.plot(run["time"][1:], right.error[0, :, 0], color="#0072B2", label="with it")
ax.set(xlabel="time (s)", ylabel="error of x (m)")
_ = ax.legend()

# %% [markdown]
# For half a minute nothing shows, since the range alone tells $x$. Then the ball nears the zenith,
# where only the angle does, and pushes $x$ to the wrong side: 190 m. As the ball flies away the
# range brings it back. A test run that looks at the end alone would find no mistake.
#
# Could the filter itself notice, without any truth? Its innovations are larger than it claims. The
# mean NIS of a flight ($d' S^{-1} d$, 2 if all is well; more below) has the deviation
# $2/\sqrt{1319}$. How many of 200 flights are beyond 1.96 of these?

# %%
echoes = echoes_of(run, FLIGHTS, RUNS)
both = {"with it": fly(echoes, truth), "without the minus": fly(echoes, truth, minus=False)}
limit = 2 + 1.96 * 2 / 1319**0.5
above = {name: (f.NIS.mean(axis=1) > limit).mean() for name, f in both.items()}
assert above["with it"] < 0.06 < 0.4 < above["without the minus"] < 0.7
above

# %%
ax = plt.subplots(figsize=(8, 3), layout="constrained")[1]
for level, (name, f) in enumerate(both.items()):
    jitter = np.random.RandomState(1).uniform(-0.2, 0.2, RUNS)
    ax.plot(f.NIS.mean(axis=1), level + jitter, "o", ms=3, alpha=0.6, label=name)
ax.axvline(limit, color="k", ls="--")
ax.set(xlabel="mean NIS of a flight, one dot each", yticks=[0, 1], yticklabels=[*both])
_ = ax.set_ylim(-0.5, 1.5)

# %% [markdown]
# The dashed line is the bound. About every second flight with the wrong sign gives itself away: the
# filter *could* notice, if somebody looked at its NIS, but a single flight may well pass.
#
# ## The angle jumps
#
# $\tan^{-1}(b/a)$ of *one* argument (**misprint 10**) lies between $-\pi/2$ and $\pi/2$. As the
# ball passes over the radar it jumps from one end to the other. Two arguments mend that, but make
# another trap: the filter starts *below* the horizon, where the angle is near $-\pi$, and the first
# echo says $+\pi$.


# %%
def one(y, x):
    return atan(y / x)


VARIANTS = {
    "one argument": build_model(arctangent=one, wrap=False),
    "one, wrapped": build_model(arctangent=one),
    "two": build_model(wrap=False),
    "two, wrapped": cannonball,
}
variants = {name: kf.evaluate(m) for name, m in VARIANTS.items()}
pd.DataFrame({n: f["theta"].iloc[1::220] for n, f in variants.items()}).round(2)

# %%
pd.DataFrame({n: f["d_theta"].iloc[1:4] for n, f in variants.items()}).round(3)

# %% [markdown]
# Two arguments without wrapping: the first innovation is a whole turn, and the filter believes it.
# With one argument the start is harmless; the trap is the zenith. In sweep 471 the ball is 6 m
# short of the radar. A filter that errs by more believes that it has passed, as in this flight, the
# third of the 200:

# %%
third = dict(zip(("n_theta", "n_r"), FLIGHTS.of(2, 1320), strict=True))
over = {n: kf.evaluate(m, third, columns=["d_theta"])["d_theta"] for n, m in VARIANTS.items()}
pd.DataFrame({n: d[469:475] for n, d in over.items() if n != "two"}).round(2)

# %% [markdown]
# The jump looks like an innovation of $-\pi$. It throws the ball forward; a sweep later the true
# one has passed as well, and the angles fit again. *Wrapping makes it worse*: $-3.16$ becomes
# $+3.12$, which throws the ball back to the near side, where every echo is as wrong. How often does
# that happen? The error of $x$ (m) over 200 flights:

# %%
LEVELS = {0.5: "median", 0.75: "3 of 4 below", 0.9: "9 of 10 below", 1: "worst"}


def spread(model):
    study = kf.study(model, RUNS, FLIGHTS, scalars=["rms_x_a"], quantiles=[*LEVELS])
    line = study.scalars.loc["rms_x_a"]
    return [line[f"{q} quantile"] for q in LEVELS] + [line["rms"]]


table = pd.DataFrame({name: spread(variant) for name, variant in VARIANTS.items()})
table.index = [*LEVELS.values(), "rms of all"]
table.T.round(0).astype(int)

# %% [markdown]
# With one argument most flights do not suffer; more than a quarter are thrown off by some 80 m, an
# error that a single test run need not show. With wrapping on top, more than one flight in ten
# is lost for good, 49 km off.
#
# How sure is the figure of all 200, 47 m? It hangs on how many flights happen to be thrown off.
# Suppose we had flown only forty: a hundred such sets show what we might have found.

# %%
sets = [
    kf.study(VARIANTS["one argument"], 40, kf.Draws("n_theta", "n_r", seed=s)).scalars
    for s in range(100)
]
found = np.quantile([s.loc["rms_x_a", "rms"] for s in sets], [0.05, 0.5, 0.95, 1])
columns = ["1 of 20 below", "median", "19 of 20 below", "largest"]
pd.DataFrame([found.round().astype(int)], ["rms of forty flights (m)"], columns)

# %% [markdown]
# Nine sets of ten lie between 37 and 56 m, the largest at 61 m. Five times as many flights scatter
# $\sqrt{5}$ times less: our 47 m is known to some 4 m. Two arguments without wrapping lose every
# flight. The errors in km:

# %%
(figures(VARIANTS["two"]).loc[["e_x_a", "e_y_a"]] / 1000).round(1)

# %% [markdown]
# A filter that is lost drifts: in $x$ it errs by 45 km over the whole flight and by 91 km over the
# last 100 sweeps, in the height by 24 km there.

# %% [markdown]
# ## Is the filter honest?
#
# A filter says how well it knows. Two numbers test that. $\mathrm{NIS} = d' S^{-1} d$ compares
# innovations with their claimed variance; it needs no truth. $\mathrm{NEES} = e' P^{-1} e$ compares
# errors with theirs. If all is well they have chi-square distributions with 2 and 4 degrees of
# freedom. Again 200 flights.

# %%
spec = {"NEES": kf.NEES(STATE)}
wanted = ["NIS", "e_x_a", "e_x_lin"]
study = kf.study(cannonball, RUNS, FLIGHTS, columns=wanted, nees=spec)
NIS, NEES = (study.rows[name]["mean"][1:] for name in ("NIS", "NEES"))
assert np.allclose(NEES, both["with it"].NEES.mean(axis=0), rtol=1e-6)

# %% [markdown]
# How to judge them? First a look, sweep by sweep, with the bounds that the mean over 200 flights
# keeps in 19 of 20 sweeps, by chi-square.

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.6), layout="constrained")
for ax, name, values, k in zip(axes, ("NIS", "NEES"), (NIS, NEES), (2, 4), strict=True):
    ax.plot(run["time"][1:], values, lw=0.7)
    for bound in chi2.interval(0.95, RUNS * k):
        ax.axhline(bound / RUNS, color="k", linestyle="--")
    ax.set_title(f"{name}, and its 95 % bounds")
    ax.set(xlabel="time (s)", ylabel=f"mean {name} over {RUNS} flights")

# %% [markdown]
# The curve of the NIS is noise about 2. That of the NEES wanders: a flight that errs, errs for
# long, so neighbouring sweeps tell the same story again. It is tempting to count the sweeps within
# the bounds. That is no test. Forty other sets of 50 flights each, of this same honest filter:

# %%
sets = fly(echoes_of(run, kf.Draws("n_theta", "n_r", seed=9), 2000), truth)
means = sets.NEES.reshape(40, 50, -1).mean(axis=1)
low, high = (bound / 50 for bound in chi2.interval(0.95, 50 * 4))
shares = ((low < means) & (means < high)).mean(axis=1)
print(f"at least 95 % of the sweeps are inside in {(shares >= 0.95).mean():.0%} of the sets")

# %%
ax = plt.subplots(figsize=(8, 2.2), layout="constrained")[1]
ax.plot(100 * shares, np.zeros(40), "o", alpha=0.5)
ax.axvline(95, color="k", ls="--")
_ = ax.set(xlabel="sweeps whose mean NEES is inside (%), a dot for each set", yticks=[])

# %% [markdown]
# An honest filter fails such a "test" in many sets. **The test of all our notebooks**: sweeps
# are not independent, flights are. So a flight is *one* number, its mean NIS or NEES, and the mean
# over the flights is judged by the spread of these numbers (Student's t). That is `kf.consistency`.

# %%
honest = both["with it"]
for name, values, k in (("NIS", honest.NIS, 2), ("NEES", honest.NEES, 4)):
    verdict = kf.consistency(values.mean(axis=1), k)
    assert verdict.holds
    print(f"mean {name}: {verdict}")

# %% [markdown]
# Both intervals hold what is expected. And does the test find a filter that is not honest? One that
# is told half the radar's error, or twice as much, and one with $\Phi_s$ = 1, on the same echoes:

# %%
told = {"told half": {"belief_theta": 0.5, "belief_r": 0.5}}
told |= {"told twice": {"belief_theta": 2, "belief_r": 2}, "distrusts": {"Phi_s": 1}}
for case, changed in told.items():
    f = fly(echoes, truth, **changed)
    found = [kf.consistency(v.mean(axis=1), k) for v, k in ((f.NIS, 2), (f.NEES, 4))]
    assert not found[1].holds
    print(f"{case}: NIS {found[0]}; NEES {found[1]}")

# %% [markdown]
# It finds them all by the NEES, and false claims of the radar's error by the NIS too. Notebook 5
# asks ten thousand flights *when* and in which direction a filter is not honest.
#
# Honest also means: right on average. The mean error of $x$ over the flights, in multiples of its
# standard error, should be below 2 or so.

# %%
errors = {"EKF": study.rows["e_x_a"], "linear filter": study.rows["e_x_lin"]}
bias = {k: e["mean"] / (e["std"] / RUNS**0.5) for k, e in errors.items()}
pd.DataFrame(bias).loc[100::300].round(1)

# %% [markdown]
# The linear filter leans to one side, by some metres: a position computed from a noisy angle is not
# right on average, and its variance is computed from the same noise. The extended filter does not.
#
# ## What $\Phi_s$ does
#
# With $\Phi_s = 0$ the filter believes its model without reserve and in the end hardly listens.
# That is right here, since the motion is exactly the model's. Filters that distrust it, on the same
# 200 flights: their errors (m), and what NIS and NEES say.


# %%
def distrust(Phi_s):
    options = {"columns": ["NIS", "e_x_a", "e_y_a"], "nees": spec, "Phi_s": Phi_s}
    rows = kf.study(cannonball, RUNS, FLIGHTS, **options).rows
    errors = [np.sqrt((rows[e]["rms"] ** 2).mean()) for e in ("e_x_a", "e_y_a")]
    return errors + [rows[name]["mean"][1:].mean() for name in ("NIS", "NEES")]


index = ["error of x", "error of y", "mean NIS", "mean NEES"]
pd.DataFrame({Phi: distrust(Phi) for Phi in (0, 1, 10, 100)}, index=index).round(2)

# %% [markdown]
# The more noise a filter suspects, the more it follows the radar's. The NIS hardly moves: an
# innovation is mostly the radar's error, whatever the filter thinks of its model. The NEES falls to
# half at once, far below its bounds of 3.62 and 4.40: such a filter errs less than it claims. But
# the NEES needs a truth. See exercise 6 for the other direction. One flight, its velocity:

# %%
fig, axes = plt.subplots(1, 2, figsize=(12, 3.8), sharey=True, layout="constrained")
for Phi, ax in zip((0, 10), axes, strict=True):
    kf.draw(CHARTS["Horizontal velocity"], kf.evaluate(cannonball, Phi_s=Phi), ax)
    ax.set(title=f"$\\Phi_s$ = {Phi} m²/s³", ylim=(-20, 20))

# %% [markdown]
# On the right both are wider, the error and the band: the filter never rests. But the band has
# grown more than the error, which seldom fills half of it: that is what the NEES says.
#
# ## What if
#
# Move the sliders: the barrel, the radar, the distrust.


# %% tags=["interactive", "nbval-ignore-output"]
@interact(
    angle=FloatSlider(45, min=10, max=60, description="barrel (°)"),
    sigma_theta=FloatLogSlider(0.01, min=-3, max=-1, description="σ_θ (rad)"),
    sigma_r=FloatLogSlider(30.48, min=0.5, max=3, description="σ_r (m)"),
    Phi_s=[("0 m²/s³", 0), ("1 m²/s³", 1), ("10 m²/s³", 10), ("100 m²/s³", 100)],
)
def what_if(**parameters):
    run = kf.evaluate(cannonball, **parameters)
    _, axes = plt.subplots(1, 2, figsize=(12, 3.8), layout="constrained")
    kf.draw(CHARTS["The flight"], run, axes[0])
    kf.draw(CHARTS["Height"], run, axes[1])
    axes[0].set_title("The flight" if run.attrs["scalars"]["landed"] else "still in the air")


# %% [markdown]
# The same without sliders: our radar, one whose angle is three times worse, one whose range is ten
# times worse, and a lower barrel.

# %%
CASES = {"as it is": {}, "angle ± 0.03 rad": {"sigma_theta": 0.03}}
CASES |= {"range ± 304.8 m": {"sigma_r": 304.8}, "barrel at 30°": {"angle": 30}}
runs = {case: kf.evaluate(cannonball, **changed) for case, changed in CASES.items()}
fig, axes = plt.subplots(2, 2, figsize=(12, 7.2), sharey=True, layout="constrained")
for (case, f), ax in zip(runs.items(), axes.flat, strict=True):
    kf.draw(CHARTS["Height"], f, ax).set_title(case)

# %%
names = ["flight", "rms_x_obs", "rms_x_a", "rms_y_obs", "rms_y_a"]
pd.DataFrame({case: f.attrs["scalars"] for case, f in runs.items()}).loc[names].round(1)

# %% [markdown]
# With the worse angle the radar alone errs three times as much, the filter less than twice: the
# range is as good as before, and gains weight. A range ten times worse costs more in $x$ than in
# $y$. The lower ball lands after 934 sweeps, where its lines end; its filter errs much as ours.

# %% [markdown]
# ## The eleven misprints
#
# | | printed | right |
# |---|---|---|
# | 1 | $F$, third row: $\dot y = y$ | $\dot y = v_y$ |
# | 2 | $\Phi = I + F + \dots$ | $I + F t + \dots$ |
# | 3 | $H_{11} = (y_T - y_R)/r^2$ | $-(y_T - y_R)/r^2$ |
# | 4 | $\partial\theta/\partial\dot x$, twice | the first is $\partial\theta/\partial x$ |
# | 5 | $y_T$ is the height of the radar | $y_R$ is |
# | 6 | range error 30,500 m | 30.48 m |
# | 7 | $v_x = v_0 \sin$, $v_y = v_0 \cos$ | $v_x = v_0 \cos$, $v_y = v_0 \sin$ |
# | 8 | gains times residuals of position | residuals of angle and range |
# | 9 | no update of the covariance | $P = M - K H M$ |
# | 10 | $\tan^{-1}$ of one argument | of two, and innovations wrapped |
# | 11 | integrand of $Q_k$, second row: $\tau * 1, 0, 0$ | $\tau, 1, 0, 0$ |
#
# Further slips change no number and are not run: a Laplace transform that should be the inverse
# one, $\bar{x}$ from a velocity without its index $k-1$, $r \sin\theta + y_R$ without a left side.
# And the printed $\Phi$ is right, so it contradicts the printed $F$.

# %% [markdown]
# ## What was learned
#
# A filter for what is not linear is the linear one with tangents taken at each forecast. In scalar
# columns it needs no matrix. Misprints are found by units, by limits, and by what they do over many
# flights; one that 45 degrees hides needs another angle. And a filter is honest when flights, not
# sweeps, say so.
#
# ## Exercises
#
# **Routine**
#
# 1. In `workbooks/cannonball.xlsx` set `angle` to 35. Where do the grey rows begin, and what do the
#    columns `K_x_theta` and `P_xx_a` do there? Why? Then set it to 60: which result turns red, and
#    what must `dt` be for the ball to land?
# 2. Derive $\partial r/\partial y$ by hand and compare it with the column `H_r_y`.
#
# **Break it**
#
# 3. In the sheet, take the minus out of `H_theta_x` in *one* row. How long does the filter
#    remember it? Then in all rows.
# 4. Set `s_x` and `s_y` to 1 m: the filter is now sure of a start that is wrong by 305 m. What
#    happens to the first innovations, and to `mean_NIS`?
# 5. Put the radar near the cannon, `x_R` to 100 m. Which filter is honest now, by `mean_NIS`? What
#    does the tangent of the angle mean where the start is wrong by three times the range?
#
# **Extend it**
#
# 6. Give the truth a drag (in a file of your own, start from this exercise). By how much must
#    `Phi_s` grow until the NIS is 2 again, and what do you lose?
# 7. The linear filter neglects the correlation between the errors of `x_obs` and `y_obs`. Add it:
#    rotate the observations so that their errors are independent again.
