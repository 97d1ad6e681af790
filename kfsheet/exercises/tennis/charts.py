"""The charts of the tennis exercises, each drawn in the workbook and in the notebook."""

from __future__ import annotations

from kfsheet.model.chart import Chart, Series


def _path(title: str, k: int, label: str, note: str) -> Chart:
    series = (
        Series("x1_true", f"x{k}_true", "truth", "truth"),
        Series("x1_tri", f"x{k}_tri", "triangulation", "observation"),
        Series("x1_a", f"x{k}_a", "filter", "line"),
        Series("x1_fly", f"x{k}_fly", "to the ground", "free"),
    )
    return Chart(title, "x1: away from camera 1 (m)", label, series, note)


def _innovations(name: str, role: str, note: str) -> Chart:
    band = "second band" if role == "second" else "band"
    series = (
        Series("time", f"d_{name}", f"innovation d_{name}", role),
        Series("time", f"d_{name}_low", "", band),
        Series("time", f"d_{name}_high", "2 sigma band", band),
    )
    return Chart(f"Innovations of {name}", "time (s)", "observed - forecast (px)", series, note)


CHARTS = (
    _path(
        "Side view",
        3,
        "x3: height (m)",
        "From the side, and on to the ground; the truth lies under the filter.",
    ),
    _path(
        "Top view",
        2,
        "x2: away from camera 2 (m)",
        "From above, x2 stretched; the truth lies under the filter: see the errors.",
    ),
    Chart(
        "What the cameras see",
        "u: to the right (px)",
        "v: down (px)",
        (Series("u1", "v1", "camera 1", "first"), Series("u2", "v2", "camera 2", "second")),
        note="The whole flight fills a narrow strip of camera 1; camera 2 has eight images.",
        origin_top_left=True,
    ),
    Chart(
        "Errors of x1, the depth",
        "time (s)",
        "estimate - truth (m)",
        (
            Series("time", "e_tri_x1", "triangulation", "observation"),
            Series("time", "e_a_x1", "filter", "line"),
        ),
        note="What both cameras knew early, the equation of the flight carries on.",
    ),
    _innovations(
        "u1",
        "first",
        "An honest filter: 19 of 20 inside. At first the band is too wide to show (n_band).",
    ),
    _innovations("v1", "second", "The same for the vertical pixel."),
    _innovations("u2", "first", "Camera 2: eight images."),
    _innovations("v2", "second", "The same for its vertical pixel."),
    Chart(
        "Where to put the cameras",
        "theta (deg)",
        "error (m)",
        (
            Series("theta_deg", "H", "H, along", "line"),
            Series("theta_deg", "V", "V, across", "second line"),
            Series("theta_deg", "rms_cross", "rms", "free"),
        ),
        note="Diagonals of the error diamond, and the rms error: their minima differ.",
    ),
    Chart(
        "A ball lit from the side",
        "pixel to the right (px)",
        "brightness",
        (Series("i_px", "light", "all lines of the image", "observation"),),
        note="Each point is a pixel. The centre of intensity moves to the light.",
    ),
)
