"""What other packages add: installed for the test as a folder with entry points on the path."""

import sys

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from gfimu.base import plugins as loading
from gfimu.base.plugins import GROUPS, plugins
from gfimu.model.user_code import user_function
from gfimu.rate.registry import RateMethod, rate_method
from gfimu.recording import read_foreign
from gfimu.recording.formats import formats
from gfimu.recording.importing.readers import readers
from sim.effects import added_effects, make_effect
from sim.twin import Twin

MODULE = '''
from pathlib import Path

import numpy as np

import gfimu
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.readers import Reader
from gfimu.model.own_rig import Cause, Parameter, SimulatorModel
from gfimu.rate.registry import RATE_METHODS, RateMethod
from gfimu.recording.formats import RecordingFormat
from sim.effects.base import Effect, Size

ARRAY = gfimu.AccelerometerArray.load("one_chip")


class BeltSlip(Effect):
    """The belt that drives the table slips."""

    name = "belt_slip"
    summary = "the belt slips"
    place = "reference"

    @classmethod
    def sizes(cls, array):
        return (Size("ratio", "1", 0.01),)

    def apply(self, world):
        slip = 1.0 + self.value("ratio")
        return world.changed(reference_steps=(*world.reference_steps, lambda read, spin, t: read * slip))


def read_words(path, text):
    """Files of a logger that writes words."""
    columns = {"a": np.arange(3.0)}
    return RawFile(path, "words", {"": RawTable("", columns)})


words = Reader(read_words, (b"WORDS",))
mine = RateMethod("mine", RATE_METHODS["algebraic"].solver, "what it likes")


def recognise(path):
    return Path(path).suffix == ".mine"


def read(path):
    t = np.arange(100) / 100.0
    return gfimu.Recording(t, np.ones((100, 3)), ARRAY.channels).carrying(ARRAY)


whole = RecordingFormat("files of my logger", recognise, read)


def twin():
    cause = Cause("radius", "", (Parameter("radius_m", "m", 0.01),))
    return SimulatorModel(ARRAY, lambda state, t, wrong: (np.zeros((len(t), 3)), state.rate), (cause,))
'''

POINTS = """
[gfimu.effects]
belt_slip = stranger_rig:BeltSlip
[gfimu.readers]
words = stranger_rig:words
[gfimu.estimators]
mine = stranger_rig:mine
[gfimu.formats]
my_logger = stranger_rig:whole
[gfimu.twins]
my_rig = stranger_rig:twin
"""


def install(folder, monkeypatch, points):
    (folder / "stranger_rig.py").write_text(MODULE)
    info = folder / "stranger_rig-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: stranger-rig\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(points)
    monkeypatch.syspath_prepend(str(folder))
    loading._loaded.cache_clear()


@pytest.fixture
def installed(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch, POINTS)
    yield tmp_path
    loading._loaded.cache_clear()
    sys.modules.pop("stranger_rig", None)


def test_without_packages_there_is_nothing():
    loading._loaded.cache_clear()
    assert {group: plugins(group, object) for group in GROUPS} == {group: {} for group in GROUPS}


def test_an_effect_joins_the_library_of_tables(installed):
    assert "belt_slip" in Twin.load("cube12_turntable").families()
    assert "belt_slip" not in Twin.load("mimu4444_free").families()
    assert make_effect("belt_slip", {"ratio": 0.1}).value("ratio") == 0.1
    assert gfimu.catalogue("effects")["belt_slip"] == "the belt slips"


def test_a_reader_reads_files_by_their_mark(installed):
    file = installed / "a.bin"
    file.write_bytes(b"WORDS\0\0\1\2")
    np.testing.assert_array_equal(read_foreign(file).tables[""].columns["a"], [0.0, 1.0, 2.0])
    assert readers()["words"].summary == "Files of a logger that writes words."
    assert "words" in gfimu.catalogue("formats")


def test_an_estimator_is_a_method(installed):
    assert isinstance(rate_method("mine"), RateMethod)
    with pytest.raises(InputError, match="mine"):
        rate_method("nobody's")


def test_a_format_is_opened_like_any_recording(installed):
    file = installed / "run.mine"
    file.write_bytes(b"anything")
    assert gfimu.open_recording(file).channels == ("a11", "a12", "a13")
    assert "my_logger" in formats()


def test_a_twin_is_found_by_its_name(installed):
    from gfimu.model import load_model

    model = load_model("my_rig")
    assert list(model.families()) == ["radius"]
    assert 'simulator = "my_rig"' in model.to_toml()


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("[gfimu.effects]\nbias = stranger_rig:BeltSlip\n", "gfimu has 'bias' itself"),
        ("[gfimu.effects]\nslip = stranger_rig:BeltSlip\n", "no sim.effects.base.Effect of that name"),
        (
            "[gfimu.effects]\nbelt_slip = stranger_rig:nothing\n",
            "AttributeError.*package stranger-rig|package stranger",
        ),
        ("[gfimu.effects]\nbelt_slip = stranger_rig:mine\n", "not a type"),
    ],
)
def test_a_package_that_is_wrong_is_named(tmp_path, monkeypatch, points, message):
    install(tmp_path, monkeypatch, points)
    with pytest.raises(InputError, match=message):
        added_effects()
    loading._loaded.cache_clear()
    sys.modules.pop("stranger_rig", None)


def test_a_function_of_a_file_sees_the_files_beside_it_and_installed_packages_first(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "beside_of_a_rig.py").write_text("LENGTH = 0.2\n")
    (tmp_path / "msgspec.py").write_text("raise RuntimeError\n")
    file = tmp_path / "rig.py"
    file.write_text("import msgspec\nfrom beside_of_a_rig import LENGTH\n\ndef length():\n    return LENGTH\n")
    monkeypatch.delitem(sys.modules, "msgspec")
    assert user_function(f"{file}:length", "a length")() == 0.2


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("none.py:length", r"none\.py: no such file; give a length as FILE\.py:FUNCTION"),
        ("length", r"length: no such file; give a length as FILE\.py:FUNCTION"),
        ("{rig}:lengths", r"unknown function of .*rig\.py 'lengths'; valid: length; did you mean 'length'\?"),
        ("{wrong}:length", r"wrong\.py: ZeroDivisionError: division by zero; run it with python to see where"),
    ],
)
def test_a_function_that_is_not_in_a_file_is_one_line(tmp_path, source, words):
    places = {"rig": tmp_path / "rig.py", "wrong": tmp_path / "wrong.py"}
    places["rig"].write_text("def length():\n    return 0.2\n")
    places["wrong"].write_text("1 / 0\n")
    with pytest.raises(InputError, match=words):
        user_function(source.format(**places), "a length")
