"""XML access shared by the SSP readers: safe parsing, schema check, attributes with line numbers."""

from __future__ import annotations

import importlib.resources
import math
from collections.abc import Iterable, Iterator
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final

from lxml import etree

from master.errors import Problem

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
    problems : list of Problem
        Shared by all documents of a scenario.
    """

    file: str
    problems: list[Problem] = field(default_factory=list)

    def problem(self, node: Any, rule: str, text: str) -> None:
        """Record a problem at ``node`` (None: at the file as a whole)."""
        self.report(0 if node is None else int(node.sourceline or 0), rule, text)

    def report(self, line: int, rule: str, text: str, file: str | None = None) -> None:
        """Record a problem in a line of this file, or of another one of the scenario."""
        self.problems.append(Problem(file or self.file, line, rule, text))

    def parse(self, path: Path) -> Any | None:
        """Return the root element of ``path``; None (and a problem) if it is not well-formed XML."""
        try:
            return safe_root(path.read_bytes())
        except OSError as error:
            self.report(0, "file", f"cannot be read ({error.strerror})")
        except XmlError as error:
            self.report(error.line, "xml", str(error))
        return None

    def check_schema(self, root: Any, kind: str) -> None:
        """Validate against the official SSP 1.0 schema of ``kind`` ('ssd', 'ssv' or 'ssm').

        A document of version 2.0 has to be one of 1.0 but for its version: what 2.0 added is not supported.
        """
        if root.get("version") == "2.0":
            root = _as_first_version(root)
        schema = _schema(kind)
        schema.validate(root)
        for entry in schema.error_log:
            self.problems.append(Problem(self.file, entry.line, "schema", _plain(entry.message)))

    def text(self, node: Any, name: str, default: str = "") -> str:
        """Return an attribute; absence is reported by the schema check."""
        return str(node.get(name, default))

    def unique(self, nodes: Iterable[Any], what: str) -> None:
        """Report elements that have the name of one before them: which of them counts would be a guess."""
        first: dict[str, int] = {}
        for node in nodes:
            name = self.text(node, "name")
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
                self.problem(node, "attribute", f"attribute '{name}' is missing")
                return math.nan
            return default
        try:
            # Python reads 1_000, and the digits of every script; XML does not.
            value = float(raw) if raw.isascii() and "_" not in raw else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.problem(node, "number", f"{name}='{raw}' is not a finite number")
            return math.nan
        return value

    def flag(self, node: Any, name: str, default: bool = False) -> bool:
        """Return an attribute of type xs:boolean."""
        raw = node.get(name)
        if raw is None:
            return default
        if raw not in ("true", "false", "1", "0"):
            self.problem(node, "boolean", f"{name}='{raw}' is neither true nor false")
        return raw in ("true", "1")


@cache
def _schema(kind: str) -> Any:
    return etree.XMLSchema(file=str(importlib.resources.files("fmpy") / "ssp" / "schema" / SCHEMAS[kind]))


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
