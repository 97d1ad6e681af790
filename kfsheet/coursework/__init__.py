"""Assignments for every student, and their grading."""
