"""The service as the station needs it: one attempt per call, raising `Unreachable` or `ServerRefused`."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from types import TracebackType
from typing import Any, Final, Self

from app.station.contracts import Certified, Place
from app.station.keeping.entries import Begun
from app.station.keeping.history import Attempt
from app.station.sending.client import asked, connected, currents_request

_LONGEST_NOTE: Final = 1000


class Service:
    """A connection to the service; every thread has its own."""

    def __init__(self, server: str, token: str, timeout_s: float = 60.0) -> None:
        self._client = connected(server, token, timeout_s)

    def open_session(self, begun: Begun) -> int:
        """Open the run's session, or find it again by the run's key."""
        facts = asdict(begun)
        said = {name: facts[name] for name in ("gyro", "stand", "certificate", "temperature_c")}
        body = {name: value for name, value in said.items() if value is not None}
        body["started_at"] = begun.started_at.isoformat()
        key = {"Idempotency-Key": f"station-{begun.run}"}
        return int(asked(self._client, "POST", "/sessions", "id", json=body, headers=key)["id"])

    def described(self, session: int) -> tuple[tuple[Certified, ...], str]:
        """Positions of the certificate that the session names, in its order, and the gyro's type."""
        said = asked(self._client, "GET", f"/sessions/{session}", "positions", "type")
        found = {
            Place(item["theta_deg"], item["psi_deg"]): _turned(item["certified"])
            for item in said["positions"]
        }
        return tuple(Certified(*item) for item in found.items()), str(said["type"])

    def put_record(self, session: int, attempt: Attempt, content: bytes) -> None:
        """Bring a record, and what the checks said of it; the same again changes nothing.

        An answer that does not name it is none.
        """
        path, params = currents_request(session, *attempt.target)
        note = _objections(attempt)
        said = params | ({"note": note} if note else {})
        asked(self._client, "PUT", path, "record_sha256", params=said, content=content)

    def calibrate(self, session: int, method: str) -> str:
        """Ask for the calibration; give the job."""
        path = f"/sessions/{session}/calibrations"
        return str(asked(self._client, "POST", path, "id", json={"method": method})["id"])

    def job(self, job: str) -> dict[str, Any]:
        """How a job stands."""
        return asked(self._client, "GET", f"/jobs/{job}", "state", "result", "error")

    def calibration(self, address: str) -> dict[str, Any]:
        """A result, by the address that its job gave."""
        path = str(self._client.base_url.copy_with(path=address))
        return asked(self._client, "GET", path, "method")

    def page(self, address: str) -> str:
        """Address of the page of a result, by the address that its job gave."""
        number = address.rsplit("/", 1)[-1]
        return str(self._client.base_url.copy_with(path=f"/results/{number}"))

    def report(self, session: int, said: dict[str, Any]) -> dict[str, Any]:
        """Tell how the station stands; the answer brings commands."""
        path = f"/sessions/{session}/station"
        return asked(self._client, "PUT", path, "commands", "events_seen", json=said)

    def close(self) -> None:
        """Close the connection."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _turned(angles: Mapping[str, float]) -> float:
    """√(α² + β² + γ²), arcsec."""
    return math.hypot(angles["alpha_arcsec"], angles["beta_arcsec"], angles["gamma_arcsec"])


def _objections(attempt: Attempt) -> str:
    """What the checks said of a take that is sent all the same; nothing when they are content with it."""
    findings = attempt.judged.findings if attempt.judged is not None else ()
    said = dict.fromkeys(finding.said.text for finding in findings)
    return f"suspicious: {' '.join(said)}"[:_LONGEST_NOTE] if said else ""
