# SPDX-License-Identifier: MIT
"""Measures the engine and its peers: `make bench`."""

import json
from pathlib import Path

import click

from . import measure, report

BEGIN = "<!-- measured: the lines from here on are written by `make bench` -->"
END = "<!-- end of what is measured -->"


def write_into(page: Path, tables: str) -> None:
    """Replaces what stands between the two marks of a page. Raises click.ClickException when they are not there."""
    text = page.read_text(encoding="utf-8")
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise click.ClickException(f"{page}: the lines `{BEGIN}` and `{END}` are missing")
    page.write_text(f"{before}{BEGIN}\n\n{tables}\n\n{END}{after}", encoding="utf-8")


@click.command()
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path),
    help="Also write the figures here ('-': only print them as JSON).",
)
@click.option("--page", type=click.Path(exists=True, path_type=Path), help="Put the tables into this page.")
def main(json_file: Path | None, page: Path | None) -> None:
    """Counts instructions, stack, memory and code, for this machine and for Cortex-M."""
    try:
        results = measure.measure(lambda what: click.echo(f"  {what}", err=True))
    except RuntimeError as error:
        raise click.ClickException(str(error)) from error
    figures = json.dumps(results, indent=2)
    if str(json_file) == "-":
        click.echo(figures)
        return
    if json_file is not None:
        json_file.write_text(figures + "\n", encoding="utf-8")
    tables = report.markdown(results)
    if page is not None:
        write_into(page, tables)
    click.echo(tables)


if __name__ == "__main__":
    main()
