"""The views of the runs of a diagnosis: each recording beside the given and the extended twin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.criticism.views.body_view import body_view
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.data.body.run import BodyRun
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.learn import starting_point
from gfimu.diagnosis.fit.linear import linearise
from gfimu.diagnosis.terms.cause import effects_of
from gfimu.diagnosis.terms.spline import AngleSpline
from gfimu.model.world_model import Spin, is_linear

__all__ = ["run_views"]


def run_views(prepared: PreparedRuns, stretches: Sequence[Stretch], believed: Fit) -> tuple[RunView, ...]:
    """Collect each run for pictures: before is the given twin driven by the reference alone."""
    return tuple(_view(prepared, index, stretches, believed) for index in range(len(prepared.runs)))


def _view(prepared: PreparedRuns, number: int, stretches: Sequence[Stretch], believed: Fit) -> RunView:
    run = prepared.runs[number]
    if isinstance(run, BodyRun):
        given = tuple(replace(stretch, known=()) for stretch in stretches)
        plain = linearise(given, replace(believed.point, causes=())).posteriors[number]
        return body_view(plain, linearise(stretches, believed.point).posteriors[number])
    before, after, states = [], [], []
    for stretch, drive in zip(stretches, believed.point.drives, strict=True):
        if stretch.index != number:
            continue
        effects = effects_of(believed.causes, stretch.model.array, stretch.index)
        after.append(stretch.predict(effects, drive.spin))
        states.append(stretch.motion([*stretch.known, *effects], drive.spin).at(stretch.run.t))
        bare = replace(stretch, known=())
        before.append(bare.predict([], _by_reference(bare, drive.spline)))
    first, second = np.concatenate(before), np.concatenate(after)
    return RunView(
        run.name,
        run.t,
        run.readings,
        run.valid,
        first[:, :-1],
        second[:, :-1],
        run.reference,
        first[:, -1],
        second[:, -1],
        np.concatenate([state.angle for state in states]),
        np.concatenate([state.rate for state in states]),
        np.concatenate([state.acceleration for state in states]),
        run.temperature,
        believed.point.levels[0].white[:-1],
        linear=is_linear(stretches[0].model),
    )


def _by_reference(stretch: Stretch, spline: AngleSpline) -> Spin:
    return starting_point([stretch], spline.spacing).drives[0].spin
