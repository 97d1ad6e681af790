"""Workbooks: written, recalculated by others, checked."""
