"""Records of currents: checks, positions, means."""

from dataclasses import replace

import numpy as np
import pytest

from app.errors import Invalid
from app.exchange.record_checks import duration_and_rate
from app.exchange.records import (
    means_row,
    position_of,
    read_record,
    record_name,
    write_record_csv,
    write_record_parquet,
)
from app.exchange.rows import CurrentRecord

N = 12000  # 60 s at 200 Hz
T = np.arange(N) / 200


def noisy(seed: int = 1, n: int = N) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0045, 1e-5, n)


def record(
    t_s: np.ndarray = T, jx_ma: np.ndarray | None = None, jy_ma: np.ndarray | None = None
) -> CurrentRecord:
    jx_ma = noisy(1, len(t_s)) if jx_ma is None else jx_ma
    jy_ma = noisy(2, len(t_s)) if jy_ma is None else jy_ma
    return CurrentRecord(90.0, 270.0, t_s, jx_ma, jy_ma)


def codes(item: CurrentRecord) -> list[str]:
    _, warnings = read_record(write_record_parquet(item), "theta090_psi270.parquet")
    return [warning.code for warning in warnings]


def test_a_minute_at_200_hertz_is_the_method() -> None:
    assert codes(record()) == []


@pytest.mark.parametrize(
    ("samples", "rate", "below"),
    [
        (12000, 200.0, 0),
        (11989, 200.0, 0),  # 59.945 s: within 0.1 % of 60 s
        (11987, 200.0, 1),  # 59.935 s: beyond it
        (12000, 199.81, 0),  # within 0.1 % of 200 Hz; 60.06 s
        (12000, 199.79, 1),
        (2000, 100.0, 2),
    ],
)
def test_the_tolerance_of_the_method_is_a_thousandth(samples: int, rate: float, below: int) -> None:
    assert codes(record(np.arange(samples) / rate)) == ["below-method"] * below


def test_duration_is_samples_times_the_median_step_whatever_the_clock_adds() -> None:
    jitter = np.random.default_rng(1).uniform(-1e-5, 1e-5, N)
    duration, rate = duration_and_rate(T + 1e6 + jitter)
    assert duration == pytest.approx(60.0, rel=1e-4)  # the jitter moves the median step by less
    assert rate == pytest.approx(200.0, rel=1e-4)
    assert duration_and_rate(T) == (60.0, 200.0)
    assert duration_and_rate(np.arange(600) * 0.1) == (60.0, 10.0)


def test_gaps_are_counted_and_named_by_row() -> None:
    t_s = T.copy()
    t_s[5000:] += 0.0026  # 1.52 steps
    t_s[7000:] += 1.0
    t_s[9000:] += 0.0024  # 1.48 steps: no gap
    _, (warning,) = read_record(write_record_csv(record(t_s)), "theta090_psi270.csv")
    assert warning.code == "gap"
    assert warning.values["count"] == 2
    assert "before row 5002 (1.52×), 7002 (201×)" in warning.text


def test_a_channel_that_never_changes_is_stuck() -> None:
    _, (warning,) = read_record(write_record_parquet(record(jy_ma=np.full(N, 0.001))), "x.parquet")
    assert (warning.code, warning.values["channel"]) == ("channel-stuck", "jy")


def test_a_channel_that_stops_changing_is_stuck_from_that_row() -> None:
    jx = noisy()
    jx[6000:6300] = jx[6000]
    _, (warning,) = read_record(write_record_csv(record(jx_ma=jx)), "theta090_psi270.csv")
    assert (warning.code, warning.values["row"], warning.values["length"]) == ("channel-stuck", 6002, 300)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_channel_at_the_end_of_its_range_is_saturated(sign: int) -> None:
    wave = sign * np.minimum(np.sin(np.arange(N) / 500) * 0.01 + noisy() * 0.1, 0.0095)
    _, (warning,) = read_record(write_record_csv(record(jx_ma=wave)), "theta090_psi270.csv")
    assert warning.code == "channel-saturated"
    assert warning.values["value"] == sign * 0.0095
    first = warning.values["row"] - 2
    assert (wave[first : first + warning.values["length"]] == sign * 0.0095).all()


@pytest.mark.parametrize("quantum_ma", [1e-6, 1e-5, 2e-5, 1e-4])
def test_coarse_but_honest_quantisation_is_no_fault(quantum_ma: float) -> None:
    # From a tenth of the noise's standard deviation to ten times it, where few values are left.
    coarse = np.round(noisy() / quantum_ma) * quantum_ma
    if len(np.unique(coarse)) > 1:
        assert codes(record(jx_ma=coarse)) == []


@pytest.mark.parametrize("quantum_ma", [0.0, 1e-5, 2e-5])
def test_a_value_that_leaps_is_named_with_its_row(quantum_ma: float) -> None:
    jx = noisy()
    if quantum_ma:
        jx = np.round(jx / quantum_ma) * quantum_ma
    jx[7000] = 4.0
    _, (warning,) = read_record(write_record_csv(record(jx_ma=jx)), "theta090_psi270.csv")
    assert (warning.code, warning.values["channel"], warning.values["row"]) == ("spike", "jx", 7002)


def test_what_drifts_and_waves_does_not_leap() -> None:
    wave = 0.01 * np.sin(np.arange(N) / 300) + np.linspace(0.0, 0.05, N)
    assert codes(record(jx_ma=wave + noisy())) == []


def test_one_long_file_is_cut_into_its_measurements() -> None:
    theta, psi = [0, 0, 0, 0, 90, 90, 0, 0], [0, 0, 90, 90, 0, 0, 0, 0]
    rows = "".join(f"{t},{p},{i},{i}.5,{-i}\n" for i, (t, p) in enumerate(zip(theta, psi, strict=True)))
    records, _ = read_record(f"theta_deg,psi_deg,t_s,jx_ma,jy_ma\n{rows}".encode(), "long.csv")
    assert [(r.theta_deg, r.psi_deg, r.repeat, len(r.t_s)) for r in records] == [
        (0, 0, 0, 2), (0, 90, 0, 2), (90, 0, 0, 2), (0, 0, 1, 2),
    ]  # fmt: skip
    assert records[3].jx_ma.tolist() == [6.5, 7.5]


def test_time_may_begin_anew_at_each_position_and_repeats_may_be_told() -> None:
    text = "theta_deg,psi_deg,t_s,jx_ma,jy_ma,repeat\n" + "".join(
        f"-90,360,{t},1,2,{repeat}\n" for repeat in (1, 0) for t in range(3)
    )
    records, _ = read_record(text.encode(), "long.csv")
    assert [(r.theta_deg, r.psi_deg, r.repeat) for r in records] == [(270.0, 0.0, 1), (270.0, 0.0, 0)]


def test_a_repeat_that_comes_back_is_refused_with_the_row() -> None:
    text = "theta_deg,psi_deg,t_s,jx_ma,jy_ma,repeat\n" + "".join(
        f"{theta},0,{t},1,2,0\n" for theta in (0, 90, 0) for t in range(2)
    )
    with pytest.raises(Invalid) as caught:
        read_record(text.encode(), "long.csv")
    (item,) = caught.value.problems
    assert (item.message.code, item.row, item.column) == ("duplicate-position", 6, "repeat")


def test_a_wrong_angle_in_a_long_file_is_named_once_by_its_first_row() -> None:
    text = "theta_deg,psi_deg,t_s,jx_ma,jy_ma\n0,0,0,1,2\n0,x,1,1,2\n0,x,2,1,2\n"
    with pytest.raises(Invalid) as caught:
        read_record(text.encode(), "long.csv")
    assert [(item.row, item.column) for item in caught.value.problems] == [(3, "psi_deg")]


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("theta090_psi270.csv", (90.0, 270.0, None)),
        ("theta090_psi270_repeat1.csv.gz", (90.0, 270.0, 1)),
        ("records/Theta0_Psi22.5.parquet", (0.0, 22.5, None)),
        ("C:\\stand\\theta-90_psi360.npz", (270.0, 0.0, None)),
        ("0417_theta180_psi090_evening.csv", (180.0, 90.0, None)),
        ("theta090.csv", None),
        ("means.csv", None),
    ],
)
def test_a_position_is_read_from_a_name(name: str, place: tuple[float, float, int | None] | None) -> None:
    assert position_of(name) == place


@pytest.mark.parametrize("place", [(0.0, 0.0, 0), (90.0, 270.0, 1), (22.5, 337.25, 12), (1e-7, 359.999, 0)])
def test_a_name_written_is_a_name_read(place: tuple[float, float, int]) -> None:
    assert position_of(record_name(*place, "csv")) == (*place[:2], place[2] or None)
    assert record_name(90.0, 270.0, 0, "csv") == "theta090_psi270.csv"


def test_the_caller_knows_better_than_the_name_and_is_told() -> None:
    data = write_record_csv(record())
    (read,), (warning,) = read_record(data, "theta000_psi000.csv", theta_deg=90.0, psi_deg=270.0, repeat=2)
    assert (read.theta_deg, read.psi_deg, read.repeat) == (90.0, 270.0, 2)
    assert warning.code == "position-differs"


def test_a_file_brought_for_a_position_must_not_hold_another() -> None:
    text = "theta_deg,psi_deg,t_s,jx_ma,jy_ma\n0,0,0,1,2\n0,0,1,1,2\n0,90,2,1,2\n0,90,3,1,2\n"
    with pytest.raises(Invalid) as caught:
        read_record(text.encode(), "long.csv", theta_deg=0.0, psi_deg=0.0)
    (item,) = caught.value.problems
    assert (item.message.code, item.row) == ("position-differs", 4)


def test_metadata_of_parquet_tells_the_position_before_its_name() -> None:
    (read,), warnings = read_record(write_record_parquet(replace(record(), repeat=3)), "a.parquet")
    assert (read.theta_deg, read.psi_deg, read.repeat, warnings) == (90.0, 270.0, 3, [])


def test_means_of_a_record() -> None:
    row = means_row(replace(record(), repeat=2, temperature_c=21.5))
    assert (row.theta_deg, row.psi_deg, row.repeat, row.temperature_c) == (90.0, 270.0, 2, 21.5)
    assert (row.duration_s, row.rate_hz) == (60.0, 200.0)
    # The mean of 12,000 white samples of 1e-5 has a standard deviation of 9.1e-8; five of them.
    assert row.jx_ma == pytest.approx(0.0045, abs=4.6e-7)
    # With some 50 degrees of freedom u is known to 10 %, nearly three times that.
    assert row.u_jx_ma == pytest.approx(1e-5 / np.sqrt(N), rel=0.28)
    assert row.u_jy_ma is not None


def test_a_channel_without_noise_has_no_known_uncertainty() -> None:
    row = means_row(record(jx_ma=np.full(N, 0.5)))
    assert (row.u_jx_ma, row.dof_jx) == (None, None)
    assert row.u_jy_ma is not None
    assert row.dof_jy is not None
    assert row.dof_jy >= 6


def test_means_are_the_same_bits_whatever_the_file() -> None:
    item = record()
    (csv,), _ = read_record(write_record_csv(item), "theta090_psi270.csv")
    (parquet,), _ = read_record(write_record_parquet(item), "theta090_psi270.parquet")
    long = "theta_deg,psi_deg,t_s,jx_ma,jy_ma\n0,0,0,1,1\n0,0,1,1,1\n" + "".join(
        f"90,270,{t!r},{x!r},{y!r}\n"
        for t, x, y in zip(item.t_s.tolist(), item.jx_ma.tolist(), item.jy_ma.tolist(), strict=True)
    )
    (_, cut), _ = read_record(long.encode(), "long.csv")
    assert means_row(csv) == means_row(parquet) == means_row(cut) == means_row(item)
