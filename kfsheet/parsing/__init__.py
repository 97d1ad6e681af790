"""The way back: the text of a spreadsheet formula as a SymPy expression.

Here belong the grammar (``syntax``), the functions and the references of spreadsheets. Nothing here
may open a file or decide whether a formula is right.
Begin with :func:`kfsheet.parsing.formula.read_formula`.
"""
