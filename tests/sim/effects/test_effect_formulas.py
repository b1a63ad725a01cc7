"""Each formula of the catalogue of effects, evaluated, agrees with the simulation: it is what the code does."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray
from gfimu.model.generic_basis import Motion, basis_function
from gfimu.motion import BodyDrive
from sim import SpinState, forward
from sim.body import body_channels
from sim.effects import BODY_EFFECTS, CARRIAGE_EFFECTS, INCLINED_EFFECTS, SIMULATED_EFFECTS, TABLE_EFFECTS, describe
from sim.effects.mounting import RailTilt
from sim.effects.unknown import Unknown
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.twin import Twin
from sim.world import World

SCRIPT = Path(__file__).resolve().parents[3] / "docs" / "scripts" / "effect_formulas.py"
SPECIFICATION = importlib.util.spec_from_file_location("effect_formulas", SCRIPT)
formulas = importlib.util.module_from_spec(SPECIFICATION)
SPECIFICATION.loader.exec_module(formulas)

STEP = 1e-3  # s
T = np.arange(0.0, 6.0, STEP)
INSIDE = slice(60, -60)  # derivatives at the ends are one-sided
ARRAY = AccelerometerArray.load("cube12")
OFFSET = np.array([0.0, 0.0, 0.06])
WARMING = 25.0 + 4.0 * -np.expm1(-T / 2.0)

TOLERANCE, BY_CHANCE = formulas.TOLERANCE, formulas.BY_CHANCE


class Swinging:
    """A smooth spin in one direction and then the other, with no angular acceleration at the start."""

    def at(self, t):
        t = np.asarray(t, dtype=float)
        return SpinState(
            1.3 * t + 4.0 * np.sin(1.1 * t) / 1.1 + 0.3 * (t - np.sin(7.0 * t) / 7.0),
            1.3 + 4.0 * np.cos(1.1 * t) + 0.3 * (1.0 - np.cos(7.0 * t)),
            -4.4 * np.sin(1.1 * t) + 2.1 * np.sin(7.0 * t),
        )


class Vec:
    """Vectors, shape (…, 3): ``*`` scales, or is the scalar product; ``@`` is the vector product."""

    __array_ufunc__ = None

    def __init__(self, parts):
        self.parts = np.asarray(parts, dtype=float)

    def __add__(self, other):
        return Vec(self.parts + other.parts)

    def __sub__(self, other):
        return Vec(self.parts - other.parts)

    def __neg__(self):
        return Vec(-self.parts)

    def __mul__(self, other):
        if isinstance(other, Vec):
            return np.sum(self.parts * other.parts, axis=-1)
        return Vec(self.parts * np.asarray(other)[..., None])

    __rmul__ = __mul__

    def __matmul__(self, other):
        return Vec(np.cross(self.parts, other.parts))


class Names(dict):
    """Values by name; a name that ends in ``_dot`` or ``_dot2`` is a derivative by time of another one."""

    def __missing__(self, name):
        for mark, order in (("_dot2", 2), ("_dot", 1)):
            if mark in name:
                value = self[name.replace(mark, "")]
                parts = value.parts if isinstance(value, Vec) else np.asarray(value)
                for _ in range(order):
                    parts = np.gradient(parts, STEP, axis=0, edge_order=2)
                return Vec(parts) if isinstance(value, Vec) else parts
        raise KeyError(name)


def turn(vector, angle):
    """Turn vectors about z."""
    x, y, z = np.moveaxis(vector.parts, -1, 0)
    cos, sin = np.cos(angle), np.sin(angle)
    return Vec(np.stack(np.broadcast_arrays(cos * x - sin * y, sin * x + cos * y, z), axis=-1))


def backlash(reading, width):
    """Follow a reading once a backlash of this half-width is taken up."""
    out = np.array(reading)
    for row in range(1, len(out)):
        out[row] = np.clip(out[row - 1], reading[row] - width, reading[row] + width)
    return out


def hold(reading, start, stop):
    """Hold the last value before the start until the stop."""
    held, frozen = reading.copy(), (start <= T) & (stop > T)
    held[frozen] = reading[np.argmax(frozen) - 1]
    return held


FUNCTIONS = {"turn": turn, "backlash": backlash, "hold": hold} | {
    name: getattr(np, name) for name in ("sin", "cos", "exp", "abs", "clip", "round", "sqrt", "mean")
}


def keys_of(pattern, array):
    """Return the value of the parameters that a pattern of keys names."""
    chips = [chip.name for chip in array.chips]
    if "{neighbour}" in pattern:
        return pattern  # one of many pairs: the test of that effect takes it
    if "{channel}" in pattern:
        return [pattern.replace("{channel}", name) for name in array.channels]
    if "{chip}_{axis}" in pattern:
        return [[pattern.format(chip=chip, axis=axis) for axis in "xyz"] for chip in chips]
    if "{chip}" in pattern:
        return [pattern.format(chip=chip) for chip in chips]
    for axes in ("x,y,z", "x,y"):
        if f"{{{axes}}}" in pattern:
            return [pattern.replace(f"{{{axes}}}", axis) for axis in "xyz"]
    return pattern


def symbol_values(effect, array):
    """Return the values of the symbols of an effect's formula."""
    values = {}
    for symbol, pattern in describe(type(effect)).symbols.items():
        factor, key = (2.0 * np.pi, pattern[3:]) if pattern.startswith("2π·") else (1.0, pattern)
        keys = keys_of(key, array)
        if isinstance(keys, str):
            value = factor * effect.value(keys) if isinstance(effect.parameters.get(keys), float | int) else None
        else:
            value = np.array([effect.vector(one) if isinstance(one, list) else effect.value(one) for one in keys])
            if "{chip}" in pattern:
                value = value[array.chip_of_channel]
            value = Vec(value) if "{axis}" in pattern or "{x,y" in pattern else value
        for name in formulas.to_python(f"{symbol} = 0")[0].split(", "):
            values[name] = value
    return values


def compare(formula, names, scale, tolerance):
    """Evaluate equations: what is new is defined by its own, and both sides of the others must agree."""
    compared = 0
    for equation in formula:
        left, right = formulas.to_python(equation)
        value = eval(right, {"__builtins__": {}, **FUNCTIONS}, names)
        if left.isidentifier() and left not in names and "_dot" not in left:
            names[left] = value
            continue
        other = eval(left, {"__builtins__": {}, **FUNCTIONS}, names)
        difference = np.max(np.abs((other - value)[INSIDE] if np.ndim(other - value) else other - value))
        size = np.max(np.abs(value)) if "y" not in left and "prime" not in left else scale
        assert difference <= tolerance * size, (equation, difference / size)
        compared += 1
    assert compared


def table_names(effect, motion, world, array):
    """Return what a formula may name for an effect of a table, and the largest change that the effect makes."""
    changed = effect.apply(world)
    spin = motion.at(T)
    column = {name: value[:, None] for name, value in (("θ", spin.angle), ("ω", spin.rate), ("α", spin.acceleration))}
    readings = forward.channels(world, motion, T, WARMING)
    after = forward.channels(changed, motion, T, WARMING)
    rng = np.random.default_rng(0)
    for step in changed.data_steps:
        after = step(T, after, rng)
    zhat, xhat = Vec(np.array([0.0, 0.0, 1.0])), Vec(np.array([1.0, 0.0, 0.0]))
    r = Vec(array.positions + OFFSET)
    u = turn(zhat, -column["θ"])
    spun = column["α"] * (zhat @ r) + column["ω"] ** 2 * (zhat @ (zhat @ r))
    known = {
        "t": T[:, None], "T": WARMING[:, None], "i": array.chip_of_channel + 1.0, "g": world.gravity, "π": np.pi,
        "a": Vec(array.axes), "r": r, "ρ": Vec(array.positions), "z": zhat, "x": xhat, "u": u,
        "F": world.gravity * u + spun,
        "f": readings, "y": after, "Ω": forward.reference(world, motion, T)[:, None],
        "Ω_prime": forward.reference(changed, motion, T)[:, None],
    }  # fmt: skip
    names = Names({**column, **known, **symbol_values(effect, array)})
    change = np.nanmax(np.abs(after - readings)) + np.max(np.abs(names["Ω_prime"] - names["Ω"]))
    return names, change, changed


def at_other_times(names, formula, motion, world):
    """Let a formula ask for readings or the reference at other times."""

    def readings(times):
        times = np.broadcast_to(times, (len(T), ARRAY.n_channels))
        return np.column_stack([forward.channels(world, motion, times[:, k])[:, k] for k in range(ARRAY.n_channels)])

    text = " ".join(formula)
    if "f(t" in text:
        names["f"] = readings
    if "Ω(t" in text:
        names["Ω"] = lambda times: forward.reference(world, motion, times.ravel())[:, None]
    return names


def special(name, effect, names, motion, changed):
    """Add what only one formula names."""
    spin = motion.at(T)
    if name in ("cogging", "resonance"):
        step = (*changed.motion_steps, *changed.mount_steps)[0]
        angle = step(motion, T).at(T).angle[:, None]
        names |= {"ω_1": 0.3}
        if name == "cogging":
            names |= {"δ": angle - names["θ"], "ω_0": 2 * np.pi, "ζ": 0.7}
        else:
            names |= {"θ_prime": angle, "φ": (angle - names["θ"]) / effect.value("gain")}
    if name == "bench_sway":
        natural, damping = names["ω_0"], names["ζ"]
        mode = ([1.0], [1.0, 2 * damping * natural, natural**2])
        cos, sin = np.cos(spin.angle), np.sin(spin.angle)
        forces = spin.rate**2 * cos + spin.acceleration * sin, spin.rate**2 * sin - spin.acceleration * cos
        names |= {"c": lsim(mode, forces[0], T)[1][:, None], "s": lsim(mode, forces[1], T)[1][:, None]}
    if name in ("lagged_temperature", "temperature_gradient"):
        warm = names["T"].ravel()
        names["T_prime"] = lsim(([1.0], [names["τ"], 1.0]), warm - warm[0], T)[1][:, None] + warm[0]
    if name == "saturation":
        for symbol, side, none in (("L_1", "lower", -np.inf), ("L_2", "upper", np.inf)):
            names[symbol] = np.array([effect.value(f"{one}_{side}_m_s2", none) for one in ARRAY.channels])
    if name == "wrong_range":
        names["κ"] = np.where(names["i"] == 2, effect.value("factor"), 1.0)
    if name in ("axis_swap", "sign_flip", "stuck_channel", "cross_axis"):
        names |= {"y": names["y"].T, "f": names["f"].T}
        listed = effect.parameters.get("channels") or effect.parameters.get("channel") or ["a11", "a12"]
        first, *others = [listed] if isinstance(listed, str) else listed
        names |= {"i": ARRAY.index(first), "j": ARRAY.index((others or ["a12"])[0])}
        names["c"] = effect.value("a11_from_a12")
    if name == "unknown":
        names["h"] = np.asarray(basis_function("rate")(Motion.of(spin, T, effect.units)))[:, None]
    return names


ON_TABLE = {
    **{name: one for name, one in TABLE_EFFECTS.items() if name not in BY_CHANCE},
    **SIMULATED_EFFECTS,
    "chip_delay": BODY_EFFECTS["chip_delay"],
    "unknown": Unknown,
}


@pytest.mark.parametrize("name", ON_TABLE)
def test_the_formula_of_a_table_is_what_the_simulation_does(name):
    family = ON_TABLE[name]
    text = describe(family)
    example = dict(text.example)
    if name == "saturation":
        example = {"a11_upper_m_s2": 0.3, "a11_lower_m_s2": -1.0}
    if name == "stuck_channel":
        example |= {"start_s": 2.0, "stop_s": 3.0}
    effect = family(example)
    effect.check(ARRAY)
    motion, world = Swinging(), World(ARRAY, cube_offset=OFFSET)
    names, change, changed = table_names(effect, motion, world, ARRAY)
    assert change > 0
    names = at_other_times(special(name, effect, names, motion, changed), text.formula, motion, world)
    compare(text.formula, names, change, TOLERANCE.get(name, 1e-6))


class Carried:
    """Place, speed and acceleration of a carriage."""

    def at(self, t):
        t = np.asarray(t, dtype=float)
        return SpinState(0.1 * np.sin(3.0 * t), 0.3 * np.cos(3.0 * t), -0.9 * np.sin(3.0 * t))


@pytest.mark.parametrize("family", [RailTilt, CARRIAGE_EFFECTS["mount_turn"]])
def test_the_formula_of_a_linear_axis_is_what_the_simulation_does(family):
    text = describe(family)
    effect, slide = family(text.example), np.array([1.0, 0.0, 0.0])
    world = World(ARRAY, cube_offset=np.zeros(3), slide=slide)
    names, change, _ = table_names(effect, Carried(), world, ARRAY)
    zhat = Vec(np.array([0.0, 0.0, 1.0]))
    names["F"] = world.gravity * zhat + Carried().at(T).acceleration[:, None] * Vec(slide)
    compare(text.formula, names, change, TOLERANCE["mount_turn"])


@pytest.mark.parametrize("name", ["gyro_scale", "gyro_misalignment", "gyro_latency"])
def test_the_formula_of_a_gyro_is_what_the_simulation_does(name):
    """Channels predicted from the gyro by its formula, with the effect, are those of the true rate without it."""
    family = BODY_EFFECTS[name]
    text = describe(family)
    effect = family(text.example)

    def rate(t):
        return np.stack([3.0 * np.sin(2.0 * t), 2.0 * np.cos(3.0 * t), 4.0 * np.sin(1.5 * t + 1.0)], axis=-1)

    values = symbol_values(effect, ARRAY)
    gains = effect.vector("xyz") if name == "gyro_scale" else None
    names = Names(t=T, Ω=rate if "Ω(t" in text.formula[0] else Vec(rate(T)), **values)
    if gains is not None:
        names |= {"s": gains, "Ω": rate(T)}
    read = eval(formulas.to_python(text.formula[0])[1], {}, names)
    read = read.parts if isinstance(read, Vec) else read
    force = np.zeros((len(T), 3))

    def channels(world, gyro):
        return body_channels(world, BodyDrive(T, gyro, force), T)

    plain = World(ARRAY)
    truth = channels(plain, rate(T))
    change = np.max(np.abs(channels(plain, read) - truth)[INSIDE])
    assert np.max(np.abs(channels(effect.apply(plain), read) - truth)[INSIDE]) <= TOLERANCE[name] * change


def test_the_formula_of_the_encoders_zero_is_what_the_simulation_does():
    family = INCLINED_EFFECTS["angle_zero"]
    text = describe(family)
    effect, twin = family(text.example), Twin.load("pendulum")
    names = Names(
        θ=twin.predict(Swinging(), T)[1],
        θ_prime=twin.predict(Swinging(), T, effects=[effect])[1],
        **symbol_values(effect, ARRAY),
    )
    compare(text.formula, names, 0.02, 1e-6)


def rest(*effects):
    parts = ", ".join(effects)
    scenario = Scenario.load(
        "rest",
        changes=["sensor.errors=false", "sensor.quantisation=false", "duration_s=200.0", f"effect=[{parts}]"],
    )
    return simulate(scenario, seed=3).for_array(ARRAY)


def test_the_formula_of_noise_holds_on_average():
    factor = describe(TABLE_EFFECTS["noise"]).example["factor"]
    plain, noisy = rest(), rest(f'{{name = "noise", parameters = {{factor = {factor}}}}}')
    assert np.std(np.diff(noisy, axis=0)) / np.std(np.diff(plain, axis=0)) == pytest.approx(
        factor, rel=BY_CHANCE["noise"]
    )


def test_the_formula_of_a_random_walk_holds_on_average():
    strength = 0.2
    walk = rest(f'{{name = "bias_random_walk", parameters = {{strength_m_s2_rts = {strength}}}}}') - rest()
    seconds = 5.0
    moved = np.diff(walk[:: round(100 * seconds)], axis=0)
    assert np.mean(moved**2) == pytest.approx(strength**2 * seconds, rel=BY_CHANCE["bias_random_walk"])


def test_the_formula_of_lost_frames_holds_on_average():
    family = TABLE_EFFECTS["dropped_frames"]
    effect = family({"share": 0.02})
    (step,) = effect.apply(World(ARRAY)).data_steps
    kept = step(T, np.zeros((len(T), 12)), np.random.default_rng(0))
    assert np.mean(np.isnan(kept[:, 0])) == pytest.approx(0.02, rel=BY_CHANCE["dropped_frames"])


def test_the_rotation_of_the_formulas_is_that_of_the_frames():
    vector = np.array([0.3, -0.2, 0.5])
    assert turn(Vec(vector), 0.4).parts == pytest.approx(Rotation.from_rotvec([0, 0, 0.4]).apply(vector))
