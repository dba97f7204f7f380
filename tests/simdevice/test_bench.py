"""The bench: steady currents, records, means. The geometry is written out again with matrices."""

import multiprocessing
import random
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.ammeter import Ammeter, Channel
from simdevice.bench import (
    Bench,
    SimulatedSession,
    mean_currents,
    position_record,
    run_session,
    steady_currents,
)
from simdevice.certificate import Position, certify, draw_certificate, sixteen_positions
from simdevice.gyro import Gyro
from simdevice.noise import RateNoise
from simdevice.stand import Stand

OMEGA = 7.292115e-5  # rad/s, the Earth's rate (GRS 80)
GYRO = Gyro(kx=10.0, ky=9.9, kxy=2.0, kyx=-1.5, w0x=7e-6, w0y=-4e-6, wg=3e-5, wk=1e-5)
CHANNEL = Channel(step=1e-9, limit=1e-3, noise=5e-8)
STAND = Stand(0.97, draw_certificate(1), seed=2)
BENCH = Bench(GYRO, STAND, Ammeter(CHANNEL, CHANNEL), RateNoise(8e-8), rate=200.0, duration=2.0, seed=3)
SIXTEEN = sixteen_positions()


def bits(session: SimulatedSession) -> dict[tuple[float, float, int], bytes]:
    return {
        (p.theta, p.psi, p.repeat): p.t.tobytes() + p.jx.tobytes() + p.jy.tobytes() for p in session.positions
    }


@pytest.mark.parametrize("latitude", [0.97, 0.0, -0.6, np.pi / 2])
@pytest.mark.parametrize("kx", [10.0, -10.0])
def test_steady_currents_satisfy_the_observation_equations(latitude: float, kx: float) -> None:
    rng = np.random.default_rng(7)
    positions = [*SIXTEEN, *(Position(*rng.uniform(0, 2 * np.pi, 2)) for _ in range(8))]
    angles = rng.normal(0, 0.1, (len(positions), 3))  # degrees of misalignment
    stand = Stand(latitude, certify([p.theta for p in positions], [p.psi for p in positions], angles))
    gyro = replace(GYRO, kx=kx)
    jx, jy = steady_currents(Bench(gyro, stand), positions)
    north, up = OMEGA * np.cos(latitude), OMEGA * np.sin(latitude)
    for row, position in enumerate(positions):
        (ca, cb, cc, ct, cp) = np.cos([*angles[row], position.theta, position.psi])
        (sa, sb, sc, st, sp) = np.sin([*angles[row], position.theta, position.psi])
        commanded = np.array([[cp, sp, 0], [-sp, cp, 0], [0, 0, 1]]) @ [[1, 0, 0], [0, ct, st], [0, -st, ct]]
        small = (
            np.array([[cc, sc, 0], [-sc, cc, 0], [0, 0, 1]])
            @ [[cb, 0, -sb], [0, 1, 0], [sb, 0, cb]]
            @ [[1, 0, 0], [0, ca, sa], [0, -sa, ca]]
        )
        turned = small @ commanded  # paper, eq. (9)
        a, b, c, d = turned[0, 1], turned[1, 1], turned[0, 2], turned[1, 2]  # eq. (14)
        left_x = kx * jx[row] + 2.0 * jy[row] + 7e-6 + 3e-5 * c - 1e-5 * d
        left_y = -1.5 * jx[row] + 9.9 * jy[row] - 4e-6 + 1e-5 * c + 3e-5 * d
        # Relative to the Earth rate, which makes the right side.
        assert left_x == pytest.approx(north * a + up * c, abs=1e-12 * OMEGA)
        assert left_y == pytest.approx(north * b + up * d, abs=1e-12 * OMEGA)


def test_a_record_without_noise_is_the_steady_current() -> None:
    bench = replace(BENCH, ammeter=Ammeter(), noise=RateNoise())
    jx, jy = steady_currents(bench, SIXTEEN)
    for row, record in enumerate(run_session(bench, SIXTEEN).positions):
        assert (record.jx == jx[row]).all()
        assert (record.jy == jy[row]).all()


def test_a_record_has_the_length_and_times_asked_for() -> None:
    session = run_session(replace(BENCH, duration=60.0), SIXTEEN[:1])
    record = session.positions[0]
    assert len(record.t) == len(record.jx) == len(record.jy) == 12000
    assert record.t[0] == 0.0
    # 60 s: n times the time step; a quotient rounds once.
    assert len(record.t) * np.median(np.diff(record.t)) == pytest.approx(60.0, rel=1e-12)


def test_a_session_keeps_the_order_asked_for_and_its_truth() -> None:
    session = run_session(BENCH, SIXTEEN)
    assert [(p.theta, p.psi, p.repeat) for p in session.positions] == [
        (p.theta, p.psi, p.repeat) for p in SIXTEEN
    ]
    assert session.truth is GYRO
    assert session.stand is STAND
    assert session.certificate is STAND.certificate


def test_white_noise_has_the_deviation_and_correlation_of_its_coefficients() -> None:
    n_walk, f = 8e-8, 200.0
    noise = 5e-8
    bench = replace(BENCH, duration=600.0, ammeter=Ammeter(Channel(noise=noise), Channel(noise=noise)))
    record = position_record(bench, SIXTEEN[6])
    steady = np.array(steady_currents(bench, SIXTEEN[6:7]))
    errors = np.array([record.jx, record.jy]) - steady
    n = errors.shape[1]
    # Currents are K⁻¹·rates; rate samples of N·√f, independent in x and y.
    inverse = np.linalg.inv([[10.0, 2.0], [-1.5, 9.9]])
    covariance = n_walk**2 * f * inverse @ inverse.T + noise**2 * np.eye(2)
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), errors)
    # If the covariance is right, each row's sum of squares is χ² with n degrees (the mean is known) …
    low, high = chi2.ppf([0.0005, 0.9995], n)
    squares = np.sum(whitened**2, axis=1)
    assert ((low < squares) & (squares < high)).all()
    # … and the rows' products, at lag 0 between rows and at lag 1 within them, have deviation √n.
    assert abs(whitened[0] @ whitened[1]) < 4 * np.sqrt(n)
    assert abs(whitened[0, 1:] @ whitened[0, :-1]) < 4 * np.sqrt(n)
    assert abs(whitened[1, 1:] @ whitened[1, :-1]) < 4 * np.sqrt(n)


def test_quantised_records_hold_whole_steps_and_stay_within_the_limit() -> None:
    channel = Channel(step=1e-7, limit=2e-6, noise=5e-8)
    session = run_session(replace(BENCH, ammeter=Ammeter(channel, channel)), SIXTEEN)
    readings = np.array([[p.jx, p.jy] for p in session.positions])
    codes = readings / 1e-7
    # Codes up to 20, one division: 1e-14.
    np.testing.assert_allclose(codes, np.rint(codes), rtol=0, atol=1e-13)
    assert readings.max() == 20 * 1e-7  # some positions are beyond 2 µA
    assert readings.min() == -20 * 1e-7


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_bytes_do_not_depend_on_workers_or_order(workers: int) -> None:
    positions = list(sixteen_positions(repeats=2))
    reference = bits(run_session(BENCH, positions))
    random.Random(workers).shuffle(positions)
    assert bits(run_session(BENCH, positions, workers=workers)) == reference


def test_bytes_do_not_depend_on_the_process() -> None:
    positions = SIXTEEN[:4]
    # Started afresh: nothing of this process's state can be shared.
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        records = tuple(pool.map(partial(position_record, BENCH), positions))
    assert bits(SimulatedSession(BENCH, records)) == bits(run_session(BENCH, positions))


def test_more_positions_and_repeats_change_no_other_record() -> None:
    extra = Position(0.4, 1.2)
    stand = replace(STAND, certificate=draw_certificate(1, (*SIXTEEN, extra)))
    more = bits(run_session(replace(BENCH, stand=stand), (extra, *sixteen_positions(repeats=3))))
    fewer = bits(run_session(BENCH, SIXTEEN))
    assert fewer == {key: more[key] for key in fewer}


def test_every_record_has_noise_of_its_own() -> None:
    session = run_session(BENCH, sixteen_positions(repeats=2))
    errors = [
        (jx - jx.mean(), jy - jy.mean())
        for jx, jy in ((record.jx, record.jy) for record in session.positions)
    ]
    rows = np.array([row for pair in errors for row in pair])
    correlation = np.corrcoef(rows)
    between = correlation[np.triu_indices_from(correlation, 1)]
    # Of 400 independent samples a correlation has deviation 0.05; 2016 pairs stay within 5.5 of it.
    # Two channels of one record share the gyro's rate noise through the cross-coupling: −0.05 here.
    assert np.abs(between).max() < 5.5 / np.sqrt(400)


def test_another_seed_is_another_noise_on_the_same_truth() -> None:
    one, other = run_session(BENCH, SIXTEEN), run_session(replace(BENCH, seed=4), SIXTEEN)
    assert not set(bits(one).values()) & set(bits(other).values())
    assert steady_currents(BENCH, SIXTEEN)[0].tobytes() == steady_currents(other.bench, SIXTEEN)[0].tobytes()


def test_a_part_added_leaves_the_other_parts_as_they_were() -> None:
    noisy = Ammeter(Channel(noise=5e-8), Channel(noise=5e-8))
    only_x = Ammeter(Channel(noise=5e-8), Channel())

    def record(ammeter: Ammeter, walk: float) -> np.ndarray:
        made = position_record(replace(BENCH, ammeter=ammeter, noise=RateNoise(walk)), SIXTEEN[3])
        return np.array([made.jx, made.jy])

    neither, rate, meter, both = (
        record(ammeter, walk) for ammeter in (Ammeter(), noisy) for walk in (0.0, 8e-8)
    )
    # Sums of currents below 1e-5 A in another order: a few roundings of 1e-21.
    np.testing.assert_allclose(both - rate, meter - neither, rtol=0, atol=1e-20)
    assert np.std(rate - neither) > 1e-8
    assert np.std(meter - neither) > 1e-8
    # A channel's noise is no business of the other's.
    half = record(only_x, 8e-8)
    assert half[0].tobytes() == both[0].tobytes()
    assert half[1].tobytes() == rate[1].tobytes()


@pytest.mark.parametrize("run", [run_session, mean_currents])
def test_a_position_named_twice_is_refused(run: Callable[[Bench, list[Position]], object]) -> None:
    with pytest.raises(ValueError, match="named twice"):
        run(BENCH, [Position(0.0, 0.0), Position(0.0, 2 * np.pi)])
    with pytest.raises(ValueError, match="at least one position"):
        run(BENCH, [])


def test_impossible_benches_and_workers_are_refused() -> None:
    with pytest.raises(ValueError, match="greater than zero"):
        replace(BENCH, rate=0.0)
    with pytest.raises(ValueError, match="shorter than one sample"):
        replace(BENCH, duration=0.001)
    with pytest.raises(ValueError, match="at least one"):
        run_session(BENCH, SIXTEEN, workers=0)
