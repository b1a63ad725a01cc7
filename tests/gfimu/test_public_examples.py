"""Public names: each has a docstring, nearly all an example, and every example runs."""

import doctest
import importlib
import inspect

import pytest
from every_item import every

import gfimu

PUBLIC = sorted(set(gfimu.__all__) - {"__version__"})

NO_EXAMPLE = {
    "CorruptValueWarning",
    "GeometryError",
    "InputError",
    "MissingPackageError",
    "RecordingWarning",
    "UnitError",
    "WriteError",
    "benchmark",
    "firmware",
    "posterior_rate_bound",
    "update_array_calibration",
}
"""Names that need none: errors of one kind, modules, and two functions whose example would be a page."""


def of_name(name):
    value = getattr(gfimu, name)
    return inspect.unwrap(value) if callable(value) and not inspect.isclass(value) else value


@every("name", PUBLIC)
def test_a_public_name_says_what_it_is(name):
    text = inspect.getdoc(of_name(name)) or ""
    assert len(text.splitlines()[0]) > 10
    assert not text.startswith(f"{name}("), "a dataclass without a docstring"
    assert (">>>" in text) == (name not in NO_EXAMPLE)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", [name for name in PUBLIC if name not in NO_EXAMPLE])
def test_its_example_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    value = of_name(name)
    module = importlib.import_module(value.__module__)
    finder = doctest.DocTestFinder(recurse=inspect.isclass(value))
    failures = []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE, verbose=False)
    for test in finder.find(value, name, module=module, globs={}):
        runner.run(test, out=failures.append)
    assert failures == []
