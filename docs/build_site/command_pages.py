"""The command reference, from the argparse parsers of the entry points."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import os
import sys
from collections.abc import Iterator
from typing import Any, Final
from unittest import mock

#: How a reader calls an entry point, and the modules of it (the first one that exists, with `main` or `_main`).
ENTRY_POINTS: Final = {
    "openpanto": ("openpanto",),
    "python -m master": ("master.__main__",),
    "python -m models": ("models.__main__",),
    "python -m fmus": ("fmus.__main__",),
}


class _ParserFoundError(BaseException):
    """Ends an entry point once it has made its parser; no handler of errors there takes it for one."""

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        super().__init__()
        self.parser = parser


def parser_of(call: str) -> argparse.ArgumentParser | None:
    """Return the parser of an entry point, None if there is no such command (yet)."""
    found = [name for name in ENTRY_POINTS[call] if importlib.util.find_spec(name)]
    if not found:
        return None
    module = importlib.import_module(found[0])
    if hasattr(module, "command_line"):  # it imports what a verb needs only when that is asked for
        return module.command_line()
    start = getattr(module, "main", None) or module._main

    def stop(parser: argparse.ArgumentParser, *_: Any, **__: Any) -> None:
        raise _ParserFoundError(parser)

    replaced = dict.fromkeys(("parse_args", "parse_known_args"), stop)
    with mock.patch.multiple(argparse.ArgumentParser, **replaced), mock.patch.object(sys, "argv", [call]):
        try:
            _call(start)
        except _ParserFoundError as caught:
            return caught.parser
    return None


def _call(start: Any) -> None:
    """Call an entry point; that of the physics wants its arguments."""
    try:
        start()
    except TypeError:
        start([])


def page() -> str:
    """Return the command reference as Markdown."""
    lines = [
        "# Commands",
        "",
        "Made from the programs' own declarations. Exit codes: 0 done; 1 failed, invalid or incomplete; 2 a command",
        "line that was not understood ([more](../reliability.md#exit-codes)).",
        "",
    ]
    with mock.patch.dict(os.environ, {"COLUMNS": "84", "NO_COLOR": "1"}):
        for call in ENTRY_POINTS:
            parser = parser_of(call)
            if parser is not None:
                lines += _entry(call, parser)
    return "\n".join(lines)


def verbs(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers of a parser's verbs, by name."""
    return {
        name: verb
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for name, verb in action.choices.items()
    }


def _entry(call: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    yield from (f"## {call}", "", parser.description or "", "")
    if parser.epilog:
        yield from _epilog(parser.epilog)
    helps = {
        choice.dest: choice.help
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for choice in action._choices_actions
    }
    for name, verb in verbs(parser).items():
        yield from (f"### {call} {name}", "", verb.description or helps.get(name) or "", "")
        yield from ("```text", verb.format_usage().strip(), "```", "")
        yield from _arguments(verb)
        if verb.epilog:
            yield from _epilog(verb.epilog)


def _epilog(text: str) -> Iterator[str]:
    yield from ("```text", text.strip("\n"), "```", "")


def _arguments(parser: argparse.ArgumentParser) -> Iterator[str]:
    shown = [a for a in parser._actions if a.help != argparse.SUPPRESS and a.dest != "help"]
    if not shown:
        return
    yield "| argument | meaning |"
    yield "|---|---|"
    formatter = parser._get_formatter()
    for action in shown:
        text = formatter._expand_help(action) if action.help else ""
        yield f"| {_names(action, formatter)} | {_escaped(text)} |"
    yield ""


def _names(action: argparse.Action, formatter: argparse.HelpFormatter) -> str:
    value = "" if action.nargs == 0 else formatter._format_args(action, _metavar(action))
    if not action.option_strings:
        return f"`{value}`"
    return ", ".join(f"`{option}{' ' if value else ''}{value}`" for option in action.option_strings)


def _metavar(action: argparse.Action) -> str:
    if action.choices is not None:
        return "{" + ",".join(str(c) for c in action.choices) + "}"
    return action.dest.upper() if action.option_strings else action.dest


def _escaped(text: str) -> str:
    """Return a text that a table's cell may hold."""
    return text.replace("|", "\\|").replace("<", "&lt;")
