"""Accounts and tokens."""

import secrets
from datetime import timedelta
from typing import Annotated

import typer

from app.cli.options import Data, settings
from app.services import access
from app.services.access import SYSTEM
from app.services.opening import open_lab

users = typer.Typer(help="Accounts of people.", no_args_is_help=True)
tokens = typer.Typer(help="Bearer tokens for machines.", no_args_is_help=True)


@users.callback()
@tokens.callback()
def _group() -> None:
    """Keep the group's name on the command line although it has one command."""


@users.command("add")
def add_user(
    name: Annotated[str, typer.Argument(help="Name to sign in with.")],
    role: Annotated[str, typer.Option("--role", help=f"One of {', '.join(access.ROLES)}.")],
    full_name: Annotated[str, typer.Option("--full-name", help="As it stands on results.")] = "",
    ask_password: Annotated[bool, typer.Option("--ask-password", help="Ask for the password.")] = False,
    data: Data = None,
) -> None:
    """Open an account; its password is made up and printed once, unless it is asked for."""
    asked = typer.prompt("Password", hide_input=True, confirmation_prompt=True) if ask_password else None
    password = asked or secrets.token_urlsafe(12)
    with open_lab(settings(data)) as lab, lab.write(SYSTEM) as work:
        access.add_account(work, name, role, password, full_name)
    if not ask_password:
        typer.echo(password)


@tokens.command("create")
def create_token(
    name: Annotated[str, typer.Argument(help="Account; a new name opens one for a machine.")],
    scope: Annotated[str, typer.Option("--scope", help="Comma-separated: read, upload, admin.")] = "read",
    days: Annotated[int | None, typer.Option("--days", min=1, help="Valid for so many days.")] = None,
    data: Data = None,
) -> None:
    """Make a token and print it, alone and once."""
    scopes = tuple(part.strip() for part in scope.split(",") if part.strip())
    valid_for = None if days is None else timedelta(days=days)
    with open_lab(settings(data)) as lab, lab.write(SYSTEM) as work:
        secret = access.create_token(work, name, scopes, valid_for)
    typer.echo(secret)
