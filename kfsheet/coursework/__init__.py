"""Assignments for every student, and their grading.

``handout`` makes the files, ``reading`` finds the answers in what comes back, ``judging`` says what
each is worth, ``reports`` writes the tables. Nothing here may define an exercise.
Begin with :mod:`kfsheet.coursework.handout.handouts` and :mod:`kfsheet.coursework.reports.grading`.
"""
