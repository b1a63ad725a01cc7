"""Every file in ``models`` is read as the objects that were read from it before."""

import json

import pytest
from shipped_models import LOADERS, STORED, loaded

KNOWN = json.loads(STORED.read_text(encoding="utf-8"))


def differences(stored, found, place=""):
    """Places at which an object lacks what the copy holds; fields that came later are none."""
    if isinstance(stored, dict) and isinstance(found, dict):
        return [one for key, value in stored.items() for one in differences(value, found.get(key), f"{place}.{key}")]
    if isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        return [
            one
            for number, (old, new) in enumerate(zip(stored, found, strict=True))
            for one in differences(old, new, f"{place}[{number}]")
        ]
    same = type(stored) is type(found) and (
        found == pytest.approx(stored, rel=1e-12, abs=1e-12) if isinstance(stored, float) else found == stored
    )
    return [] if same else [f"{place}: {stored!r} is now {found!r}"]


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in LOADERS for name in KNOWN[kind]])
def test_a_shipped_file_gives_the_same_objects(kind, name, project_root, monkeypatch):
    monkeypatch.chdir(project_root)
    assert differences(KNOWN[kind][name], loaded(kind, name)) == []


def test_a_changed_value_is_seen():
    found = loaded("arrays", "cube12")
    assert differences(KNOWN["arrays"]["cube12"], found) == []
    found[0]["chips"][2]["position"][1] += 1e-9
    assert differences(KNOWN["arrays"]["cube12"], found) == ["[0].chips[2].position[1]: 0.05 is now 0.050000001"]
