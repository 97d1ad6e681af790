# %% [markdown]
# # 1. A football, one camera, and a filter that tells on its model
#
# A football is kicked from 23.4 m towards the goal. A camera takes ten photos a second and errs by
# 3 pixels; a simple model of the flight errs by 0.1 m a step. **Where was the ball?** And, once we
# have an answer: how would we notice that it is wrong, if nobody told us the truth?
#
# The photos are simulated, with quadratic drag in fine steps, so the model of the exercise is *not*
# the truth.
#
# *Source:* "Reanalysis of a football kick using the Kalman Filter", the sheet of a course. Our copy
# names no author, year or place.

# %%
import matplotlib.pyplot as plt
import pandas as pd
from IPython.display import display
from sympy import Eq, Function, Limit, Matrix, diag, init_printing, oo, simplify, solve, symbols

import kfsheet as kf
from kfsheet.exercises.football import exercise, football

init_printing(use_latex="mathjax", latex_printer=lambda e, **_: kf.latex_code(e))
CHARTS = {chart.title: chart for chart in exercise.charts}

# %% [markdown]
# ## The gain, derived
#
# The analysis weighs a forecast against observations:
#
# $$x_a = x_f + B H' \, (R + H B H')^{-1} \, (y - H[x_f])$$
#
# For two quantities, each observed by itself, all three matrices are diagonal. We let SymPy do the
# algebra and look at every step. These are $B$, $R$ and $H$:

# %%
A = kf.diagonal_analysis(2)
display(A.B, A.R, A.H)

# %% [markdown]
# First $B H'$ and $H B H'$: the error of the forecast, half and then fully as the camera sees it.

# %%
display(A.BHt, A.HBHt)

# %% [markdown]
# Add the camera's own error and we have $S$, the variance of the innovation. It is what the
# difference between a photo and a forecast *should* scatter by. Remember it; we shall need it.

# %%
A.S

# %% [markdown]
# The inverse of a diagonal matrix is the diagonal of inverses:

# %%
A.S_inverse

# %% [markdown]
# So $K = B H' S^{-1}$ needs no matrix at all: one scalar gain for each quantity. This is the
# formula that will stand in a cell.

# %%
A.K

# %% [markdown]
# And the analysis itself, one line for each quantity:

# %%
A.x_a

# %% [markdown]
# ### The camera's operator is affine
#
# The camera counts $i$ to the right and $j$ *down* from the top left corner: $i = a x$ and
# $j = j_0 - a z$. The innovation takes the whole of it; the gain only its slope, so we expect a
# negative gain for $z$: a ball seen too low in the picture has to come down.

# %%
x, z, i, j = symbols("x_f z_f i j", real=True)
a, j_0, b_x, b_z, r_i, r_j = symbols("a j_0 b_x b_z r_i r_j", positive=True)
camera = kf.analysis([x, z], [a * x, j_0 - a * z], [i, j], diag(b_x, b_z), diag(r_i, r_j))
camera.K

# %%
camera.innovation

# %% [markdown]
# The source prints $H(z) = 500 - a\,x$. Taken at its word, the camera never sees $z$. Let us see
# what the same derivation makes of that.

# %%
misprint = kf.analysis([x, z], [a * x, j_0 - a * x], [i, j], diag(b_x, b_z), diag(r_i, r_j))
misprint.K

# %% [markdown]
# The second row is zero: no photo would ever correct the height. That is **misprint (a)**; it must
# read $500 - a\,z$.
#
# ### Limits
#
# A formula is easier to trust at its ends. What should the gain be if the camera is perfect, if it
# is blind, and if the model knows nothing?

# %%
K_x = camera.K[0, 0]
limits = kf.gain_limits(K_x, r_i, b_x).values()
for end, value in zip(((r_i, 0), (r_i, oo), (b_x, oo)), limits, strict=True):
    display(Eq(Limit(K_x, *end), value))

# %% [markdown]
# A perfect camera or an ignorant model: $1/a$, which turns pixels into metres and believes the
# photo. A blind camera: 0, which believes the model.
#
# ## The model
#
# Each column of the exercise is one expression, and $t$ is the row. The mean velocity of a step
# comes from the two analyses before it, less friction; this very object becomes a cell.

# %%
football.table["u"].expression

# %%
football.table["x_f"].expression

# %% [markdown]
# Two switches hold what the source prints: $h = 1/2$ for the "half-step" terms and $p = 1$ for the
# power of $\Delta t$ in the friction. We shall run it as printed and see.
#
# ## The sheet
#
# The same expressions as formulas, in the first three rows of the worksheet. Parameters and gains
# are names, so a formula reads like the equation it came from.

# %%
with pd.option_context("display.max_colwidth", None):
    display(kf.formula_table(football, "Reanalysis"))

# %% [markdown]
# Does the sheet compute what NumPy computes? IronCalc, an independent spreadsheet engine,
# recalculates the workbook from nothing. Here are its analyses of $x$ beside NumPy's.

# %%
WORKBOOK = "../workbooks/football.xlsx"
K = 11  # the column of x_a
sheet = kf.recalculate(WORKBOOK)["Reanalysis"]
both = pd.DataFrame({"sheet": [sheet[row, K] for row in range(4, 20)]})
both["NumPy"] = kf.evaluate(football)["x_a"]
assert (both["sheet"] - both["NumPy"]).abs().max() < 1e-12
both.iloc[::5].round(6)

# %% [markdown]
# And now every formula: as it stands, with every input moved by one percent, and with photos
# taken out.

# %%
report = kf.check_workbook(WORKBOOK, exercise)
assert report.holds
assert report.largest < 1e-12
print(f"{report.cells} formulas agree with NumPy to 12 figures: {report.holds}")

# %% [markdown]
# ## Run it, as printed
#
# We run the model with the source's numbers. The free run is the same model without photos. We
# expect the analysis to lie close to the truth, and closer than the camera alone.

# %%
printed = kf.evaluate(football)
_ = kf.draw(CHARTS["The kick, in metres"], printed)

# %% [markdown]
# The free run is hopeless, so the photos do help, and the analysis lies on the path. But a dot on
# the path can still be early or late. How large are the errors, in metres?


# %%
def errors(run):
    s = run.attrs["scalars"]
    return pd.DataFrame({axis: {who: s[f"rms_{axis}_{key}"] for who, key in WHO} for axis in "xz"})


WHO = [("camera alone", "cam"), ("analysis", "a"), ("free run", "free")]
errors(printed).round(3)

# %% [markdown]
# In $x$ the analysis is **worse than the camera alone**. The filter was given good photos and
# spoiled them. Here we know it because the data are simulated. On a real pitch there is no truth to
# compare with.
#
# ## The turn: the filter tells on its model
#
# What we do have on a real pitch are the innovations. If model and camera err as we said, they
# scatter about zero with the standard deviation $\sqrt{S}$ that we derived.

# %%
fig, axes = plt.subplots(1, 2, figsize=(11, 3.6), layout="constrained")
for pixel, ax in zip("ij", axes, strict=True):
    kf.draw(CHARTS[f"Innovations in {pixel}"], printed, ax)

# %% [markdown]
# All innovations in $i$ are negative, and 14 of 15 lie outside the band. (In this filter neighbours
# are correlated, since each forecast extrapolates two analyses; so we look at the size of their
# mean rather than test it.) The gain turns it into metres: how far do the photos have to push the
# ball in every step?


# %%
def push(run):
    s = run.attrs["scalars"]
    pairs = {"x": ("K_x", "mean_d_i"), "z": ("K_z", "mean_d_j")}
    return {axis: round(float(s[K] * s[d]), 3) for axis, (K, d) in pairs.items()}


push(printed)

# %% [markdown]
# A third of a metre, in every step, always towards the goal: the model brakes too much. Nobody had
# to tell us the truth.
#
# ### Suspect the units
#
# The source gives $f = 0.03$ s/m. We ask kfsheet whether the terms of each equation agree.

# %%
for problem in football.check_units()[:2]:
    print(problem)

# %% [markdown]
# With $f$ in s/m, the friction in the velocity equation is a length. Then perhaps $f$ is in 1/m,
# as a quadratic drag law wants?

# %%
for problem in football.check_units(units={"f": "1/m"})[:2]:
    print(problem)

# %% [markdown]
# Now the *position* equation complains: its friction is a velocity. No unit of $f$ satisfies both.
# With $\Delta t^2$ in the position equation, does everything agree?

# %%
problems = football.check_units(units={"f": "1/m"}, values={"p": 2})
print(*problems or ["no problem"], sep="\n")

# %% [markdown]
# Everything: **misprint (b)** is the missing square. And what do the photos have to push now?

# %%
mended = kf.evaluate(football, p=2)
push(mended)

# %% [markdown]
# ### Suspect the half-step
#
# Nine times better in $x$. But in $z$ the photos still push by 45 mm a step, *upwards*: the model
# falls too fast. How strongly does it accelerate? Take the step of the source without friction and
# solve for the second difference.

# %%
h, g, dt = symbols("h g dt", positive=True)
Z = Function("z")
w = (Z(kf.t - 1) - Z(kf.t - 2)) / dt - g * dt
step = Eq(Z(kf.t), Z(kf.t - 1) + w * dt - h * g * dt**2)
acceleration = (Z(kf.t) - 2 * Z(kf.t - 1) + Z(kf.t - 2)) / dt**2
simplify(acceleration.subs(Z(kf.t), solve(step, Z(kf.t))[0]))

# %% [markdown]
# With $h = 1/2$ the ball falls with $1.5\,g$. The velocity $w$ is already the *mean* velocity of
# the step, as in the Störmer-Verlet scheme; half of $g \Delta t^2$ on top, 49 mm a step, counts
# gravity twice: **misprint (c)**. So $h = 0$.

# %%
consistent = kf.evaluate(football, h=0, p=2)
push(consistent)

# %% [markdown]
# A few millimetres are left. Compare the three models by what we can always see (innovations) and
# by what only a simulation shows (errors).

# %%
RUNS = {"as printed": printed, "power mended": mended, "consistent": consistent}
seen = ["mean_d_i", "std_d_i", "sigma_d_i", "mean_d_j", "std_d_j", "sigma_d_j"]
pd.DataFrame({k: {s: r.attrs["scalars"][s] for s in seen} for k, r in RUNS.items()}).T.round(1)

# %%
hidden = ["rms_x_a", "rms_z_a", "rms_x_cam", "rms_z_cam", "rms_x_free", "rms_z_free"]
pd.DataFrame({k: {s: r.attrs["scalars"][s] for s in hidden} for k, r in RUNS.items()}).T.round(3)

# %% [markdown]
# The *mean* innovation ranked the three models as the hidden free runs do: from metres to
# decimetres. The analysis itself is nearly as good once (b) is mended, since the photos repair the
# rest. One thing stays open: `std_d_j` exceeds its theory. The camera's own error in $z$ is 0.092 m
# here, 4.1 pixels instead of 3: sixteen photos can be unlucky. See exercise 6.

# %%
_ = kf.draw(CHARTS["The kick, in metres"], consistent)
# %% [markdown]
# ### And as the camera sees it

# %%
_ = kf.draw(CHARTS["The kick, as the camera sees it"], consistent)
# %% [markdown]
# ## What if
#
# Move the sliders: the camera's error in pixels, the model's error in metres, and the two switches.
# Watch the gain, and how the analysis chooses between photos and forecast.

# %% tags=["interactive", "nbval-ignore-output"]
from ipywidgets import FloatSlider, interact


@interact(
    camera=FloatSlider(3, min=1, max=60),
    model=FloatSlider(0.1, min=0.01, max=1, step=0.01),
    h=[0.5, 0.0],
    p=[1, 2],
)
def what_if(camera, model, h, p):
    variances = {"r_i": camera**2, "r_j": camera**2, "b_x": model**2, "b_z": model**2}
    kf.draw(CHARTS["The kick, in metres"], kf.evaluate(football, h=h, p=p, **variances))


# %% [markdown]
# The same without sliders: a camera that errs by 3 pixels beside one that errs by 30. We expect the
# second analysis to lean on its (bad, as printed) model.

# %%
fig, axes = plt.subplots(1, 2, figsize=(11, 3.8), sharey=True, layout="constrained")
for pixels, ax in zip((3, 30), axes, strict=True):
    kf.draw(CHARTS["The kick, in metres"], kf.evaluate(football, r_i=pixels**2, r_j=pixels**2), ax)
    ax.set_title(f"camera error {pixels} px")

# %%
blurred = kf.evaluate(football, r_i=900, r_j=900)
{run: round(r.attrs["scalars"]["K_x"], 5) for run, r in (("3 px", printed), ("30 px", blurred))}

# %% [markdown]
# ### A photo that is not there
#
# Delete photo 7's $i$: the analysis of $x$ is then the forecast, and the innovation has no value.
# The height still has its pixel.

# %%
pixels = football.table["i"].values
gap = kf.evaluate(football, {"i": [None if k == 7 else v for k, v in enumerate(pixels)]}, h=0, p=2)
gap.loc[6:8, ["i", "d_i", "x_f", "x_a", "z_f", "z_a"]].round(3)

# %% [markdown]
# ### When does it cross the line?
#
# At every photo the filter can say how high the ball will be at $x = 0$. The forecast should
# settle. Its standard deviation counts the errors of the last two analyses only, not the drag that
# lies ahead: early forecasts are off by much more than it says.

# %%
consistent[["wait", "z_goal", "s_goal"]].iloc[::3].round(2)

# %%
goal = consistent.attrs["scalars"]
print(
    f"{goal['goal_height']:.2f} +/- {goal['goal_sigma']:.2f} m, "
    f"{goal['goal_wait']:.2f} s after the last photo"
)

# %% [markdown]
# ## What a correlation would do
#
# We took the errors of $x$ and $z$ as independent. Suppose they have a correlation $\rho$. The gain
# becomes a full 2 x 2 matrix, still in closed form. Here is the term that lets the pixel $j$
# correct $x$:

# %%
rho = symbols("rho", real=True)
B = kf.correlated_covariance(b_x, b_z, rho)
full = kf.analysis([x, z], [a * x, j_0 - a * z], [i, j], B, diag(r_i, r_j))
full.K[0, 1]

# %% [markdown]
# It vanishes with $\rho$, and the scalar gains come back:

# %%
simplify(full.K.subs(rho, 0) - camera.K)

# %% [markdown]
# With numbers: at $\rho = 0.8$, one photo with $i$ missing still corrects $x$ through $j$. A
# spreadsheet needs no matrix inverse for that: observations are assimilated one after the other,
# each with a scalar division.

# %%
numbers = {a: 44.2, b_x: 0.01, b_z: 0.01, r_j: 9, rho: 0.8}
K, P = kf.sequential_gain(B, Matrix([[0, -a]]), r_j)
K.subs(numbers).evalf(4)

# %% [markdown]
# One pixel in $j$ moves $z$ by 15 mm and $x$ by 12 mm, although nobody looked at $x$. That is how
# real data assimilation fills the gaps between its observations.
#
# ## Exercises
#
# **Routine**
#
# 1. In `workbooks/football.xlsx`, set `h` to 0 and `p` to 2 and read the root mean square errors on
#    the sheet Parameters. Then double `r_i`: by what factor does `K_x` change, and why not by 2?
# 2. At which `r_i` would the gain be exactly half of its limit $1/a$? Derive it, then try it.
#
# **Break it**
#
# 3. Type a wrong sign into one formula of the column `x_f` and run `kfsheet check`. Which cell does
#    it name, and which cells are wrong but not named? Why?
# 4. With `h` = 0 and `p` = 2, set `b_x` and `b_z` to 0.0001. The gain falls. What do the
#    innovations do, and what does that say about the errors you claimed?
#
# **Extend it**
#
# 5. Let the covariance of the forecast follow from that of the analysis (add a variance `q` in each
#    step) in an exercise file of your own, and compare the gain with the constant one.
# 6. Choose `b_z` so that the theory `sigma_d_j` meets `std_d_j` in the consistent run. Does the
#    error of `z_a` become smaller? Which other variance could have been meant, and what would you
#    need to tell the two apart?
