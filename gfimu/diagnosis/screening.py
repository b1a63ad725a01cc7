"""All signatures about a set of causes, and their normal equations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import effects_of_run
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.linearisation import Linearisation
from gfimu.diagnosis.parallel import over_segments
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import SignatureSet, hypotheses, plan_signatures, signature_columns
from gfimu.world_model import Effect

__all__ = ["screen"]


def screen(segments: Sequence[Segment], base: Fit, fixed: Sequence[Sequence[Effect]], runs: int) -> SignatureSet:
    """Compute all signatures about a base and their normal equations relative to no effects."""
    model = segments[0].model
    array = model.array
    for segment, drive in zip(segments, base.drives, strict=True):
        segment.coefficients = drive
    linear = over_segments(
        lambda segment, known: segment.linearise([*known, *effects_of_run(base.causes, array, segment.index)]),
        segments,
        fixed,
    )
    signatures, count = plan_signatures(model.families(), segments, linear, base.causes, runs)
    gram, score = np.zeros((count, count)), np.zeros(count)

    def products(
        segment: Segment, line: Linearisation, known: Sequence[Effect]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        columns, numbers = signature_columns(segment, signatures, base.causes, known, line.prediction)
        part, part_score, eliminated = segment.whitened_products(line, columns)
        response = np.zeros((segment.spline.size, count))
        response[:, numbers] = line.drive.response(eliminated)
        return numbers, part, part_score, response

    responses = []
    for numbers, part, part_score, response in over_segments(products, segments, linear, fixed):
        gram[np.ix_(numbers, numbers)] += part
        score[numbers] += part_score
        responses.append(response)
    at = np.zeros(count)
    for cause in base.causes:
        signature = next(one for one in signatures if one.family.name == cause.name)
        at[signature.columns] = cause.mixing @ cause.coordinates
    places = tuple(hypotheses(signatures, array, runs))
    return SignatureSet(tuple(signatures), gram, score + gram @ at, places, at, tuple(responses))
