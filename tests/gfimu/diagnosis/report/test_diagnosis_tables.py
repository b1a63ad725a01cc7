"""The tables of a verdict that the command prints: each cause with its numbers, and what stays in the residual."""

from made_diagnoses import made_diagnosis

from gfimu.base import Table
from gfimu.diagnosis import diagnosis_tables


def test_the_tables_name_every_cause_with_its_size():
    diagnosis = made_diagnosis()
    tables = [block for block in diagnosis_tables(diagnosis) if isinstance(block, Table)]
    cells = [str(cell) for table in tables for row in table.rows for cell in row]
    assert diagnosis.causes
    for cause in diagnosis.causes:
        assert any(cause.effect in cell for cell in cells), cause.effect
    assert any("±" in cell for cell in cells)
