"""The whole automated cycle: station program, simulated instruments on TCP, service with its workers.

Sixteen positions and the closing record are measured at a thousandfold speed: 60 s at 200 Hz each, as the
method wants, so the records are those of a real cycle. A run takes some seconds; the faults that strike once
share one run, those that strike always another.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from serving import Service, running
from simulated_laboratory import instruments

from app.exchange.certificate import write_certificate_csv
from app.exchange.si import PARAMETER_UNITS
from app.main import working_lab
from app.services.simulated import certificate_lab, truth_values
from app.settings import Settings
from app.station.instruments.description import SIMULATED
from app.station.keeping.history import History
from app.station.keeping.spool import history_in
from simdevice.bench import Bench
from simdevice.certificate import Position, sixteen_positions
from simdevice.interference import Interference
from simdevice.scenarios import scenario
from simdevice.truth import mean_gyro
from solver.records import PARAMETERS

SEED = 7
ODDS = 1e-4
"""Probability with which a correct result is off by more than the bound; the seed fixes the outcome."""
ONCE = {
    "dropped@0/90": "gap",
    "stuck-x@0/180": "stuck",
    "stuck-y@90/0": "stuck",
    "spike@90/90": "spike",
    "saturation@90/270": "saturation",
    "wrong-position@180/90": "partner",
    "lost-reference@180/270": "lost-reference",
    "stall@270/180": "stall",
}
ALWAYS = {
    "dropped@0/90!": "gap",
    "stuck-x@0/180!": "stuck",
    "spike@0/270!": "spike",
    "stall@90/0!": "stall",
    "saturation@90/90!": "saturation",
    "lost-reference@90/270!": "lost-reference",
    "wrong-position@180/90!": "partner",
}


@dataclass
class Laboratory:
    """A service, and what is measured into it; every bench has a stand of its own there."""

    service: Service
    folder: Path
    stands: int = 0

    def stand_of(self, bench: Bench, **uncertainty: float) -> str:
        self.stands += 1
        name = f"S{self.stands}"
        with self.service.client() as client:
            said = {"name": name, "latitude_deg": np.degrees(bench.stand.latitude)}
            assert client.post("/stands", json=said).status_code == 201
            head = {"number": "C", "valid_from": "2000-01-01", "valid_until": "2100-01-01"}
            content = write_certificate_csv(certificate_lab(bench.stand.certificate))
            made = client.post(f"/stands/{name}/certificates", params=head, content=content,
                               headers={"content-type": "text/csv"})  # fmt: skip
            assert made.status_code == 201, made.text
            if uncertainty:
                assert client.put(f"/stands/{name}/uncertainty", json=uncertainty).status_code == 200
        return name


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    folder = tmp_path_factory.mktemp("laboratory")
    with running(Settings(data=folder / "data"), working_lab) as service:
        with service.client() as client:
            assert client.post("/gyros", json={"serial": "0417", "type": "GVK-6"}).status_code == 201
        yield Laboratory(service, folder)


@dataclass
class Run:
    """What a life of the station's program left."""

    code: int
    out: str
    err: str
    history: History
    result: dict | None
    session: dict

    @property
    def codes(self) -> list[tuple[str, str]]:
        """Events as (place, code)."""
        return [
            (f"{event.place.theta_deg:g}/{event.place.psi_deg:g}" if event.place else "", event.said.code)
            for event in self.history.events
        ]


@pytest.fixture
def cycle(laboratory: Laboratory, driftbook, tmp_path, monkeypatch) -> Callable[..., Run]:
    """Run the station's program on instruments that are served at these addresses."""
    monkeypatch.setenv("DRIFTBOOK_DATA", str(tmp_path / "user"))
    # Three seconds are long enough to wait for an instrument in this very process.
    config = tmp_path / "station.toml"
    config.write_text(SIMULATED.read_text("utf-8").replace("timeout_s = 5", "timeout_s = 3"), "utf-8")

    def run(served, stand: str, *options: object) -> Run:
        spool = tmp_path / "spool"
        outcome = driftbook(
            "station", "run", "--config", config, "--gyro", "0417", "--stand", stand,
            "--server", laboratory.service.url, "--token", laboratory.service.tokens["both"],
            "--spool", spool, "--speed", 1000, "--stand-address", served.stand,
            "--ammeter-address", served.ammeter, "--unattended", *options,
        )  # fmt: skip
        history = history_in(spool)
        with laboratory.service.client() as client:
            session = client.get(f"/sessions/{history.session}").json()
            found = history.result and client.get(history.result.removeprefix("/api/v1")).json()
        return Run(outcome.code, outcome.out, outcome.err, history, found, session)

    return run


def bench_of(name: str, **changed: object) -> Bench:
    return replace(scenario(name).bench(SEED), **changed)


def closed_cycle() -> list[Position]:
    places = list(sixteen_positions())
    return [*places, replace(places[0], repeat=1)]


def assert_true(run: Run, bench: Bench) -> None:
    """The result is the truth within its uncertainty.

    Deviations δ from the truth with covariance C have δᵀC⁻¹δ from χ² of 8 degrees of freedom, which exceeds its
    quantile with the probability ODDS; and none may be off by more than 4 standard uncertainties (8 parameters
    have 5e-4 for that together).
    """
    truth = truth_values(mean_gyro(bench, closed_cycle()))
    parameters = run.result["parameters"]
    off = np.array([parameters[name]["value"] - truth[name] for name in PARAMETERS])
    covariance = np.array(run.result["covariance"])
    assert off @ np.linalg.solve(covariance, off) < chi2.isf(ODDS, len(PARAMETERS))
    assert all(abs(off) < 4 * np.sqrt(np.diag(covariance)))
    assert [parameters[name]["unit"] for name in PARAMETERS] == [
        PARAMETER_UNITS[name][0] for name in PARAMETERS
    ]


def measured(run: Run) -> dict[tuple[float, float, int], dict]:
    rows = [item for item in run.session["positions"] if item["measurement"] is not None]
    return {(row["theta_deg"], row["psi_deg"], row["repeat"]): row["measurement"] for row in rows}


@pytest.mark.parametrize(
    ("changed", "options", "said"),
    [
        ("Driftbook,SIM-STAND", ("--speed", 1000), "--speed: Real instruments take their time."),
        ("Driftbook,SIM-AMMETER", ("--speed", 0.5), "--speed: Real instruments take their time."),
        (None, ("--server", "not a url"), "--server: “not a url” is not the address of a service."),
    ],
    ids=["real stand", "real ammeter", "no address"],
)
def test_what_cannot_go_well_is_refused_before_anything_is_begun(driftbook, tmp_path, changed, options, said):
    config = tmp_path / "station.toml"
    config.write_text(SIMULATED.read_text("utf-8").replace(changed or "\0", "ACME,RT-2"), "utf-8")
    spool = tmp_path / "spool"
    outcome = driftbook(
        "station", "run", "--config", config, "--gyro", "0417", "--stand", "S1", "--token", "t",
        "--server", "http://127.0.0.1:9", "--spool", spool, *options,
    )  # fmt: skip
    assert outcome.code == 2
    assert said in outcome.err
    assert not spool.exists()


def test_a_cycle_from_identity_to_the_calibrations_page(laboratory, cycle):
    bench = bench_of("gvk-6")
    stand = laboratory.stand_of(bench)
    with instruments(bench) as served:
        run = cycle(served, stand)
        assert run.code == 0, run.err
        assert_true(run, bench)
        assert [code for place, code in run.codes if place] == []
        assert len(measured(run)) == 17
        assert {item["revision"] for item in measured(run).values()} == {1}
        assert {item["duration_s"] for item in measured(run).values()} == {60.0}
        page = run.out.strip().splitlines()[-1]
        with laboratory.service.client(path="") as browser:
            assert page.startswith(f"{laboratory.service.url}/results/")
            # The page wants somebody who has signed in: it is there, and says so.
            assert browser.get(page.removeprefix(laboratory.service.url)).status_code in (200, 303)
        live = laboratory.service.client().get(f"/sessions/{run.history.session}/station").json()
        assert (live["phase"], live["waiting"], live["ended"]) == ("finished", 0, True)
        assert {cell["state"] for cell in live["cells"]} == {"recorded"}
        # The same command again finds nothing to do, and says the same.
        again = cycle(served, stand)
        assert (again.code, again.result, again.history.attempts) == (0, run.result, run.history.attempts)


def test_faults_that_strike_once_are_named_and_repaired(laboratory, cycle):
    bench = bench_of("gvk-6")
    stand = laboratory.stand_of(bench)
    with instruments(bench, faults=[*ONCE, "interrupted@180/0"]) as served:
        run = cycle(served, stand)
    assert run.code == 0, run.err
    assert_true(run, bench)
    for fault, code in ONCE.items():
        assert (fault.partition("@")[2], code) in run.codes
    # The connection that was cut in the middle of a block belongs to no position: none had to be measured again.
    assert {code for place, code in run.codes if place == ""} >= {"instruments-back"}
    there = [attempt for attempt in run.history.attempts if attempt.target == (180.0, 0.0, 0)]
    assert [attempt.abandoned for attempt in there] == [None]
    assert len(measured(run)) == 17


def test_faults_that_strike_always_are_refused_by_name(laboratory, cycle):
    bench = bench_of("gvk-6")
    stand = laboratory.stand_of(bench)
    with instruments(bench, faults=list(ALWAYS)) as served:
        run = cycle(served, stand)
    assert run.code == 1
    assert run.result is None
    # Which of two partners stands wrong their sum does not tell: 180/270 is refused with 180/90.
    named = {fault.partition("@")[2].removesuffix("!"): code for fault, code in ALWAYS.items()}
    for place, code in (named | {"180/270": "partner"}).items():
        assert run.codes.count((place, code)) >= 2
        assert f"{place} is not in the session" in run.err
    for place in set(named) - {"180/90"}:
        theta, psi = map(float, place.split("/"))
        assert (theta, psi, 0) not in measured(run)


def test_an_emergency_stop_ends_the_cycle_until_a_person_starts_it_again(laboratory, cycle):
    bench = bench_of("gvk-6")
    stand = laboratory.stand_of(bench)
    with instruments(bench, faults=["emergency-stop@90/180"]) as served:
        stopped = cycle(served, stand)
        assert stopped.code == 1
        assert "emergency stop" in stopped.err
        assert ("", "emergency-stop") in stopped.codes
        moved = served.laboratory.axes.encoders()
        # Started again without a word about the stop it does not move either.
        refused = cycle(served, stand)
        assert refused.code == 1
        assert served.laboratory.axes.encoders() == moved
        going_on = cycle(served, stand, "--release")
    assert going_on.code == 0, going_on.err
    assert_true(going_on, bench)
    assert len(measured(going_on)) == 17


def test_instruments_that_are_only_poor_give_a_true_result(laboratory, cycle):
    """Gain errors of +300 and −200 ppm, zero errors of 4 and −3 nA; mains, ripple, a clock that jitters.

    Nothing in the currents shows errors of gain and zero, so a laboratory states what its ammeter may do.
    """
    bench = bench_of("poor-ammeter", interference=Interference(mains=2e-8, ripple=5e-8, jitter=2e-4))
    stated = {"u_gain_x_ppm": 300, "u_gain_y_ppm": 300, "u_offset_x_ma": 4e-6, "u_offset_y_ma": 4e-6}
    stand = laboratory.stand_of(bench, **stated)
    with instruments(bench) as served:
        run = cycle(served, stand)
    assert run.code == 0, run.err
    assert_true(run, bench)


def test_a_range_that_is_too_small_is_refused_everywhere(laboratory, cycle):
    bench = bench_of("saturated")
    stand = laboratory.stand_of(bench)
    with instruments(bench) as served:
        run = cycle(served, stand, "--positions", "0/0,0/90,90/0")
    assert run.code == 1
    assert run.result is None
    assert measured(run) == {}
    assert {code for _, code in run.codes} >= {"saturation"}


def test_currents_that_creep_all_the_time_give_no_result_without_a_warning(laboratory, cycle):
    """The simulated records follow the session's plan, so waiting for the gyro does not warm them."""
    bench = bench_of("cold-start")
    stand = laboratory.stand_of(bench)
    with instruments(bench) as served:
        run = cycle(served, stand)
    assert run.code == 1
    assert {"partner", "closing"} & {code for _, code in run.codes}
    assert "do not fit together" in run.err or "is not in the session" in run.err


def test_parameters_that_were_not_found_are_no_success(laboratory, cycle):
    """At the pole there is no horizontal Earth rate."""
    bench = bench_of("pole")
    stand = laboratory.stand_of(bench)
    with instruments(bench) as served:
        run = cycle(served, stand, "--positions", "0/0,90/0,90/90,90/180,90/270")
    unknown = [name for name, item in run.result["parameters"].items() if item["value"] is None]
    assert run.code == 1
    assert unknown
    assert f"Not determined from these positions: {', '.join(unknown)}." in run.err


def test_a_wrong_position_that_has_no_partners_to_show_it_is_no_success(laboratory, cycle):
    """Four positions: the fit takes the mistake for another scale factor, of half the true one.

    The gyro is the test's own: the next calibration of it would be held against this one.
    """
    with laboratory.service.client() as client:
        assert client.post("/gyros", json={"serial": "0418", "type": "GVK-6"}).status_code == 201
    bench = bench_of("gvk-6")
    stand = laboratory.stand_of(bench)
    with instruments(bench, faults=["wrong-position@0/180!"]) as served:
        run = cycle(served, stand, "--gyro", "0418", "--positions", "0/0,0/90,0/180,90/0")
    assert run.code == 1
    assert run.result["parameters"]["kx"]["value"] < 0.6 * truth_values(bench.gyro)["kx"]
    assert "another position: 0/0, 0/90, 0/180, 90/0." in run.err


def test_a_stand_whose_certificate_states_degrees_is_no_stand_that_stands_wrong(laboratory, cycle):
    bench = bench_of("skewed")
    stand = laboratory.stand_of(bench)
    with instruments(bench) as served:
        run = cycle(served, stand, "--positions", "8")
    assert run.code == 0, run.err
    assert run.codes == []
