"""What a cell of a submission may hold."""

from kfsheet.parsing.calculator import Content, Formula

__all__ = ["Content", "Formula"]
