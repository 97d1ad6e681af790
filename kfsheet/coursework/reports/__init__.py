"""From a folder of submissions to tables, pages and marked files.

Here belongs what puts marks together and shows them to a lecturer, a student or a platform.
Nothing here may decide a mark. Begin with :mod:`kfsheet.coursework.reports.grading`.
"""
