"""XML access shared by the SSP readers: safe parsing, schema check, attributes with line numbers."""

from __future__ import annotations

import importlib.resources
import math
import re
from collections.abc import Iterable, Iterator
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final

from lxml import etree

from master.errors import Problem, said

SSC: Final = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSD: Final = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSV: Final = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SSM: Final = "http://ssp-standard.org/SSP1/SystemStructureParameterMapping"

#: Versions of SSP that are read; 2.0 kept the namespaces of 1.0, and what it adds to 1.0 is refused.
VERSIONS: Final = ("1.0", "2.0")
#: The schema file of each kind of document, as shipped with FMPy.
SCHEMAS: Final = {
    "ssd": "SystemStructureDescription.xsd",
    "ssv": "SystemStructureParameterValues.xsd",
    "ssm": "SystemStructureParameterMapping.xsd",
}
_VERSIONED: Final = ("SystemStructureDescription", "ParameterSet", "ParameterMapping")
#: What 2.0 calls the types that 1.0 has; its further types are refused.
_RENAMED: Final = {"Float64": "Real", "Int32": "Integer"}
#: What 2.0 may add to a file or an element that has no effect on the run.
_REMARKS: Final = (f"{{{SSC}}}MetaData", f"{{{SSC}}}Signature")
#: What XML Schema leaves out around a value.
_BLANKS: Final = " \t\r\n"
#: Types of which XML Schema says only that a value is not of it.
_TYPE_ERROR: Final = re.compile(r"is not a valid value of the (?:local )?atomic type")


class XmlError(ValueError):
    """A document that is not parsed; ``line`` says where, 0 for the whole of it."""

    def __init__(self, line: int, text: str) -> None:
        self.line = line
        super().__init__(text)


def safe_root(data: bytes) -> Any:
    """Return the root element of a document that need not be trusted.

    Raises
    ------
    XmlError
        If it is not well-formed, or has a document type declaration: with it entities that read other files, or
        expand without end.
    """
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
    try:
        root = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        raise XmlError(error.lineno or 0, f"is not well-formed XML: {error.msg}") from error
    if root.getroottree().docinfo.doctype:
        raise XmlError(int(root.sourceline or 0), "a document type declaration is not allowed")
    return root


@dataclass
class Reader:
    """One XML document being read; problems are collected, so that reading goes on.

    Attributes
    ----------
    file : str
        Its name in messages.
    problems, warnings : list of Problem
        What is wrong, and what can be run but may not be meant; shared by all documents of a scenario.
    """

    file: str
    problems: list[Problem] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)

    def beside(self, file: str) -> Reader:
        """Return a reader of another file of the same scenario."""
        return Reader(file, self.problems, self.warnings)

    def problem(self, node: Any, rule: str, text: str) -> None:
        """Record a problem at ``node`` (None: at the file as a whole)."""
        self.report(0 if node is None else int(node.sourceline or 0), rule, text)

    def report(self, line: int, rule: str, text: str, file: str | None = None) -> None:
        """Record a problem in a line of this file, or of another one of the scenario."""
        self.problems.append(Problem(file or self.file, line, rule, text))

    def warn(self, line: int, rule: str, text: str, file: str | None = None) -> None:
        """Record what can be run but may not be meant."""
        self.warnings.append(Problem(file or self.file, line, rule, text))

    def parse(self, path: Path) -> Any | None:
        """Return the root element of ``path``; None (and a problem) if it is not well-formed XML."""
        try:
            return _in_first_words(safe_root(path.read_bytes()))
        except OSError as error:
            self.report(0, "file", f"cannot be read ({said(error)})")
        except XmlError as error:
            self.report(error.line, "xml", str(error))
        return None

    def check_schema(self, root: Any, kind: str) -> None:
        """Validate a document, or an element inside one, against the official SSP 1.0 schema of ``kind``.

        ``kind`` is 'ssd', 'ssv' or 'ssm'. What is of version 2.0 has to be of 1.0 but for its version and the names
        of types: what 2.0 added is not supported.
        """
        if root.get("version") == "2.0":
            root = _as_first_version(root)
        schema = _schema(kind)
        schema.validate(root)
        reported: set[tuple[int, str]] = set()
        for entry in schema.error_log:
            where = (int(entry.line), str(entry.path))
            if where in reported and _TYPE_ERROR.search(entry.message):
                continue  # the same value again: first which rule it breaks, then that it is none of the type
            reported.add(where)
            self.problems.append(Problem(self.file, entry.line, "schema", _plain(entry.message)))

    def text(self, node: Any, name: str, default: str = "") -> str:
        """Return an attribute; absence is reported by the schema check."""
        return str(node.get(name, default))

    def unique(self, nodes: Iterable[Any], what: str) -> None:
        """Report elements that have the name of one before them: which of them counts would be a guess."""
        first: dict[str, int] = {}
        for node in nodes:
            name = self.text(node, "name")
            if not is_one_line(name):
                self.problem(node, "name", f"{what} {name!r}: a name is one line of text")
            if name in first:
                where = f", first in line {first[name]}" if first[name] else ""
                self.problem(node, "name", f"{what} '{name}' is there twice{where}; remove one")
            else:
                first[name] = int(node.sourceline or 0)

    def number(self, node: Any, name: str, default: float | None = None) -> float:
        """Return an attribute as a finite number, NaN (and a problem) if it is none."""
        raw = node.get(name)
        if raw is None:
            if default is None:
                self.replace_problem(node, name, "attribute", f"attribute '{name}' is missing")
                return math.nan
            return default
        try:
            # Python reads 1_000, and the digits of every script; XML does not.
            value = float(raw) if raw.isascii() and "_" not in raw else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.replace_problem(node, raw, "number", f"{name}='{raw}' is not a finite number")
            return math.nan
        return value

    def replace_problem(self, node: Any, what: str, rule: str, text: str) -> None:
        """Record a problem with a name or value, in place of what the schema check has said of it in this line."""
        place = (self.file, int(node.sourceline or 0), "schema")
        self.problems[:] = [p for p in self.problems if (p.file, p.line, p.rule) != place or f"'{what}'" not in p.text]
        self.problem(node, rule, text)

    def flag(self, node: Any, name: str, default: bool = False) -> bool:
        """Return an attribute of type xs:boolean."""
        raw = node.get(name)
        if raw is None:
            return default
        raw = raw.strip(_BLANKS)
        if raw not in ("true", "false", "1", "0"):
            self.replace_problem(node, raw, "boolean", f"{name}='{raw}' is neither true nor false")
        return raw in ("true", "1")


@cache
def _schema(kind: str) -> Any:
    return etree.XMLSchema(file=str(importlib.resources.files("fmpy") / "ssp" / "schema" / SCHEMAS[kind]))


def is_one_line(name: str) -> bool:
    """Whether a name has no line breaks nor other control characters."""
    return len(name.splitlines()) < 2 and not any(ord(letter) < ord(" ") for letter in name)


def tag(node: Any) -> str:
    """Return the local name of an element."""
    return str(etree.QName(node).localname)


def namespace(node: Any) -> str:
    """Return the namespace of an element, empty if it has none."""
    return str(etree.QName(node).namespace or "")


def children(node: Any | None, namespace: str, name: str) -> Iterator[Any]:
    """Iterate over the child elements with this qualified name."""
    if node is not None:
        yield from node.iterchildren(f"{{{namespace}}}{name}")


def child(node: Any | None, namespace: str, name: str) -> Any | None:
    """Return the first child element with this qualified name."""
    return next(children(node, namespace, name), None)


def elements(node: Any | None) -> Iterator[Any]:
    """Iterate over the child elements, leaving out comments and processing instructions."""
    if node is not None:
        yield from node.iterchildren(etree.Element)


def _in_first_words(root: Any) -> Any:
    """Give types of version 2.0 the names that they had in 1.0, and leave out its remarks; in place."""
    if root.get("version") != "2.0":
        return root
    for node in list(root.iter(etree.Element)):
        if node.tag in _REMARKS and node.getparent() is not None:
            node.getparent().remove(node)
        elif namespace(node) in (SSC, SSV) and tag(node) in _RENAMED:
            node.tag = f"{{{namespace(node)}}}{_RENAMED[tag(node)]}"
    return root


def _as_first_version(root: Any) -> Any:
    copy = deepcopy(root)
    for node in copy.iter(etree.Element):
        if node.get("version") == "2.0" and tag(node) in _VERSIONED:
            node.set("version", "1.0")
    return copy


def _plain(message: str) -> str:
    for namespace, prefix in ((SSC, "ssc:"), (SSD, "ssd:"), (SSV, "ssv:"), (SSM, "ssm:")):
        message = message.replace(f"{{{namespace}}}", prefix)
    return message
