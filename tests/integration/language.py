# SPDX-License-Identifier: MIT
"""What the tests of the tree language share: a model, and `canopy compile` on texts."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner, Result

from canopy.cli import main

ROOT = Path(__file__).parents[2]
DBC = ROOT / "tests" / "unit" / "language" / "language.dbc"
WARNINGS = [
    *("-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wundef", "-Wswitch-enum", "-Wcast-align"),
    *("-Wdouble-promotion", "-Wmissing-prototypes", "-Wvla", "-Werror"),
]

MODEL = """\
<Action ID="Go">
<input_port name="speed" type="int"/><MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>
<Action ID="Find"><output_port name="goal" type="int16_t"/></Action>
<Action ID="Say"><input_port name="text" type="std::string"/><input_port name="any" default="3"/></Action>
<Action ID="Measure"><output_port name="level" type="int16_t/10"/></Action>
<Action ID="Fine"><input_port name="level" type="int16_t*0.01"/></Action>
<Action ID="Tenth"><input_port name="level" type="int16_t * 0.3"/></Action>
<Action ID="Choose"><output_port name="colour" type="std::string"/></Action>
<Action ID="Name"><output_port name="it" type="std::string[3]"/>
<MetadataFields><Metadata texts="a;b"/></MetadataFields></Action>
<Control ID="Pick"><input_port name="first" type="uint8_t" default="0"/></Control>
<Decorator ID="Guard"/>"""


def compile_files(tmp_path: Path, files: dict[str, str], *more: str) -> Result:
    """Compiles main.xml of these files into tmp_path/out."""
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    arguments = ["compile", str(tmp_path / "main.xml"), "--dbc", str(DBC), "--node", "Controller", "--period-ms", "10"]
    return CliRunner().invoke(main, [*arguments, "-o", str(tmp_path / "out"), *more])


def tree(nodes: str, more: str = "", model: str = MODEL) -> str:
    """A file whose tree begins in line 3."""
    return (
        '<root BTCPP_format="4" main_tree_to_execute="Main">\n'
        f'<BehaviorTree ID="Main">\n{nodes}\n</BehaviorTree>\n{more}\n'
        f"<TreeNodesModel>{model}</TreeNodesModel></root>"
    )
