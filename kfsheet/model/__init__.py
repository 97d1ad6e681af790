"""What a recurrence is, before anybody computes it.

Here belong the table of named columns, what it consists of (quantities, expressions, names, units),
the rules by which a definition is refused, the order of computation, and an exercise around it.
Nothing here may compute a row, write a file or know of a spreadsheet's cells.
Begin with :class:`kfsheet.model.recurrence.Recurrence`.
"""
