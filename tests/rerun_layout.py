"""What a rerun recording opens with: its views read back from the file, beside the data that they show."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rerun.chunk import RrdReader

UNITS = re.compile(r", (rad|m|s|Hz|rad/s|rad/s²|m/s|m/s²)( |$|,)|, estimated$")
WITHOUT_UNIT = re.compile(r"health|reference that drives the twin|residual \w+|[a-z]+\d+$|lost, corrupt|sign of ω")
"""Titles of lanes of health, and of channels whose tab has the unit."""

LONGEST_LINKED_S = 60.0


@dataclass(frozen=True)
class Layout:
    """Components of every entity of the blueprint and of the recording, by entity and short name."""

    blueprint: dict[str, dict[str, list[Any]]]
    data: dict[str, dict[str, list[Any]]]

    @classmethod
    def read(cls, path: Path) -> Layout:
        reader = RrdReader(str(path))
        (blueprint,) = reader.blueprints()
        return cls(_columns(reader, blueprint), _columns(reader, None))

    def views(self, kind: str) -> dict[str, dict[str, list[Any]]]:
        """Views of a class, ``TimeSeries``, ``3D``, ``TextDocument``, by entity."""
        return {
            name: columns for name, columns in self.blueprint.items() if _first(columns.get("class_identifier")) == kind
        }

    def below(self, origin: str) -> dict[str, dict[str, list[Any]]]:
        """Entities of the recording at and below an origin."""
        return {name: columns for name, columns in self.data.items() if f"{name}/".startswith(f"{origin}/")}


def check_layout(path: Path) -> Layout:
    """Assert that no view is empty, each has its unit, the whole run is shown, and the body is in the 3-D picture."""
    layout = Layout.read(path)
    shown = set()
    for view, columns in layout.views("TimeSeries").items():
        name, origin = _first(columns["display_name"]), _first(columns["space_origin"])
        lines = {one: part for one, part in layout.below(origin).items() if part.get("scalars")}
        shown |= set(lines)
        values = np.concatenate([np.ravel(part["scalars"]).astype(float) for part in lines.values()])
        assert np.isfinite(values).any(), f"{name}: nothing is drawn"
        assert UNITS.search(name) or WITHOUT_UNIT.match(name), f"{name}: without unit"
        low, high = _first(layout.blueprint[f"{view}/ScalarAxis"]["range"])
        assert high > low, name
        times = np.concatenate([np.ravel(part["time"]).astype(float) for part in lines.values()]) * 1e-9
        axis = layout.blueprint[f"{view}/TimeAxis"]
        spanned = _first(axis["view_range"])
        np.testing.assert_allclose([spanned["start"], spanned["end"]], [times.min() * 1e9, times.max() * 1e9], atol=1e6)
        assert _first(axis["link"]) == (2 if np.ptp(times) <= LONGEST_LINKED_S else 1), name
    drawn = {name for name, part in layout.data.items() if part.get("scalars")}
    assert drawn == shown, "lines that no view shows, or the other way round"
    for columns in layout.views("TextDocument").values():
        (notes,) = layout.below(_first(columns["space_origin"])).values()
        assert len(str(notes["text"])) > 200
    _check_scenes(layout)
    for columns in layout.blueprint.values():  # containers of tabs open on their first
        if "active_tab" in columns:
            assert columns["active_tab"][0][0] == columns["contents"][0][0]
    return layout


def _check_scenes(layout: Layout) -> None:
    """Body and table of every 3-D view are there, and the camera looks at the body from a fitting distance."""
    scenes = layout.views("3D")
    assert any(_first(columns["space_origin"]) == "/scene" for columns in scenes.values())
    for view, columns in scenes.items():
        assert layout.below(_first(columns["space_origin"]))
        if _first(columns["space_origin"]) != "/scene":
            continue
        camera = layout.blueprint[f"{view}/EyeControls3D"]
        eye, target = (np.array(_first(camera[part]), dtype=float) for part in ("position", "look_target"))
        body = next(name for name in ("/scene/cube", "/scene/array") if name in layout.data)
        moved = [one for one in layout.data[body].get("translation", []) if one]
        place = np.array(moved[0][0] if moved else [0.0, 0.0, 0.0], dtype=float)
        ahead, towards = target - eye, place - eye
        angle = np.arccos(ahead @ towards / (np.linalg.norm(ahead) * np.linalg.norm(towards)))
        assert np.rad2deg(angle) < 25.0
        size = np.ptp(_vertices(layout, body), axis=0).max()
        assert 0.05 < size / np.linalg.norm(towards) < 1.0


def _vertices(layout: Layout, body: str) -> np.ndarray:
    """Corners of the boxes and ends of the arrows of a body, m, (k, 3)."""
    points = [np.zeros((1, 3))]
    for columns in layout.below(body).values():
        for centre, half in zip(columns.get("centers", []), columns.get("half_sizes", []), strict=False):
            if centre and half:
                points += [np.array(centre, dtype=float) + sign * np.array(half, dtype=float) for sign in (-1, 1)]
    return np.concatenate(points)


def _columns(reader: RrdReader, store: Any) -> dict[str, dict[str, list[Any]]]:
    found: dict[str, dict[str, list[Any]]] = {}
    for chunk in reader.stream(store=store).to_chunks():
        batch = chunk.to_record_batch()
        columns = found.setdefault(chunk.entity_path, {})
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            plain = column.cast("int64") if str(column.type).startswith(("duration", "timestamp")) else column
            columns.setdefault(name.split(":")[-1], []).extend(one for one in plain.to_pylist() if one is not None)
    return found


def _first(column: list[Any] | None) -> Any:
    """First value of a component, without the list around it."""
    if not column:
        return None
    value = column[0]
    return value[0] if isinstance(value, list) and value else value
