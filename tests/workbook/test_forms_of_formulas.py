"""Forms that formulas take in files: our own engine beside LibreOffice, and by Excel's rules."""

import openpyxl
import pytest
from conftest import need
from openpyxl.workbook.defined_name import DefinedName
from openpyxl.worksheet.formula import ArrayFormula

from kfsheet.workbook.engines.recalculate import recalculate

NAMES = {
    "whole": "Data!$C:$C",
    "above": "Data!$C1048576",  # one row up, seen from A1
    "left": "Data!XFD1",
    "rows": "Data!$C$5:$C$12",
    "factor": "Other!$B$2",
    "double": "2*Other!$B$2",
    "so_far": "Data!$C$5:Data!C1",
    "line": "Data!$A5:$Z5",
    "list": "{1,2,3}",
}
FORMS = {
    "a name of a whole column": "whole*2",
    "a name of rows": "rows*2",
    "the sheet's own name wins": "factor",
    "a name that is a formula": "double+1",
    "a name of rows so far": "SUM(so_far)",
    "a name of a list": "SUM(list)",
    "a whole column": "C:C*2",
    "a column of another sheet": "Other!B:B*1",
    "a whole row": "SUM(5:5)-SUM(D5:XFD5)",
    "a fixed range in its own row": "$C$5:$C$12*2",
    "sheets": "SUM(Jan:Mar!B2)",
    "the average of sheets": "AVERAGE(Jan:Mar!B2)",
    "an intersection": "C5:C12 A{r}:D{r}",
    "an intersection of names": "rows line",
    "up to INDEX": "SUM(C5:INDEX(C:C,{r}))",
    "from INDEX to INDEX": "SUM(INDEX(C:C,5):INDEX(C:C,{r}))",
    "OFFSET": "SUM(OFFSET(C{r},-1,0,2,1))",
    "AGGREGATE": "_xlfn.AGGREGATE(9,6,C$5:C{r})",
    "AGGREGATE over errors": "_xlfn.AGGREGATE(14,6,E$5:E$12,2)",
    "SUMX2MY2": "SUMX2MY2(C$5:C{r},D$5:D{r})",
    "SUMXMY2": "SUMXMY2(C$5:C{r},D$5:D{r})",
    "the last that is there": 'LOOKUP(2,1/(D$5:D{r}<>""),C$5:C{r})',
    "the last number": "LOOKUP(9.99E+307,C$5:C{r})",
    "a product of conditions": "SUMPRODUCT((C$5:C{r}>2)*(D$5:D{r}<9)*C$5:C{r})",
    "a product with minus minus": "SUMPRODUCT(--(C$5:C{r}>2),D$5:D{r})",
    "INDEX without a row": "SUM(INDEX(C5:D12,0,1))",
    "a union": "SUM((C5:C6,D5:D6))",
    "small of a list": "SMALL(C5:C12,{{2}})",
    "an average with conditions": 'AVERAGEIF(C5:C12,">2",D5:D12)',
    "a row's place": "INDEX(C$5:C$12,ROW()-4)",
    "MATCH of a column": "INDEX(D:D,MATCH(C{r},C:C,0))",
    "CHOOSE of ranges": "SUM(CHOOSE(2,C5:C6,D5:D6))",
    "IF of ranges": "SUM(IF(C{r}>2,C5:C6,D5:D6))",
    "a text that holds a number": '"3"*C{r}',
    "an empty cell": "Z99+C{r}",
    "percent": "C{r}%*50%",
    "powers of minus": "-C{r}^2+2^-1",
    "trend": "FORECAST({r},D$5:D$12,C$5:C$12)",
    "N of a text": 'N("a")+C{r}',
    "subtotal": "SUBTOTAL(9,C$5:C{r})",
    "true and false": "(C{r}>2)+TRUE",
    "a sheet in other capitals": "dATA!c{r}+1",
}
OF_EXCEL = {  # LibreOffice does not go round the edge of a worksheet, and reads no quotes here
    "a relative name": ("above+1", lambda row: 2 + (7 * (row - 1)) % 11 / 4),
    "a relative name of a column": ("left+1", lambda row: 3 + (7 * (row - 1)) % 11 / 4),
    "sheets in quotes": ("SUM('Jan:Mar'!B2:B3)", lambda row: 2 * (2 + 3 + 4) + 3 * (2 + 3) / 8),
}
ARRAYS = {
    "an array formula": "C5:C12*D5:D12",
    "one row for all": "C5:D5+C5:C12",
    "TRANSPOSE": "TRANSPOSE(C5:J5)+0*C5",
    "MMULT": "MMULT(C5:D12,{1;2})",
    "IF over rows": 'IF(C5:C12>2,C5:C12,"")',
    "FREQUENCY is short": "SUM(C5:C12)*(D5:D12>3)",
    "a name": "rows+1",
}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Values of all forms in both engines, by the form: rows 6 and 9, or the whole array."""
    need("libreoffice")
    book = openpyxl.Workbook()
    data = book.active
    data.title = "Data"
    for n, title in enumerate(("Other", "Jan", "Feb", "Mar"), 1):
        sheet = book.create_sheet(title)
        for row in range(1, 15):
            sheet.cell(row, 2).value = n + row / 8
    for row in range(5, 13):
        data.cell(row, 1).value = row - 5
        data.cell(row, 3).value = 1 + (7 * row) % 11 / 4
        data.cell(row, 4).value = 0.5 * row
        data.cell(row, 5).value = f"=1/({row}-7)"
    for name, text in NAMES.items():
        book.defined_names[name] = DefinedName(name, attr_text=text)
    data.defined_names["factor"] = DefinedName("factor", attr_text="Data!$C$7")
    places = {}
    forms = {form: formula for form, (formula, _) in OF_EXCEL.items()} | FORMS
    for column, (form, formula) in enumerate(forms.items(), 30):
        for row in (6, 9):
            data.cell(row, column).value = "=" + formula.format(r=row)
        places[form] = [(row, column) for row in (6, 9)]
    for column, (form, formula) in enumerate(ARRAYS.items(), 120):
        letters = openpyxl.utils.get_column_letter(column)
        data[f"{letters}5"] = ArrayFormula(f"{letters}5:{letters}12", "=" + formula)
        places[form] = [(row, column) for row in range(5, 13)]
    path = tmp_path_factory.mktemp("forms") / "forms.xlsx"
    book.save(path)
    values = {engine: recalculate(path, engine)["Data"] for engine in ("own", "libreoffice")}
    return {
        form: [[of.get(cell) for cell in cells] for of in values.values()]
        for form, cells in places.items()
    }


@pytest.mark.parametrize("form", [*FORMS, *ARRAYS])
def test_our_own_engine_calculates_it_as_libreoffice_does(form, found):
    ours, theirs = found[form]
    assert None not in ours
    theirs = ["" if value is None else value for value in theirs]  # as openpyxl reads a text
    for mine, value in zip(ours, theirs, strict=True):
        if isinstance(value, str):
            assert mine == value or (value.startswith("#") and str(mine).startswith("#"))
        else:
            assert mine == pytest.approx(value, rel=1e-12), (ours, theirs)


@pytest.mark.parametrize("form", OF_EXCEL)
def test_our_own_engine_calculates_it_as_excel_does(form, found):
    assert found[form][0] == pytest.approx([OF_EXCEL[form][1](row) for row in (6, 9)])
