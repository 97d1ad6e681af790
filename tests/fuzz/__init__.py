"""A differential fuzz of marks: random answers, and LibreOffice to say which of them are right.

:mod:`fuzz.question` knows a question's cells, :mod:`fuzz.rewritings` and :mod:`fuzz.mutations`
write answers, :mod:`fuzz.oracle` finds their values, :mod:`fuzz.papers` writes workbooks. Nothing
here may ask our own calculator or the judge what is right. Begin with ``coursework/fuzz_marks.py``.
"""
