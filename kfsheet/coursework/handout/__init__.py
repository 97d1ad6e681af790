"""A workbook, or a notebook, for every student.

Here belong the secret of a course, own numbers, the sheet Questions and the files.
Nothing here may judge an answer. Begin with :mod:`kfsheet.coursework.handout.handouts`.
"""
