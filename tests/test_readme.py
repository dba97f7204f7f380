"""The README tells the truth about commands, parameters and files."""

import re
import shlex
from pathlib import Path

import pytest
from typer.main import get_command

from app.cli import commands
from solver.records import PARAMETERS

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
CALLS = [
    shlex.split(line.partition("driftbook ")[2].partition(" #")[0].partition(" > ")[0].rstrip("& "))
    for line in re.findall(r"^(?:.*&& .*)?driftbook .*$", README, re.M)
]


def test_the_two_commands_are_one_line_each():
    for heading in ("set up and run", "set up and pass the tests"):
        line = README.split(f"# {heading}\n")[1].split("\n")[0]
        assert line.startswith("python3 -m venv .uv && ")
        assert README.split(f"# {heading}\n")[1].split("\n")[1] in ("", "```")


@pytest.mark.parametrize("call", CALLS, ids=" ".join)
def test_a_command_of_the_readme_exists_with_its_options(call):
    command = get_command(commands)
    context = command.make_context("driftbook", [], resilient_parsing=True)
    while getattr(command, "get_command", None) is not None:
        word = call.pop(0)
        command = command.get_command(context, word)
        assert command is not None, f"there is no command {word}"
    known = {
        option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)
    }
    assert {word for word in call if word.startswith("--")} <= known


def test_the_symbol_table_names_every_parameter():
    table = README.split("## Symbols")[1].split("## ")[0]
    assert {name for name in PARAMETERS if f"`{name}`" in table} == set(PARAMETERS)


def test_every_path_the_readme_names_is_there():
    named = re.findall(r"`((?:app|solver|simdevice|migrations|templates|tests|\.ci)/[\w/.]*)`", README)
    pictures = re.findall(r"\]\(((?!http)[^)#]+)\)", README)
    assert named
    assert [path for path in (*named, *pictures) if not (ROOT / path).exists()] == []
