"""The style that all pages share: every colour that its rules name is there by day and by night."""

from __future__ import annotations

import re
from pathlib import Path

import gfimu
from gfimu.base import chip_colour, css
from gfimu.visual import PAGE, STILL_POLICY, Packed, page_plots, page_style


def test_every_colour_that_a_rule_names_is_defined_by_day_and_by_night():
    text = page_style(2)
    day, night = re.findall(r":root \{ ([^}]*) \}", text)
    named = set(re.findall(r"var\((--[\w-]+)\)", text)) - {"--tone"}
    for file in Path(gfimu.__file__).parent.rglob("*.css"):
        named |= set(re.findall(r"var\((--[\w-]+)\)", file.read_text(encoding="utf-8"))) - {"--tone"}
    for variables in (day, night):
        assert named <= set(re.findall(r"(--[\w-]+):", variables))
    assert f"--chip-1: {css(chip_colour(1, on_paper=True))};" in day
    assert f"--chip-1: {css(chip_colour(1))};" in night
    assert f"--ground: {css(PAGE['dark']['ground'])};" in night
    assert "@media screen and (prefers-color-scheme: dark)" in text  # paper is light


def test_a_page_of_plots_lets_no_more_run_than_its_scripts():
    policy = page_plots({"plots": {}}, Packed())["policy"]
    assert policy.startswith(f"{STILL_POLICY}; script-src 'sha256-")
    assert "script-src" not in STILL_POLICY
