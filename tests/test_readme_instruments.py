"""The script of the README drives the simulated instruments, as it stands there."""

import re
import subprocess
import sys
from pathlib import Path

from tests.simdevice.instruments import Bench

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
SECTION = README.split("## Instruments without a laboratory\n")[1].split("\n## ")[0]
READY = re.compile(
    r"listening: stand TCPIP0::127\.0\.0\.1::(\d+)::SOCKET ammeter TCPIP0::127\.0\.0\.1::(\d+)::SOCKET\n"
)


def test_the_script_of_the_readme_measures():
    (script,) = re.findall(r"```python\n(.*?)```", SECTION, re.S)
    serve = [
        "simdevice",
        "serve",
        "--stand-port",
        "0",
        "--ammeter-port",
        "0",
        "--seed",
        "7",
        "--speed",
        "100",
    ]
    with subprocess.Popen(
        [sys.executable, "-m", "app", *serve], stdout=subprocess.PIPE, text=True, encoding="utf-8"
    ) as instruments:
        try:
            ports = READY.fullmatch(instruments.stdout.readline())
            for written, port in zip(("5025", "5026"), ports.groups(), strict=True):
                assert script.count(f"::{written}::") == 1
                script = script.replace(f"::{written}::", f"::{port}::")
            said = subprocess.run(
                [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
            )
        finally:
            instruments.kill()
    assert (said.returncode, said.stderr) == (0, "")
    lines = said.stdout.splitlines()
    assert re.fullmatch(r"Driftbook,SIM-STAND,7,[\d.]+", lines[0])
    assert re.fullmatch(r"Driftbook,SIM-AMMETER,7,[\d.]+", lines[1])
    assert lines[2] == "stand at 90.0000,180.0000"
    now = [float(number) for number in lines[3].removeprefix("currents now ").removesuffix(" A").split(",")]
    found = re.fullmatch(r"2000 samples, mean (\S+) (\S+) A", lines[4])
    # A reading of 0.1 s has 2.8e-8 A of noise (3e-4 °/√h over 10 rad/(s·A)), the mean of 10 s a tenth of it.
    assert all(abs(float(mean) - one) < 5 * 2.8e-8 for mean, one in zip(found.groups(), now, strict=True))
    assert lines[5] == 'errors: 0,"No error" 0,"No error"'


def test_the_instruments_know_every_command_of_the_readme():
    commands = re.findall(r"`([A-Z]+[a-z]*:?[^`]*)`", SECTION.split("| stand |")[1])
    assert len(commands) > 10
    bench = Bench()
    for command in set(commands) - {"RUN"}:
        errors = []
        for instrument in (bench.stand, bench.ammeter):
            list(instrument.respond(command.encode()))
            errors.append(str(instrument.status.next_error()))
        assert [error for error in errors if "Undefined header" not in error], command
