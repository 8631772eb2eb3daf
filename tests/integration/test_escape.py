# SPDX-License-Identifier: MIT
"""No text becomes code: names, units, comments and paths are harmless in C, make, SVG, DOT, JSON and on a terminal."""

from __future__ import annotations

import io
import json
import random
import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import click
import pytest
from click.testing import CliRunner
from rich.console import Console

from canopy.cli import main
from canopy.compiler.errors import CompileError, Place
from canopy.escape import c, c_templates, dot, json_text, make, terminal
from canopy.escape.visible import visible
from canopy.fmt.cli import format_bytes
from canopy.model import load_model
from canopy.view import line, picture
from canopy.watch import Watch
from integration.compilers import COMPILERS
from integration.language import ROOT, WARNINGS
from integration.trace_source import model_data

SOURCES = [ROOT / "host_tools" / "canopy", ROOT / "sim" / "canopy_sim"]
RUNTIME = ROOT / "runtime" / "include"

# It ends the comment, begins a line, and is C that runs before main(); then what joins lines, and what turns them.
EVIL = (
    'a*/\n#include <stdlib.h>\n__attribute__((constructor)) static void pwned(void) { system("id"); }\n/* ??/\n'
    "\\\n// \x85 \x9b31m \u202e\u2066 \u2028 \ufeff [red]b[/red] {{ x }} {0} [a](b) %s `id` $(id) *"
)
PRINTABLE = re.compile(r"[^\n]*")


def hostile_tree(text: str) -> str:
    """A tree with the text wherever any text may stand."""
    evil, inner = quoteattr(text), text.replace("&", "&amp;").replace("<", "&lt;")
    return f"""<root BTCPP_format="4" main_tree_to_execute={evil} project_name={evil}>
<BehaviorTree ID={evil} name={evil} _description={evil}>
  <ReactiveSequence name={evil}>
    <IsWarm name={evil} limit="25" _description={evil}/>
    <Action ID={quoteattr("Run" + text)} name={evil}/>
    <Say name={evil} {"text"}={evil}/>
    <Script name={evil} code={quoteattr("v := '" + text.replace("'", "") + "'")}/>
    <SubTree ID={quoteattr("S" + text)} name={evil} port={evil}/>
  </ReactiveSequence>
</BehaviorTree>
<BehaviorTree ID={quoteattr("S" + text)}><Say text="{{port}}"/></BehaviorTree>
<TreeNodesModel>
  <Condition ID="IsWarm">
    <input_port name="limit" type="int16_t" description={evil}>{inner}</input_port>
    <MetadataFields><Metadata reads="Climate" hysteresis={evil}/></MetadataFields>
  </Condition>
  <Action ID={quoteattr("Run" + text)}>
    <output_port name={quoteattr("out" + text)} type="std::string">{inner}</output_port>
    <MetadataFields><Metadata kind="SyncAction" writes="FanCommand" texts={evil}/></MetadataFields>
  </Action>
  <Action ID="Say"><input_port name="text" type="std::string">{inner}</input_port></Action>
</TreeNodesModel>
</root>"""


def hostile_dbc(text: str) -> bytes:
    """A DBC with the text wherever a DBC may have any."""
    quoted = text.replace("\\", "").replace('"', "")
    return f"""VERSION ""
BU_: Controller Thermometer Fan
BO_ 256 Climate: 2 Thermometer
 SG_ Temperature : 0|16@1- (0.1,0) [-40|120] "{quoted}" Controller
BO_ 512 FanCommand: 2 Controller
 SG_ Speed : 0|8@1+ (1,0) [0|100] "{quoted}" Fan
 SG_ Mode : 8|8@1+ (1,0) [0|1] "" Fan
CM_ BO_ 256 "{quoted}";
CM_ SG_ 512 Speed "{quoted}";
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_ SG_ "GenSigInactiveValue" INT 0 255;
BA_DEF_DEF_ "GenMsgCycleTime" 100;
BA_DEF_DEF_ "GenSigInactiveValue" 0;
VAL_ 512 Mode 0 "{quoted}" 1 "on";
VAL_ 512 Speed 254 "{quoted}";
""".encode()


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """The folder with room.xml and room.dbc, both as bad as they can be."""
    # XML has no way to write C0, and the parser makes blanks of raw line breaks.
    text = hostile_tree(EVIL).replace("\n#", "&#10;#")
    (tmp_path / "room.xml").write_text(text, encoding="utf-8")
    (tmp_path / "room.dbc").write_bytes(hostile_dbc(EVIL))
    return tmp_path


def compile_room(folder: Path, *more: str) -> list[Path]:
    arguments = [str(folder / "room.xml"), "--dbc", str(folder / "room.dbc"), "--node", "Controller"]
    out = folder / "out"
    result = CliRunner().invoke(main, ["compile", *arguments, "--period-ms", "100", "-o", str(out), *more])
    assert result.exit_code == 0, (result.output, result.exception)
    return sorted(out.glob("*.[ch]"))


def tokens(file: Path) -> str:
    """What a C compiler sees of a file, without comments and directives' results: strings are left out, too."""
    command = ["gcc", "-std=c11", "-fpreprocessed", "-dD", "-E", "-P", str(file)]
    text = subprocess.run(command, capture_output=True, check=True, text=True).stdout
    return re.sub(r'"(?:[^"\\]|\\.)*"', '""', text)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_hostile_names_are_comments_and_strings_in_c(hostile: Path, compiler: str) -> None:
    files = compile_room(hostile, "--stubs", str(hostile / "out" / "stubs.c"), "--image-nodes", "20")
    assert len(files) == 6
    for file in files:
        text = file.read_text(encoding="utf-8")
        assert all(one.isprintable() for one in text.split("\n")), file
        assert "pwned" in text or file.name == "room_bus.c"  # a comment names no signal there
        for word in ("pwned", "stdlib", "constructor", "system"):
            # The name of a leaf or port is made of its words, and is one word.
            assert re.search(rf"(?<!\w){word}(?!\w)", tokens(file)) is None, (file, word)
        if file.suffix == ".c":
            command = [compiler, "-std=c11", *WARNINGS, "-Wcomment", "-Wtrigraphs", f"-I{RUNTIME}", "-c", str(file)]
            subprocess.run([*command, "-o", "/dev/null"], check=True)


def test_a_hostile_dbc_gives_a_harmless_codec(hostile: Path) -> None:
    out = hostile / "codec"
    result = CliRunner().invoke(main, ["codec", str(hostile / "room.dbc"), "-o", str(out)])
    assert result.exit_code == 0, result.output
    for file in out.glob("*.[ch]"):
        assert all(one.isprintable() for one in file.read_text(encoding="utf-8").split("\n"))
        assert "system" not in tokens(file)
    command = ["gcc", "-std=c11", *WARNINGS, f"-I{RUNTIME}", "-c", str(out / "room_codec.c"), "-o", "/dev/null"]
    subprocess.run(command, check=True)


def test_no_comment_can_be_left(tmp_path: Path) -> None:
    """Random texts of what comments and lines end with, side by side; one that gets out is a syntax error."""
    rng = random.Random(20261203)
    pieces = ["*", "/", "\\", "?", "??/", "\n", "\r", "\x85", "\u2028", " ", "x", "*/", "/*", "//", "\u202e", "\0", '"']
    made = ["".join(rng.choices(pieces, k=rng.randint(0, 6))) for _ in range(4_000)]
    environment = c_templates.environment("canopy.compiler")
    text = "/* {{ a }} */\nint x{{ loop.index }}; /*{{ a }}{{ b }}*/ /* {{ b }}/{{ a }}*/\n"
    template = environment.from_string("{% for a, b in pairs %}\n" + text + "{% endfor %}")
    file = tmp_path / "comments.c"
    file.write_text(template.render(pairs=zip(made[::2], made[1::2], strict=True)), encoding="utf-8")
    command = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", str(file)]
    assert subprocess.run(command, capture_output=True, text=True).stderr == ""
    assert tokens(file).count("int x") == 2_000


@pytest.mark.parametrize("text", ["a b", "a;", "é", "a\n", '"a"', "a*", "-", "a-b", "#", "a\\"])
def test_a_template_refuses_code_that_nothing_has_made(text: str) -> None:
    environment = c_templates.environment("canopy.compiler")
    for template in (
        "int {{ x }};",
        "{% macro m() %}{{ x }}{% endmacro %}{{ m() }}",
        "{{ 'a' ~ x }}",
        "{{ [x] | join }}",
    ):
        with pytest.raises(c.EscapeError):
            environment.from_string(template).render(x=text)
    assert environment.from_string("/* {{ x }} */ int {{ y }}_t;").render(x=text, y="word").endswith("int word_t;")


def test_a_literal_of_a_template_is_code_and_what_it_is_joined_with_is_not() -> None:
    environment = c_templates.environment("canopy.compiler")

    def render(template: str) -> str:
        return environment.from_string(template).render(x="a b", word="w", n=3)

    assert render("{{ '; ' ~ word ~ n ~ ';' }}") == "; w3;"
    assert render("{{ '0x%X' | format(n) }}") == "0x3"
    assert render("{{ [word, 'f()'] | join(', ') }}") == "w, f()"
    assert render("/* {{ '*' ~ '/' }} */") == "/*  * /  */"
    assert render("{{ ';' if not n }}") == ""
    for template in ("{{ ';' ~ x }}", "{{ '%s;' | format(x) }}", "{{ [x, ';'] | join(',') }}", "{{ x | upper }}"):
        with pytest.raises(c.EscapeError):
            render(template)


def marks(pattern: str, suffix: str) -> dict[str, int]:
    """File -> how often the pattern is in it."""
    found = {}
    for folder in SOURCES:
        for file in sorted(folder.rglob(f"*{suffix}")):
            count = len(re.findall(pattern, file.read_text(encoding="utf-8")))
            if count:
                found[str(file.relative_to(folder))] = count
    return found


def test_the_places_that_mark_text_as_c_are_known() -> None:
    """Each makes C of whole numbers, checked names and string(); look at a new one before it gets into this list."""
    assert marks(r"@emits_c\n|\bmark_c\(|\bCode\(", ".py") == {
        "compiler/binding.py": 1,
        "compiler/bound_ports.py": 1,
        "compiler/codec.py": 17,
        "compiler/generation.py": 1,
        "compiler/leaf_c.py": 14,
        "compiler/port_types.py": 2,
        "compiler/row_c.py": 2,
        "compiler/script_bodies.py": 1,
        "compiler/stubs.py": 1,
        "compiler/trace.py": 2,
        "escape/c.py": 13,
        "escape/c_templates.py": 4,
        "tree/enums.py": 1,
        "tree/generic.py": 1,
        "tree/lists.py": 2,
    }
    assert marks(r"\|\s*safe\b|autoescape|Markup", ".j2") == {}


def test_all_that_is_printed_goes_through_one_place() -> None:
    printing = r"click\.(?:secho|echo|style)\(|(?<![\w.])print\(|sys\.std(?:out|err)\.write|rich import print"
    assert marks(printing, ".py") == {"escape/terminal.py": 2}
    assert marks(r"stdout\.buffer", ".py") == {"fmt/cli.py": 1}  # bytes for a pipe
    assert marks(r"(?<![\w.])Text(?:\.assemble|\.from_markup)?\(", ".py") == {
        "escape/terminal.py": 1,
        "compiler/script/syntax.py": 2,  # texts of scripts
        "fmt/document.py": 2,  # texts of XML
    }
    assert marks(r"json\.dumps\(", ".py") == {
        "certificate/check.py": 1,  # what a digest is made of
        "escape/json_text.py": 2,
    }
    assert marks(r"Console\(", ".py") == {"show/terminal.py": 1, "view.py": 1}
    assert marks(r"write_text\(", ".py") == {}


@pytest.mark.parametrize(
    "arguments",
    [
        ["check"],
        ["check", "--json"],
        ["check", "--sarif"],
        ["show"],
        ["show", "--svg", "-"],
        ["show", "--dot", "-"],
    ],
    ids=" ".join,
)
def test_no_command_prints_what_a_terminal_acts_on(hostile: Path, arguments: list[str]) -> None:
    result = CliRunner().invoke(main, [arguments[0], str(hostile / "room.xml"), *arguments[1:]], color=True)
    assert result.exit_code in (0, 1), (result.output, result.exception)
    plain = re.sub(r"\x1b\[[\d;]*m", "", result.output)
    assert all(one.isprintable() for one in plain.split("\n"))
    assert "[red]b" in plain or "\\u005bred" in plain or arguments[0] == "check"
    if "--svg" in arguments:
        ElementTree.fromstring(result.output)
    if "--json" in arguments or "--sarif" in arguments:
        json.loads(result.output)


def test_errors_show_names_on_one_line(tmp_path: Path) -> None:
    name = "no\x1b[31m\nsuch\x9b \u202efile.xml"
    for arguments in (
        ["check", name],
        ["show", name],
        ["fmt", name],
        ["compile", name, "--dbc", name, "--node", name, "--period-ms", "1", "-o", name],
        ["codec", name, "-o", name],
        ["image", "show", name],
        ["monitor", "--model", name, "--can", "unixbus:x"],
        ["monitor", "--model", "x", "--can", name],
        ["bridge", "--model", name, "--can", "unixbus:x"],
        ["record", "--can", name, "-o", "a.log"],
        ["replay", name, "--model", name, "--program", name],
        ["check", "x", f"--{name}"],
        ["check", "x", "--disable", name],
        [name],
    ):
        result = CliRunner().invoke(main, arguments)
        assert result.exit_code != 0
        assert "no" in result.stderr
        assert isinstance(result.exception, SystemExit), (arguments, result.exception)
        for one in (result.stderr + result.stdout).split("\n"):
            assert one.isprintable() and not one.startswith("such"), (arguments, result.stderr)


def test_an_error_names_a_long_text_by_its_ends() -> None:
    error = str(CompileError(Place("f.xml", 1, 1), "a" * 1_000_000, "b\nc"))
    assert len(error) < 5_000 and error.startswith("f.xml:1:1: error: aaa")
    assert error.endswith("\n  help: b\\nc")


def test_a_watched_controller_cannot_write_to_the_terminal(hostile: Path, tmp_path: Path) -> None:
    """Names come from the model file, units and choices from the DBC beside it; both may be anybody's."""
    compile_room(hostile, "--name", "room")
    path = hostile / "out" / "room.model.json"
    data = json.loads(path.read_text(encoding="utf-8"))
    data["trace"] = model_data(1)["trace"]
    data["application"] = EVIL
    path.write_text(json.dumps(data), encoding="utf-8")
    watch = Watch(load_model(path))
    watch.feed(256, b"\x00\x01", 1.0)
    console = Console(record=True, width=200, file=io.StringIO())
    console.print(picture(watch, 1.0, EVIL))
    shown = console.export_text()
    assert "[red]b" in shown
    assert all(one.isprintable() for one in shown.split("\n"))
    assert not line(watch, 1.0).isprintable()  # so that what follows says something
    result = CliRunner().invoke(_echo_command(line(watch, 1.0)), [])
    assert result.stdout.removesuffix("\n").isprintable()


def _echo_command(text: str) -> click.Command:
    @click.command()
    def command() -> None:
        terminal.echo(text)

    return command


def test_a_rule_for_make_names_any_file() -> None:
    rule = make.rule(Path("/a b/x.c"), [Path("/q#1/$(shell id).xml"), Path("/é.dbc")])
    assert rule == "/a\\ b/x.c: /q\\#1/$$(shell\\ id).xml /é.dbc\n".encode()
    for name in ("a\nb", "a\\b", "a\tb"):
        with pytest.raises(ValueError, match="cannot stand in a file for make"):
            make.rule(Path("x"), [Path(name)])


def test_make_reads_the_rule(tmp_path: Path) -> None:
    (tmp_path / "Makefile").write_bytes(make.rule(Path("out"), [Path("a b#c"), Path("$HOME `id`")]) + b"\t@echo done\n")
    for name in ("a b#c", "$HOME `id`"):
        (tmp_path / name).write_text("")
    result = subprocess.run(["make", "-C", str(tmp_path), "out"], capture_output=True, text=True)
    assert "done" in result.stdout, result.stderr


def test_the_other_targets() -> None:
    assert dot.quoted("→", 'a"b\\N\n') == '"→\\na\\"b\\\\N\\\\n"'
    assert json_text.dumps({"é": "\x9b\u202e\ud800\n"}) == '{"é": "\\u009b\\u202e\\ud800\\n"}'
    assert json.loads(json_text.dumps(EVIL)) == EVIL
    assert json_text.sarif_message("{0} [a](b)") == "{{0}} [a\\](b)"
    assert visible("a\xa0b\x1b\x9b\u202e\U000e0001\udcff") == "a b\\x1b\\x9b\\u202e\\U000e0001\\xff"
    with pytest.raises(ValueError, match="not the name of a header"):
        c.header('x.h"\n#include <a>')


def test_fmt_shows_what_is_hidden_and_loses_nothing() -> None:
    source = '<root a="x&#x202e;y&#x9b;&#10;é">t\u2066\xa0\u00adz</root>'.encode()
    formatted = format_bytes(source, "x")
    assert formatted.decode() == '<root a="x&#x202e;y&#x9b;&#10;é">t&#x2066;\xa0&#xad;z</root>\n'
    one, other = ElementTree.fromstring(source), ElementTree.fromstring(formatted)
    assert (one.attrib, one.text) == (other.attrib, other.text)
    assert format_bytes(formatted, "x") == formatted
