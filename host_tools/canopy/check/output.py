# SPDX-License-Identifier: MIT
"""Findings as text, as JSON, and as SARIF 2.1.0 (OASIS), which code hosts show beside the lines."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePath
from urllib.parse import quote

from canopy import __version__
from canopy.check.registry import Rule, Severity
from canopy.check.run import Finding, Report
from canopy.escape.json_text import sarif_message
from canopy.escape.terminal import echo, style

JSON_FORMAT = 1
SARIF_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "cyan"}


def counts(report: Report) -> dict[str, int]:
    """Number of findings of each severity, the worst first; all three are there."""
    return {
        severity.label: sum(finding.rule.severity == severity for finding in report.findings)
        for severity in sorted(Severity, reverse=True)
    }


def summary(report: Report) -> str:
    """One line: `1 error, 2 warnings (1 allowed)`."""
    parts = [f"{count} {name}{'s' if count > 1 else ''}" for name, count in counts(report).items() if count]
    allowed = f" ({report.allowed} allowed)" if report.allowed else ""
    return (", ".join(parts) or "nothing found") + allowed


def print_text(report: Report, *, quiet: bool = False) -> None:
    """Findings as a compiler prints them; colours are dropped by click when the output is no terminal."""
    for finding in report.findings:
        severity = finding.rule.severity
        word = style(severity.label, fg=_COLOURS[severity], bold=True)
        echo(f"{finding.place}: ", word, f": {finding.message} [{finding.rule.id}]")
        if not quiet:
            echo(f"  help: {finding.help_text}")
    echo(summary(report))


def as_json(report: Report) -> dict[str, object]:
    """The findings for scripts."""
    return {
        "format": JSON_FORMAT,
        "findings": [
            {
                "rule": finding.rule.id,
                "severity": finding.rule.severity.label,
                "file": finding.place.file,
                "line": finding.place.line,
                "column": finding.place.column,
                "node": finding.node,
                "message": finding.message,
                "help": finding.help_text,
            }
            for finding in report.findings
        ],
        "counts": counts(report),
        "allowed": report.allowed,
    }


def _location(finding: Finding) -> dict[str, object]:
    physical: dict[str, object] = {"artifactLocation": {"uri": quote(PurePath(finding.place.file).as_posix())}}
    if finding.place.line:
        physical["region"] = {"startLine": finding.place.line, "startColumn": max(1, finding.place.column)}
    location: dict[str, object] = {"physicalLocation": physical}
    if finding.node is not None:
        location["logicalLocations"] = [{"name": finding.node, "kind": "element"}]
    return location


def as_sarif(report: Report, rules: Iterable[Rule]) -> dict[str, object]:
    """A SARIF log with one run. Paths are given as the user gave them: run it in the repository's root."""
    known = list(rules)
    places = {rule.id: index for index, rule in enumerate(known)}
    return {
        "$schema": SARIF_SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {
                    "driver": {
                        "name": "canopy check",
                        "version": __version__,
                        "rules": [
                            {
                                "id": rule.id,
                                "shortDescription": {"text": rule.title},
                                "fullDescription": {"text": rule.why},
                                "help": {"text": rule.way_out},
                                "defaultConfiguration": {"level": rule.severity.label},
                            }
                            for rule in known
                        ],
                    }
                },
                "columnKind": "unicodeCodePoints",
                "results": [
                    {
                        "ruleId": finding.rule.id,
                        "ruleIndex": places[finding.rule.id],
                        "level": finding.rule.severity.label,
                        "message": {"text": sarif_message(f"{finding.message}. {finding.help_text}")},
                        "locations": [_location(finding)],
                    }
                    for finding in report.findings
                ],
            }
        ],
    }
