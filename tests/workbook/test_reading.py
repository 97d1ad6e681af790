"""What cells of a file hold, as the programs of this world write them."""

import pytest
from odd_workbooks import zipped

from kfsheet.errors import UnreadableFileError
from kfsheet.parsing.calculator import Formula
from kfsheet.workbook.reading.archive import SUBMISSION, Container, readable
from kfsheet.workbook.reading.book import read_book
from kfsheet.workbook.reading.plain_xml import serial_of_date

HEAD = b'<?xml version="1.0" encoding="UTF-8"?>'
MAIN = b"http://schemas.openxmlformats.org/spreadsheetml/2006/main"
RELATIONS = b"http://schemas.openxmlformats.org/officeDocument/2006/relationships"
PACKAGE = b"http://schemas.openxmlformats.org/package/2006/relationships"


def relations(*items):
    inner = b"".join(
        b'<Relationship Id="r%d" Type="%s/%s" Target="%s"/>' % (n, RELATIONS, kind, target)
        for n, (kind, target) in enumerate(items, 1)
    )
    return b'%s<Relationships xmlns="%s">%s</Relationships>' % (HEAD, PACKAGE, inner)


def parts(rows=b"", strings=b"", names=b""):
    """The parts of a workbook of one worksheet S."""
    return {
        "_rels/.rels": relations((b"officeDocument", b"xl/workbook.xml")),
        "xl/_rels/workbook.xml.rels": relations(
            (b"worksheet", b"worksheets/sheet1.xml"), (b"sharedStrings", b"sharedStrings.xml")
        ),
        "xl/workbook.xml": b'%s<workbook xmlns="%s" xmlns:r="%s"><sheets><sheet name="S" '
        b'sheetId="1" r:id="r1"/></sheets><definedNames>%s</definedNames></workbook>'
        % (HEAD, MAIN, RELATIONS, names),
        "xl/sharedStrings.xml": b'%s<sst xmlns="%s">%s</sst>' % (HEAD, MAIN, strings),
        "xl/worksheets/sheet1.xml": b'%s<worksheet xmlns="%s" xmlns:mc="m"><sheetData>%s'
        b"</sheetData></worksheet>" % (HEAD, MAIN, rows),
    }


def book_of(rows=b"", strings=b"", names=b""):
    return read_book(Container(zipped(parts(rows, strings, names))))


def cells(*inner, strings=b""):
    """What stands in A1, A2, ..., from the elements of the cells."""
    rows = b"".join(b'<row r="%d">%s</row>' % (n, cell) for n, cell in enumerate(inner, 1))
    found = book_of(rows, strings).sheets["S"]
    return [found.get((n, 1)) for n in range(1, len(inner) + 1)]


def test_constants_of_every_type():
    rich = b"<si><r><t>ri</t></r><r><t>ch</t></r><rPh sb='0' eb='1'><t>noise</t></rPh></si>"
    assert cells(
        b'<c r="A1"><v>1.5</v></c>',
        b'<c r="A2" t="s"><v>1</v></c>',
        b'<c r="A3" t="inlineStr"><is><r><t>in</t></r><r><t>line</t></r></is></c>',
        b'<c r="A4" t="inlineStr"><is><t>text</t><rPh sb="0" eb="1"><t>noise</t></rPh></is></c>',
        b'<c r="A5" t="b"><v>1</v></c>',
        b'<c r="A6" t="str"><v>words</v></c>',
        b'<c r="A7" t="d"><v>1900-03-01T12:00:00Z</v></c>',
        b'<c r="A8"/>',
        b'<c r="A9" t="b"><v>false</v></c>',
        strings=b"<si><t>zero</t></si>" + rich,
    ) == [1.5, "rich", "inline", "text", True, "words", 61.5, None, False]


def test_an_error_that_was_typed_is_one_to_who_refers_to_it():
    assert cells(b'<c r="A1" t="e"><v>#N/A</v></c>') == [Formula("=#N/A", (1, 1))]


def test_no_stored_value_of_a_formula_is_kept_whatever_its_kind():
    found = cells(
        b'<c r="A1"><f>1+1</f><v>9</v></c>',
        b'<c r="A2" t="str"><f>"a"</f><v>b</v></c>',
        b'<c r="A3"><f t="shared" si="0"/><v>9</v></c>',
        b'<c r="A4"><f t="shared" si="0" ref="A3:A5">B4*2</f><v>9</v></c>',
        b'<c r="A5"><f t="shared" si="0"/><v>9</v></c>',
        b'<c r="A6" cm="1"><f t="array" ref="A6:A7">B1:B2</f><v>9</v></c>',
        b'<c r="A7"><v>9</v></c>',
        b'<c r="A8"><f t="dataTable" ref="A8:A9" dt2D="0" dtr="0" r1="B1"/><v>9</v></c>',
    )
    filled = Formula("=B4*2", (4, 1))
    assert found[:6] == [
        Formula("=1+1", (1, 1)),
        Formula('="a"', (2, 1)),
        filled,
        filled,
        filled,
        Formula("=B1:B2", (6, 1), (6, 1, 7, 1)),
    ]
    assert isinstance(found[7], Formula)
    assert found[7].area == (8, 1, 9, 1)


def test_of_alternatives_the_one_that_excel_takes_is_read():
    inner = b'<mc:Choice Requires="x"><row r="1"><c r="A1"><v>1</v></c></row></mc:Choice>'
    inner += b'<mc:Fallback><row r="1"><c r="A1"><v>2</v></c></row></mc:Fallback>'
    book = book_of(b"<mc:AlternateContent>" + inner + b"</mc:AlternateContent>")
    assert book.sheets["S"] == {(1, 1): 1.0}


def test_names_of_the_workbook_and_of_a_worksheet():
    names = b'<definedName name="Dt">S!$A$1</definedName>'
    names += b'<definedName name="dt" localSheetId="0">S!$A$2</definedName>'
    book = book_of(names=names)
    assert (book.names, book.sheet_names) == ({"dt": "S!$A$1"}, {("S", "dt"): "S!$A$2"})


@pytest.mark.parametrize(
    ("more", "status"),
    [
        ({"XL/Workbook.xml": b"x"}, "refused"),
        ({"xl\\workbook.xml": b"x"}, "refused"),
        ({"xl/work%62ook.xml": b"x"}, "refused"),
        ({"%2e%2e/evil.xml": b"x"}, "refused"),
        ({"/root.xml": b"x"}, "refused"),
        ({"xl/workbook.xml": b"<!DOCTYPE x><workbook/>"}, "refused"),
        ({"xl/workbook.xml": '<!DOCTYPE x><workbook xmlns="m"/>'.encode("utf-16")}, "refused"),
        ({"xl/workbook.xml": b'<document xmlns="m"/>'}, "wrong kind"),
        ({"_rels/.rels": relations((b"officeDocument", b"xl/workbook.bin"))}, None),
        ({f"{n}.xml": b"" for n in range(500)}, "too large"),
    ],
)
def test_tricks_end_as_a_status(more, status):
    def read():
        with readable():
            return read_book(Container(zipped({**parts(), **more}), SUBMISSION))

    if status is None:
        assert read().sheets == {"S": {}}
    else:
        with pytest.raises(UnreadableFileError) as raised:
            read()
        assert raised.value.status == status


@pytest.mark.parametrize(
    ("text", "number"),
    [("1900-03-01", 61), ("2026-11-28T06:00:00", 46354.25), ("12:00:00", 0.5)],
)
def test_dates_are_numbers(text, number):
    assert serial_of_date(text) == number
