"""Where the columns of a filter come from: algebra of gains, state space, least squares, drag.

Here belongs what turns a model of a state and its observations into definitions of a recurrence,
and the derivations of their formulas. Nothing here may compute numbers row by row.
Begin with :func:`kfsheet.estimation.kalman.add_filter`.
"""
