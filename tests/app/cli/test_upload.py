"""What `driftbook upload` says of a session that it brings to the service."""

import json

import pytest
from serving import GRID


@pytest.fixture
def folder(tmp_path):
    """A session as it stands on a disk, as the laboratory has it."""
    lines = [f"{theta},{psi},{0.001 + 1e-5 * n},-0.002" for n, (theta, psi) in enumerate(GRID)]
    (tmp_path / "means.csv").write_text("\n".join(["theta_deg,psi_deg,jx_ma,jy_ma", *lines, ""]))
    write_certificate(tmp_path, 6.9)
    write_facts(tmp_path, 55.7558)
    return tmp_path


def write_certificate(folder, alpha):
    head = "theta_deg,psi_deg,alpha_arcsec,beta_arcsec,gamma_arcsec"
    lines = [f"{theta},{psi},{alpha},-16.4,6.6" for theta, psi in reversed(GRID)]
    (folder / "certificate.csv").write_text("\n".join([head, *lines, ""]))


def write_facts(folder, latitude):
    (folder / "session.json").write_text(
        json.dumps({"gyro": "0417", "stand": "S1", "latitude_deg": latitude})
    )


@pytest.fixture
def upload(driftbook, service, stand):
    def run(folder):
        outcome = driftbook("upload", folder, "--server", service.url, "--token", service.tokens["both"])
        assert outcome.code == 0
        assert "session 1, 16 positions" in outcome.out
        return [line for line in outcome.err.splitlines() if line.startswith("warning: ")]

    return run


def test_nothing_where_the_book_says_the_same(upload, folder):
    assert upload(folder) == []


def test_another_certificate_and_latitude_than_the_ones_that_count(upload, folder):
    write_certificate(folder, 7.9)
    write_facts(folder, 54.3)
    latitude, certificate = upload(folder)
    assert "54.3°; that of stand S1, 55.7558°, is used" in latitude
    assert "is not certificate C-17 of stand S1, which is used" in certificate


def test_what_was_noticed_in_the_files(upload, folder):
    text = (folder / "means.csv").read_text().replace("jx_ma,jy_ma", "jx_ma,jy_ma,mood", 1)
    (folder / "means.csv").write_text(
        "\n".join(line + ",good" * ("mood" not in line) for line in text.split())
    )
    (warning,) = upload(folder)
    assert "mood" in warning
