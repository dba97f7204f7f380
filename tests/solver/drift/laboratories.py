"""Simulated laboratories as the solver sees them: the sessions of each stand, solved."""

from dataclasses import replace

import numpy as np

from simdevice.fleet import YEAR, Jump
from simdevice.laboratory_life import LaboratoryLife
from solver.drift.stands.attribution import StandHistory
from solver.estimators.batch import Stand, solve_sessions
from solver.estimators.stand_attitude import level_east_signature, turns_of_sessions

ARCMIN = np.pi / 180 / 60
DEG_PER_H = np.pi / 180 / 3600
NAMES = ("kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk")
SCATTER = dict(zip(NAMES, (2e-3,) * 4 + (0.02 * DEG_PER_H,) * 2 + (0.003 * DEG_PER_H,) * 2, strict=True))
"""About what each parameter of `simdevice.laboratory_life.LABORATORY_GYRO` scatters by from start to start, SI."""


def stand_histories(laboratory: LaboratoryLife) -> list[StandHistory]:
    """Solve all sessions of a laboratory."""
    means = laboratory.means()
    first = laboratory.stands[0].birth
    stand = Stand(means.theta, means.psi, first.latitude)
    solution = solve_sessions(stand, means.angles, means.jx, means.jy, means.u_jx, means.u_jy)
    turns = turns_of_sessions(
        stand, means.angles, (means.jx, means.jy), (means.u_jx, means.u_jy), solution.values
    )
    east = level_east_signature(solution.values, first.latitude)
    u = solution.standard_uncertainties
    labels = np.array(
        [
            (visit.stand, visit.gyro, visit.start, laboratory.stands[visit.stand].certificate(visit.time))
            for visit in laboratory.visits
        ]
    )
    time = np.array([visit.time for visit in laboratory.visits])
    histories = []
    for number in range(len(laboratory.stands)):
        on = labels[:, 0] == number
        histories.append(
            StandHistory(
                time=time[on], gyro=labels[on, 1], kind=np.zeros(on.sum(), np.int64), certificate=labels[on, 3],
                start=labels[on, 2], value=solution.values[on], u=u[on], level_east=east[on],
                turn=turns.value[on], u_turn=turns.u[on], correlation=turns.correlation[on],
                u_certificate=np.zeros((on.sum(), 2)),
                chi2=solution.chi2[on], dof=np.full(on.sum(), 2.0 * means.jx.shape[1] - 8.0),
            )
        )  # fmt: skip
    return histories


def with_changing_gyros(laboratory: LaboratoryLife, rng: np.random.Generator) -> LaboratoryLife:
    """Every gyro changes by itself: steps of 1 to 30 scatters in one or all parameters, or a drift."""
    gyros = []
    years = laboratory.visits[-1].time / YEAR
    for gyro in laboratory.gyros:
        size = rng.choice([1.0, 3.0, 5.0, 10.0, 30.0]) * rng.choice([-1.0, 1.0])
        names = NAMES if rng.random() < 0.2 else (str(rng.choice(NAMES)),)
        change = {
            name: float(size * SCATTER[name] * (1.0 if len(names) == 1 else rng.normal())) for name in names
        }
        if rng.random() < 0.3:
            gyros.append(replace(gyro, drift={name: amount / YEAR for name, amount in change.items()}))
        else:
            gyros.append(replace(gyro, jumps=(Jump(float(rng.uniform(0.05, 0.98) * years) * YEAR, change),)))
    return replace(laboratory, gyros=tuple(gyros))
