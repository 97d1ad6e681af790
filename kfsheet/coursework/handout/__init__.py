"""A workbook, or a notebook, for every student.

Here belong the secret of a course, own numbers, the sheet Questions and the files.
Nothing here may judge an answer. Begin with
:func:`kfsheet.coursework.handout.handout_workbook.handout_of_run`.
"""
