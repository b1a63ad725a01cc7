"""Figures of merit against published and independently computed ones."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, Chip, GeometryError, InputError, gdop
from gfimu.array import seeing_arrays
from gfimu.array.dilution import gdop_lower_bound
from gfimu.array_search.scoring import ranking_remark, score

# Lengths in units of half the cube's edge. κ and GDOP of the tetrahedral cube: GF-IMU paper (1.414, 1.061); the rest
# from a numerical study of the geometries, to the digits given there. Last column: GDOP of [J Q] (none: inf).
FIGURES = {
    "cube12": (1.4142, 1.0607, [0.3536] * 3, [0.5] * 3, 6, 1.0607),
    "cube12_as_built": (1.4142, 1.0607, [0.3536] * 3, [0.5] * 3, 6, 1.0607),
    "corners8": (1.4142, 0.7500, [0.25] * 3, [0.3536] * 3, 6, 0.75),
    "p1_face_diagonals": (1.0, 1.7321, [0.7071] * 3, [0.7071] * 3, 0, math.inf),
    "p2_face_centres": (1.0, 1.7321, [0.7071] * 3, [0.7071] * 3, 0, math.inf),
    "p3_three_plus_one": (2.0360, 1.1988, [0.428, 0.428, 0.429], [0.551, 0.551, 0.527], 6, 1.3463),
    "nap_3_2_2_2": (2.4842, 2.0412, [0.913] * 3, [0.745] * 3, 3, 2.4495),
}
LEAKAGE = {
    "cube12": [0, 0, 0, 0, 0, 0],
    "cube12_as_built": [0, 0, 0, 0, 0, 0],
    "corners8": [0, 0, 0, 0, 0, 0],
    "p1_face_diagonals": [0, 0, 0, 1, 1, 1],
    "p2_face_centres": [1, 1, 1, 0, 0, 0],
    "nap_3_2_2_2": [1 / 3] * 3 + [4 / 9] * 3,
}


def uniaxial(places, axes):
    return AccelerometerArray(
        "six",
        tuple(
            Chip(f"a{i}", np.array(r, float), np.array([a])) for i, (r, a) in enumerate(zip(places, axes, strict=True))
        ),
        1.0,
    )


def triads(*places):
    return AccelerometerArray(
        "triads", tuple(Chip(f"a{i}", np.array(r, float), np.eye(3)) for i, r in enumerate(places)), 1.0
    )


@pytest.mark.parametrize("name", FIGURES)
def test_shipped_arrays_have_the_published_figures(name):
    condition, dilution, sigma_alpha, sigma_p, rank, joint = FIGURES[name]
    (found,) = score(name)
    assert found.length_unit_m == 0.05
    assert found.condition_number == pytest.approx(condition, abs=5e-5)
    assert found.gdop == pytest.approx(dilution, abs=5e-5)
    np.testing.assert_allclose(found.sigma_alpha, sigma_alpha, atol=5e-4)
    np.testing.assert_allclose(found.sigma_p, sigma_p, atol=5e-4)
    assert found.null_space_rank == rank
    assert found.gdop_joint == pytest.approx(joint, abs=5e-5)


@pytest.mark.parametrize("name", LEAKAGE)
def test_what_the_rate_leaves_in_the_linear_solution(name):
    (found,) = score(name)
    np.testing.assert_allclose(found.omega_squared_leakage, LEAKAGE[name], atol=1e-12)


def test_the_three_plus_one_structure_leaves_every_row_contaminated():
    (found,) = score("p3_three_plus_one")
    assert len(found.omega_squared_terms) == 6
    assert found.omega_squared_leakage[:3].max() == pytest.approx(0.25, abs=0.005)
    assert found.omega_squared_leakage[3:].max() == pytest.approx(0.47, abs=0.005)


def test_terms_are_named_with_sign_and_axes():
    terms = score("p1_face_diagonals")[0].omega_squared_terms
    assert terms == {"p_x": "+1·ωyωz", "p_y": "+1·ωxωz", "p_z": "+1·ωxωy"}
    assert score("p2_face_centres")[0].omega_squared_terms["alpha_z"] == "+1·ωxωy"


@pytest.mark.parametrize(
    ("array", "condition", "dilution", "joint"),
    [
        (triads([-1, -1, -1], [1, -1, -1], [-1, 1, -1], [1, 1, 1]), 1.966, 1.1326, 1.5811),
        (triads([-1, -1, -1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]), 2.236, 1.2550, 1.936),
        (triads([1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]), 1.414, 1.1726, None),
    ],
)
def test_other_quadruples_of_chips(array, condition, dilution, joint):
    (found,) = score(array)
    assert found.condition_number == pytest.approx(condition, abs=5e-4)
    assert found.gdop == pytest.approx(dilution, abs=5e-5)
    if joint is not None:
        assert found.gdop_joint == pytest.approx(joint, abs=5e-4)


def test_origin_at_the_centroid_frees_p_from_the_rate():
    (found,) = score(triads([-1, -1, -1], [1, -1, -1], [-1, 1, -1], [0, 0, 1]).relative_to([-0.25, -0.25, -0.5]))
    assert found.condition_number == pytest.approx(1.349, abs=5e-4)
    assert found.gdop == pytest.approx(1.1407, abs=5e-5)
    np.testing.assert_array_equal(found.omega_squared_leakage[3:], 0.0)
    assert found.omega_squared_leakage[:3].any()


def test_face_diagonals_have_two_good_sign_choices_of_64():
    faces = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    count = {}
    for signs in itertools.product((1, -1), repeat=6):
        axes = []
        for face, sign in zip(faces, signs, strict=True):
            normal = int(np.argmax(np.abs(face)))
            axis = np.zeros(3)
            axis[(normal + 1) % 3], axis[(normal + 2) % 3] = 1, sign
            axes.append(axis / np.sqrt(2))
        try:
            figure = round(score(uniaxial(faces, axes))[0].gdop, 4)
        except GeometryError:
            figure = None
        count[figure] = count.get(figure, 0) + 1
    assert count == {1.7321: 2, 3.0: 24, None: 38}


def test_length_unit_changes_the_figures_as_it_must():
    # With lengths in metres: h = 0.05 m gives κ = 14.14 and GDOP = 12.28 (GDOP² = 3/(8h²) + 3/4).
    (found,) = score("cube12", length_unit_m=1.0)
    assert found.condition_number == pytest.approx(14.14, abs=0.005)
    assert found.gdop == pytest.approx(12.28, abs=0.005)


def test_sigma_is_the_scatter_of_the_solution():
    from gfimu import motion_from_readings

    array = AccelerometerArray.load("mimu4444")
    noise = np.random.default_rng(5).normal(size=(40_000, array.n_channels))
    estimate = motion_from_readings(array, noise, np.zeros(3))
    (found,) = score(array)
    # 40 000 draws: standard error 0.35 %; four of them.
    np.testing.assert_allclose(estimate.alpha.std(axis=0) * array.length_unit, found.sigma_alpha, rtol=0.015)
    np.testing.assert_allclose(estimate.p.std(axis=0), found.sigma_p, rtol=0.015)


def test_rate_bound_stands_at_the_given_speed_and_noise():
    (slow, fast) = (score("cube12", omega_rad_s=[0, 0, w], noise_m_s2=0.02)[0] for w in (2.0, 20.0))
    sigma_alpha = 0.02 / (math.sqrt(8) * 0.05)
    np.testing.assert_allclose(slow.rate_bound_rad_s, np.array([1, 1, 0.5]) * sigma_alpha / 2.0)
    np.testing.assert_allclose(fast.rate_bound_rad_s, slow.rate_bound_rad_s / 10)


def reference_gdop(places, axes):
    j = np.concatenate([np.cross(places, axes), axes], axis=-1)
    return np.sqrt(np.trace(np.linalg.inv(np.swapaxes(j, -1, -2) @ j), axis1=-2, axis2=-1))


@pytest.mark.parametrize("n", [3, 4, 9])
def test_gdop_of_many_triads_equals_the_inverse(n):
    places = np.random.default_rng(n).uniform(-1, 1, (500, n, 3))
    axes = np.broadcast_to(np.tile(np.eye(3), (n, 1)), (500, 3 * n, 3))
    expected = reference_gdop(np.repeat(places, 3, axis=1), axes)
    np.testing.assert_allclose(gdop(places), expected, rtol=1e-9)
    np.testing.assert_allclose(gdop(np.repeat(places, 3, axis=1), axes[0]), expected, rtol=1e-9)
    np.testing.assert_allclose(gdop(places * 0.05, length_unit_m=0.05), expected, rtol=1e-9)


def test_gdop_of_many_uniaxial_geometries_equals_the_inverse():
    rng = np.random.default_rng(2)
    places = rng.uniform(-1, 1, (500, 8, 3))
    axes = rng.normal(size=(500, 8, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    np.testing.assert_allclose(gdop(places, axes), reference_gdop(places, axes), rtol=1e-7)


def test_gdop_of_blind_geometries_is_infinite():
    line = np.outer([-1.0, 0.0, 1.0, 2.0], [1.0, 2.0, 3.0])
    assert np.isinf(gdop(line)).all()
    assert np.isinf(gdop(np.eye(3).repeat(2, 0), np.eye(3).repeat(2, 0))).all()


@given(seed=st.integers(0, 2**32 - 1))
def test_turning_the_body_changes_no_gdop(seed):
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1, 1, (1, 4, 3))
    turned = places @ Rotation.random(rng=rng).as_matrix().T
    np.testing.assert_allclose(gdop(turned), gdop(places), rtol=1e-6)


def test_no_quadruple_in_the_cube_beats_the_tetrahedron():
    # Bound of docs/theory/geometry.md: GDOP² ≥ 9/24 + 3/4 = 9/8 for four tri-axial chips inside [−1, 1]³.
    assert gdop_lower_bound(4) == pytest.approx(math.sqrt(9 / 8))
    rng = np.random.default_rng(0)
    random = gdop(rng.uniform(-1, 1, (100_000, 4, 3)))
    assert random.min() > gdop_lower_bound(4)
    lattice = np.array([p for p in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(p)])
    symmetric = gdop(lattice[np.array(list(itertools.combinations(range(26), 4)))])
    assert symmetric.min() == pytest.approx(gdop_lower_bound(4), abs=1e-12)
    assert np.sum(symmetric < gdop_lower_bound(4) + 1e-9) == 2  # the two sets of alternate corners
    # Small moves of the tetrahedron's chips inside the cube never help either.
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    moved = np.clip(corners + rng.normal(size=(20_000, 4, 3)) * 0.05, -1, 1)
    assert gdop(moved).min() >= gdop_lower_bound(4) - 1e-12


def test_every_shipped_array_is_scored_and_written_plainly():
    for entry in score(seeing_arrays()):
        content = entry.to_dict()
        assert {
            "name",
            "condition_number",
            "gdop",
            "sigma_alpha",
            "sigma_p",
            "omega_squared_leakage",
            "null_space_rank",
        } <= (content.keys())


def test_bad_arguments_are_refused():
    with pytest.raises(InputError, match="length unit"):
        score("cube12", length_unit_m=0.0)
    with pytest.raises(InputError, match="angular rate"):
        score("cube12", omega_rad_s=[1, 2])
    with pytest.raises(InputError, match="noise_std"):
        score("cube12", noise_m_s2=-1.0)
    with pytest.raises(GeometryError, match="can't see angular acceleration about x"):
        score(triads([1, 0, 0], [-1, 0, 0]))
    with pytest.raises(InputError, match="positions of shape"):
        gdop(np.zeros((4, 2)))
    with pytest.raises(InputError, match="axes of shape"):
        gdop(np.zeros((4, 3)), np.zeros((5, 3)))


def figures_of(matrix):
    """κ and GDOP of a regression matrix (c, 6)."""
    return np.linalg.cond(matrix), math.sqrt(np.trace(np.linalg.inv(matrix.T @ matrix)))


def test_the_printed_j_has_one_column_twice():
    """GF-IMU paper, printed J: its second column has the same non-zero entries as the third."""
    array = AccelerometerArray.load("cube12")
    derived = array.regression_matrix / np.array([0.05] * 3 + [1.0] * 3)
    assert figures_of(derived) == pytest.approx((1.4142, 1.0607), abs=5e-5)
    for signs in itertools.product((1.0, -1.0), repeat=2):  # those of the print are lost: they change neither figure
        printed = derived.copy()
        printed[1] = derived[2] * [*signs, 1.0, 1.0, 1.0, 1.0]
        assert figures_of(printed) == pytest.approx((2.0236, 1.1146), abs=5e-5)
    assert "print has one column twice" in array.description


def test_kappa_of_p1_and_p2_is_below_the_cubes():
    """The paper's appendix claims a larger κ and GDOP for every alternative; for κ that is false of P1 and P2."""
    cube, p1, p2, p3 = score(["cube12", "p1_face_diagonals", "p2_face_centres", "p3_three_plus_one"])
    assert p1.condition_number == pytest.approx(1.0)
    assert p2.condition_number == pytest.approx(1.0)
    assert p3.condition_number > cube.condition_number > 1.0
    assert min(p1.gdop, p2.gdop, p3.gdop) > cube.gdop
    remark = ranking_remark([cube, p1, p2, p3])
    assert "p1_face_diagonals, p2_face_centres have a lower κ but a larger GDOP than cube12" in remark
    assert ranking_remark([cube, p3]) == ""
    assert ranking_remark([]) == ""
    # P1 is only partly recursive: its angular acceleration needs no rate.
    assert set(p1.omega_squared_terms) == {"p_x", "p_y", "p_z"}


def test_table_in_the_docs_is_what_the_code_computes(project_root):
    rows = [
        [cell.strip() for cell in line.strip("| \n").split("|")]
        for line in (project_root / "docs" / "theory" / "geometry.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("| `") and line.count("|") == 8  # other tables of the page are narrower
    ]
    assert {row[0].strip("`") for row in rows} == set(seeing_arrays())
    for name, channels, condition, dilution, joint, left, seen in rows:
        (found,) = score(name.strip("`"))
        assert int(channels) == found.n_channels
        assert condition == f"{found.condition_number:.4f}"
        assert dilution == f"{found.gdop:.4f}"
        assert joint == ("–" if math.isinf(found.gdop_joint) else f"{found.gdop_joint:.4f}")
        parts = [
            symbol
            for symbol, rows_of in (("α", slice(0, 3)), ("p", slice(3, 6)))
            if found.omega_squared_leakage[rows_of].any()
        ]
        assert left == (", ".join(parts) or "none")
        assert int(seen) == found.null_space_rank
