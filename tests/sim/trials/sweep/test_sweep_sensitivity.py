"""Sensitivity indices of campaigns, against functions whose indices are known exactly."""

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import sobol_indices

from sim.trials import Design, load_plan, seed_shares, sensitivities

ISHIGAMI_FIRST, ISHIGAMI_TOTAL = (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437)
"""Of sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1, x in ±π (Ishigami & Homma, 1990)."""

RANGE = "[factors.x{0}]\nlow = -3.141592653589793\nhigh = 3.141592653589793\n"
THREE = "".join(RANGE.format(k) for k in (1, 2, 3))
LISTS = '[factors]\na = [0, 1, 2]\nb = ["no", "yes"]\nc = [1.5, 2.5]\n'


def ishigami(values, rng):
    x = [values[f"x{k}"] for k in (1, 2, 3)]
    return np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])


def categorical(values, rng):
    """a + 2 b + a b, with a = 0, 1, 2 and b = 0, 1; c does nothing."""
    b = values["b"] == "yes"
    return values["a"] + 2.0 * b + values["a"] * b


# Exactly: Var(a + a/2) = 1.5², times 2/3; Var(2 b + b) = 3², times 1/4; the interaction (a − 1)(b − ½) has 2/3 · 1/4.
PARTS = np.array([1.5, 2.25, 1.0 / 6.0])
CATEGORICAL_FIRST = [PARTS[0] / PARTS.sum(), PARTS[1] / PARTS.sum(), 0.0]
CATEGORICAL_TOTAL = [(PARTS[0] + PARTS[2]) / PARTS.sum(), (PARTS[1] + PARTS[2]) / PARTS.sum(), 0.0]


def campaign(tmp_path, plan, function, noise=0.0, missing=()):
    """Rows of a plan, as a campaign has them."""
    path = tmp_path / "plan.toml"
    path.write_text(plan)
    design = Design(load_plan(path))
    rows = []
    for number in range(len(design)):
        case = design[number]
        rng = np.random.default_rng([case.seed, number])
        value = function(case.values, rng) + noise * rng.standard_normal()
        row = {"case": number, "seed": case.seed, **case.values, "failure": "", "y_m": float(value)}
        rows.append(row if number not in missing else row | {"failure": "broke", "y_m": None})
    return pa.Table.from_pylist(rows), design


def indices(found):
    return np.array([one.first for one in found]), np.array([one.total for one in found])


def inside(found, first, total=None, widths=1.5):
    """Whether the exact indices are within so many half intervals of the found ones."""
    for one, exact in zip(found, first, strict=True):
        assert abs(one.first - exact) <= widths * (one.first_high - one.first) + 1e-9, one
    for one, exact in zip(found, total or [], strict=total is not None):
        assert abs(one.total - exact) <= widths * (one.total_high - one.total) + 1e-9, one


def test_saltelli_finds_the_indices_of_ishigamis_function(tmp_path):
    table, design = campaign(tmp_path, f'design = "saltelli"\npoints = 1024\n{THREE}', ishigami)
    assert len(design) == 1024 * 5
    found = sensitivities(table, design)
    first, total = indices(found)
    assert first == pytest.approx(ISHIGAMI_FIRST, abs=0.03)
    assert total == pytest.approx(ISHIGAMI_TOTAL, abs=0.03)
    inside(found, ISHIGAMI_FIRST, ISHIGAMI_TOTAL)
    assert all(one.method == "saltelli" and one.points == 1024 for one in found)
    y = table["y_m"].to_numpy().reshape(1024, 5)
    other = sobol_indices(func={"f_A": y[None, :, 0], "f_B": y[None, :, 1], "f_AB": y[:, 2:].T[:, None]}, n=1024)
    assert first == pytest.approx(other.first_order, abs=1e-9)
    assert total == pytest.approx(other.total_order, abs=1e-9)


def test_failed_cases_leave_their_base_point_out(tmp_path):
    plan = f'design = "saltelli"\npoints = 256\n{THREE}'
    table, design = campaign(tmp_path, plan, ishigami, missing={0, 7, 8})
    found = sensitivities(table, design)
    assert {one.points for one in found} == {254}
    inside(found, ISHIGAMI_FIRST, ISHIGAMI_TOTAL, widths=2.0)
    part = sensitivities(table.slice(0, 403), design)  # of a campaign that runs
    assert {one.points for one in part} == {78}


@pytest.mark.parametrize("kind", ["sobol", "random", "latin_hypercube"])
def test_any_design_gives_first_order_indices(tmp_path, kind):
    table, design = campaign(tmp_path, f'design = "{kind}"\npoints = 1024\n{THREE}', ishigami)
    found = sensitivities(table, design)
    inside(found, ISHIGAMI_FIRST)
    assert indices(found)[0] == pytest.approx(ISHIGAMI_FIRST, abs=0.06)
    assert {one.method for one in found} == {"given data"}
    assert all(np.isnan(one.total) for one in found)


def test_the_bias_of_many_bins_is_removed(tmp_path):
    """Of pure noise every index is zero in the mean; the plain correlation ratio is bins over points, 1/8."""
    plan = f'design = "random"\npoints = 256\nseed = {{}}\n{THREE}'
    found = [
        one.first
        for seed in range(20)
        for one in sensitivities(*campaign(tmp_path, plan.format(seed), lambda v, rng: rng.standard_normal()))
    ]
    assert np.mean(found) == pytest.approx(0.0, abs=4 * np.std(found) / np.sqrt(len(found)))
    assert np.std(found) < 0.05


def test_intervals_cover(tmp_path):
    """Of x1 + noise the index is ½; the 95 % interval holds it in 54 of 60 or more (binomial, 2 %)."""
    plan = f'design = "random"\npoints = 256\nseed = {{}}\n{THREE}'
    spread = np.pi / np.sqrt(3.0)
    hits = 0
    for seed in range(60):
        one = sensitivities(*campaign(tmp_path, plan.format(seed), lambda v, rng: v["x1"], noise=spread))[0]
        hits += one.first_low <= 0.5 <= one.first_high
    assert hits >= 53


@pytest.mark.parametrize(
    ("head", "total"),
    [
        ("", None),
        ('design = "saltelli"\npoints = 512\n', CATEGORICAL_TOTAL),
        ('design = "sobol"\npoints = 512\n', None),
    ],
)
def test_lists_have_indices_too(tmp_path, head, total):
    found = sensitivities(*campaign(tmp_path, head + LISTS, categorical))
    assert [one.factor for one in found] == ["a", "b", "c"]
    assert indices(found)[0] == pytest.approx(CATEGORICAL_FIRST, abs=1e-9 if not head else 0.04)
    if head:
        inside(found, CATEGORICAL_FIRST, total)


def test_seeds_have_their_share(tmp_path):
    """Noise of the variance of the whole function: the seeds cause half; the factors' indices are of the mean."""
    spread = np.sqrt(PARTS.sum())
    table, design = campaign(tmp_path, "repeats = 200\n" + LISTS, categorical, noise=spread)
    assert seed_shares(table, design)["y_m"] == pytest.approx(0.5, abs=0.05)
    found = sensitivities(table, design)
    assert indices(found)[0] == pytest.approx(CATEGORICAL_FIRST, abs=0.05)
    inside(found, CATEGORICAL_FIRST)
    assert seed_shares(*campaign(tmp_path, LISTS, categorical)) == {}


def test_what_does_not_vary_has_no_index(tmp_path):
    assert sensitivities(*campaign(tmp_path, LISTS, lambda values, rng: 1.0)) == []
