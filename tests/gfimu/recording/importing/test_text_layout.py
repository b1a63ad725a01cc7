"""The layout of text files is found from the files themselves."""

import numpy as np
import pytest

from gfimu import InputError
from gfimu.recording import TextSpec, table_of_text

LAYOUTS = {
    "comma": ("t,ax,ay\n0.0,1.5,2\n0.1,1.6,3\n", ("t", "ax", "ay")),
    "semicolon and decimal comma": ("t;ax;ay\n0,0;1,5;2\n0,1;1,6;3\n", ("t", "ax", "ay")),
    "two decimal commas": ("t;ax;ay\n0,0;1,5;2,0\n0,1;1,6;3,0\n", ("t", "ax", "ay")),
    "tab": ("t\tax\tay\n0.0\t1.5\t2\n0.1\t1.6\t3\n", ("t", "ax", "ay")),
    "spaces of any width": ("   t    ax  ay\n 0.0   1.5   2\n 0.1  1.6    3\n", ("t", "ax", "ay")),
    "no names": ("0.0,1.5,2\n0.1,1.6,3\n", ("column_1", "column_2", "column_3")),
    "comment with names": ("# made by hand\n# t, ax, ay\n0.0,1.5,2\n0.1,1.6,3\n", ("t", "ax", "ay")),
    "a word before the names": (";Headers,t,ax,ay\n0.0,1.5,2\n0.1,1.6,3\n", ("t", "ax", "ay")),
    "a line of units below a preamble": ("device;7\n\nt;ax;ay\n0.0;1.5;2\n0.1;1.6;3\n", ("t", "ax", "ay")),
    "separator at the end": ("t,ax,ay,\n0.0,1.5,2,\n0.1,1.6,3,\n", ("t", "ax", "ay")),
    "closing semicolon": ("0.0, 1.5, 2;\n0.1, 1.6, 3;\n", ("column_1", "column_2", "column_3")),
    "quotes": ('"t","ax","ay"\n"0.0","1.5","2"\n"0.1","1.6","3"\n', ("t", "ax", "ay")),
    "end of lines of Windows": ("t,ax,ay\r\n0.0,1.5,2\r\n0.1,1.6,3\r\n", ("t", "ax", "ay")),
    "mark of UTF-8": ("\ufefft,ax,ay\n0.0,1.5,2\n0.1,1.6,3\n", ("t", "ax", "ay")),
}


@pytest.mark.parametrize(("text", "names"), LAYOUTS.values(), ids=LAYOUTS)
def test_a_layout_is_found(text, names):
    table = table_of_text(text.encode(), "file")
    assert tuple(table.columns) == names
    assert np.column_stack(list(table.columns.values())) == pytest.approx(np.array([[0.0, 1.5, 2.0], [0.1, 1.6, 3.0]]))
    assert not table.notes


def test_utf_16_is_read():
    table = table_of_text("t\tax\n0\t1\n1\t2\n".encode("utf-16"), "file")
    assert tuple(table.columns) == ("t", "ax")


def test_what_can_not_be_read_is_missing_and_said():
    table = table_of_text(b"t,ax,ay\n0.0,1.5,2\n0.1,oops,3\n0.2,,nan\n0.3,1\n0.4,inf,5\n", "file")
    assert table.columns["ax"] == pytest.approx([1.5, np.nan, np.nan, np.inf], nan_ok=True)
    assert table.columns["ay"] == pytest.approx([2.0, 3.0, np.nan, 5.0], nan_ok=True)
    assert any("1 lines with another number of cells" in note for note in table.notes)
    assert any("column ax: 1 cells are no numbers" in note for note in table.notes)


def test_whole_numbers_of_64_bits_keep_their_digits():
    table = table_of_text(b"stamp,x\n1403636579758555392,1\n1403636579763555584,2\n", "file")
    assert table.columns["stamp"].tolist() == [1403636579758555392, 1403636579763555584]


def test_text_among_numbers_stays_text():
    table = table_of_text(b"t,state,ax\n0.0,on,1\n0.1,off,2\n", "file")
    assert table.columns["state"].tolist() == ["on", "off"]


def test_a_given_layout_overrides():
    given = TextSpec(separator="space", skip_lines=1, columns=("a", "b"))
    table = table_of_text(b"3 4\n1 2\n5 6\n", "file", given)
    assert table.columns["a"].tolist() == [1, 5]


@pytest.mark.parametrize("content", [b"", b"\n\n", b"only words\nand more\n", b"\x00\x01\x02" * 50, b"t,ax\n"])
def test_no_numbers_are_one_line(content):
    with pytest.raises(InputError) as error:
        table_of_text(content, "file")
    assert str(error.value).startswith("file: ")
    assert "\n" not in str(error.value)


def test_a_date_beside_a_decimal_comma_is_one_cell():
    table = table_of_text(b"Time;rpm\n2024-05-17 10:25:14.000;0,5\n2024-05-17 10:25:14.020;1,5\n", "file")
    assert table.columns["Time"].tolist() == ["2024-05-17 10:25:14.000", "2024-05-17 10:25:14.020"]
    assert table.columns["rpm"] == pytest.approx([0.5, 1.5])
