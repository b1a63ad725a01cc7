"""A stretch of a run with its drive: linearised about the present causes, the drive marginalised out.

Observations are the c channels and the reference as one more. With the drive's spline coefficients d, the noise
weight W and the roughness prior R, the drive is eliminated by

    H = JᵀWJ + R,  H⁻¹ = VᵀV,  X = V JᵀWA,  x = V(JᵀWr − Rd),  G = AᵀWA − XᵀX,  b = AᵀWr − Xᵀx,

so that everything after it is small algebra on G and b, whatever the length of the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.calibration_residue import CalibrationResidue
from gfimu.diagnosis.coloured_noise import CosineBasis, NoiseLevels
from gfimu.diagnosis.data.rounding import COARSE, Steps
from gfimu.diagnosis.data.run import Run, difference_noise
from gfimu.diagnosis.drive import ShiftedSpin
from gfimu.diagnosis.drive_derivative import Remembered, differentiate, felt_modes, felt_play, felt_ripple
from gfimu.diagnosis.drive_jacobian import DriveJacobian
from gfimu.diagnosis.linearisation import DriveElimination, DriveEquations, Linearisation
from gfimu.diagnosis.simulation import RunUp, Simulation
from gfimu.diagnosis.slow_modes import SlowModes, WeighedModes
from gfimu.diagnosis.spline_drive import TIME_MARGIN, SplineDrive
from gfimu.world_model import Effect, Mode, Play, Ripple, Spin, WorldModel

__all__ = ["Segment", "known_walk"]

_WALK = "bias_random_walk"
_ROUNDING_ERROR = 1e-12
_KNOWN_ANGLE_STD = 5e-3
_LEAST_FACTOR = 0.05
_FACTOR_STEPS = 4
_SLOW_ROUNDS, _SLOW_STEP = 10, 0.05  # to the most probable slow noise; of the white noise, below which it is found


class Segment(SplineDrive):
    """One stretch of a run with its own drive spline.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    run : Run
        The stretch.
    index : int
        Number of the run it belongs to.
    start : float
        Time at which the whole run began, s.
    start_angle, start_angle_std : float
        Table angle at the first sample and its standard deviation, rad.
    stretches : int
        How many such stretches the run is cut into.
    """

    def __init__(
        self,
        model: WorldModel,
        run: Run,
        index: int,
        start: float,
        *,
        start_angle: float = 0.0,
        start_angle_std: float = 1e-4,
        stretches: int = 1,
    ) -> None:
        self.model, self.index, self.start, self.stretches = model, index, start, stretches
        # What came before it in the run, where it is a block of one.
        self.run_up: RunUp | None = None
        times = np.append(model.sample_times(run.t), run.t[:, None], axis=1)
        super().__init__(
            run,
            times,
            is_angle=model.drive_source == "angle",
            start_angle=start_angle,
            start_angle_std=start_angle_std,
        )
        period = run.sample_period
        # Whether the derivative knows what a play holds.
        self.holding = True
        # Whether it knows how a torque ripple answers the drive, which takes several times as long.
        self.rippling = False
        # Whether it knows what rings on, which takes more time: from the start where the model has a mode already.
        self.ringing = bool(self.felt_modes(()))
        self.basis = CosineBasis(len(run.t), period, float(run.t[0] - start), stretches=stretches)
        self.weight_mask = np.column_stack([run.valid, run.reference_valid])  # (n, c + 1)
        self.row_weight, self._weighed = self.weight_mask.astype(float), False
        # Where the slow noise of coarse readings most probably is: they are expanded about it.
        self._wandered: NDArray[np.float64] | float = 0.0
        self.modes: SlowModes
        self.rounding, self.levels = self._starting_levels()
        self.round_to(model.expected_noise(1.0 / period).quantum)
        self.calibration_residue: CalibrationResidue | None = None
        self._start()

    # -- starting values -------------------------------------------------------------------------------------

    def _starting_levels(self) -> tuple[Steps, NoiseLevels]:
        expected = self.model.expected_noise(1.0 / self.run.sample_period)
        reference = self.run.reference[self.run.reference_valid]
        steps, noise = Steps.of_reference(reference, difference_noise(reference))
        white = np.append(expected.white, max(noise, self.finest))
        flicker = np.append(np.full(len(expected.white), 2e-3), 0.0)
        return steps, NoiseLevels(white, flicker, known_walk(self.model))

    def adopt(self, whole: Segment, effects: Sequence[Effect] = ()) -> None:
        """Take noise levels, roughness and drive from a segment of which this is a part.

        The drive reaches as far as it does there, or, in a part, as effects ask for.
        """
        self.levels = whole.levels
        self.rounding, self.knots_chosen, self.ringing = whole.rounding, whole.knots_chosen, whole.ringing
        start, stop = whole.spline.start, whole.spline.stop
        if len(self.run.t) < len(whole.run.t):
            times = self.model.sample_times(self.run.t, effects)
            start = max(min(self.spline.start, float(times.min()) - TIME_MARGIN), start)
            stop = min(max(self.spline.stop, float(times.max()) + TIME_MARGIN), stop)
        spline = whole.spline.within(start, stop)
        self.start_angle, self.start_angle_std = float(whole.spin.at(self.run.t[:1]).angle[0]), _KNOWN_ANGLE_STD
        earlier = whole.run.t < self.run.t[0]
        if earlier.any():
            temperature = whole.run.temperature
            self.run_up = RunUp(whole.run.t[earlier], None if temperature is None else temperature[earlier], whole.spin)
        self._follow(whole.spin, whole.roughness.on(spline, corners=True))
        self.prepare_weights()

    def reach_out(self, effects: Sequence[Effect]) -> bool:
        """Widen the spline to the motion that effects ask for (a slow clock, late chips); tells whether it was."""
        times = self.model.sample_times(self.run.t, effects)
        before, after = self.spline.start - float(times.min()), float(times.max()) - self.spline.stop
        if not 0.0 < max(before, after) < self.run.duration:
            return False
        spline = self.spline.widened(max(before + TIME_MARGIN, 0.0), max(after + TIME_MARGIN, 0.0))
        self._follow(self.spin, self.roughness.on(spline, corners=True))
        return True

    def _acuity(self) -> float:
        """Return how well one sample of all channels tells the angular acceleration, s²/rad."""
        pushed = self.predict((), ShiftedSpin(self.spin, 2, 1.0)) - self.predict(())
        levers = np.sqrt(np.mean(pushed[:, :-1] ** 2, axis=0))  # m, from the axis to the chips
        return float(np.linalg.norm(levers / self.levels.white[:-1]))

    def tune_roughness(self, effects: Sequence[Effect]) -> None:
        """Pick the scale of the roughness prior by marginal likelihood, the drive integrated out."""
        factor = self.roughness.factor
        # Below the least factor a prior that is learnt from the drive and then tightened again would tighten for ever.
        least = 0.0 if self.at_rest else _LEAST_FACTOR

        data = self._equations(effects)

        def likelihood(trial: float) -> float:
            self.roughness.factor = trial
            self._set_prior()
            drive = data.eliminated(self.drive_prior, self.coefficients)
            return self.log_volume(drive) - 0.5 * drive.objective

        best = (likelihood(factor), factor)
        for ratio in (0.5, 2.0):
            for _ in range(_FACTOR_STEPS):
                trial = max(best[1] * ratio, least)
                value = likelihood(trial)
                if value <= best[0]:
                    break
                best = (value, trial)
            if best[1] != factor:
                break
        self.roughness.factor = best[1]
        self._set_prior()

    def set_levels(self, levels: NoiseLevels) -> None:
        """Take new noise levels."""
        self.levels = levels

    # -- prediction --------------------------------------------------------------------------------------------

    def predict(self, effects: Sequence[Effect], spin: Spin | None = None) -> NDArray[np.float64]:
        """Predict channels and reference, shape (n, c + 1)."""
        return self.simulation.predict(effects, self.spin if spin is None else spin)

    def motion(self, effects: Sequence[Effect]) -> Spin:
        """Return the table's motion for the present drive under effects."""
        return self.simulation.motion(effects, self.spin)

    @property
    def simulation(self) -> Simulation:
        """The model of this stretch."""
        return Simulation(self.model, self.run, self.start, self.run_up)

    def reference_prediction(self, effects: Sequence[Effect]) -> NDArray[np.float64]:
        """Predict channels and reference, shape (n, c + 1), with the drive that the reference alone gives."""
        return self.predict(effects, self.spline.spin(self._reference_drive))

    def residual(self, effects: Sequence[Effect]) -> NDArray[np.float64]:
        """Return measured minus predicted, shape (n, c + 1); zero where invalid."""
        measured = np.column_stack([self.run.readings, self.run.reference])
        return np.where(self.weight_mask, measured - self.predict(effects), 0.0)

    def working_residual(self, effects: Sequence[Effect]) -> NDArray[np.float64]:
        """Return the residual as the normal equations take it, shape (n, c + 1).

        The plain one, unless readings are so coarse that each has a weight of its own (`rounded_likelihood`).
        """
        return self._weigh(self.residual(effects))[0]

    def _weigh(self, residual: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Set the weight of every sample; return the working residual and what its squares lack of the deviance."""
        if not self.rounding.coarse:
            return residual, 0.0
        self._weighed = True
        working, lacking = self._weigh_about(residual)
        if not self.rounding.channels:
            return working, lacking
        modes = WeighedModes(self.basis, self.levels, self.row_weight)
        # A walk over steps moves the edges at which they tell much: it is expanded about where it most probably is
        # (penalised quasi-likelihood, Breslow and Clayton 1993); bias instability keeps well within a step.
        for _ in range(_SLOW_ROUNDS if self.levels.walk > 0.0 else 0):
            wandered = modes.slow_noise(working)
            if np.abs((wandered - self._wandered) / self.levels.white).max() < _SLOW_STEP:
                break
            self._wandered = wandered
            working, lacking = self._weigh_about(residual)
            modes = WeighedModes(self.basis, self.levels, self.row_weight)
        self.modes = modes
        # Where edges of steps are met more is known of slow noise, which is less probable to be so by chance.
        return working, lacking + modes.log_narrowing

    def _weigh_about(self, residual: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        about = residual - self._wandered * self.weight_mask
        working, self.row_weight, lacking = self.rounding.weigh(about, self.levels.white, self.weight_mask)
        return working + self.row_weight * self._wandered, lacking

    def round_to(self, quantum: float) -> None:
        """Tell that readings are rounded to steps of ``quantum`` m/s² after the noise, where that is coarse."""
        analogue = self.model.expected_noise(1.0 / self.run.sample_period).analogue
        if quantum > COARSE * float(np.median(analogue)):
            self.rounding = replace(self.rounding, channels=quantum)
            white = np.append(analogue, self.levels.white[-1])
            self.set_levels(NoiseLevels(white, self.levels.flicker, self.levels.walk))

    def noise_before_rounding(self, effects: Sequence[Effect], level: NDArray[np.float64]) -> NDArray[np.float64]:
        """Replace white noise in ``level``, shape (c + 1,), by what it was before a coarse rounding."""
        if not self.rounding.coarse:
            return level
        error = np.where(self.weight_mask, self.residual(effects) - self._wandered, np.nan)
        return self.rounding.noise_before(error, self.levels.white, level)

    # -- normal equations --------------------------------------------------------------------------------------

    def prepare_weights(self) -> None:
        """Compute the noise weights for the present levels, and for the weights of coarse readings as they are now."""
        if not self.rounding.channels:
            self.modes = SlowModes(self.basis, self.levels)
        else:
            if not self._weighed:
                self.working_residual(())
            self.modes = WeighedModes(self.basis, self.levels, self.row_weight)
        self.inverse_variance = 1.0 / self.levels.white**2

    def linearise(self, effects: Sequence[Effect]) -> Linearisation:
        """Linearise about effects and the present drive, and eliminate the drive."""
        data = self._equations(effects)
        state = self.motion(effects).at(self.run.t)
        return Linearisation(
            data.prediction,
            data.residual,
            data.slow_residual,
            data.jacobian,
            data.slow,
            data.eliminated(self.drive_prior, self.coefficients),
            state,
        )

    def _equations(self, effects: Sequence[Effect]) -> DriveEquations:
        """Return the normal equations of the drive, and of a calibration residue, without the drive's prior."""
        predicted = self.predict(effects)
        residual, objective = self._misfit(predicted)
        slow_residual = self.modes.of_each(residual)
        jacobian = self._jacobian(effects, predicted)
        weights = self.inverse_variance
        rhs = jacobian.backward((residual - self.modes.back(self.modes.share * slow_residual)) * weights)
        slow = self.modes.of_drive(jacobian, weights)
        residue = None
        if self.calibration_residue is not None:
            residue = self.calibration_residue.normal_equations(residual, slow, self.modes, weights)
        return DriveEquations(
            predicted, residual, slow_residual, jacobian, slow, jacobian.information(), rhs, objective, residue
        )

    def _misfit(self, predicted: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Return the working residual r (n, c + 1) and rᵀWr."""
        measured = np.column_stack([self.run.readings, self.run.reference])
        residual, misfit = self._weigh(np.where(self.weight_mask, measured - predicted, 0.0))
        power = np.sum(residual**2, axis=0) - self.modes.explained(residual)
        return residual, misfit + float(self.inverse_variance @ power)

    def energy(self, effects: Sequence[Effect]) -> float:
        """Return rᵀWr + dᵀRd at the present drive, which is held; a calibration residue is at its best there."""
        residual, misfit = self._misfit(self.predict(effects))
        if self.calibration_residue is not None:
            misfit -= self.calibration_residue.explained(residual, self.modes, self.inverse_variance)
        return misfit + self.drive_prior.energy(self.coefficients)[0]

    def _jacobian(self, effects: Sequence[Effect], base: NDArray[np.float64]) -> DriveJacobian:
        """Differentiate the prediction ``base`` with respect to the drive's state and chain with the spline."""
        remembered = Remembered(
            play=self.felt_play(effects) if self.holding else None,
            modes=self.felt_modes(effects) if self.ringing else (),
            ripple=self.rippling,
        )
        return differentiate(
            self.simulation,
            effects,
            self.spline,
            self.spin,
            base,
            remembered,
            self.inverse_variance,
            self.row_weight,
        )

    def felt_modes(self, effects: Sequence[Effect]) -> Sequence[Mode]:
        """Return what rings between the table and the array."""
        return felt_modes(self.model, effects)

    def felt_play(self, effects: Sequence[Effect]) -> Play | None:
        """Return what holds a share of the readings, where that is more than their noise."""
        return felt_play(self.model, effects, self.levels.of_reading)

    def felt_ripple(self, effects: Sequence[Effect]) -> Ripple | None:
        """Return what the table ripples by, where that is strong."""
        return felt_ripple(self.model, effects)

    def whitened_products(
        self, linear: Linearisation, signatures: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return G (P, P), b (P,) and X (m + k + q, P) of signatures (c + 1, P, n)."""
        count = signatures.shape[1]
        gram = np.zeros((count, count))
        score = np.zeros(count)
        weights = self.inverse_variance
        damped = np.zeros((len(weights), count, len(self.modes.share)))  # (c + 1, P, K)
        reached = [np.flatnonzero(mine.any(axis=1)) for mine in signatures]
        for column, used in enumerate(reached):
            part = signatures[column, used]  # (P, n)
            slow = self.modes.of(part, column)  # (P, K)
            damped[column, used] = slow * self.modes.share[:, column]
            gram[np.ix_(used, used)] += weights[column] * (part @ part.T - slow @ damped[column, used].T)
            score[used] += weights[column] * (
                part @ linear.residual[:, column] - damped[column, used] @ linear.slow_residual[:, column]
            )
        cross = linear.jacobian.correlate(signatures, weights) - linear.slow.through(damped, weights)  # (m, P)
        if self.calibration_residue is not None:
            cross = np.vstack([cross, self.calibration_residue.correlate(signatures, damped, self.modes, weights)])
        eliminated = linear.drive.eliminate(cross)
        told = gram.diagonal() * _ROUNDING_ERROR
        gram -= eliminated.T @ eliminated
        score -= eliminated.T @ linear.drive.forward
        gone = gram.diagonal() <= told  # what the drive takes whole leaves rounding errors
        gram[gone], gram[:, gone], score[gone] = 0.0, 0.0, 0.0
        return gram, score, eliminated

    def log_volume(self, drive: DriveElimination) -> float:
        """Return the log of how much of the prior of the drive (and of a calibration residue) the data leave.

        Needed only to compare fits under different priors.
        """
        return drive.log_volume() - self.drive_prior.log_roughness

    def move_drive(self, linear: Linearisation) -> None:
        """Move the drive to its posterior mean."""
        self.coefficients = self.coefficients + linear.drive.alone()[0]

    def residue_readings(self, linear: Linearisation) -> NDArray[np.float64] | float:
        """Return what the calibration residue most probably adds to the observations, shape (n, c + 1)."""
        if self.calibration_residue is None:
            return 0.0
        return self.calibration_residue.readings(linear.drive.alone()[1])

    def whitened_residual(self, linear: Linearisation) -> NDArray[np.float64]:
        """Return W(r − Jδ) with δ the drive's posterior step, shape (n, c + 1): for scans over tones and orders."""
        left = linear.residual - linear.jacobian.forward(linear.drive.alone()[0]) - self.residue_readings(linear)
        return (left - self.modes.back(self.modes.share * self.modes.of_each(left))) * self.inverse_variance


def known_walk(model: WorldModel) -> float:
    """Return the random walk of the biases that the model has already, m/s² per √s."""
    walks = [float(effect.parameters["strength_m_s2_rts"]) for effect in model.effects if effect.name == _WALK]
    return float(np.linalg.norm(walks))
