"""One expression in many languages: Excel, Python, LaTeX.

Here belong printers, each a table of functions and a few methods for what its language says
otherwise, and the rules by which a language takes a name. Nothing here may know of a model: a
printer is handed an expression, and names for its symbols.
Begin with :mod:`kfsheet.printing.formula_printer`, which all printers share.
"""
