"""An exercise of a lecturer's own: a stone falls with linear drag, a ruler sees it."""

from sympy import exp

from kfsheet import RMS, Chart, Exercise, Question, Recurrence, Series, t, when_observed

m = Recurrence("stone", title="A stone falls with linear drag", step="frame")
dt = m.parameter("dt", 0.1, "s", "time step", sign="positive")
g = m.parameter("g", 9.81, "m/s2", "gravity")
k = m.parameter("k", 0.5, "1/s", "drag over mass", sign="positive")
K = m.parameter("K_z", 0.4, "", "gain: how far the analysis follows the ruler")
m.time(t * dt, "s", "time")

page = "Fall"
seen = [0, -0.02, -0.25, -0.41, -0.71, -1.15, None, -2.1, -2.71, -3.36]
z_obs = m.data("z_obs", seen, "m", "ruler", section=page, may_be_missing=True)
v, z_f, z_a, z_exact, e = m.columns("v", "z_f", "z_a", "z_exact", "e", section=page)
m.define(v[t], v[t - 1] - (g + k * v[t - 1]) * dt, "m/s", "velocity", start=[0])
m.define(z_f[t], z_a[t - 1] + v[t] * dt, "m", "forecast", start=[0])
correction = when_observed(z_obs[t], K * (z_obs[t] - z_f[t]), 0)
m.define(z_a[t], z_f[t] + correction, "m", "analysis", start=[0])
m.define(z_exact[t], g / k**2 * (1 - exp(-k * t * dt)) - g / k * t * dt, "m", "exact")
m.define(e[t], z_a[t] - z_exact[t], "m", "error of the analysis")
m.summary("rms_e", RMS(e), "m", "rms error")

exercise = Exercise(
    model=m,
    about=("A stone falls. Change k and K_z, and see the forecast and the analysis follow.",),
    source="a lecturer's own",
    charts=(Chart("Fall", "time (s)", "z (m)", (Series("time", "z_a", "analysis", "analysis"),)),),
    questions=(Question("z_f", 2, "One step of the model."),),
)
