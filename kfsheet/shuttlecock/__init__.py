"""The parts of the shuttlecock: two filters, and forecasts of the point where it falls.

Numbers of equations in the docstrings are those of Man, Zhao and Hu (2009).
"""
