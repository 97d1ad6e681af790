"""One run of a recurrence: generated Python source, or machine code of it.

Here belongs what turns a recurrence into a function and a table of numbers, and a chart into a
plot. Nothing here may know of many members; that is :mod:`kfsheet.ensemble`.
Begin with :func:`kfsheet.evaluation.evaluate.evaluate`.
"""
