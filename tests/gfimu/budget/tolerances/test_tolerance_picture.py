"""The picture of a tolerance budget: axes of errors have plain numbers that fit beside each other."""

import re

import gfimu


def test_axes_of_less_than_a_decade_have_plain_numbers(tmp_path):
    out = tmp_path / "budget.svg"
    gfimu.tolerance("mimu4444", calibrated=["rest", "poses"], closed_form=True, picture=out)
    shown = re.findall(r"<!-- (.*?) -->", out.read_text())
    assert not [text for text in shown if "10^" in text]
    axis = [text for text in shown if re.fullmatch(r"[\d.]+", text)]
    assert len(axis) >= 4 * 3
